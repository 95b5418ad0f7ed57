//! How a measurement file is read.

/// How a file is read.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Options {
    /// Sheet of a workbook; without it the first that has the columns.
    pub sheet: Option<String>,
    /// Takes angles that look like radians and lengths that look like metres at their word.
    pub allow_odd_units: bool,
}
