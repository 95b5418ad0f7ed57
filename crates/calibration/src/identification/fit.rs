//! Weighted fit with an estimated noise variance, and outlier detection.
//!
//! Stages, each with its error on the fitted rows and on held-out rows:
//!
//! 1. *raw*: the nominal arm with a stated sensor frame; absent otherwise, since the error with a fitted frame is not raw;
//! 2. *registered*: the nominal arm, with base or outlet, cable zero and target fitted;
//! 3. *geometry*: the links too.
//!
//! The gain of a model is the step from registered to geometry, never from raw.
//!
//! Outliers are detected on all rows before the split, by a robust fit of geometry (Cauchy weights, then rows beyond ten robust
//! standard deviations), because geometry can explain a large residual. The sensor's variance is the one at which the
//! whitened residuals have their degrees of freedom as sum of squares.

use crate::identification::calibration::{CalibrationProblem, Frames, Weight};
use crate::identification::identifiability::{Identifiability, identifiability};
use crate::identification::prior_width::learn_tolerance;
use crate::identification::rounding::{
    self, AngleCovariance, NotFused, ReadoutFusion, fuse_readout, logged_covariance,
};
use crate::identification::solver::Solver;
use crate::identification::tolerance::Tolerance;
use crate::measurement::dataset::{Dataset, Reading, Sensor};
use truegrind_arm::condition::Condition;
use truegrind_arm::model::Model;
use truegrind_arm::parameter::{Parameter, arm_parameters};
use truegrind_estimation::estimate::{Estimate, Evaluations, Iteration, Termination};
use truegrind_estimation::problem::effective_parameters;
use truegrind_estimation::problem::{Prior, Problem};
use truegrind_math::statistics::{ErrorSummary, median};
use truegrind_math::work::checkpoint;

/// Parameters of the measurement: frame, outlet, zero, target, and how each further station stands to the first.
pub fn frame_parameters(dataset: &Dataset) -> Vec<Parameter> {
    let target = if dataset.sensor == Sensor::Pose { 6 } else { 3 };
    let mut out: Vec<Parameter> = (0..target).map(Parameter::Target).collect();
    match dataset.sensor {
        Sensor::Cable => {
            for anchor in 0..dataset.anchors() {
                out.extend((0..3).map(|axis| Parameter::Outlet { anchor, axis }));
                out.push(Parameter::Zero { anchor });
            }
        }
        Sensor::Position | Sensor::Pose => {
            out.extend((0..6).map(Parameter::SensorFrame));
            for index in 1..dataset.stations() {
                out.extend((0..6).map(|parameter| Parameter::Disturbance { index: index - 1, parameter }));
            }
        }
    }
    out
}

/// Rows with the covariance of their joint angles.
#[derive(Debug, Clone)]
pub struct Observations {
    /// The rows, with the read-out fused into the angles where possible.
    pub dataset: Dataset,
    /// Covariance of each row's angles.
    pub angles: AngleCovariance,
}

impl Observations {
    /// Rows with their angles as logged.
    pub fn logged(dataset: Dataset) -> Self {
        Self { angles: logged_covariance(&dataset), dataset }
    }

    /// Rows with the controller's read-out fused into their rounded angles, or as logged, with the reason; those at `excluded` stay as logged.
    pub fn fused(
        dataset: Dataset,
        nominal: &Model,
        excluded: &[usize],
    ) -> (Self, Result<ReadoutFusion, NotFused>) {
        let fused: Vec<usize> = (0..dataset.rows.len()).filter(|row| !excluded.contains(row)).collect();
        let mut rows = dataset.subset(&fused);
        let mut observed = Self::logged(dataset);
        match fuse_readout(&mut rows, nominal) {
            Ok((report, covariances)) => {
                for ((&i, row), covariance) in fused.iter().zip(&rows.rows).zip(covariances) {
                    observed.dataset.rows[i].joints = row.joints;
                    observed.angles.set(i, covariance);
                }
                (observed, Ok(report))
            }
            Err(why) => (observed, Err(why)),
        }
    }

    /// The rows at `indices`.
    pub fn subset(&self, indices: &[usize]) -> Self {
        Self { dataset: self.dataset.subset(indices), angles: self.angles.subset(indices) }
    }

