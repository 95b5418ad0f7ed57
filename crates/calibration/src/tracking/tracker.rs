//! The filter that follows an arm, pose by pose.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::alarm::{Alarm, Course};
use super::bounds::outlier_bound;
use super::error::TrackError;
use super::first_noise::FirstPoses;
use super::gauge::Gauge;
use super::options::Options;
use super::scale::{AS_CALIBRATED, SCALE, SCALE_NAME, scale};
use super::state::{ConsumedFile, PoseRecord, SCHEMA, Snapshot, State, digest, extend_region};
use super::station::{end_of_station, moved, number_of, station_of};
use crate::identification::calibration::{CalibrationProblem, Frames, Weight};
use crate::identification::fit::{Observations, frame_parameters};
use crate::identification::identify::prepare_observations;
use crate::identification::rounding;
use crate::identification::tolerance::Tolerance;
use crate::measurement::dataset::{Dataset, Reading, Row, Sensor};
use truegrind_arm::condition::Condition;
use truegrind_arm::estimated::Estimated;
use truegrind_arm::model::Joints;
use truegrind_arm::parameter::Parameter;
use truegrind_estimation::filter::rls::{Memory, RecursiveLeastSquares};
use truegrind_estimation::problem::{Prior, Problem};
use truegrind_math::se3::{pose_from_vector, vector_from_pose};

/// At least `poses` first rows of files that are tracked together: the first file, and further ones as needed. `None` without
/// a file.
pub fn first_poses(datasets: &[Dataset], poses: usize) -> Option<Dataset> {
    let mut out = datasets.first()?.clone();
    let mut files = 1;
    for dataset in datasets[1..].iter().take_while(|d| d.sensor == out.sensor) {
        if out.rows.len() >= poses {
            break;
        }
        // Each file numbers its stations anew.
        let mut names = std::mem::take(&mut out.station_names);
        let rows = (0..dataset.rows.len()).map(|row| {
            let anchor = match station_of(dataset, row) {
                Some(name) => number_of(name, &mut names),
                None => dataset.rows[row].anchor,
            };
            Row { anchor, ..dataset.rows[row].clone() }
        });
        out.rows.extend(rows.collect::<Vec<_>>());
        out.station_names = names;
        files += 1;
    }
    if files > 1 {
        out.file = format!("{} and {} more", out.file, files - 1);
    }
    Some(out)
}

/// Covariance at the start of a track: the model's for the arm, a wide prior for the sensor.
fn first_covariance(model: &Estimated, parameters: &[Parameter]) -> DMatrix<f64> {
    let (arm, p) = (model.order.len(), parameters.len());
    let priors = frame_priors(model, parameters);
    DMatrix::from_fn(p, p, |i, j| match (i < arm && j < arm, i == j) {
        (true, _) => model.covariance[(i, j)] + if i == j { MIN_VARIANCE } else { 0.0 },
        (false, true) => priors[i].sigma * priors[i].sigma,
        (false, false) => 0.0,
    })
}

/// Priors of the parameters of the measurement.
///
/// The sensor was registered with a few poses under this model, so its frame is off by no more than links of ordinary tolerance can shift it.
/// The poses used for registration are filtered like all others.
pub(super) fn frame_priors(model: &Estimated, parameters: &[Parameter]) -> Vec<Prior> {
    let tolerance = Tolerance {
        target_mm: 10.0,
        target_rad: 0.02,
        frame_mm: 20.0,
        frame_rad: 0.04,
        ..Tolerance::default()
    };
    let prior = |parameter: &Parameter| match *parameter {
        SCALE => Prior { mean: 0.0, sigma: AS_CALIBRATED },
        _ => tolerance.prior(parameter, &model.model),
    };
    parameters.iter().map(prior).collect()
}

