//! Tables of cells, common to CSV and workbooks, with the line numbers that users see.

use std::borrow::Cow;
use std::fmt;

/// One cell.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// Nothing, or only white space.
    Empty,
    /// A number.
    Number {
        /// The value.
        value: f64,
        /// Whether a workbook or a data frame held it as text.
        as_text: bool,
    },
    /// Anything else, as the user sees it.
    Text(String),
}

impl Cell {
    /// A text of a workbook or a data frame: a number if it is one.
    pub fn of_text(text: &str) -> Self {
        let text = text.trim();
        if text.is_empty() {
            return Cell::Empty;
        }
        match number(text, false) {
            Some(value) => Cell::Number { value, as_text: true },
            None => Cell::Text(text.to_owned()),
        }
    }

    /// Whether nothing is there.
    pub fn is_empty(&self) -> bool {
        matches!(self, Cell::Empty)
    }

    /// The number, where it is one.
    pub fn number(&self) -> Option<f64> {
        match self {
            Cell::Number { value, .. } => Some(*value),
            _ => None,
        }
    }
}

impl fmt::Display for Cell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Cell::Empty => Ok(()),
            // Not up to three hundred digits.
            Cell::Number { value, .. } if value.abs() >= 1e16 => write!(f, "{value:e}"),
            Cell::Number { value, .. } => write!(f, "{value}"),
            Cell::Text(text) => f.write_str(text),
        }
    }
}

/// Parses a decimal number. With `decimal_comma`, one comma is accepted in place of the point; a point and a comma together
/// are ambiguous and remain text.
pub(super) fn number(text: &str, decimal_comma: bool) -> Option<f64> {
    // Spreadsheets sometimes write a typographic minus.
    let text = if text.is_ascii() { Cow::Borrowed(text) } else { Cow::Owned(text.replace('\u{2212}', "-")) };
    if decimal_comma && text.matches(',').count() == 1 && !text.contains('.') {
        return text.replace(',', ".").parse().ok();
    }
    text.parse().ok()
}

/// One row.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Line of a text file or row of a sheet, from 1, as an editor or spreadsheet shows it.
    pub number: usize,
    /// The cells, up to the last one that the file holds.
    pub cells: Vec<Cell>,
}

/// A CSV file or one sheet of a workbook, header included.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// Name of the sheet, in a workbook.
    pub sheet: Option<String>,
    /// The rows.
    pub rows: Vec<Line>,
    /// Columns of a sheet up to the last used one; 0 for a text table, whose lines have their own lengths.
    pub width: usize,
    /// Blank lines that the format's reader skips.
    pub blank_lines: usize,
    /// Empty columns that the format counts as used.
    pub blank_columns: usize,
    /// Whether decimal commas are accepted.
    pub decimal_comma: bool,
}
