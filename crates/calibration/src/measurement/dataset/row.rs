//! One measured row.

use nalgebra::Vector3;

use truegrind_arm::condition::Condition;
use truegrind_arm::model::Joints;
use truegrind_math::se3::Pose;

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

/// How the arm came to a pose, from the rows around it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Joint angles less those of the row before (rad).
    pub step: Joints,
    /// Joint speeds where the rows are a path with a clock (rad/h).
    pub rate_per_h: Option<Joints>,
}

/// One measured pose.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// What the row is called where people read of it: its line in a file that was read, counted as the spreadsheet counts;
    /// an index where there is no file.
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
    /// How the arm came here, where the order of the rows is that of measuring; filled in by a diagnosis.
    pub motion: Option<Box<Motion>>,
    /// Session label, where logged.
    pub session: Option<String>,
    /// Cells of [`Dataset::other_columns`](super::Dataset::other_columns), as text, up to the last one that holds something.
    pub other: Vec<String>,
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
            motion: None,
            session: None,
            other: Vec::new(),
        }
    }
}
