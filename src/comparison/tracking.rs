//! Continuous calibration: a model that is kept accurate as measurements come in, and says when and why it had to change.
//!
//! **Method.** The state is the arm's parameters with the model's own covariance, and the sensor's frames with a wide
//! prior, linearised anew at every pose and updated row by row by Potter's square-root form
//! ([`rls`](crate::estimation::filter::rls)), which cannot lose positive definiteness. Every parameter drifts by a
//! random walk of its own between two poses (process noise), so that the filter never stops listening.
//!
//! **Alarm.** The normalised innovations squared (NIS) of a pose are χ² with as many degrees of freedom as the pose has
//! rows, where arm, sensor and noise are what the filter believes. A single pose beyond the 1 in 10⁹ bound is set aside
//! as an accident; the sum over a sliding window beyond the 1 in 10⁵ bound raises the alarm. Poses set aside count in
//! the window, each up to a third of its bound, so that a jump of the arm cannot hide as a series of accidents and a
//! single accident is none.
//!
//! **Which parameter, since when.** For every parameter k and every pose s of the history, the generalised likelihood
//! ratio of a step of k at s (Willsky and Jones 1976), against what was known before the history began. With J and r of
//! the history at that state, P its covariance, A_s = Σ_{i≥s} JᵢᵀJᵢ, g_s = Σ_{i≥s} Jᵢᵀrᵢ and M = (P⁻¹ + A₀)⁻¹:
//! ratio = (g_s(k) − A_s(:,k)ᵀ M g₀)² / (A_s(k,k) − A_s(:,k)ᵀ M A_s(:,k)), exact for rows of unit noise. Parameters whose
//! ratio is nearly as large are named as alternatives: a sensor that was knocked and a joint that lost its zero can look
//! the same.
//!
//! **After an alarm.** The filter goes back to where the history began, the parameter that moved may move by three times
//! what was found, and the history is taken in again: nothing is lost, and the model follows within a few poses.
//!
//! **Shapes.** p parameters; a pose has 1, 3 or 6 rows. A pose costs one row evaluation with derivatives, p³ for the
//! process noise and p² for each row.
//!
//! **Source and departures.** rls-2025 keeps its arm accurate by RLS without forgetting, which stops listening; process
//! noise and alarm are ours. Bar-Shalom, Li, Kirubarajan, *Estimation with Applications to Tracking and Navigation*,
//! 2001, ch. 5 for the NIS test.
//!
//! **Checked against** a simulated arm whose parameters jump at a known pose, and resumption to the bit.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::comparison::distribution::chi_square_quantile;
use crate::comparison::experiment::ExperimentError;
use crate::comparison::protocol::register;
use crate::estimation::filter::rls::{Memory, Recursion};
use crate::estimation::problem::Problem;
use crate::identification::calibration::{Calibration, Frames};
use crate::identification::fit::{Observed, frame_parameters};
use crate::identification::identify::{observe, sensor_name};
use crate::identification::rounding;
use crate::identification::tolerance::Tolerance;
use crate::kinematics::condition::Condition;
use crate::kinematics::estimated::{Estimated, EstimatedParameter, Judgement, Verdict};
use crate::kinematics::model::Joints;
use crate::kinematics::parameter::Parameter;
use crate::kinematics::region::Region;
use crate::math::se3::{pose_from_vector, vector_from_pose};
use crate::math::statistics::ErrorSummary;
use crate::measurement::dataset::{Dataset, Reading, Row, Sensor};

/// Schema of the state file.
pub const SCHEMA: &str = "truegrind.track/1";

/// How an arm is watched.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Options {
    /// Random walk of a length of the arm from pose to pose (mm).
    pub drift_length_mm: f64,
    /// Random walk of an angle of the arm from pose to pose (rad).
    pub drift_angle_rad: f64,
    /// Random walk of a frame's position from pose to pose (mm).
    pub drift_frame_mm: f64,
    /// Random walk of a frame's orientation from pose to pose (rad).
    pub drift_frame_rad: f64,
    /// Random walks of single parameters in place of the above, by name (`link2.theta`), in mm or rad.
    pub drift: BTreeMap<String, f64>,
    /// Standard deviation of a reading (mm), with what the model does not explain; where not stated, what the first poses
    /// leave, but no less than the model's held-out error.
    pub sigma_mm: Option<f64>,
    /// Poses that place the sensor before tracking begins.
    pub first_poses: usize,
    /// Poses of the alarm's window.
    pub window: usize,
    /// Poses of the history in which a change is looked for.
    pub history: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            drift_length_mm: 2e-4,
            drift_angle_rad: 4e-7,
            drift_frame_mm: 2e-4,
            drift_frame_rad: 4e-7,
            drift: BTreeMap::new(),
            sigma_mm: None,
            first_poses: 30,
            window: 15,
            history: 200,
        }
    }
}