/// Recursive estimator of one arm's parameters.
#[derive(Debug, Clone)]
pub struct Tracker {
    /// The model that tracking began with.
    pub(super) initial: Estimated,
    pub(super) parameters: Vec<Parameter>,
    pub(super) drift: Vec<f64>,
    pub(super) frames: Frames,
    pub(super) filter: RecursiveLeastSquares,
    pub(super) gauge: Gauge,
    pub(super) state: State,
    pub(super) condition: Condition,
}

/// Result of one filter update.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseUpdate {
    /// Normalised innovation squared.
    pub nis: f64,
    /// Whether the pose was rejected as an outlier.
    pub set_aside: bool,
}

/// The rows that register the sensor: the first ones, or as many of them as were read from the first place. Fewer than `poses` must be all that
/// can come from there.
fn rows_to_register(dataset: &Dataset, poses: usize) -> Option<Dataset> {
    let end = if dataset.rows.is_empty() { 0 } else { end_of_station(dataset, 0) };
    let is_over = end < dataset.rows.len() && end >= FEWEST_FIRST;
    let count = if end < poses && !is_over { return None } else { end.min(poses) };
    let mut first = dataset.subset(&(0..count).collect::<Vec<_>>());
    first
        .rows
        .iter_mut()
        .for_each(|row| row.anchor = if dataset.sensor == Sensor::Cable { row.anchor } else { 0 });
    Some(first)
}

/// Fewest poses that register the sensor where it was set up elsewhere after them.
const FEWEST_FIRST: usize = 8;

impl Tracker {
    /// Registers the sensor with the first poses of `dataset`; no pose is filtered yet.
    ///
    /// # Errors
    /// [`TrackError`] where the poses are too few or do not determine the sensor's frame.
    pub fn begin(
        model: &Estimated,
        model_hash: &str,
        dataset: &Dataset,
        options: &Options,
    ) -> Result<Self, TrackError> {
        let first = rows_to_register(dataset, options.first_poses).ok_or_else(|| TrackError::TooFew {
            file: dataset.file.clone(),
            found: dataset.rows.len(),
            asked: options.first_poses,
        })?;
        let first = first.at_unless_logged(&model.condition);
        let (observed, _) = prepare_observations(&first, &model.nominal, false);
        let FirstPoses { frames, sigma_mm, sigma_rad } = FirstPoses::of(model, &observed, options)?;
        let sensing = frame_parameters(&observed.dataset);
        let parameters: Vec<Parameter> = model.order.iter().copied().chain([SCALE]).chain(sensing).collect();
        let covariance = first_covariance(model, &parameters);
        let filter =
            RecursiveLeastSquares::new(DVector::zeros(parameters.len()), covariance, Memory::SquareRoot)
                .ok_or_else(|| TrackError::State {
                    file: model.provenance.file.clone(),
                    reason: "the model's covariance is not positive definite".to_owned(),
                })?;
        let snapshot = Snapshot::of(&filter, 0);
        let state = State {
            schema: SCHEMA.to_owned(),
            model_hash: model_hash.to_owned(),
            sensor: dataset.sensor,
            poses: 0,
            outliers: 0,
            options: options.clone(),
            outlets_mm: frames.outlets_mm.iter().map(|o| (*o).into()).collect(),
            zeros_mm: frames.zeros_mm.clone(),
            base_from_sensor: vector_from_pose(&frames.base_from_sensor),
            flange_from_target: vector_from_pose(&frames.flange_from_target),
            sigma_mm,
            sigma_rad,
            now: snapshot.clone(),
            reference: snapshot.clone(),
            middle: snapshot,
            start: None,
            placed: None,
            placed_at: options.first_poses + options.window.max(1),
            start_scatter: None,
            replaced_sigma_mm: None,
            station: station_of(dataset, 0),
            track_from_station: None,
            region: model.region.clone(),
            quiet_until: 0,
            pending_since: 0,
            burst_since: 0,
            consumed: Vec::new(),
            alarms: Vec::new(),
            history: Vec::new(),
        };
        Self::resume(model, state, "a new track")
    }

