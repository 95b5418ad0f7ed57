//! Persistent state of a track: the filter with the exact bits of its covariance root, the latest poses, the processed files.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::alarm::Alarm;
use super::error::StateError;
use super::options::Options;
use crate::measurement::dataset::{Reading, Row, Sensor};
use truegrind_arm::condition::Condition;
use truegrind_arm::model::Joints;
use truegrind_arm::region::Region;
use truegrind_estimation::filter::rls::RecursiveLeastSquares;
use truegrind_math::se3::{pose_from_vector, vector_from_pose};

/// Schema of the state file.
pub const SCHEMA: &str = "truegrind.track/1";

/// One pose of the history.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoseRecord {
    /// File it came from.
    pub file: String,
    /// Its row, as the spreadsheet counts.
    pub row: usize,
    /// Time, where logged (h).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_h: Option<f64>,
    /// Joint angles (rad).
    pub(super) joints: [f64; 6],
    /// Length, position, or position and rotation vector.
    pub(super) reading: Vec<f64>,
    pub(super) condition: Condition,
    pub(super) anchor: usize,
    pub(super) per_mm: f64,
    pub(super) per_rad: f64,
    /// Normalised innovation squared when the pose was filtered.
    pub nis: f64,
    /// Residual at the updated state (mm): signed for a cable, the norm otherwise.
    pub error_mm: f64,
    /// The same before the update, when the pose was not yet known; absent in states of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub predicted_mm: Option<f64>,
    /// Whether the sensor was set up anew for this pose.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub(super) begins_station: bool,
}

impl PoseRecord {
    pub(super) fn row_of(&self, sensor: Sensor) -> Row {
        let reading = match (sensor, self.reading.as_slice()) {
            (Sensor::Cable, [length, ..]) => Reading::Cable(*length),
            (Sensor::Position, [x, y, z, ..]) => Reading::Position(nalgebra::Vector3::new(*x, *y, *z)),
            (Sensor::Pose, [x, y, z, a, b, c, ..]) => {
                Reading::Pose(Box::new(pose_from_vector(&[*x, *y, *z, *a, *b, *c])))
            }
            _ => Reading::Cable(f64::NAN),
        };
        let mut row = Row::new(self.row, Joints::from(self.joints), reading);
        row.condition = self.condition.into();
        row.anchor = self.anchor;
        row
    }
}

/// A processed file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConsumedFile {
    /// Name of the file.
    pub file: String,
    /// Rows.
    pub rows: usize,
    /// Hash of these rows, to detect a later change of the file.
    pub digest: String,
}

/// State vector and root of its covariance, bit-exact in the file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Snapshot {
    pub(super) x: Vec<f64>,
    /// S with SSᵀ the covariance, row by row.
    pub(super) root: Vec<Vec<f64>>,
    /// Number of history poses before the snapshot.
    pub(super) before: usize,
}

impl Snapshot {
    pub(super) fn of(filter: &RecursiveLeastSquares, before: usize) -> Self {
        let rows = |s: &DMatrix<f64>| s.row_iter().map(|r| r.iter().copied().collect()).collect();
        Self {
            x: filter.x.as_slice().to_vec(),
            root: filter.root().as_ref().map(rows).unwrap_or_default(),
            before,
        }
    }

    fn root(&self) -> Option<DMatrix<f64>> {
        let p = self.x.len();
        let whole = self.root.len() == p && self.root.iter().all(|r| r.len() == p);
        let finite = self.root.iter().flatten().chain(&self.x).all(|v| v.is_finite());
        (whole && finite).then(|| DMatrix::from_fn(p, p, |i, j| self.root[i][j]))
    }

    pub(super) fn covariance(&self) -> Option<DMatrix<f64>> {
        self.root().map(|s| &s * s.transpose())
    }

    pub(super) fn filter(&self) -> Option<RecursiveLeastSquares> {
        Some(RecursiveLeastSquares::from_root(DVector::from_column_slice(&self.x), self.root()?))
    }
}