    /// A stratified subsample of more than [`MANY_ROWS`] rows, one from each of equal intervals; `None` for fewer rows.
    ///
    /// It determines weights, the sensor's standard deviation and outlier bounds as well, at a fraction of the cost.
    pub(crate) fn subsample(&self) -> Option<Self> {
        let rows = self.dataset.rows.len();
        if rows <= MANY_ROWS {
            return None;
        }
        let draw = |interval: usize| {
            let [begin, end] = [interval, interval + 1].map(|k| k * rows / FEW_ROWS);
            // A hash (the finaliser of splitmix64), so that no period of the measurement is matched.
            let mut bits = (interval as u64).wrapping_add(0x9e37_79b9_7f4a_7c15);
            bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            begin + ((bits ^ (bits >> 31)) % (end - begin) as u64) as usize
        };
        Some(self.subset(&(0..FEW_ROWS).map(draw).collect::<Vec<_>>()))
    }
}

/// Rows above which weights are estimated from a subsample.
const MANY_ROWS: usize = 50_000;
/// Rows of the subsample.
const FEW_ROWS: usize = 20_000;

/// Result of a fit.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// Free parameters.
    pub parameters: Vec<Parameter>,
    /// Their priors.
    pub priors: Vec<Prior>,
    /// Estimate as deviations from the start.
    pub estimate: Estimate,
    /// The arm.
    pub model: Model,
    /// The frames.
    pub frames: Frames,
    /// Estimated standard deviation of a reading (mm), without the rounding of angles.
    pub sigma_mm: f64,
    /// The same for an orientation (rad).
    pub sigma_rad: f64,
    /// The problem with its final weights.
    pub problem: CalibrationProblem,
    /// Total work of all rounds.
    pub evaluations: Evaluations,
    /// Trace of every round. Weights change between rounds, so costs of different rounds are not comparable.
    pub rounds: Vec<Vec<Iteration>>,
}

/// Starting values of a fit.
#[derive(Debug, Clone, Copy)]
pub struct Start<'a> {
    /// The arm.
    pub model: &'a Model,
    /// The frames.
    pub frames: &'a Frames,
}

/// Lower bound of the noise estimate (mm): below it, weights would only amplify rounding.
const MIN_SIGMA_MM: f64 = 1e-4;
const MIN_SIGMA_RAD: f64 = 1e-6;

/// Fits `parameters` to `observed` and estimates the sensor's standard deviation, alternating in three rounds; likewise the
/// prior widths of the links where [`Tolerance::learn_widths`] is set.
pub fn fit(
    observed: &Observations,
    start: Start<'_>,
    parameters: &[Parameter],
    tolerance: &Tolerance,
    solver: &Solver,
    seed: u64,
) -> Fitted {
    let mut priors = tolerance.priors_within(parameters, start.model, start.frames);
    let (mut sigma_mm, mut sigma_rad) = (0.1, 1e-3);
    let mut x = vec![0.0; parameters.len()];
    let mut model = start.model.clone();
    let mut frames = start.frames.clone();
    let mut evaluations = Evaluations::default();
    let (mut last, mut rounds): (Option<(CalibrationProblem, Estimate)>, _) =
        (None, Vec::with_capacity(ROUNDS));
    // Weights from a subsample of very many rows; all rows are fitted once.
    let few = observed.subsample();
    let mut steps = StepBudget::of(few.as_ref().unwrap_or(observed), parameters);
    for round in 1..=ROUNDS {
        checkpoint();
        let observed = few.as_ref().filter(|_| round < ROUNDS).unwrap_or(observed);
        if few.is_some() && round == ROUNDS {
            last = None;
        }
        let before = rounding::angle_shares(&observed.dataset, &model, &frames, &observed.angles);
        let weights = rounding::weights_of(&before, sigma_mm, sigma_rad);
        // Only the weights change from round to round.
        let problem = match last.take() {
            Some((problem, _)) => problem.with_weights(&weights),
            None => CalibrationProblem::new(
                &observed.dataset,
                start.model,
                start.frames,
                parameters,
                &priors,
                &weights,
            ),
        };
        drop(weights);
        let estimate = steps.solve(solver, &problem, &x, seed);
        evaluations.residuals += estimate.evaluations.residuals;
        evaluations.jacobians += estimate.evaluations.jacobians;
        x.clone_from(&estimate.x);
        (model, frames) = problem.apply(&x);
        let shares = match &few {
            // The arm moves by a fraction of its tolerance, so the shares at the start are accurate enough.
            Some(_) => before,
            None => rounding::angle_shares(&observed.dataset, &model, &frames, &observed.angles),
        };
        (sigma_mm, sigma_rad) = noise_sigmas(&problem, &x, &shares, residual_share(&problem, &estimate));
        rounds.push(estimate.trace.clone());
        if tolerance.learn_widths && round < ROUNDS {
            let learned = learn_tolerance(tolerance, parameters, &priors, &estimate);
            priors = learned.priors_within(parameters, start.model, start.frames);
        }
        last = Some((problem.with_priors(&priors), estimate));
    }
    let (problem, estimate) = last.unwrap_or_else(|| unreachable!("at least one round"));
    Fitted {
        parameters: parameters.to_vec(),
        priors,
        estimate,
        model,
        frames,
        sigma_mm,
        sigma_rad,
        problem,
        evaluations,
        rounds,
    }
}

