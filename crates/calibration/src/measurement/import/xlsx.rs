//! Workbooks: XLSX, read cell by cell, so that a table takes the memory of its cells and not of the rectangle around them.
//!
//! Limits protect against hostile files: the unpacked size of its parts (`archive`), the sheets that share a part, the cells
//! of all sheets (with the empty ones to the left of each), and their text. The old binary workbooks (XLS, XLSB) and ODS are
//! refused: their reader allocates whatever rectangle a file declares.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};

use calamine::{Data, DataRef, Dimensions, Reader, Xlsx, XlsxError};

use super::archive::{self, Refusal};
use super::cell::{Cell, Line, Table};
use super::error::{ImportError, Location};

/// Rows and columns of a sheet.
const SHEET: (u32, u32) = (1 << 20, 1 << 14);
/// Cells of all sheets, including empty ones to the left of a used one and blank lines between used ones: 400,000 rows of
/// forty columns.
const MAX_CELLS: usize = 16_000_000;
/// Text of all cells (bytes); any number of cells can share one string.
const MAX_TEXT: usize = 128 << 20;
/// Limit for repeated reads of the largest part by sheets that share it, in multiples of the unpacked limit.
const SHARED: u64 = 4;

/// Whether the bytes are a workbook: a zip archive (XLSX, XLSB, ODS) or an OLE container (XLS, or XLSX with a password).
pub fn is_workbook(bytes: &[u8]) -> bool {
    bytes.starts_with(b"PK\x03\x04") || bytes.starts_with(b"\xd0\xcf\x11\xe0")
}

/// All sheets of a workbook, in its order.
pub fn tables(file: &str, bytes: &[u8]) -> Result<Vec<Table>, ImportError> {
    let fail = |message: String| ImportError::Format { location: Location::file(file), message };
    if !bytes.starts_with(b"PK") {
        return Err(fail("this is an XLS workbook, or an XLSX workbook with a password".to_owned()));
    }
    let unpacked = archive::measure_unpacked(bytes).map_err(|refusal| match refusal {
        Refusal::Broken(message) => fail(format!("the workbook is damaged ({message})")),
        Refusal::Large { found, expected } => ImportError::TooLarge {
            location: Location::file(file),
            found: found.into(),
            expected: expected.into(),
        },
    })?;
    // The workbook reader still panics on some inconsistent indices.
    let read = catch_unwind(AssertUnwindSafe(|| {
        let mut workbook = Xlsx::new(Cursor::new(bytes)).map_err(|e| fail(e.to_string()))?;
        let names = workbook.sheet_names();
        if names.len() as u64 > SHARED * unpacked.allowed / unpacked.largest.max(1) {
            return Err(ImportError::TooLarge {
                location: Location::file(file),
                found: format!("{} sheets beside a part of {} bytes", names.len(), unpacked.largest).into(),
                expected: "sheets with parts of their own".into(),
            });
        }
        let mut budget = Budget { cells: MAX_CELLS, text: MAX_TEXT };
        names.iter().map(|name| table(file, &mut workbook, name, &mut budget)).collect()
    }));
    read.unwrap_or_else(|_| Err(fail("its contents contradict each other".to_owned())))
}

/// Cells and text that are left of the limits.
struct Budget {
    cells: usize,
    text: usize,
}

impl Budget {
    /// Spends `count` cells and `text` bytes.
    fn take(&mut self, location: &Location, count: usize, text: usize) -> Result<(), ImportError> {
        let (Some(cells), Some(text)) = (self.cells.checked_sub(count), self.text.checked_sub(text)) else {
            return Err(ImportError::TooLarge {
                location: location.clone(),
                found: format!(
                    "more than {MAX_CELLS} cells (including empty ones before a used one) or {} MB of text",
                    MAX_TEXT >> 20
                )
                .into(),
                expected: "one table that begins at the upper left of its sheet".into(),
            });
        };
        (self.cells, self.text) = (cells, text);
        Ok(())
    }
}

/// Reads one sheet, each line up to its last used cell.
fn table(
    file: &str,
    workbook: &mut Xlsx<Cursor<&[u8]>>,
    sheet: &str,
    budget: &mut Budget,
) -> Result<Table, ImportError> {
    let location = Location { sheet: Some(sheet.into()), ..Location::file(file) };
    let fail = |e: XlsxError| ImportError::Format {
        location: Location::file(file),
        message: format!("sheet {sheet}: {e}"),
    };
    let mut found = Table { sheet: Some(sheet.to_owned()), ..Table::default() };
    let mut cells = match workbook.worksheet_cells_reader(sheet) {
        Ok(cells) => cells,
        // A chart or macro sheet.
        Err(XlsxError::NotAWorksheet(_)) => return Ok(found),
        Err(e) => return Err(fail(e)),
    };
    let Dimensions { end, .. } = cells.dimensions();
    let mut lines: BTreeMap<u32, Vec<Cell>> = BTreeMap::new();
    while let Some(next) = cells.next_cell().map_err(fail)? {
        if next.get_value() == &DataRef::Empty {
            continue;
        }
        let (row, column) = next.get_position();
        if row >= SHEET.0 || column >= SHEET.1 {
            return Err(ImportError::TooLarge {
                location,
                found: format!("a cell in row {}, column {}", u64::from(row) + 1, u64::from(column) + 1)
                    .into(),
                expected: format!("at most {} rows and {} columns", SHEET.0, SHEET.1).into(),
            });
        }
        let value = cell(&Data::from(next.get_value().clone()));
        let text = if let Cell::Text(text) = &value { text.len() } else { 0 };
        let line = lines.entry(row).or_default();
        let column = column as usize;
        budget.take(&location, (column + 1).saturating_sub(line.len()), text)?;
        if line.len() <= column {
            line.resize(column + 1, Cell::Empty);
        }
        line[column] = value;
        found.width = found.width.max(column + 1);
    }
    let (Some((&first, _)), Some((&last, _))) = (lines.first_key_value(), lines.last_key_value()) else {
        return Ok(found);
    };
    budget.take(&location, (last - first) as usize, 0)?;
    found.rows = (first..=last)
        .map(|row| Line { number: row as usize + 1, cells: lines.remove(&row).unwrap_or_default() })
        .collect();
    // Cleared or merely formatted cells are inside the sheet's extent but have no value.
    found.blank_lines = end.0.min(SHEET.0 - 1).saturating_sub(last) as usize;
    found.blank_columns = (end.1.min(SHEET.1 - 1) as usize + 1).saturating_sub(found.width);
    Ok(found)
}

fn cell(data: &Data) -> Cell {
    match data {
        Data::Empty => Cell::Empty,
        Data::Int(i) => Cell::Number { value: *i as f64, as_text: false },
        Data::Float(value) => Cell::Number { value: *value, as_text: false },
        Data::String(text) => Cell::of_text(text),
        Data::Bool(b) => Cell::Text(if *b { "TRUE".into() } else { "FALSE".into() }),
        Data::DateTime(date) => Cell::Text(format!("a date (serial number {})", date.as_f64())),
        Data::DateTimeIso(text) | Data::DurationIso(text) => Cell::Text(format!("a date ({text})")),
        Data::Error(error) => Cell::Text(error.to_string()),
    }
}