/// A pose beyond this share of χ² is an accident.
const ACCIDENT: f64 = 1e-9;

/// A window beyond so many standard deviations, 1 in 10⁵, raises the alarm.
const ALARM_DEVIATIONS: f64 = 4.265;

/// Ratios within this of the largest are alternatives: e^−2 of its likelihood.
const ALTERNATIVE: f64 = 4.0;

/// Why an arm cannot be tracked.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum TrackError {
    /// Not enough poses yet.
    #[error(
        "{file}: {found} poses so far, {asked} are needed to place the sensor; run it again when there are more \
         (--first-poses asks for fewer)"
    )]
    TooFew {
        /// File.
        file: String,
        /// Poses there are.
        found: usize,
        /// Poses needed.
        asked: usize,
    },
    /// The rows do not place the sensor.
    #[error(transparent)]
    Placing(#[from] ExperimentError),
    /// Another sensor than before.
    #[error(
        "{file}: has {found} readings, and the track so far has {expected}: start a new track with another --state"
    )]
    Sensor {
        /// File.
        file: String,
        /// What it has.
        found: &'static str,
        /// What was tracked.
        expected: String,
    },
    /// The state file cannot be used.
    #[error("{file}: {why}")]
    State {
        /// File.
        file: String,
        /// Why.
        why: String,
    },
}

/// One pose as it is kept in the history.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Seen {
    /// File it came from.
    pub file: String,
    /// Data row in that file, from 0.
    pub row: usize,
    /// Time, where logged (h).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_h: Option<f64>,
    /// Joint angles (rad).
    joints: [f64; 6],
    /// Length, position, or position and rotation vector.
    reading: Vec<f64>,
    condition: Condition,
    anchor: usize,
    per_mm: f64,
    per_rad: f64,
    /// Normalised innovation squared when the pose came.
    pub nis: f64,
}

/// A change that was noticed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Alarm {
    /// File and data row at which the alarm went off.
    pub noticed_file: String,
    /// Data row.
    pub noticed_row: usize,
    /// File of the first changed pose.
    pub since_file: String,
    /// Data row of the first changed pose.
    pub since_row: usize,
    /// Its time, where logged (h).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub since_time_h: Option<f64>,
    /// Name of the parameter that moved.
    pub parameter: String,
    /// Unit.
    pub unit: String,
    /// By how much.
    pub shift: f64,
    /// Standard deviation of that.
    pub sigma: f64,
    /// Likelihood ratio: χ² with one degree of freedom if nothing had moved.
    pub ratio: f64,
    /// Parameters that would explain it nearly as well.
    pub alternatives: Vec<String>,
    /// Sum of the window's NIS, and what it should not exceed.
    pub window_nis: [f64; 2],
}

/// Rows of a file that were taken in.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Consumed {
    /// Name of the file.
    pub file: String,
    /// Rows.
    pub rows: usize,
    /// Hash of these rows: a file that is changed behind its end is noticed.
    pub digest: String,
}

/// A state with a root of its covariance, as it stands in the file: every bit of both, so that a stop changes nothing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Snapshot {
    x: Vec<f64>,
    /// S with SSᵀ the covariance, row by row.
    root: Vec<Vec<f64>>,
    /// Poses of the history that came before.
    before: usize,
}

impl Snapshot {
    fn of(recursion: &Recursion, before: usize) -> Self {
        let rows = |s: &DMatrix<f64>| s.row_iter().map(|r| r.iter().copied().collect()).collect();
        Self {
            x: recursion.x.as_slice().to_vec(),
            root: recursion.root().map(rows).unwrap_or_default(),
            before,
        }
    }

    fn root(&self) -> Option<DMatrix<f64>> {
        let p = self.x.len();
        let whole = self.root.len() == p && self.root.iter().all(|r| r.len() == p);
        let finite = self.root.iter().flatten().chain(&self.x).all(|v| v.is_finite());
        (whole && finite).then(|| DMatrix::from_fn(p, p, |i, j| self.root[i][j]))
    }

    fn covariance(&self) -> Option<DMatrix<f64>> {
        self.root().map(|s| &s * s.transpose())
    }