    /// Resumes from a saved state; `file` is named in errors.
    ///
    /// # Errors
    /// [`TrackError::State`] where the state does not belong to the model or is damaged.
    pub fn resume(model: &Estimated, state: State, file: &str) -> Result<Self, TrackError> {
        let wrong = |reason: &str| TrackError::State { file: file.to_owned(), reason: reason.to_owned() };
        if state.schema != SCHEMA {
            return Err(wrong(&format!("`schema` is \"{}\", expected \"{SCHEMA}\"", state.schema)));
        }
        let mut frames = Frames::at_origin(state.outlets_mm.len());
        frames.outlets_mm = state.outlets_mm.iter().map(|o| (*o).into()).collect();
        frames.zeros_mm.clone_from(&state.zeros_mm);
        frames.base_from_sensor = pose_from_vector(&state.base_from_sensor);
        frames.flange_from_target = pose_from_vector(&state.flange_from_target);
        // One row of the last cable defines the number of outlets.
        let mut shape = Row::new(0, Joints::zeros(), Reading::Cable(0.0));
        shape.anchor = state.outlets_mm.len().saturating_sub(1);
        let sensing = frame_parameters(&Dataset::new(file, state.sensor, vec![shape]));
        // A track of an earlier version has no scale.
        let has_scale = state.now.x.len() > model.order.len() + sensing.len();
        let own_scale = has_scale.then_some(SCALE);
        frames.disturbances.extend(own_scale.map(|_| scale()));
        let parameters: Vec<Parameter> =
            model.order.iter().copied().chain(own_scale).chain(sensing).collect();
        let snapshots = [Some(&state.now), Some(&state.reference), Some(&state.middle), state.start.as_ref()];
        if snapshots.iter().flatten().any(|s| s.x.len() != parameters.len()) {
            return Err(wrong(
                "the number of parameters differs from the model's: it belongs to another model",
            ));
        }
        let filter = state.now.filter().ok_or_else(|| wrong("the root of the covariance is damaged"))?;
        let drift = parameters.iter().map(|p| process_noise(p, &state.options)).collect();
        let condition = model.condition;
        let gauge = Gauge::of(state.sensor, &model.model, &frames, &parameters);
        Ok(Self { initial: model.clone(), parameters, drift, frames, filter, gauge, state, condition })
    }

    /// Filters the new rows of a file and returns the alarms raised.
    ///
    /// # Errors
    /// [`TrackError`] where the file has another sensor, or rows already processed have changed.
    pub fn process_file(&mut self, dataset: &Dataset) -> Result<Vec<Alarm>, TrackError> {
        if dataset.sensor != self.state.sensor {
            return Err(TrackError::Sensor {
                file: dataset.file.clone(),
                found: dataset.sensor.name(),
                expected: self.state.sensor.name(),
            });
        }
        let done = self.state.consumed.iter().position(|c| c.file == dataset.file);
        let from = done.map_or(0, |at| self.state.consumed[at].rows);
        if let Some(at) = done {
            let known = &self.state.consumed[at];
            if dataset.rows.len() < known.rows || digest(dataset.rows.iter().take(known.rows)) != known.digest
            {
                return Err(TrackError::State {
                    file: dataset.file.clone(),
                    reason: format!(
                        "the {} rows that were already processed have changed: start a new track with another --state",
                        known.rows
                    ),
                });
            }
        }
        if from == dataset.rows.len() {
            return Ok(Vec::new());
        }
        let mut alarms = Vec::new();
        let mut next = from;
        while next < dataset.rows.len() {
            let end = end_of_station(dataset, next);
            let station = station_of(dataset, next);
            let begins = station.is_some() && station != self.state.station;
            // Rows that do not place another set-up yet wait for more of them.
            if begins && !self.begin_station(dataset, (next, end), end < dataset.rows.len())? {
                break;
            }
            alarms.extend(self.process_rows(dataset, next..end, begins));
            next = end;
        }
        if next == from {
            return Ok(alarms);
        }
        let consumed = ConsumedFile {
            file: dataset.file.clone(),
            rows: next,
            digest: digest(dataset.rows.iter().take(next)),
        };
        match done {
            Some(at) => self.state.consumed[at] = consumed,
            None => self.state.consumed.push(consumed),
        }
        self.state.now = Snapshot::of(&self.filter, self.state.history.len());
        Ok(alarms)
    }