/// Persistent state of a track. More than twenty fields: the keys of its file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct State {
    pub(super) schema: String,
    /// Hash of the model that tracking began with.
    pub model_hash: String,
    /// Sensor.
    pub sensor: Sensor,
    /// Poses processed.
    pub poses: usize,
    /// Poses rejected as outliers.
    #[serde(rename = "accidents")]
    pub outliers: usize,
    /// Settings.
    pub options: Options,
    pub(super) outlets_mm: Vec<[f64; 3]>,
    pub(super) zeros_mm: Vec<f64>,
    pub(super) base_from_sensor: [f64; 6],
    pub(super) flange_from_target: [f64; 6],
    pub(super) sigma_mm: f64,
    pub(super) sigma_rad: f64,
    /// The present state.
    pub(super) now: Snapshot,
    /// Snapshots at the beginning and in the middle of the history.
    pub(super) reference: Snapshot,
    pub(super) middle: Snapshot,
    /// Snapshot after the first poses, before any change: what the arm was when the track began.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) start: Option<Snapshot>,
    /// Snapshot from which on a turn of the arm against the sensor counts: after the first poses, or since the sensor was moved.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) placed: Option<Snapshot>,
    /// Pose number at which the next such snapshot is taken; 0 for none.
    #[serde(default)]
    pub(super) placed_at: usize,
    /// Scatter of the first poses, in units of the noise that the track assumes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) start_scatter: Option<f64>,
    /// The noise that the track began with, where the first poses showed it several times too large (mm).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) replaced_sigma_mm: Option<f64>,
    /// The present place of the sensor, as the files name it; absent where they do not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) station: Option<String>,
    /// How readings from there are brought into the frame in which the track began; absent as long as it is that.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) track_from_station: Option<[f64; 6]>,
    /// Measured region: the model's, extended by the track.
    pub region: Region,
    /// Pose number before which no further alarm is raised, after an unexplained one.
    pub quiet_until: usize,
    /// Pose number at which the window exceeded its bound, while the change is not localised yet; 0 otherwise.
    #[serde(default)]
    pub pending_since: usize,
    /// Pose number at which the current burst of outliers was detected; 0 without a burst.
    #[serde(default)]
    pub burst_since: usize,
    /// Processed files.
    pub consumed: Vec<ConsumedFile>,
    /// Changes detected so far.
    pub alarms: Vec<Alarm>,
    /// The latest poses.
    pub history: Vec<PoseRecord>,
}

impl State {
    /// Serialises to TOML.
    ///
    /// # Errors
    /// [`StateError::Unwritable`], when a number cannot be written.
    pub fn to_toml(&self) -> Result<String, StateError> {
        let text = toml::to_string(self).map_err(|e| StateError::Unwritable(e.to_string()))?;
        Ok(format!("# The state of a track, written by truegrind {}.\n{text}", env!("CARGO_PKG_VERSION")))
    }

    /// Reads TOML.
    ///
    /// # Errors
    /// [`StateError`] for a syntax error or an invalid value.
    pub fn from_toml(text: &str) -> Result<Self, StateError> {
        let fault = |e: toml::de::Error| StateError::Syntax(e.message().replace('\n', " "));
        let state: Self = toml::from_str(text).map_err(fault)?;
        let whole: toml::Table = toml::from_str(text).map_err(fault)?;
        if let Some((key, found)) =
            whole.iter().find_map(|(key, value)| not_finite(value).map(|x| (key.clone(), x)))
        {
            return Err(StateError::Value { key, found: found.to_string(), expected: "finite numbers" });
        }
        state.check()?;
        Ok(state)
    }