/// Rounds of solver and variance; the variance converges to per cent after two.
const ROUNDS: usize = 3;

/// Budget of trial steps over all rounds of a fit, for searches along a flat valley. A normal fit takes some ten steps a round.
struct StepBudget {
    left: usize,
}

/// Rows times parameters squared, summed over all steps: about a second.
const WORK: usize = 5_000_000_000;

/// Smallest budget.
const MIN_STEPS: usize = 100;

impl StepBudget {
    fn of(observed: &Observations, parameters: &[Parameter]) -> Self {
        let step = observed.dataset.rows.len() * parameters.len() * parameters.len();
        Self { left: (WORK / step.max(1)).max(MIN_STEPS) }
    }

    fn solve(&mut self, solver: &Solver, problem: &CalibrationProblem, start: &[f64], seed: u64) -> Estimate {
        let estimate = solver.solve_within(problem, start, seed, self.left);
        self.left = self.left.saturating_sub(estimate.trace.len().saturating_sub(1));
        estimate
    }
}

/// The standard deviations σ with Σ r²/(σ² + share) = n − k ([`residual_share`]), for lengths and for orientations.
fn noise_sigmas(
    problem: &CalibrationProblem,
    x: &[f64],
    shares: &[(f64, f64)],
    freedom_share: f64,
) -> (f64, f64) {
    let per = problem.rows_per_observation();
    let plain = problem.unweighted_residuals(x);
    let solve = |components: std::ops::Range<usize>, share: fn(&(f64, f64)) -> f64, smallest: f64| {
        // Squared residual and share; recomputed rather than stored, as there can be a million rows.
        let squares = || {
            plain.chunks_exact(per).zip(shares).flat_map(|(r, s)| {
                let share = share(s);
                r[components.clone()].iter().filter(|r| r.is_finite()).map(move |r| (r * r, share))
            })
        };
        let count = squares().count();
        let freedom = count as f64 * freedom_share;
        let excess = |sigma: f64| squares().map(|(r, s)| r / (sigma * sigma + s)).sum::<f64>() - freedom;
        let (mut low, mut high) = (smallest.ln(), 1e4_f64.ln());
        if count == 0 || excess(smallest) <= 0.0 {
            return smallest;
        }
        for _ in 0..60 {
            checkpoint();
            let middle = 0.5 * (low + high);
            if excess(middle.exp()) > 0.0 { low = middle } else { high = middle }
        }
        high.exp()
    };
    let mm = solve(0..per.min(3), |share| share.0, MIN_SIGMA_MM);
    let rad = if per > 3 { solve(3..per, |share| share.1, MIN_SIGMA_RAD) } else { 1e-3 };
    (mm, rad)
}

/// Error with only the frames fitted from which readings are of another arm, or in other units or columns (mm): the RMS for `identify`, the
/// median for the beginning of a diagnosis, along each axis for a later series and for tracking.
pub(crate) const OTHER_ARM_MM: f64 = 25.0;

/// A row rejected as a gross outlier.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outlier {
    /// Its index in the data set.
    pub index: usize,
    /// Its residual of the robust fit of geometry, in robust standard deviations.
    pub robust_sigmas: f64,
    /// The same (mm).
    pub error_mm: f64,
}

/// Rows rejected as gross outliers.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Outliers {
    /// Largest first.
    pub rows: Vec<Outlier>,
    /// Rows beyond the cut, if there were too many to be outliers and none was rejected.
    pub too_many: usize,
}

