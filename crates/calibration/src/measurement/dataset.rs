//! Measured rows as the rest of truegrind sees them: units converted, columns resolved.

mod rows;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use truegrind_arm::condition::Condition;
use truegrind_arm::model::Joints;
use truegrind_math::se3::Pose;

pub use self::rows::{Iter, Rows};

/// What the sensor tells of a pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sensor {
    /// Length of a draw-wire from an outlet to a hook on the flange.
    Cable,
    /// Position of a reflector on the flange, in the sensor's own frame.
    Position,
    /// Position and orientation of a target on the flange, in the sensor's own frame.
    Pose,
}

/// One reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reading {
    /// Cable length (mm), its zero unknown.
    Cable(f64),
    /// Position in the sensor's frame (mm).
    Position(Vector3<f64>),
    /// Pose in the sensor's frame (mm).
    Pose(Pose),
}

/// One measured pose.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Index of the data row in the file, from 0 at the first row below the header.
    pub number: usize,
    /// Line of the file or row of the sheet, from 1, as an editor or spreadsheet shows it.
    pub line: usize,
    /// Logged joint angles of the controller (rad).
    pub joints: Joints,
    /// What the sensor read.
    pub reading: Reading,
    /// The controller's own Cartesian read-out (mm), where logged.
    pub readout_mm: Option<Vector3<f64>>,
    /// Time, temperature, payload and approach sides, where logged.
    pub condition: Condition,
    /// Which cable outlet (0-based) the row belongs to.
    pub anchor: usize,
    /// Session label, where logged.
    pub session: Option<String>,
    /// Cells of [`Dataset::other_columns`], as text, up to the last one that holds something.
    pub other: Vec<String>,
}

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
    /// What a reader should know: columns skipped, blank rows dropped.
    pub notes: Vec<String>,
    /// Step to which the angles are rounded (rad), where all are multiples of one.
    pub angle_step_rad: Option<f64>,
    /// Step to which the read-out is rounded (mm), where all are multiples of one.
    pub readout_step_mm: Option<f64>,
    /// Step to which the sensor's lengths are rounded (mm), where all are multiples of one.
    pub reading_step_mm: Option<f64>,
}

impl Row {
    /// A row of nothing but joint angles (rad) and a reading, line `number + 2` of a file with a header.
    pub fn new(number: usize, joints: Joints, reading: Reading) -> Self {
        Self {
            number,
            line: number + 2,
            joints,
            reading,
            readout_mm: None,
            condition: Condition::default(),
            anchor: 0,
            session: None,
            other: Vec::new(),
        }
    }
}

impl Dataset {
    /// Rows that come from no file.
    pub fn new(file: &str, sensor: Sensor, rows: impl Into<Rows>) -> Self {
        Self {
            file: file.into(),
            sheet: None,
            sha256: String::new(),
            sensor,
            rows: rows.into(),
            other_columns: Vec::new(),
            notes: Vec::new(),
            angle_step_rad: None,
            readout_step_mm: None,
            reading_step_mm: None,
        }
    }

    /// The same file with only the rows at `indices` of [`Dataset::rows`].
    pub fn subset(&self, indices: &[usize]) -> Self {
        Self { rows: self.rows.part(indices), ..self.clone() }
    }

    /// Number of cable outlets.
    pub fn anchors(&self) -> usize {
        self.rows.iter().map(|r| r.anchor + 1).max().unwrap_or(1)
    }
}
