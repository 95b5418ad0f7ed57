//! Reads measurement files to a [`Dataset`]; errors name the location in the file.
//!
//! Columns are found by header name, in any order: `q1…q6` logged joint angles (deg); one sensor, `L` (mm) or
//! `measured_x, measured_y, measured_z` (mm) (with `measured_qw … measured_qz` a full pose); optional `x, y, z` (mm),
//! `t` (h), `session`, `temperature` [°C], `payload` (kg), `approach1…6`, `anchor` or `station`, and `path, cycle, sample` of rows that were read
//! on a path. A header may state the unit behind the name (`q1 [deg]`, `L (mm)`, `q1_deg`). Other columns are kept as text.
//! Tables of RoboDK and DELMIA are recognised by their content (see the notes of the dataset).
//! CSV fields are separated by comma, semicolon or tab; with semicolon or tab, decimal commas are accepted. Of a workbook,
//! the named sheet is read, or else the first with the required columns.

mod archive;
pub mod cell;
pub mod csv;
pub mod xlsx;
pub mod template;
mod clock;
mod column_names;
mod columns;
mod error;
mod join_by_time;
mod options;
mod tracker_export;
mod foreign;
mod rows;
mod rounding;
mod stated_unit;

pub use error::{ImportError, Location};
pub use options::{Options, TimeMatching};

use sha2::{Digest, Sha256};
use truegrind_math::digest;

use self::cell::{Cell, Line, Table};
use self::columns::HeaderColumns;
use self::tracker_export::Points;
use super::dataset::Dataset;

/// Reads a measurement file. `file` is the name in messages and reports; the format is detected from the bytes.
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
/// // An error names its location.
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
    dataset.sha256 = digest::sha256(bytes);
    Ok(dataset)
}

/// Reads a log of joints and a tracker's exported points, and joins them by the column `name` of the log. Each is a pair of its name
/// in messages and its bytes.
///
/// ```
/// use truegrind_calibration::measurement::dataset::Reading;
/// use truegrind_calibration::measurement::import::{Options, read_joined};
///
/// let log = b"name,q1,q2,q3,q4,q5,q6\np1,10,20,30,40,50,60\np2,11,21,31,41,51,61\n";
/// let points = b"// Frame: World\nMain p2 812.5 -40.25 903.125\nMain p1 800.5 -41.0 900.25\n";
/// let rows = read_joined(("joints.csv", log), ("tracker.txt", points), &Options::default())?;
/// assert_eq!(rows.rows[0].reading, Reading::Position([800.5, -41.0, 900.25].into()));
/// # Ok::<(), truegrind_calibration::measurement::import::ImportError>(())
/// ```
///
/// # Errors
/// [`ImportError`]: as of [`read`], and for an export whose lines differ in layout, a duplicate point, a log without names, or no
/// common name.
pub fn read_joined(
    log: (&str, &[u8]),
    points: (&str, &[u8]),
    options: &Options,
) -> Result<Dataset, ImportError> {
    read_together(log, points, options, |measured, table| measured.join_by_name(log.0, table))
}

