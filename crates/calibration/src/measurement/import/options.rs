//! How a measurement file is read.

/// How a file is read.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Options {
    /// Sheet of a workbook; without it the first that has the columns.
    pub sheet: Option<String>,
    /// Takes angles that look like radians and lengths that look like metres at their word.
    pub allow_odd_units: bool,
}

/// How far the times of two clocks may be apart where a log and measured points are joined by them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeMatching {
    /// The largest difference (s).
    pub within_s: f64,
    /// By how much the clock of the points is ahead of that of the log (s).
    pub ahead_s: f64,
}