    fn recursion(&self) -> Option<Recursion> {
        Some(Recursion::from_root(DVector::from_column_slice(&self.x), self.root()?))
    }
}

/// Everything that must outlive a stop.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct State {
    schema: String,
    /// Hash of the model that tracking began with.
    pub model_hash: String,
    /// Sensor.
    pub sensor: String,
    /// Poses taken in.
    pub poses: usize,
    /// Poses set aside as accidents.
    pub accidents: usize,
    /// Settings.
    pub options: Options,
    outlets_mm: Vec<[f64; 3]>,
    zeros_mm: Vec<f64>,
    base_from_sensor: [f64; 6],
    flange_from_target: [f64; 6],
    sigma_mm: f64,
    sigma_rad: f64,
    /// The present state.
    now: Snapshot,
    /// Where the history begins, and where its middle stood.
    reference: Snapshot,
    middle: Snapshot,
    /// Files and rows taken in.
    pub consumed: Vec<Consumed>,
    /// Changes noticed so far.
    pub alarms: Vec<Alarm>,
    /// The latest poses.
    pub history: Vec<Seen>,
}

/// A model that follows its arm.
#[derive(Debug, Clone)]
pub struct Tracker {
    /// The model that tracking began with.
    begun: Estimated,
    parameters: Vec<Parameter>,
    drift: Vec<f64>,
    frames: Frames,
    recursion: Recursion,
    state: State,
    /// Errors of the poses of this run, each with the state after it (mm).
    errors_mm: Vec<f64>,
    joints: Vec<Joints>,
    condition: Condition,
}

/// What one pose said.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Taken {
    /// Normalised innovation squared.
    pub nis: f64,
    /// Whether the pose was set aside as an accident.
    pub set_aside: bool,
}

impl Tracker {
    /// Places the sensor with the first poses of `dataset` and begins; no pose is taken in yet.
    ///
    /// # Errors
    /// [`TrackError`] where the poses are too few or do not place the sensor.
    pub fn begin(
        model: &Estimated,
        model_hash: &str,
        dataset: &Dataset,
        options: &Options,
    ) -> Result<Self, TrackError> {
        if dataset.rows.len() < options.first_poses {
            return Err(TrackError::TooFew {
                file: dataset.file.clone(),
                found: dataset.rows.len(),
                asked: options.first_poses,
            });
        }
        let first = dataset.subset(&(0..options.first_poses).collect::<Vec<_>>());
        let (observed, _) = observe(&first, &model.nominal, false);
        let (_, fitted) = register(&observed, &model.model)?;
        // A reading cannot agree better with the model than held-out readings did when it was identified; a few poses that
        // have just placed the sensor seem to.
        let axes: f64 = if dataset.sensor == Sensor::Cable { 1.0 } else { 3.0 };
        let unexplained_mm = model.geometry.held_out.rmse / axes.sqrt();
        let sigma_mm = options.sigma_mm.unwrap_or(fitted.sigma_mm.max(unexplained_mm));
        let frames = fitted.frames;
        let sensing = frame_parameters(dataset);
        let parameters: Vec<Parameter> = model.order.iter().copied().chain(sensing).collect();
        let (arm, p) = (model.order.len(), parameters.len());
        // The sensor was placed by a few poses under this very model: from there its frame may lie within what links of
        // ordinary tolerance can shift it by, and the poses that placed it are taken in like all others.
        let priors = Tolerance {
            target_mm: 10.0,
            target_rad: 0.02,
            frame_mm: 20.0,
            frame_rad: 0.04,
            ..Tolerance::default()
        }
        .priors(&parameters, &model.model);
        let covariance = DMatrix::from_fn(p, p, |i, j| match (i < arm && j < arm, i == j) {
            (true, _) => model.covariance[(i, j)] + if i == j { SMALLEST_VARIANCE } else { 0.0 },
            (false, true) => priors[i].sigma * priors[i].sigma,
            (false, false) => 0.0,
        });
        let recursion =
            Recursion::new(DVector::zeros(p), covariance, Memory::SquareRoot).ok_or_else(|| {
                TrackError::State {
                    file: model.provenance.file.clone(),
                    why: "the model's covariance is not positive definite".to_owned(),
                }
            })?;
        let snapshot = Snapshot::of(&recursion, 0);
        let state = State {
            schema: SCHEMA.to_owned(),
            model_hash: model_hash.to_owned(),
            sensor: sensor_name(dataset.sensor).to_owned(),
            poses: 0,
            accidents: 0,
            options: options.clone(),
            outlets_mm: frames.outlets_mm.iter().map(|o| (*o).into()).collect(),
            zeros_mm: frames.zeros_mm.clone(),
            base_from_sensor: vector_from_pose(&frames.base_from_sensor),
            flange_from_target: vector_from_pose(&frames.flange_from_target),
            sigma_mm,
            sigma_rad: fitted.sigma_rad,
            now: snapshot.clone(),
            reference: snapshot.clone(),
            middle: snapshot,
            consumed: Vec::new(),
            alarms: Vec::new(),
            history: Vec::new(),
        };
        Self::resume(model, state, "a new track")
    }

