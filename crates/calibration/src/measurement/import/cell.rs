//! What CSV and workbooks have in common: rows of cells with the line at which the user sees them.

use std::fmt;

/// One cell.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// Nothing, or only white space.
    Empty,
    /// A number; `as_text` where the file held it as text in a format that has numbers.
    Number {
        /// The value.
        value: f64,
        /// Whether a workbook held it as text.
        as_text: bool,
    },
    /// Anything else, as the user sees it.
    Text(String),
}

impl Cell {
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
            // Three hundred digits say less than an exponent.
            Cell::Number { value, .. } if value.abs() >= 1e16 => write!(f, "{value:e}"),
            Cell::Number { value, .. } => write!(f, "{value}"),
            Cell::Text(text) => f.write_str(text),
        }
    }
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
    /// Columns up to the last one in which any row of a sheet has a cell; 0 for a text table, whose lines say it themselves.
    pub width: usize,
    /// What was passed over on the way: blank lines that the format itself hides.
    pub blank_lines: usize,
    /// Columns that the format counts as used though nothing stands in them.
    pub blank_columns: usize,
    /// Whether a decimal comma was understood.
    pub decimal_comma: bool,
}
