//! One measured row.

use std::sync::{Arc, LazyLock};

use nalgebra::Vector3;

use truegrind_arm::condition::Condition;
use truegrind_arm::model::Joints;
use truegrind_math::se3::Pose;

/// One reading.
#[derive(Debug, Clone, PartialEq)]
pub enum Reading {
    /// Cable length (mm), its zero unknown.
    Cable(f64),
    /// Position in the sensor's frame (mm).
    Position(Vector3<f64>),
    /// Pose in the sensor's frame (mm).
    Pose(Box<Pose>),
}

impl Reading {
    /// The measured position in the sensor's frame, or a cable's length along x (mm).
    pub fn place_mm(&self) -> Vector3<f64> {
        match self {
            Reading::Cable(length) => Vector3::new(*length, 0.0, 0.0),
            Reading::Position(position) => *position,
            Reading::Pose(pose) => pose.translation.vector,
        }
    }
}

/// How the arm came to a pose, from the rows around it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Joint angles less those of the row before (rad).
    pub step: Joints,
    /// Joint speeds where the rows are a path with a clock.
    pub rates: Option<Rates>,
}

/// Joint speeds at a row of a path (rad/h).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rates {
    /// From the row before to the next.
    pub mean: Joints,
    /// Where the path turns sharply, those with which the arm came; elsewhere the mean.
    pub before: Joints,
    /// Where the path turns sharply, those with which it went on; elsewhere the mean.
    pub after: Joints,
}

impl Rates {
    /// Those of a row at which the path does not turn sharply.
    pub fn steady(mean: Joints) -> Self {
        Self { mean, before: mean, after: mean }
    }

    /// Whether the path turns so sharply here that the arm has the mean of its speeds at no time.
    pub fn is_corner(&self) -> bool {
        self.before != self.mean || self.after != self.mean
    }
}

/// Sampling point of a row on a measured path. The path is run in several cycles and read at the same sampling points in each.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PathPoint {
    /// Which path.
    pub path: String,
    /// Which run of it, from 1.
    pub cycle: u32,
    /// Which sampling point, counted along the path.
    pub sample: u32,
}

/// Fields that only some rows have.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Extra {
    /// The controller's own Cartesian read-out (mm), where logged.
    pub readout_mm: Option<Vector3<f64>>,
    /// Motion from the previous row, where rows are in the order of measuring; filled in by a diagnosis.
    pub motion: Option<Motion>,
    /// Session label, where logged.
    pub session: Option<String>,
    /// Sampling point, where the row was read on a path.
    pub path: Option<Box<PathPoint>>,
    /// Cells of [`Dataset::other_columns`](super::Dataset::other_columns), as text, up to the last one that holds something.
    pub other: Vec<String>,
}

/// One measured pose. Kept small, since a file can hold a million: rare fields are in [`Extra`], conditions are shared.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Row number in reports: the line of the file, counted as a spreadsheet counts; an index where there is no file.
    pub number: usize,
    /// Line of the file or row of the sheet, from 1, as an editor or spreadsheet shows it.
    pub line: u32,
    /// Logged joint angles of the controller (rad).
    pub joints: Joints,
    /// The sensor's reading.
    pub reading: Reading,
    /// Time, temperature, payload and approach sides, where logged; rows of one condition share it.
    pub condition: Arc<Condition>,
    /// Index of the cable outlet; of a tracker or camera that of the station.
    pub anchor: usize,
    /// Fields that only some rows have.
    pub extra: Option<Box<Extra>>,
}

/// The condition of a row without any logged.
static UNKNOWN: LazyLock<Arc<Condition>> = LazyLock::new(Arc::default);

impl Row {
    /// A row of joint angles (rad) and a reading alone, line `number + 2` of a file with a header.
    pub fn new(number: usize, joints: Joints, reading: Reading) -> Self {
        let line = u32::try_from(number).unwrap_or(u32::MAX).saturating_add(2);
        Self { number, line, joints, reading, condition: UNKNOWN.clone(), anchor: 0, extra: None }
    }

    /// The controller's own Cartesian read-out (mm), where logged.
    pub fn readout_mm(&self) -> Option<Vector3<f64>> {
        self.extra.as_ref()?.readout_mm
    }

    /// Motion from the previous row, where known.
    pub fn motion(&self) -> Option<&Motion> {
        self.extra.as_ref()?.motion.as_ref()
    }

    /// Session label, where logged.
    pub fn session(&self) -> Option<&str> {
        self.extra.as_ref()?.session.as_deref()
    }

    /// Sampling point, where the row was read on a path.
    pub fn path(&self) -> Option<&PathPoint> {
        self.extra.as_ref()?.path.as_deref()
    }

    /// Cells of [`Dataset::other_columns`](super::Dataset::other_columns), up to the last one that holds something.
    pub fn other(&self) -> &[String] {
        self.extra.as_ref().map_or(&[], |extra| &extra.other)
    }

    /// The optional fields, to be filled in.
    pub fn extra_mut(&mut self) -> &mut Extra {
        self.extra.get_or_insert_default()
    }
}