/// A row is an outlier beyond this many robust standard deviations of a geometry fit.
pub const OUTLIER_CUT: f64 = 10.0;

/// Largest share of rejected rows: more is a systematic effect.
pub(crate) const OUTLIER_SHARE: f64 = 0.1;

/// σ of one coordinate or length over the median size of the errors: 1.4826 for |normal|; the norm of three coordinates has median 1.538 σ.
pub(crate) fn sigma_per_median(sensor: Sensor) -> f64 {
    if sensor == Sensor::Cable { 1.4826 } else { 1.0 / 1.538 }
}

/// Detects gross outliers by a robust fit of geometry.
pub fn outliers(
    observed: &Observations,
    start: Start<'_>,
    tolerance: &Tolerance,
    solver: &Solver,
) -> Outliers {
    let dataset = &observed.dataset;
    let parameters: Vec<Parameter> =
        arm_parameters(start.model).into_iter().chain(frame_parameters(dataset)).collect();
    let priors = tolerance.priors_within(&parameters, start.model, start.frames);
    let (all, few) = (observed, observed.subsample());
    let observed = few.as_ref().unwrap_or(all);
    let n = all.dataset.rows.len();
    let dataset = &observed.dataset;
    let mut factor = vec![1.0; dataset.rows.len()];
    let mut x = vec![0.0; parameters.len()];
    let (mut model, mut frames) = (start.model.clone(), start.frames.clone());
    let (mut scaled, mut errors) = (vec![0.0; dataset.rows.len()], Vec::new());
    let mut sigma = 0.1;
    let consistency = sigma_per_median(dataset.sensor);
    let mut before: Option<CalibrationProblem> = None;
    let mut steps = StepBudget::of(observed, &parameters);
    for _ in 0..ROBUST_ROUNDS {
        let base = rounding::weights(dataset, &model, &frames, &observed.angles, sigma, 1e-3);
        let weights: Vec<Weight> = base
            .iter()
            .zip(&factor)
            .map(|(w, f)| Weight { per_mm: w.per_mm * f, per_rad: w.per_rad * f })
            .collect();
        let problem = match before.take() {
            Some(problem) => problem.with_weights(&weights),
            None => {
                CalibrationProblem::new(dataset, start.model, start.frames, &parameters, &priors, &weights)
            }
        };
        let estimate = steps.solve(solver, &problem, &x, 0);
        let moved: f64 = estimate
            .x
            .iter()
            .zip(&x)
            .zip(&priors)
            .map(|((a, b), p)| ((a - b) / p.sigma).abs())
            .fold(0.0, f64::max);
        let left = residual_share(&problem, &estimate).sqrt();
        x = estimate.x;
        (model, frames) = problem.apply(&x);
        errors = problem.errors_mm(&x);
        let sizes: Vec<f64> = errors.iter().zip(&base).map(|(e, w)| e.abs() * w.per_mm).collect();
        let spread = (median(&sizes).unwrap_or(1.0) * consistency / left).max(1e-9);
        scaled = sizes.iter().map(|s| s / spread).collect();
        sigma = (sigma * spread).max(MIN_SIGMA_MM);
        for (f, s) in factor.iter_mut().zip(&scaled) {
            *f = 1.0 / (1.0 + (s / CAUCHY).powi(2)).sqrt();
        }
        before = Some(problem);
        if moved < 1e-3 {
            break;
        }
    }
    drop(before);
    if few.is_some() {
        // Fitted to the subsample, applied to all rows.
        let base = rounding::weights(&all.dataset, &model, &frames, &all.angles, sigma, 1e-3);
        errors = errors_on(all, &model, &frames);
        let sizes: Vec<f64> = errors.iter().zip(&base).map(|(e, w)| e.abs() * w.per_mm).collect();
        let spread = (median(&sizes).unwrap_or(1.0) * consistency).max(1e-9);
        scaled = sizes.iter().map(|s| s / spread).collect();
    }
    let of_row = |(index, (robust_sigmas, error_mm)): (usize, (&f64, &f64))| Outlier {
        index,
        robust_sigmas: *robust_sigmas,
        error_mm: *error_mm,
    };
    let mut rows: Vec<Outlier> = scaled.iter().zip(&errors).enumerate().map(of_row).collect();
    rows.retain(|row| !(row.robust_sigmas <= OUTLIER_CUT));
    rows.sort_by(|a, b| b.robust_sigmas.total_cmp(&a.robust_sigmas));
    if rows.len() as f64 > OUTLIER_SHARE * n as f64 {
        return Outliers { too_many: rows.len(), rows: Vec::new() };
    }
    Outliers { rows, too_many: 0 }
}