/// Reads the same pair of files and joins them by the log's column `time` and the export's time stamps. A point is joined with the
/// row nearest in time; rows and points without a partner within the tolerance are omitted and listed in the notes.
///
/// ```
/// use truegrind_calibration::measurement::dataset::Reading;
/// use truegrind_calibration::measurement::import::{TimeMatching, Options, read_joined_by_time};
///
/// let log = b"time,q1,q2,q3,q4,q5,q6\n10:15:30,10,20,30,40,50,60\n10:15:40,11,21,31,41,51,61\n";
/// let points = b"Main p1 800.5 -41.0 900.25 11/23/2026 10:15:39.8\n";
/// let clocks = TimeMatching { within_s: 0.5, ahead_s: 0.0 };
/// let rows = read_joined_by_time(("joints.csv", log), ("tracker.txt", points), &clocks, &Options::default())?;
/// assert_eq!(rows.rows.len(), 1);
/// assert!((rows.rows[0].joints[0].to_degrees() - 11.0).abs() < 1e-12);
/// # Ok::<(), truegrind_calibration::measurement::import::ImportError>(())
/// ```
///
/// # Errors
/// [`ImportError`]: as of [`read_joined`], for a row or point without a time, no row within the tolerance of any point, and an
/// ambiguous match: the arm moved within the tolerance, or a row is nearest to two points.
pub fn read_joined_by_time(
    log: (&str, &[u8]),
    points: (&str, &[u8]),
    clocks: &TimeMatching,
    options: &Options,
) -> Result<Dataset, ImportError> {
    let joined = read_together(log, points, options, |measured, table| {
        join_by_time::join_by_time(&measured, log.0, table, clocks)
    })?;
    Ok(Dataset { joined_by_time: true, ..joined })
}

fn read_together(
    log: (&str, &[u8]),
    points: (&str, &[u8]),
    options: &Options,
    join: impl FnOnce(Points, Table) -> Result<(Table, Vec<String>), ImportError>,
) -> Result<Dataset, ImportError> {
    let measured = Points::read(points.0, points.1)?;
    let table = match xlsx::is_workbook(log.1) {
        true => {
            let tables = xlsx::tables(log.0, log.1)?;
            let stated = stated_sheet(log.0, &tables, options)?;
            let filled = |table: &&Table| !table.rows.is_empty();
            let log_of = || tables.iter().find(|table| columns::has_joints(table));
            let sheet = stated.or_else(log_of).or_else(|| tables.iter().find(filled));
            sheet.cloned().ok_or(ImportError::Empty { location: Location::file(log.0) })?
        }
        false => {
            let text = csv::Text::of(log.0, log.1)?;
            let rows = text.lines(log.0).collect::<Result<_, _>>()?;
            Table { rows, ..text.empty() }
        }
    };
    if table.rows.iter().all(|line| line.cells.iter().all(Cell::is_empty)) {
        return Err(ImportError::Empty { location: Location::file(log.0) });
    }
    let (table, notes) = join(measured, table)?;
    let columns = HeaderColumns::find(log.0, &table)?;
    let mut dataset = rows::dataset(log.0, &table, &columns, options, std::iter::empty())?;
    dataset.notes.splice(0..0, notes);
    let digest = Sha256::new().chain_update(log.1).chain_update(points.1).finalize();
    dataset.sha256 = digest::hex(&digest);
    Ok(dataset)
}

/// The sheet that the options name, if they do.
fn stated_sheet<'t>(
    file: &str,
    tables: &'t [Table],
    options: &Options,
) -> Result<Option<&'t Table>, ImportError> {
    let Some(wanted) = &options.sheet else { return Ok(None) };
    let found = tables.iter().find(|table| table.sheet.as_ref() == Some(wanted));
    found.map(Some).ok_or_else(|| {
        let sheets = tables.iter().map(|table| table.sheet.clone().unwrap_or_default()).collect();
        ImportError::UnknownSheet { file: file.into(), sheet: wanted.clone(), sheets }
    })
}

