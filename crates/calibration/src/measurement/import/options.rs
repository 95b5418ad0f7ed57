//! Options for reading measurement files.

/// Options for reading a file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Options {
    /// Sheet of a workbook; by default the first with the required columns.
    pub sheet: Option<String>,
    /// Accepts angles that look like radians and lengths that look like metres.
    pub allow_odd_units: bool,
}

/// Tolerance and offset of two clocks when a log and measured points are joined by time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeMatching {
    /// Largest time difference of a row and its point (s).
    pub within_s: f64,
    /// Offset by which the points' clock is ahead of the log's (s).
    pub ahead_s: f64,
}