/// Share of the noise's variance that a fit leaves in the residuals, 1 − k/n with k parameters determined by n readings. With few readings
/// most residuals are smaller than the noise, and a healthy row would lie beyond ten times their median.
fn residual_share(problem: &CalibrationProblem, estimate: &Estimate) -> f64 {
    let variances = estimate.covariance.as_ref().map(|covariance| covariance.diagonal());
    let determined =
        variances.map_or(0.0, |found| effective_parameters(found.iter().copied(), problem.priors()));
    let rows = problem.rows() as f64;
    ((rows - determined) / rows).max(MIN_RESIDUAL_SHARE)
}

/// Least such share: the effective number of parameters is approximate.
const MIN_RESIDUAL_SHARE: f64 = 0.1;

const ROBUST_ROUNDS: usize = 12;
/// Tuning constant of the Cauchy weight: 95 % efficiency on normal errors.
const CAUCHY: f64 = 2.385;

/// Position errors of a model and frames on any rows (mm), as [`CalibrationProblem::errors_mm`].
pub fn errors_on(observed: &Observations, model: &Model, frames: &Frames) -> Vec<f64> {
    let weights = vec![Weight { per_mm: 1.0, per_rad: 1.0 }; observed.dataset.rows.len()];
    CalibrationProblem::new(&observed.dataset, model, frames, &[], &[], &weights).errors_mm(&[])
}

/// Angle between the measured orientation of the target and that under a model, for each of these rows (rad); `None` if a reading has no
/// orientation.
pub fn orientation_errors(
    observed: &Observations,
    rows: &[usize],
    model: &Model,
    frames: &Frames,
) -> Option<Vec<f64>> {
    // Rows of one condition follow each other, and preparing the arm costs more than one pose.
    let mut prepared = model.at_condition(&Condition::default());
    let error = |&row: &usize| {
        let row = &observed.dataset.rows[row];
        let Reading::Pose(seen) = &row.reading else { return None };
        if prepared.condition != *row.condition {
            prepared = model.at_condition(&row.condition);
        }
        let flange = prepared.forward(&row.joints);
        let target = flange.rotation * frames.flange_from_target.rotation;
        Some((frames.base_from_sensor.rotation * seen.rotation).angle_to(&target))
    };
    rows.iter().map(error).collect()
}

/// Median of [`orientation_errors`] over all rows (rad).
pub fn median_orientation_error(observed: &Observations, model: &Model, frames: &Frames) -> Option<f64> {
    let rows: Vec<usize> = (0..observed.dataset.rows.len()).collect();
    median(&orientation_errors(observed, &rows, model, frames)?)
}

/// Median orientation error with only the frames fitted above which orientations are wrong (rad): an arm is off by tenths of a degree.
pub const WRONG_ORIENTATION_RAD: f64 = 3.0 * std::f64::consts::PI / 180.0;

/// Summary of [`errors_on`].
pub fn summary_on(observed: &Observations, model: &Model, frames: &Frames) -> ErrorSummary {
    ErrorSummary::of(errors_on(observed, model, frames))
}

impl Fitted {
    /// Standard deviation of each parameter; the prior's where the covariance is missing.
    pub fn sigmas(&self) -> Vec<f64> {
        match self.estimate.sigmas() {
            Some(sigmas) => sigmas,
            None => self.priors.iter().map(|p| p.sigma).collect(),
        }
    }

    /// Identifiability of the parameters.
    pub fn identifiability(&self) -> Option<Identifiability> {
        let scale: Vec<f64> = self.priors.iter().map(|p| p.sigma).collect();
        identifiability(&self.problem, &self.estimate.x, &scale)
    }

    /// How the solver ended.
    pub fn termination(&self) -> Termination {
        self.estimate.termination
    }

    /// Trace of the last round.
    pub fn trace(&self) -> &[Iteration] {
        &self.estimate.trace
    }
}