    /// Filters rows that were read from one place, which `begins` with them or not.
    fn process_rows(&mut self, dataset: &Dataset, rows: Range<usize>, begins: bool) -> Vec<Alarm> {
        let mut fresh = dataset.subset(&rows.collect::<Vec<_>>()).at_unless_logged(&self.initial.condition);
        let track_from_station = self.track_from_station();
        fresh.rows.iter_mut().for_each(|row| *row = moved(row, &track_from_station));
        let (observed, _) = prepare_observations(&fresh, &self.initial.nominal, false);
        let mut record = self.pose_records(&observed);
        let mut problem = self.problem(&record);
        let mut alarms = Vec::new();
        for (at, row) in observed.dataset.rows.iter().enumerate() {
            self.condition = *row.condition;
            let sigma_mm = self.state.sigma_mm;
            let begins_station = begins && at == 0;
            if begins_station {
                self.release_sensor();
                // A turn about axis 1 shows against one place of the sensor alone.
                self.state.placed = None;
                self.state.placed_at = self.state.poses + self.state.options.window.max(1);
            }
            let own = PoseRecord { begins_station, ..record[at].clone() };
            let alarm = self.process_pose(&problem, at, own);
            let is_mounted = alarm.as_ref().is_some_and(|alarm| alarm.course == Course::Mounted);
            if is_mounted || self.state.sigma_mm != sigma_mm {
                // The frames have changed, and with them the weights of rounded angles; or the noise.
                record = self.pose_records(&observed);
                problem = self.problem(&record);
            }
            alarms.extend(alarm);
        }
        alarms
    }

    /// Observation `at` of `problem`, which is `record`. Gives the alarm, where it raises one.
    pub(super) fn process_pose(
        &mut self,
        problem: &CalibrationProblem,
        at: usize,
        mut record: PoseRecord,
    ) -> Option<Alarm> {
        record.predicted_mm =
            Some(self.error_mm(problem, at, record.per_mm).abs()).filter(|mm| mm.is_finite());
        let registered = self.registered(self.state.poses);
        let taken = self.update_about(problem, at, registered.as_ref());
        record.nis = taken.nis;
        self.state.poses += 1;
        self.state.outliers += usize::from(taken.set_aside);
        record.error_mm = self.error_mm(problem, at, record.per_mm);
        if !taken.set_aside {
            extend_region(&mut self.state.region, &record.joints);
        }
        self.state.history.push(record);
        // The last pose before any alarm.
        if self.state.poses == self.state.options.first_poses + self.state.options.window.max(1) {
            self.judge_noise();
            self.state.start_scatter = self.late_scatter();
            self.state.start = Some(Snapshot::of(&self.filter, self.state.history.len()));
        }
        if self.state.poses == self.state.placed_at {
            self.state.placed = Some(Snapshot::of(&self.filter, 0));
        }
        if let Some(alarm) = self.alarm() {
            if self.is_of_sensor(&alarm) {
                self.state.placed = None;
                self.state.placed_at = self.state.poses + self.state.options.window.max(1);
            }
            self.state.alarms.push(alarm.clone());
            return Some(alarm);
        }
        let options = &self.state.options;
        let length = self.state.history.len();
        if length == options.history / 2 && self.state.middle.before == 0 {
            self.state.middle = Snapshot::of(&self.filter, length);
        } else if length >= options.history.max(2) {
            let half = self.state.middle.before;
            self.state.history.drain(..half);
            self.state.reference = Snapshot { before: 0, ..self.state.middle.clone() };
            self.state.middle = Snapshot::of(&self.filter, self.state.history.len());
        }
        None
    }