    /// Goes on from a state; `file` is named in errors.
    ///
    /// # Errors
    /// [`TrackError::State`] where the state does not belong to the model or is damaged.
    pub fn resume(model: &Estimated, state: State, file: &str) -> Result<Self, TrackError> {
        let wrong = |why: &str| TrackError::State { file: file.to_owned(), why: why.to_owned() };
        if state.schema != SCHEMA {
            return Err(wrong(&format!("`schema` is \"{}\", expected \"{SCHEMA}\"", state.schema)));
        }
        let mut frames = Frames::at_origin(state.outlets_mm.len());
        frames.outlets_mm = state.outlets_mm.iter().map(|o| (*o).into()).collect();
        frames.zeros_mm.clone_from(&state.zeros_mm);
        frames.base_from_sensor = pose_from_vector(&state.base_from_sensor);
        frames.flange_from_target = pose_from_vector(&state.flange_from_target);
        let sensor = match state.sensor.as_str() {
            "cable" => Sensor::Cable,
            "position" => Sensor::Position,
            "pose" => Sensor::Pose,
            other => return Err(wrong(&format!("unknown sensor \"{other}\""))),
        };
        // A row of the last cable makes as many outlets as the track has.
        let mut shape = Row::new(0, Joints::zeros(), Reading::Cable(0.0));
        shape.anchor = state.outlets_mm.len().saturating_sub(1);
        let sensing = frame_parameters(&Dataset::new(file, sensor, vec![shape]));
        let parameters: Vec<Parameter> = model.order.iter().copied().chain(sensing).collect();
        let snapshots = [&state.now, &state.reference, &state.middle];
        if snapshots.iter().any(|s| s.x.len() != parameters.len()) {
            return Err(wrong(
                "the number of parameters is another than the model's: it belongs to another model",
            ));
        }
        let recursion =
            state.now.recursion().ok_or_else(|| wrong("the root of the covariance is damaged"))?;
        let drift = parameters.iter().map(|p| drift_of(p, &state.options)).collect();
        let condition = model.condition;
        Ok(Self {
            begun: model.clone(),
            parameters,
            drift,
            frames,
            recursion,
            state,
            errors_mm: Vec::new(),
            joints: Vec::new(),
            condition,
        })
    }

    /// Takes in the rows of a file that it has not seen yet. Gives the alarms that this raised.
    ///
    /// # Errors
    /// [`TrackError`] where the file has another sensor, or rows that were taken in have changed.
    pub fn take(&mut self, dataset: &Dataset) -> Result<Vec<Alarm>, TrackError> {
        let sensor = sensor_name(dataset.sensor);
        if sensor != self.state.sensor {
            return Err(TrackError::Sensor {
                file: dataset.file.clone(),
                found: sensor,
                expected: self.state.sensor.clone(),
            });
        }
        let done = self.state.consumed.iter().position(|c| c.file == dataset.file);
        let from = done.map_or(0, |at| self.state.consumed[at].rows);
        if let Some(at) = done {
            let known = &self.state.consumed[at];
            if dataset.rows.len() < known.rows || digest(&dataset.rows[..known.rows]) != known.digest {
                return Err(TrackError::State {
                    file: dataset.file.clone(),
                    why: format!(
                        "the {} rows that were taken in have changed: start a new track with another --state",
                        known.rows
                    ),
                });
            }
        }
        if from == dataset.rows.len() {
            return Ok(Vec::new());
        }
        let fresh = dataset.subset(&(from..dataset.rows.len()).collect::<Vec<_>>());
        let (observed, _) = observe(&fresh, &self.begun.nominal, false);
        let seen = self.seen(&observed);
        let task = self.task(&seen);
        let mut alarms = Vec::new();
        for (at, (row, seen)) in observed.dataset.rows.iter().zip(seen).enumerate() {
            self.condition = row.condition;
            self.joints.push(row.joints);
            alarms.extend(self.pose(&task, at, seen));
        }
        let consumed =
            Consumed { file: dataset.file.clone(), rows: dataset.rows.len(), digest: digest(&dataset.rows) };
        match done {
            Some(at) => self.state.consumed[at] = consumed,
            None => self.state.consumed.push(consumed),
        }
        self.state.now = Snapshot::of(&self.recursion, self.state.history.len());
        Ok(alarms)
    }

