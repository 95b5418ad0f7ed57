//! A measurement file as the rest of truegrind uses it: units converted, columns resolved.

mod row;
mod rows;

pub use self::row::{Extra, Motion, PathPoint, Rates, Reading, Row};
pub use self::rows::{Iter, Rows};
use truegrind_arm::condition::Condition;
pub use truegrind_arm::sensor::Sensor;

/// A measurement file.
#[derive(Debug, Clone, PartialEq)]
pub struct Dataset {
    /// Name of the file, as reports print it.
    pub file: String,
    /// Sheet of a workbook.
    pub sheet: Option<String>,
    /// SHA-256 of the file's bytes, in hex.
    pub sha256: String,
    /// The one sensor of the file.
    pub sensor: Sensor,
    /// The rows.
    pub rows: Rows,
    /// Headers of columns that are kept but not used.
    pub other_columns: Vec<String>,
    /// Notes for the user: columns skipped, blank rows dropped.
    pub notes: Vec<String>,
    /// Whether the points of a tracker were joined to the rows by their times: then clocks that differ shift them.
    pub joined_by_time: bool,
    /// Names of the stations as the file has them, in the order of [`Row::anchor`]; none without a column of stations.
    pub station_names: Vec<String>,
    /// Step to which the angles are rounded (rad); absent where no common step divides all of them.
    pub angle_step_rad: Option<f64>,
    /// Step to which the controller's read-out is rounded (mm); absent as above.
    pub readout_step_mm: Option<f64>,
    /// Step to which the sensor's lengths are rounded (mm); absent as above.
    pub reading_step_mm: Option<f64>,
}

impl Dataset {
    /// Rows without a source file.
    pub fn new(file: &str, sensor: Sensor, rows: impl Into<Rows>) -> Self {
        Self {
            file: file.into(),
            sheet: None,
            sha256: String::new(),
            sensor,
            rows: rows.into(),
            other_columns: Vec::new(),
            notes: Vec::new(),
            joined_by_time: false,
            station_names: Vec::new(),
            angle_step_rad: None,
            readout_step_mm: None,
            reading_step_mm: None,
        }
    }

    /// The same file with only the rows at `indices` of [`Dataset::rows`].
    pub fn subset(&self, indices: &[usize]) -> Self {
        Self { rows: self.rows.select(indices), ..self.clone() }
    }

    /// The same rows, those without a logged time, temperature or payload at that of `condition`. Programs are corrected for the condition of
    /// the model's own rows: an arm that had warmed up there is not judged as a cold one because later rows have no clock.
    #[must_use]
    pub fn at_unless_logged(&self, condition: &Condition) -> Self {
        let mut out = self.clone();
        for row in &mut out.rows {
            let known = row.condition.or(condition);
            if known != *row.condition {
                row.condition = known.into();
            }
        }
        out
    }

    /// Number of cable outlets; 1 without a cable.
    pub fn anchors(&self) -> usize {
        if self.sensor == Sensor::Cable { self.places() } else { 1 }
    }

    /// Number of stations of a tracker or camera; 1 for cables.
    pub fn stations(&self) -> usize {
        if self.sensor == Sensor::Cable { 1 } else { self.places() }
    }

    /// The station of a row, by index; the first for cables.
    pub fn station_of(&self, row: usize) -> usize {
        if self.sensor == Sensor::Cable { 0 } else { self.rows[row].anchor }
    }

    /// The name of a station as the file has it, else its number from 1.
    pub fn station_name(&self, anchor: usize) -> String {
        self.station_names.get(anchor).cloned().unwrap_or_else(|| (anchor + 1).to_string())
    }

    fn places(&self) -> usize {
        self.rows.iter().map(|r| r.anchor + 1).max().unwrap_or(1)
    }
}
