//! Measurement files: bytes in, a [`Dataset`] or a precise complaint out.
//!
//! Columns are found by header name, in any order: `q1…q6` logged joint angles (deg); one sensor, `L` (mm) or
//! `measured_x, measured_y, measured_z` (mm) (with `measured_qw … measured_qz` a full pose); optional `x, y, z` (mm),
//! `t` (h), `session`, `temperature` [°C], `payload` (kg), `approach1…6`, `anchor`. Other columns are kept as text.
//! CSV may be separated by comma, semicolon or tab; with semicolon or tab a decimal comma is understood. Of a
//! workbook the first sheet that has the columns is read, or the one named.

mod archive;
pub mod cell;
pub mod csv;
pub mod xlsx;
mod columns;
mod error;
mod options;
mod rows;
mod rounding;

pub use error::{ImportError, Place};
pub use options::Options;

use sha2::{Digest, Sha256};

use self::cell::Table;
use self::columns::Columns;
use super::dataset::Dataset;

/// Reads a measurement file. `file` is the name that messages and reports print; the format is told by the bytes.
///
/// ```
/// use truegrind_calibration::measurement::dataset::{Reading, Sensor};
/// use truegrind_calibration::measurement::import::{Options, read};
///
/// let rows = read("poses.csv", b"q1,q2,q3,q4,q5,q6,L\n10,20,30,40,50,60,500.25\n", &Options::default())?;
/// assert_eq!(rows.sensor, Sensor::Cable);
/// assert_eq!(rows.rows[0].reading, Reading::Cable(500.25));
/// assert!((rows.rows[0].joints[1].to_degrees() - 20.0).abs() < 1e-12);
///
/// // A fault is named with its place.
/// let error = read("poses.csv", b"q1,q2,q3,q4,q5,q6,L\n10,20,30,40,fifty,60,500.25\n", &Options::default());
/// let said = error.map(|_| ()).map_err(|error| error.to_string()).err().ok_or("was read")?;
/// assert!(said.starts_with("poses.csv, row 2, column q5") && said.contains("fifty"), "{said}");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read(file: &str, bytes: &[u8], options: &Options) -> Result<Dataset, ImportError> {
    let mut dataset = if xlsx::is_workbook(bytes) {
        let tables = xlsx::tables(file, bytes)?;
        from_workbook(file, &tables, options)?
    } else {
        if let Some(sheet) = &options.sheet {
            return Err(ImportError::NoSheets { file: file.into(), sheet: sheet.clone() });
        }
        from_text(file, &csv::Text::of(file, bytes)?, options)?
    };
    dataset.sha256 = Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect();
    Ok(dataset)
}

fn from_table(file: &str, table: &Table, options: &Options) -> Result<Dataset, ImportError> {
    let columns = Columns::find(file, table)?;
    rows::dataset(file, table, &columns, options, std::iter::empty())
}

/// A text table: as many lines as it takes to find the header, and the rest one by one.
fn from_text(file: &str, text: &csv::Text<'_>, options: &Options) -> Result<Dataset, ImportError> {
    let mut table = text.empty();
    let mut lines = text.lines(file);
    while !columns::shows_header(&table.rows)
        && let Some(line) = lines.next()
    {
        table.rows.push(line?);
    }
    let columns = Columns::find(file, &table)?;
    rows::dataset(file, &table, &columns, options, lines)
}

fn from_workbook(file: &str, tables: &[Table], options: &Options) -> Result<Dataset, ImportError> {
    let name = |t: &Table| t.sheet.clone().unwrap_or_default();
    if let Some(wanted) = &options.sheet {
        let table = tables.iter().find(|t| t.sheet.as_ref() == Some(wanted)).ok_or_else(|| {
            let sheets = tables.iter().map(name).collect::<Vec<_>>();
            ImportError::UnknownSheet { file: file.into(), sheet: wanted.clone(), sheets }
        })?;
        return from_table(file, table, options);
    }
    let mut usable = tables.iter().filter(|t| Columns::find(file, t).is_ok());
    let Some(table) = usable.next() else {
        // Nothing fits: complain about the first sheet that holds anything.
        let table = tables.iter().find(|t| !t.rows.is_empty()).or(tables.first());
        return match table {
            Some(table) => from_table(file, table, options),
            None => Err(ImportError::Empty { place: Place::file(file) }),
        };
    };
    let mut dataset = from_table(file, table, options)?;
    for other in usable {
        let rows = other.rows.iter().filter(|r| !r.cells.iter().all(|c| c.is_empty())).count();
        dataset.notes.push(format!(
            "sheet {} read; sheet {} has the columns too ({} rows) and was not read",
            name(table),
            name(other),
            rows.saturating_sub(1)
        ));
    }
    Ok(dataset)
}