    /// Rejects invalid values.
    fn check(&self) -> Result<(), StateError> {
        let wrong = |key: &str, found: String, expected| {
            Err(StateError::Value { key: key.to_owned(), found, expected })
        };
        for (key, sigma) in [("sigma_mm", self.sigma_mm), ("sigma_rad", self.sigma_rad)] {
            if !(sigma > 0.0) {
                return wrong(key, sigma.to_string(), "a standard deviation above 0");
            }
        }
        if self.zeros_mm.len() != self.outlets_mm.len() {
            let found = format!("{} for {} outlets", self.zeros_mm.len(), self.outlets_mm.len());
            return wrong("zeros_mm", found, "one for each outlet");
        }
        let poses = self.history.len();
        for (key, before, fits, expected) in [
            ("now.before", self.now.before, self.now.before == poses, "the poses of the history"),
            (
                "middle.before",
                self.middle.before,
                self.middle.before <= poses,
                "no more than the poses of the history",
            ),
            ("reference.before", self.reference.before, self.reference.before == 0, "0"),
        ] {
            if !fits {
                return wrong(key, format!("{before} with {poses} poses"), expected);
            }
        }
        for (k, record) in self.history.iter().enumerate() {
            let key = |name: &str| format!("history {}: {name}", k + 1);
            if record.reading.len() != self.sensor.scalars() {
                let found = format!("{} numbers for the sensor {}", record.reading.len(), self.sensor);
                return wrong(&key("reading"), found, "1 of a cable, 3 of a position, 6 of a pose");
            }
            if record.anchor >= self.outlets_mm.len().max(1) {
                return wrong(
                    &key("anchor"),
                    record.anchor.to_string(),
                    "an outlet of the track, counted from 0",
                );
            }
            if !(record.per_mm >= 0.0 && record.per_rad >= 0.0) {
                let found = format!("{} and {}", record.per_mm, record.per_rad);
                return wrong(&key("per_mm, per_rad"), found, "weights of 0 or more");
            }
        }
        Ok(())
    }
}

/// A non-finite number in a value.
fn not_finite(value: &toml::Value) -> Option<f64> {
    match value {
        toml::Value::Float(x) => (!x.is_finite()).then_some(*x),
        toml::Value::Array(list) => list.iter().find_map(not_finite),
        toml::Value::Table(table) => table.iter().find_map(|(_, value)| not_finite(value)),
        _ => None,
    }
}

/// Hash of joints and readings, by their bits.
pub(super) fn digest<'r>(rows: impl Iterator<Item = &'r Row>) -> String {
    use sha2::{Digest, Sha256};
    let mut hash = Sha256::new();
    for row in rows {
        let mut number = |v: f64| hash.update(v.to_bits().to_le_bytes());
        row.joints.iter().for_each(|q| number(*q));
        match &row.reading {
            Reading::Cable(length) => number(*length),
            Reading::Position(p) => p.iter().for_each(|v| number(*v)),
            Reading::Pose(pose) => vector_from_pose(pose).iter().for_each(|v| number(*v)),
        }
    }
    truegrind_math::digest::hex(&hash.finalize())
}

/// Limit of a region's samples.
const SAMPLES: usize = 2_000;

/// Extends the measured region by a pose, as a new sample where none is within the samples' spacing. Sequential, so that the
/// region does not depend on how the poses are divided among runs.
pub(super) fn extend_region(region: &mut Region, joints: &[f64; 6]) {
    let degrees = joints.map(f64::to_degrees);
    for (i, q) in degrees.iter().enumerate() {
        region.min_deg[i] = region.min_deg[i].min(*q);
        region.max_deg[i] = region.max_deg[i].max(*q);
    }
    let near = |sample: &[f64; 6]| {
        let square: f64 = sample.iter().zip(&degrees).map(|(a, b)| (a - b) * (a - b)).sum();
        square <= region.spacing_deg * region.spacing_deg
    };
    if region.samples_deg.len() < SAMPLES && !region.samples_deg.iter().any(near) {
        region.samples_deg.push(degrees);
    }
}
