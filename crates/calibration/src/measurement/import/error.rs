//! Errors of measurement files: location, what was found, what was expected, and the remedy.

use std::fmt;

use thiserror::Error;

use super::column_names::READOUT;

/// A location in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Location {
    /// File, as the caller named it.
    pub file: Box<str>,
    /// Sheet, in a workbook.
    pub sheet: Option<Box<str>>,
    /// Line of the file or row of the sheet, from 1.
    pub row: Option<usize>,
    /// Header of the column.
    pub column: Option<Box<str>>,
}

impl Location {
    /// The file as a whole.
    pub fn file(file: &str) -> Self {
        Self { file: file.into(), sheet: None, row: None, column: None }
    }
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.file)?;
        if let Some(sheet) = &self.sheet {
            write!(f, ", sheet {sheet}")?;
        }
        if let Some(row) = self.row {
            write!(f, ", row {row}")?;
        }
        if let Some(column) = &self.column {
            write!(f, ", column {column}")?;
        }
        Ok(())
    }
}

/// A measurement file that cannot be used.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ImportError {
    /// Neither text nor a workbook.
    #[error(
        "{location}: this is neither a text table nor a workbook; export the measurements as CSV or XLSX"
    )]
    NotATable {
        /// The file.
        location: Location,
    },
    /// The container is broken.
    #[error("{location}: cannot be read: {message}; export the measurements again as CSV or XLSX")]
    Format {
        /// The file.
        location: Location,
        /// Message of the format's reader.
        message: String,
    },
    /// A table of another program, or two files to be joined, without what is needed of them.
    #[error("{location}: {message}")]
    Unusable {
        /// The file or row.
        location: Location,
        /// What was found and expected, and what to do.
        message: String,
    },
    /// A size limit is exceeded.
    #[error(
        "{location}: found {found}; expected {expected}; save the table alone in a new workbook, or as CSV"
    )]
    TooLarge {
        /// The file or sheet.
        location: Location,
        /// What was found.
        found: Box<str>,
        /// The limit.
        expected: Box<str>,
    },
    /// No rows.
    #[error("{location}: found no rows; expected a header line and one row for each measured pose")]
    Empty {
        /// The file or sheet.
        location: Location,
    },
    /// The named sheet does not exist.
    #[error("{file}: there is no sheet {sheet}; it has {}", sheets.join(", "))]
    UnknownSheet {
        /// The file.
        file: String,
        /// The requested sheet.
        sheet: String,
        /// The existing sheets.
        sheets: Vec<String>,
    },
    /// A sheet was named, but the file is text.
    #[error("{file}: sheet {sheet} was requested, but this is a text table without sheets; omit the sheet")]
    NoSheets {
        /// The file.
        file: String,
        /// The requested sheet.
        sheet: String,
    },
    /// Columns are missing.
    #[error("{location}: {}; found the columns {}{}", missing.join("; "), list(found), headless(found))]
    MissingColumns {
        /// The file or sheet, with the row of the header.
        location: Location,
        /// The missing columns, each with a suggestion if a header is similar.
        missing: Vec<String>,
        /// The headers found.
        found: Vec<String>,
    },
    /// No sensor.
    #[error(
        "{location}: found no sensor's column; expected L (cable length) or measured_x, measured_y, measured_z{}; \
         found the columns {}{}",
        suggestion(near),
        list(found),
        readout_only(found)
    )]
    NoSensor {
        /// The file or sheet, with the row of the header.
        location: Location,
        /// Similar headers, each with the expected name.
        near: Vec<(String, String)>,
        /// The headers found.
        found: Vec<String>,
    },
    /// Two sensors in one file.
    #[error(
        "{location}: found two sensors at once, a cable (L) and a tracker ({tracker}); expected one; \
         keep each sensor's rows in a file of its own, or rename the columns of the one not to be used"
    )]
    TwoSensors {
        /// The file or sheet, with the row of the header.
        location: Location,
        /// The tracker's columns.
        tracker: String,
    },
    /// A duplicate header.
    #[error("{location}: found the column twice; expected it once; rename or delete one of the two")]
    DuplicateColumn {
        /// The column.
        location: Location,
    },
    /// An arm with more than six joints.
    #[error(
        "{location}: found a column for joint {joint}; truegrind works with six-axis arms, q1 to q6; \
         a track or positioner can be left out only if it stood still while measuring"
    )]
    TooManyJoints {
        /// The column.
        location: Location,
        /// Number of the joint.
        joint: usize,
    },
    /// An invalid cell.
    #[error("{location}: found {found}; expected {expected}; {remedy}")]
    Cell {
        /// The cell.
        location: Location,
        /// What was found.
        found: Box<str>,
        /// What was expected.
        expected: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// A row longer than the header.
    #[error(
        "{location}: found {found} cells under a header of {expected}; are these decimal commas? \
         Export with a decimal point, or with semicolons between the columns"
    )]
    LongRow {
        /// The row.
        location: Location,
        /// Cells of the row.
        found: usize,
        /// Columns of the header.
        expected: usize,
    },
    /// Numbers in the wrong unit.
    #[error("{location}: {found}; expected {expected}; {remedy}")]
    Units {
        /// The columns.
        location: Location,
        /// What looks wrong about the numbers.
        found: Box<str>,
        /// The unit of the format.
        expected: &'static str,
        /// What to do.
        remedy: &'static str,
    },
}