    /// Observation `at` of `task`, which is `seen`. Gives the alarm, where it raises one.
    fn pose(&mut self, task: &Calibration, at: usize, mut seen: Seen) -> Option<Alarm> {
        let taken = self.update(task, at);
        seen.nis = taken.nis;
        self.state.poses += 1;
        self.state.accidents += usize::from(taken.set_aside);
        let error_mm = self.error_mm(task, at, seen.per_mm);
        self.errors_mm.push(error_mm);
        self.state.history.push(seen);
        if let Some(alarm) = self.alarm() {
            self.state.alarms.push(alarm.clone());
            return Some(alarm);
        }
        let options = &self.state.options;
        let length = self.state.history.len();
        if length == options.history / 2 && self.state.middle.before == 0 {
            self.state.middle = Snapshot::of(&self.recursion, length);
        } else if length >= options.history.max(2) {
            let half = self.state.middle.before;
            self.state.history.drain(..half);
            self.state.reference = Snapshot { before: 0, ..self.state.middle.clone() };
            self.state.middle = Snapshot::of(&self.recursion, self.state.history.len());
        }
        None
    }

    /// Takes in observation `pose` of `task`: process noise, linearisation, one update for each row. This is the whole
    /// cost of a pose but for the alarm.
    pub fn update(&mut self, task: &Calibration, pose: usize) -> Taken {
        let (p, per) = (self.parameters.len(), task.rows_per_observation());
        self.recursion.predict(&self.drift);
        let mut trial = self.recursion.clone();
        let (mut r, mut j) = (vec![0.0; per], vec![0.0; per * p]);
        let at = trial.x.clone();
        task.jacobian(at.as_slice(), pose * per..(pose + 1) * per, &mut r, &mut j);
        let mut a = DVector::zeros(p);
        let mut nis = 0.0;
        for i in 0..per {
            (0..p).for_each(|k| a[k] = j[k * per + i]);
            let e = r[i] + a.dot(&trial.x) - a.dot(&at);
            let variance = trial.update(&a, e, 1.0);
            nis += e * e / variance;
        }
        let finite = nis.is_finite() && trial.x.iter().all(|x| x.is_finite());
        // Written so that not-a-number is set aside too.
        let set_aside = !(finite && nis <= chi_square_cut(per));
        if !set_aside {
            self.recursion = trial;
        }
        Taken { nis, set_aside }
    }

    fn task(&self, poses: &[Seen]) -> Calibration {
        let rows = poses.iter().map(|seen| seen.row_of(&self.state.sensor)).collect();
        let sensor = match self.state.sensor.as_str() {
            "cable" => Sensor::Cable,
            "position" => Sensor::Position,
            _ => Sensor::Pose,
        };
        let dataset = Dataset::new("track", sensor, rows);
        let weights: Vec<_> = poses
            .iter()
            .map(|s| crate::identification::calibration::Weight { per_mm: s.per_mm, per_rad: s.per_rad })
            .collect();
        Calibration::new(&dataset, &self.begun.model, &self.frames, &self.parameters, &[], &weights)
    }

    fn seen(&self, observed: &Observed) -> Vec<Seen> {
        let weights = rounding::weights(
            &observed.dataset,
            &self.begun.model,
            &self.frames,
            &observed.angles,
            self.state.sigma_mm,
            self.state.sigma_rad,
        );
        let one = |(row, weight): (&Row, &crate::identification::calibration::Weight)| Seen {
            file: observed.dataset.file.clone(),
            row: row.number,
            time_h: row.condition.time_h,
            joints: row.joints.into(),
            reading: match &row.reading {
                Reading::Cable(length) => vec![*length],
                Reading::Position(p) => p.as_slice().to_vec(),
                Reading::Pose(pose) => vector_from_pose(pose).to_vec(),
            },
            condition: row.condition,
            anchor: row.anchor,
            per_mm: weight.per_mm,
            per_rad: weight.per_rad,
            nis: 0.0,
        };
        observed.dataset.rows.iter().zip(&weights).map(one).collect()
    }