    /// Filters observation `pose` of `problem`: process noise, linearisation, one update per row. This is the whole cost of a
    /// pose apart from an alarm.
    pub fn update(&mut self, problem: &CalibrationProblem, pose: usize) -> PoseUpdate {
        self.update_about(problem, pose, None)
    }

    /// The same, linearised at a state that is known better than the filter's own as yet.
    pub(super) fn update_about(
        &mut self,
        problem: &CalibrationProblem,
        pose: usize,
        known: Option<&DVector<f64>>,
    ) -> PoseUpdate {
        let (p, per) = (self.parameters.len(), problem.rows_per_observation());
        self.filter.predict(&self.drift);
        let mut trial = self.filter.clone();
        let (mut r, mut j) = (vec![0.0; per], vec![0.0; per * p]);
        let at = known.unwrap_or(&trial.x).clone();
        problem.jacobian(at.as_slice(), pose * per..(pose + 1) * per, &mut r, &mut j);
        let mut a = DVector::zeros(p);
        let mut nis = 0.0;
        for i in 0..per {
            (0..p).for_each(|k| a[k] = j[k * per + i]);
            self.gauge.project(&mut a);
            let e = r[i] + a.dot(&trial.x) - a.dot(&at);
            let variance = trial.update(&a, e, 1.0);
            nis += e * e / variance;
        }
        let finite = nis.is_finite() && trial.x.iter().all(|x| x.is_finite());
        // NaN is rejected too.
        let set_aside = !(finite && nis <= outlier_bound(per));
        if !set_aside {
            self.filter = trial;
        }
        PoseUpdate { nis, set_aside }
    }

    /// Where pose `number` of the track is linearised, if it is one of those that registered the sensor: where they put it together. Each by
    /// itself leaves outlet, zero and target open by centimetres; a filter that follows them there is linearised elsewhere at every
    /// pose, and counts as known what no reading tells.
    pub(super) fn registered(&self, number: usize) -> Option<DVector<f64>> {
        (number < self.state.options.first_poses).then(|| DVector::zeros(self.parameters.len()))
    }

    pub(super) fn problem(&self, poses: &[PoseRecord]) -> CalibrationProblem {
        let rows: Vec<Row> = poses.iter().map(|record| record.row_of(self.state.sensor)).collect();
        let dataset = Dataset::new("track", self.state.sensor, rows);
        let weights: Vec<_> = poses.iter().map(|s| Weight { per_mm: s.per_mm, per_rad: s.per_rad }).collect();
        CalibrationProblem::new(&dataset, &self.initial.model, &self.frames, &self.parameters, &[], &weights)
    }

    pub(super) fn pose_records(&self, observed: &Observations) -> Vec<PoseRecord> {
        let weights = rounding::weights(
            &observed.dataset,
            &self.initial.model,
            &self.frames,
            &observed.angles,
            self.state.sigma_mm,
            self.state.sigma_rad,
        );
        let one = |(row, weight): (&Row, &Weight)| PoseRecord {
            file: observed.dataset.file.clone(),
            row: row.number,
            time_h: row.condition.time_h,
            joints: row.joints.into(),
            reading: match &row.reading {
                Reading::Cable(length) => vec![*length],
                Reading::Position(p) => p.as_slice().to_vec(),
                Reading::Pose(pose) => vector_from_pose(pose).to_vec(),
            },
            condition: *row.condition,
            anchor: row.anchor,
            per_mm: weight.per_mm,
            per_rad: weight.per_rad,
            nis: 0.0,
            error_mm: 0.0,
            predicted_mm: None,
            begins_station: false,
        };
        observed.dataset.rows.iter().zip(&weights).map(one).collect()
    }