impl ImportError {
    /// The location in the file, as far as known.
    pub fn location(&self) -> Option<&Location> {
        match self {
            Self::NotATable { location }
            | Self::Format { location, .. }
            | Self::Unusable { location, .. }
            | Self::TooLarge { location, .. }
            | Self::Empty { location }
            | Self::MissingColumns { location, .. }
            | Self::NoSensor { location, .. }
            | Self::TwoSensors { location, .. }
            | Self::DuplicateColumn { location }
            | Self::TooManyJoints { location, .. }
            | Self::Cell { location, .. }
            | Self::LongRow { location, .. }
            | Self::Units { location, .. } => Some(location),
            Self::UnknownSheet { .. } | Self::NoSheets { .. } => None,
        }
    }

    /// The same error for a table whose header is not a row of a file.
    pub(super) fn without_row(mut self) -> Self {
        if let Self::MissingColumns { location, .. }
        | Self::NoSensor { location, .. }
        | Self::TwoSensors { location, .. }
        | Self::DuplicateColumn { location }
        | Self::TooManyJoints { location, .. } = &mut self
        {
            location.row = None;
        }
        self
    }
}

fn list(names: &[String]) -> String {
    if names.is_empty() {
        return "none".into();
    }
    let shown = |name: &String| match name.char_indices().nth(MAX_UNBROKEN_NAME) {
        Some((end, _)) => format!("`{}…`", &name[..end]),
        None => format!("`{name}`"),
    };
    let more = names.len().saturating_sub(MAX_NAMES);
    let shown = names.iter().take(MAX_NAMES).map(shown).collect::<Vec<_>>().join(", ");
    if more > 0 { format!("{shown} and {more} more") } else { shown }
}

/// Limits for column names in messages: characters of a name, and number of names.
const MAX_UNBROKEN_NAME: usize = 32;
const MAX_NAMES: usize = 40;

/// A hint where the first line has only numbers and thus is not a header.
fn headless(found: &[String]) -> &'static str {
    let numbers = !found.is_empty() && found.iter().all(|name| name.trim().parse::<f64>().is_ok());
    if numbers {
        "; these are numbers: put a header line with the names of the columns above them"
    } else {
        ""
    }
}

/// A hint where the only Cartesian columns are named as the controller's read-out.
fn readout_only(found: &[String]) -> &'static str {
    if READOUT.iter().all(|name| found.iter().any(|found| found == name)) {
        "; x, y, z are the controller's own read-out: if a sensor measured them, rename them to measured_x, measured_y, measured_z"
    } else {
        ""
    }
}

fn suggestion(near: &[(String, String)]) -> String {
    let parts: Vec<String> = near.iter().map(|(f, e)| format!("found `{f}`, did you mean {e}?")).collect();
    if parts.is_empty() { String::new() } else { format!(" ({})", parts.join(" ")) }
}