    /// Error of a pose with the state after it (mm): signed for a cable, the norm otherwise.
    fn error_mm(&self, task: &Calibration, at: usize, per_mm: f64) -> f64 {
        let per = task.rows_per_observation();
        let mut r = vec![0.0; per];
        task.residuals(self.recursion.x.as_slice(), at * per..(at + 1) * per, &mut r);
        match r.as_slice() {
            [length] => length / per_mm,
            rows => rows.iter().take(3).map(|v| v * v).sum::<f64>().sqrt() / per_mm,
        }
    }

    fn rows_per_pose(&self) -> usize {
        match self.state.sensor.as_str() {
            "cable" => 1,
            "position" => 3,
            _ => 6,
        }
    }

    /// Looks at the window, and where it is out of bounds finds out what moved.
    fn alarm(&mut self) -> Option<Alarm> {
        let window = self.state.options.window.max(1);
        let history = &self.state.history;
        // The window never reaches back behind the first poses, which place the sensor.
        if history.len() < window || self.state.poses < self.state.options.first_poses + window {
            return None;
        }
        let per = self.rows_per_pose();
        let bound = window_bound(window * per);
        // One accident alone must not raise the alarm, three do.
        let counted = |s: &Seen| if s.nis.is_finite() { s.nis.min(bound / 3.0) } else { bound / 3.0 };
        let sum: f64 = history[history.len() - window..].iter().map(counted).sum();
        if sum <= bound {
            return None;
        }
        let found = self.locate()?;
        let last = self.state.history.last()?;
        let onset = &self.state.history[found.since];
        let name = |k: usize| self.parameters[k].to_string();
        let alarm = Alarm {
            noticed_file: last.file.clone(),
            noticed_row: last.row,
            since_file: onset.file.clone(),
            since_row: onset.row,
            since_time_h: onset.time_h,
            parameter: name(found.parameter),
            unit: self.parameters[found.parameter].unit().to_owned(),
            shift: found.shift,
            sigma: found.sigma,
            ratio: found.ratio,
            alternatives: found.alternatives.iter().map(|k| name(*k)).collect(),
            window_nis: [sum, bound],
        };
        self.reopen(&found);
        Some(alarm)
    }

    /// The step of one parameter at one pose that explains the history best.
    fn locate(&self) -> Option<Found> {
        let poses = &self.state.history;
        let (n, p, per) = (poses.len(), self.parameters.len(), self.rows_per_pose());
        let reference = &self.state.reference;
        let task = self.task(poses);
        let (mut r, mut j) = (vec![0.0; n * per], vec![0.0; n * per * p]);
        task.jacobian(&reference.x, 0..n * per, &mut r, &mut j);
        let j = DMatrix::from_vec(n * per, p, j);
        let mut information = vec![DMatrix::<f64>::zeros(p, p); n + 1];
        let mut gradient = vec![DVector::<f64>::zeros(p); n + 1];
        for s in (0..n).rev() {
            let rows = j.rows(s * per, per);
            let residual = DVector::from_column_slice(&r[s * per..(s + 1) * per]);
            information[s] = &information[s + 1] + rows.tr_mul(&rows);
            gradient[s] = &gradient[s + 1] + rows.tr_mul(&residual);
        }
        let prior = reference.covariance()?.cholesky()?.inverse();
        let m = (prior + &information[0]).cholesky()?.inverse();
        let mg = &m * &gradient[0];
        // For each parameter its best onset.
        let mut best: Vec<Option<Found>> = vec![None; p];
        for s in 0..n {
            let a = &information[s];
            let ma = &m * a;
            for k in 0..p {
                let column = a.column(k);
                let left = gradient[s][k] - column.dot(&mg);
                let seen = a[(k, k)] - column.dot(&ma.column(k));
                // A step that the history hardly sees says nothing.
                if !(seen > 1e-9 * a[(k, k)]) {
                    continue;
                }
                let ratio = left * left / seen;
                if best[k].as_ref().is_none_or(|b| ratio > b.ratio) {
                    best[k] = Some(Found {
                        parameter: k,
                        since: s,
                        shift: -left / seen,
                        sigma: 1.0 / seen.sqrt(),
                        ratio,
                        alternatives: Vec::new(),
                    });
                }
            }
        }
        let mut all: Vec<Found> = best.into_iter().flatten().collect();
        all.sort_by(|a, b| b.ratio.total_cmp(&a.ratio).then(a.parameter.cmp(&b.parameter)));
        let mut first = all.first().cloned()?;
        first.alternatives = all[1..]
            .iter()
            .take_while(|f| f.ratio > first.ratio - ALTERNATIVE)
            .map(|f| f.parameter)
            .collect();
        Some(first)
    }