/// Converts rows in memory, such as arrays and data frames, with the same column names and checks as a file. `file` is their name
/// in messages and reports; rows are counted from 0.
///
/// ```
/// use truegrind_calibration::measurement::import::cell::Cell;
/// use truegrind_calibration::measurement::import::{Options, from_rows};
///
/// let names = ["q1", "q2", "q3", "q4", "q5", "q6", "L"].map(String::from);
/// let number = |value: f64| Cell::Number { value, as_text: false };
/// let pose = |length: f64| vec![10.0, 20.0, 30.0, 40.0, 50.0, 60.0, length].into_iter().map(number).collect::<Vec<_>>();
/// let found = from_rows("array", &names, [pose(500.25), pose(500.5)].into_iter(), &Options::default())?;
/// assert_eq!((found.rows.len(), found.rows[1].number), (2, 1));
///
/// let error = from_rows("array", &names, [pose(500.25), pose(f64::NAN)].into_iter(), &Options::default());
/// let said = error.map(|_| ()).map_err(|error| error.to_string());
/// assert!(said.is_err_and(|said| said.starts_with("array, row 1, column L: found `NaN`; expected a finite number")));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`ImportError`], as for a file.
pub fn from_rows(
    file: &str,
    names: &[String],
    rows: impl Iterator<Item = Vec<Cell>>,
    options: &Options,
) -> Result<Dataset, ImportError> {
    let header = Line { number: 0, cells: names.iter().map(|name| Cell::Text(name.clone())).collect() };
    let table = Table { rows: vec![header], ..Table::default() };
    let columns = HeaderColumns::find(file, &table).map_err(ImportError::without_row)?;
    let mut digest = Sha256::new();
    digest.update(names.join(","));
    let lines = rows.enumerate().map(|(number, cells)| {
        for cell in &cells {
            match cell {
                Cell::Empty => digest.update([0]),
                Cell::Number { value, .. } => digest.update(value.to_le_bytes()),
                Cell::Text(text) => digest.update(text),
            }
        }
        Ok(Line { number, cells })
    });
    let mut dataset = rows::dataset(file, &table, &columns, options, lines)?;
    dataset.sha256 = digest::hex(&digest.finalize());
    Ok(dataset)
}

fn from_table(file: &str, table: &Table, options: &Options) -> Result<Dataset, ImportError> {
    match HeaderColumns::find(file, table) {
        Ok(columns) => rows::dataset(file, table, &columns, options, std::iter::empty()),
        Err(error) => from_foreign(file, table, options).unwrap_or(Err(error)),
    }
}

/// Reads a table of another program; `None` for an unknown format.
fn from_foreign(file: &str, table: &Table, options: &Options) -> Option<Result<Dataset, ImportError>> {
    let read = |(table, notes): (Table, Vec<String>)| {
        let columns = HeaderColumns::find(file, &table)?;
        let mut dataset = rows::dataset(file, &table, &columns, options, std::iter::empty())?;
        dataset.notes.splice(0..0, notes);
        Ok(dataset)
    };
    foreign::convert(file, table).map(|found| found.and_then(read))
}

/// Reads a text table: the lines up to the header at once, the rest one by one.
fn from_text(file: &str, text: &csv::Text<'_>, options: &Options) -> Result<Dataset, ImportError> {
    let mut table = text.empty();
    let mut lines = text.lines(file);
    while !columns::shows_header(&table.rows)
        && let Some(line) = lines.next()
    {
        table.rows.push(line?);
    }
    match HeaderColumns::find(file, &table) {
        Ok(columns) => rows::dataset(file, &table, &columns, options, lines),
        Err(error) => {
            for line in lines {
                table.rows.push(line?);
            }
            from_foreign(file, &table, options).unwrap_or(Err(error))
        }
    }
}

fn from_workbook(file: &str, tables: &[Table], options: &Options) -> Result<Dataset, ImportError> {
    let name = |t: &Table| t.sheet.clone().unwrap_or_default();
    if let Some(table) = stated_sheet(file, tables, options)? {
        return from_table(file, table, options);
    }
    let mut usable = tables.iter().filter(|t| HeaderColumns::find(file, t).is_ok());
    let Some(table) = usable.next() else {
        if let Some(found) = tables.iter().find_map(|table| from_foreign(file, table, options)) {
            return found;
        }
        // No sheet fits: report the error of the first nonempty sheet.
        let table = tables.iter().find(|t| !t.rows.is_empty()).or(tables.first());
        return match table {
            Some(table) => from_table(file, table, options),
            None => Err(ImportError::Empty { location: Location::file(file) }),
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