    /// Residual of a pose at the updated state (mm): signed for a cable, the norm otherwise.
    pub(super) fn error_mm(&self, problem: &CalibrationProblem, at: usize, per_mm: f64) -> f64 {
        let per = problem.rows_per_observation();
        let mut r = vec![0.0; per];
        problem.residuals(self.filter.x.as_slice(), at * per..(at + 1) * per, &mut r);
        match r.as_slice() {
            [length] => length / per_mm,
            rows => rows.iter().take(3).map(|v| v * v).sum::<f64>().sqrt() / per_mm,
        }
    }

    /// The file with the same rows that was processed before, under another name.
    pub fn copy_of(&self, dataset: &Dataset) -> Option<&str> {
        let own = self.state.consumed.iter().any(|consumed| consumed.file == dataset.file);
        let rows = digest(dataset.rows.iter());
        let same = |consumed: &&ConsumedFile| consumed.rows == dataset.rows.len() && consumed.digest == rows;
        self.state.consumed.iter().find(same).filter(|_| !own).map(|consumed| consumed.file.as_str())
    }

    /// Name of the robot.
    pub fn robot(&self) -> &str {
        &self.initial.robot
    }

    /// Whether the track is unreliable: more than one pose in ten was rejected.
    pub fn mostly_set_aside(&self) -> bool {
        self.state.outliers > FEW_OUTLIERS && 10 * self.state.outliers > self.state.poses
    }

    /// How many of so many latest poses fit neither the arm nor a detected change, where that is more than a third of them: the arm, the sensor
    /// or the target is another one now, whatever the earlier poses said.
    pub fn latest_set_aside(&self) -> Option<[usize; 2]> {
        let bound = outlier_bound(self.state.sensor.scalars());
        let latest = self.state.history.iter().rev().take(2 * self.state.options.window.max(1));
        let (all, aside) = latest
            .fold((0, 0), |(all, aside), record| (all + 1, aside + usize::from(!(record.nis <= bound))));
        (aside > FEW_OUTLIERS && 3 * aside > all).then_some([aside, all])
    }

    /// The state to save.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// The tracked parameters, in the order of the state vector.
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// Name of a tracked parameter.
    pub fn name(&self, k: usize) -> String {
        match self.parameters[k] {
            SCALE => SCALE_NAME.to_owned(),
            parameter => parameter.to_string(),
        }
    }

    /// The first parameter that places sensor or target: before it are those of the arm, and the scale.
    pub(super) fn first_of_frames(&self) -> usize {
        let places = |parameter: &Parameter| !parameter.is_of_arm() && *parameter != SCALE;
        self.parameters.iter().position(places).unwrap_or(self.parameters.len())
    }

    /// Deviations of the parameters from the model that tracking began with.
    pub fn deviations(&self) -> &[f64] {
        self.filter.x.as_slice()
    }

    /// Standard deviations of these.
    pub fn sigmas(&self) -> Vec<f64> {
        self.filter.covariance().diagonal().iter().map(|v| v.max(0.0).sqrt()).collect()
    }

    /// The rows of `dataset` as a weighted problem for [`Tracker::update`].
    pub fn prepare(&self, dataset: &Dataset) -> CalibrationProblem {
        let (observed, _) = prepare_observations(dataset, &self.initial.nominal, false);
        self.problem(&self.pose_records(&observed))
    }
}

/// Up to this number of outliers a track is reliable whatever their share.
const FEW_OUTLIERS: usize = 5;

/// Added to the model's variances, as its covariance can be singular to rounding; negligible beside any tolerance (mm², rad²).
const MIN_VARIANCE: f64 = 1e-14;

fn process_noise(parameter: &Parameter, options: &Options) -> f64 {
    if let Some(own) = options.drift.get(&parameter.to_string()) {
        return *own;
    }
    match (parameter.is_of_arm(), parameter.unit()) {
        (false, "") => 0.0,
        (true, "mm") => options.drift_length_mm,
        (true, "rad") => options.drift_angle_rad,
        // Parameters of effects have various units: constant unless a drift is stated for them.
        (true, _) => 0.0,
        (false, "mm") => options.drift_frame_mm,
        (false, _) => options.drift_frame_rad,
    }
}