    /// Takes the history in again, with room for what moved.
    fn reopen(&mut self, found: &Found) {
        let Some(recursion) = self.state.reference.recursion() else { return };
        self.recursion = recursion;
        let poses = std::mem::take(&mut self.state.history);
        let task = self.task(&poses);
        for at in 0..poses.len() {
            if at == found.since {
                let mut room = vec![0.0; self.parameters.len()];
                // What looks alike may have moved alike.
                for k in std::iter::once(found.parameter).chain(found.alternatives.iter().copied()) {
                    room[k] = 3.0 * found.shift.abs();
                }
                self.recursion.predict(&room);
            }
            self.update(&task, at);
        }
        // What came before the change is settled.
        let snapshot = Snapshot::of(&self.recursion, 0);
        (self.state.reference, self.state.middle) = (snapshot.clone(), snapshot);
    }

    /// The model as it stands now.
    pub fn model(&self) -> Estimated {
        let x = self.recursion.x.as_slice();
        let task = Calibration::new(
            &Dataset::new("track", Sensor::Position, Vec::new()),
            &self.begun.model,
            &self.frames,
            &self.parameters,
            &[],
            &[],
        );
        let (model, _) = task.apply(x);
        let arm = self.begun.order.len();
        let whole = self.recursion.covariance();
        let covariance = whole.view((0, 0), (arm, arm)).into_owned();
        let mut out = self.begun.clone();
        for (k, parameter) in self.begun.order.iter().enumerate() {
            let name = parameter.to_string();
            if let Some(row) = out.parameters.iter_mut().find(|p| p.name == name) {
                update_row(row, x[k], covariance[(k, k)].max(0.0).sqrt());
            }
        }
        out.model = model;
        out.covariance = covariance;
        out.provenance.method = "track".to_owned();
        out.provenance.rows = self.begun.provenance.rows + self.state.poses;
        if let Some(last) = self.state.consumed.last() {
            out.provenance.file.clone_from(&last.file);
            out.provenance.sha256.clone_from(&last.digest);
        }
        if !self.errors_mm.is_empty() {
            out.geometry.fitted = ErrorSummary::of(self.errors_mm.iter().copied());
        }
        out.condition = self.condition;
        out.region = self.region();
        out.verdict = Verdict {
            status: if self.begun.verdict.status == Judgement::Fail {
                Judgement::Fail
            } else {
                Judgement::NotEvaluated
            },
            reasons: self.reasons(),
        };
        out
    }

    fn reasons(&self) -> Vec<String> {
        let mut reasons = vec![format!(
            "tracked over {} poses since {}, {} set aside as accidents; held-out errors are those of the first \
             identification",
            self.state.poses, self.begun.provenance.file, self.state.accidents
        )];
        reasons.extend(self.state.alarms.iter().map(ToString::to_string));
        reasons
    }

    /// Where the arm was measured, the poses of this run included.
    fn region(&self) -> Region {
        let before = &self.begun.region;
        let known = before.samples_deg.iter().map(|q| Joints::from_fn(|i, _| q[i].to_radians()));
        let all: Vec<Joints> = known.chain(self.joints.iter().copied()).collect();
        if self.joints.is_empty() || all.is_empty() {
            return before.clone();
        }
        let mut region = Region::of(&all, before.sigma_mm);
        for i in 0..6 {
            region.min_deg[i] = region.min_deg[i].min(before.min_deg[i]);
            region.max_deg[i] = region.max_deg[i].max(before.max_deg[i]);
        }
        region
    }

    /// What must be saved.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// What moves, in the order of the state.
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// Deviations of the parameters from the model that tracking began with.
    pub fn deviations(&self) -> &[f64] {
        self.recursion.x.as_slice()
    }

    /// Standard deviations of these.
    pub fn sigmas(&self) -> Vec<f64> {
        self.recursion.covariance().diagonal().iter().map(|v| v.max(0.0).sqrt()).collect()
    }

    /// A task of rows for [`Tracker::update`], with the weights that tracking gives them.
    pub fn prepare(&self, dataset: &Dataset) -> Calibration {
        let (observed, _) = observe(dataset, &self.begun.nominal, false);
        self.task(&self.seen(&observed))
    }
}

