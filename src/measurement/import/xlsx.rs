//! Workbooks: XLSX, and what else calamine opens (XLS, XLSB, ODS).

use std::io::Cursor;

use calamine::{Data, Dimensions, Reader, Sheets, Xlsx, open_workbook_auto_from_rs};

use super::cell::{Cell, Line, Table};
use super::csv::number;
use super::error::{ImportError, Place};

/// Whether the bytes are a workbook: a zip archive (XLSX, XLSB, ODS) or an OLE container (XLS).
pub fn is_workbook(bytes: &[u8]) -> bool {
    bytes.starts_with(b"PK\x03\x04") || bytes.starts_with(b"\xd0\xcf\x11\xe0")
}

/// All sheets of a workbook, in its order.
pub fn tables(file: &str, bytes: &[u8]) -> Result<Vec<Table>, ImportError> {
    let fail = |message: String| ImportError::Format { place: Place::file(file), message };
    let mut workbook = match open_workbook_auto_from_rs(Cursor::new(bytes)) {
        Ok(workbook) => workbook,
        // The other formats are tried in vain; what is wrong with an archive only the XLSX reader says.
        Err(error) => match Xlsx::new(Cursor::new(bytes)) {
            Ok(workbook) => Sheets::Xlsx(workbook),
            Err(archive) if bytes.starts_with(b"PK") => return Err(fail(archive.to_string())),
            Err(_) => return Err(fail(error.to_string())),
        },
    };
    let mut out = Vec::new();
    for sheet in workbook.sheet_names().to_vec() {
        let range = workbook.worksheet_range(&sheet).map_err(|e| fail(format!("sheet {sheet}: {e}")))?;
        let (top, left) = range.start().unwrap_or((0, 0));
        let rows = range
            .rows()
            .enumerate()
            .map(|(i, cells)| {
                // Keep the columns where the user sees them, though the range starts at the first used cell.
                let mut line = vec![Cell::Empty; left as usize];
                line.extend(cells.iter().map(cell));
                Line { number: top as usize + i + 1, cells: line }
            })
            .collect();
        // What was once typed into and cleared, or only formatted, is inside the sheet's own extent but not in the range.
        let extent = match &mut workbook {
            Sheets::Xlsx(book) => book.worksheet_cells_reader(&sheet).map(|r| r.dimensions()).ok(),
            _ => None,
        };
        let (blank_lines, blank_columns) = match (extent, range.end()) {
            (Some(Dimensions { end, .. }), Some((row, column))) => {
                (end.0.saturating_sub(row) as usize, end.1.saturating_sub(column) as usize)
            }
            _ => (0, 0),
        };
        out.push(Table { sheet: Some(sheet), rows, blank_lines, blank_columns, decimal_comma: false });
    }
    Ok(out)
}

fn cell(data: &Data) -> Cell {
    match data {
        Data::Empty => Cell::Empty,
        Data::Int(i) => Cell::Number { value: *i as f64, as_text: false },
        Data::Float(value) => Cell::Number { value: *value, as_text: false },
        Data::String(text) => {
            let text = text.trim();
            if text.is_empty() {
                return Cell::Empty;
            }
            match number(text, false) {
                Some(value) => Cell::Number { value, as_text: true },
                None => Cell::Text(text.to_owned()),
            }
        }
        Data::Bool(b) => Cell::Text(if *b { "TRUE".into() } else { "FALSE".into() }),
        Data::DateTime(date) => Cell::Text(format!("a date (serial number {})", date.as_f64())),
        Data::DateTimeIso(text) | Data::DurationIso(text) => Cell::Text(format!("a date ({text})")),
        Data::Error(error) => Cell::Text(error.to_string()),
    }
}