/// What moved, in indices.
#[derive(Debug, Clone)]
struct Found {
    parameter: usize,
    since: usize,
    shift: f64,
    sigma: f64,
    ratio: f64,
    alternatives: Vec<usize>,
}

/// A covariance of an identification may be singular to rounding; this is nothing beside any tolerance (mm², rad²).
const SMALLEST_VARIANCE: f64 = 1e-14;

/// The NIS beyond which a pose of so many rows is an accident: the quantile, worked out once.
fn chi_square_cut(rows: usize) -> f64 {
    use std::sync::OnceLock;
    static CUTS: OnceLock<[f64; 7]> = OnceLock::new();
    let cuts = CUTS
        .get_or_init(|| std::array::from_fn(|m| if m == 0 { 0.0 } else { chi_square_quantile(ACCIDENT, m) }));
    cuts[rows.min(6)]
}

/// The bound of a window with so many rows, by Wilson and Hilferty's cube (1931): good to a per cent out here, and
/// cheap enough for every pose.
fn window_bound(rows: usize) -> f64 {
    let (n, z) = (rows as f64, ALARM_DEVIATIONS);
    let spread = 2.0 / (9.0 * n);
    n * (1.0 - spread + z * spread.sqrt()).powi(3)
}

fn drift_of(parameter: &Parameter, options: &Options) -> f64 {
    if let Some(own) = options.drift.get(&parameter.to_string()) {
        return *own;
    }
    match (parameter.is_of_arm(), parameter.unit()) {
        (true, "mm") => options.drift_length_mm,
        (true, "rad") => options.drift_angle_rad,
        // Parameters of effects have units of their own: they stay unless a drift is stated for them.
        (true, _) => 0.0,
        (false, "mm") => options.drift_frame_mm,
        (false, _) => options.drift_frame_rad,
    }
}

fn update_row(row: &mut EstimatedParameter, deviation: f64, sigma: f64) {
    row.value += deviation;
    row.sigma = sigma;
    if let Some(prior) = row.prior_sigma {
        row.determined = (1.0 - (sigma / prior).powi(2)).clamp(0.0, 1.0);
    }
}

/// A short hash of rows, by their bits.
fn digest(rows: &[Row]) -> String {
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
    hash.finalize().iter().map(|b| format!("{b:02x}")).collect()
}

impl Seen {
    fn row_of(&self, sensor: &str) -> Row {
        let reading = match (sensor, self.reading.as_slice()) {
            ("cable", [length, ..]) => Reading::Cable(*length),
            ("position", [x, y, z, ..]) => Reading::Position(nalgebra::Vector3::new(*x, *y, *z)),
            (_, [x, y, z, a, b, c, ..]) => Reading::Pose(pose_from_vector(&[*x, *y, *z, *a, *b, *c])),
            _ => Reading::Cable(f64::NAN),
        };
        let mut row = Row::new(self.row, Joints::from(self.joints), reading);
        row.condition = self.condition;
        row.anchor = self.anchor;
        row
    }
}

impl State {
    /// The file.
    ///
    /// # Errors
    /// A sentence, when a number cannot be written.
    pub fn to_toml(&self) -> Result<String, String> {
        let text = toml::to_string(self).map_err(|e| format!("the state cannot be written: {e}"))?;
        Ok(format!("# The state of a track, written by truegrind {}.\n{text}", env!("CARGO_PKG_VERSION")))
    }

    /// Reads the file.
    ///
    /// # Errors
    /// A sentence that says what cannot be used.
    pub fn from_toml(text: &str) -> Result<Self, String> {
        toml::from_str(text)
            .map_err(|e| format!("not a track of truegrind: {}", e.message().replace('\n', " ")))
    }
}

impl std::fmt::Display for Alarm {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (scale, unit) = match self.unit.as_str() {
            "rad" => (1f64.to_degrees(), "°"),
            "" => (1.0, ""),
            other => (1.0, other),
        };
        write!(
            f,
            "{} moved by {:.4} ± {:.4} {unit} since row {} of {}",
            self.parameter,
            self.shift * scale,
            self.sigma * scale,
            self.since_row,
            self.since_file
        )?;
        if let Some(hours) = self.since_time_h {
            write!(f, " (t = {hours:.3} h)")?;
        }
        write!(f, ", noticed at row {} of {}", self.noticed_row, self.noticed_file)?;
        if !self.alternatives.is_empty() {
            write!(f, "; {} would explain it nearly as well", self.alternatives.join(", "))?;
        }
        Ok(())
    }
}
