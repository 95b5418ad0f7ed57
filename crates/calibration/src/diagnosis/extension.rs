//! The model extended by causes: a robust fit of frames, links and causes together.
//!
//! Method: iteratively reweighted least squares with Huber's weight min(1, k/s), s the size of a row's whitened residual
//! and k = 2. The influence is bounded, not redescending: a shifted block of rows still has influence, so that its cause can
//! be found, while single outliers have no more influence than a bad normal row; from twenty standard deviations on a row's share of χ² is
//! bounded too. Scale by the median, refined at the end so that
//! the weighted sum of squares has its degrees of freedom. Source: Huber, Robust Statistics, 1981, chapter 7.
//!
//! From a nearby fit the steps are Gauss–Newton (see `newton`) as long as they descend. Fits within a search stop there; all
//! others end with Levenberg–Marquardt.

use std::ops::Range;

use super::cause::Cause;
use super::design_effect::RepeatedPoses;
use super::newton::{self, Step};
use crate::identification::calibration::{CalibrationProblem, Frames, Weight};
use crate::identification::fit::{Fitted, Observations, frame_parameters};
use crate::identification::rounding;
use crate::identification::tolerance::Tolerance;
use crate::measurement::dataset::Sensor;
use nalgebra::DMatrix;
use truegrind_arm::effect::Effect;
use truegrind_arm::model::Model;
use truegrind_arm::parameter::{Parameter, link_parameters};
use truegrind_estimation::estimate::{Estimate, Evaluations, Termination};
use truegrind_estimation::least_squares::lm;
use truegrind_estimation::problem::effective_parameters;
use truegrind_estimation::problem::{Prior, Problem, prior_cost};
use truegrind_math::statistics::median;

/// The data of a fit: rows, nominal arm, starting frames, priors.
#[derive(Debug, Clone, Copy)]
pub struct Subject<'a> {
    /// The rows.
    pub observed: &'a Observations,
    /// The data sheet's arm.
    pub nominal: &'a Model,
    /// Starting frames, without disturbances other than further stations.
    pub frames: &'a Frames,
    /// Frames that regressors of causes are evaluated at: fitted ones, since a cable's hook starts on the flange, wherever it is.
    pub evaluated_at: &'a Frames,
    /// Priors of links and frames.
    pub tolerance: &'a Tolerance,
}

impl Subject<'_> {
    /// The calibration problem of its rows, starting at an arm and frames.
    fn problem(
        &self,
        start: (&Model, &Frames),
        parameters: &[Parameter],
        priors: &[Prior],
        weights: &[Weight],
    ) -> CalibrationProblem {
        let dataset = &self.observed.dataset;
        CalibrationProblem::evaluated_at(self.evaluated_at, dataset, start, parameters, priors, weights)
    }
}

/// The free parameters of a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FreeParameters {
    /// Frames alone.
    Frames,
    /// Frames, links, and the causes.
    All,
}

/// A fit of the extended model.
#[derive(Debug, Clone)]
pub struct Extended {
    /// The causes, in the order of their acceptance.
    pub causes: Vec<Cause>,
    /// Parameters: links, effects, frames, disturbances.
    pub parameters: Vec<Parameter>,
    /// Their priors.
    pub priors: Vec<Prior>,
    /// The calibration problem, with robust weights.
    pub problem: CalibrationProblem,
    /// The estimate, in deviations from the start.
    pub x: Vec<f64>,
    /// The arm.
    pub model: Model,
    /// The frames with their disturbances.
    pub frames: Frames,
    /// Huber's weight of each row, 1 for a good one.
    pub robust_weight: Vec<f64>,
    /// Size of each row's whitened residual.
    pub sizes: Vec<f64>,
    /// Weights of the rows, Huber's not included.
    pub weights: Vec<Weight>,
    /// Mean effective weight of a row for the model error: below 1 for repeated poses (design effect).
    pub effective_share: f64,
    /// Standard deviation of a reading (mm), and of an orientation (rad).
    pub sigma: (f64, f64),
    /// The solver's result, with the covariance of the parameters except within a search.
    pub estimate: Estimate,
}

/// Huber's k, in standard deviations.
const HUBER_K: f64 = 2.0;

/// Size from which a row counts less than Huber's weight allows, in standard deviations: its share of χ² stays that of this size, so that one
/// wrong reading of metres does not decide between causes.
const GROSS: f64 = 20.0;

/// The robust weight of a row by the size of its whitened residual.
fn robust_weight_of(size: f64) -> f64 {
    (HUBER_K / size).min(1.0) * (GROSS / size).min(1.0)
}

/// Smallest standard deviation of a reading (mm, rad). With fewer rows than parameters the residual is 0; unbounded weights would then
/// overwhelm the priors.
const MIN_SIGMA: (f64, f64) = (1e-3, 1e-6);

/// Convergence tolerance of fits within a search, in χ²/2 for each scalar row: the linearisation absorbs the rest, and merits are
/// compared in units of χ².
const SEARCHED: f64 = 1e-5;

/// Most steps of Levenberg–Marquardt within a search, for the same reason. In a curved valley that only priors close the last hundredth
/// of χ² takes hundreds of steps.
pub(super) const SEARCH_STEPS: usize = 30;

/// Scalar rows times squared parameters from which the final refinement is looser.
const MUCH_WORK: f64 = 1e8;

/// Relative cost tolerance of that looser refinement.
const FINE_ENOUGH: f64 = 1e-8;

/// Most rounds of solver and weights.
const ROUNDS: usize = 8;

/// For an error map, the knots that some row reaches; all parameters of another effect.
fn reached(subject: &Subject<'_>, effect: &Effect) -> Vec<bool> {
    let Effect::GearMap(map) = effect else { return vec![true; effect.parameters().len()] };
    let mut out = vec![false; map.knots_rad.len()];
    for row in subject.observed.dataset.rows.iter() {
        let knots = map.reached(subject.nominal.mapped(&row.joints)[map.joint]);
        knots.into_iter().for_each(|k| out[k] = true);
    }
    out
}

/// The start of a fit: nominal arm and frames with the causes at size 0, and the free parameters with the current values of causes.
/// With `seen`, knots that no row reaches are not free: they would remain at their prior without affecting the others.
fn start(
    subject: &Subject<'_>,
    causes: &[Cause],
    free_parameters: FreeParameters,
    seen: bool,
) -> (Model, Frames, Vec<(Parameter, Option<f64>)>) {
    let (mut model, mut frames) = (subject.nominal.clone(), subject.frames.clone());
    let links = if free_parameters == FreeParameters::All { link_parameters(&model) } else { Vec::new() };
    let mut links: Vec<_> = links.into_iter().map(|p| (p, None)).collect();
    let mut sensing: Vec<_> =
        frame_parameters(&subject.observed.dataset).into_iter().map(|p| (p, None)).collect();
    for cause in causes {
        match cause {
            Cause::Arm(effect) => {
                let mut effect = effect.clone();
                let index = model.effects.len();
                let values = effect.parameters();
                let free = if seen { reached(subject, &effect) } else { vec![true; values.len()] };
                links.extend(
                    values
                        .iter()
                        .enumerate()
                        .filter(|(parameter, _)| free[*parameter])
                        .map(|(parameter, p)| (Parameter::Effect { index, parameter }, Some(p.value))),
                );
                (0..values.len()).for_each(|k| effect.set(k, 0.0));
                model.effects.push(effect);
            }
            Cause::Measurement(disturbance) => {
                let mut disturbance = disturbance.clone();
                let index = frames.disturbances.len();
                sensing.extend(
                    disturbance.values.iter().enumerate().map(|(parameter, value)| {
                        (Parameter::Disturbance { index, parameter }, Some(*value))
                    }),
                );
                disturbance.values.iter_mut().for_each(|v| *v = 0.0);
                frames.disturbances.push(disturbance);
            }
        }
    }
    links.extend(sensing);
    (model, frames, links)
}

/// Starting value of a parameter: the value of its cause, or that of the link or frame in a nearby fit.
fn starting((parameter, size): &(Parameter, Option<f64>), near: Option<&Extended>) -> f64 {
    size.unwrap_or_else(|| {
        near.and_then(|e| e.parameters.iter().position(|q| q == parameter).map(|k| e.x[k])).unwrap_or(0.0)
    })
}

/// Numbers of lengths and angles in one observation.
fn components(sensor: Sensor) -> (usize, usize) {
    match sensor {
        Sensor::Cable => (1, 0),
        Sensor::Position => (3, 0),
        Sensor::Pose => (3, 3),
    }
}

/// Median of √(χ²ₖ/k), to convert a median size to a standard deviation.
fn median_size(k: usize) -> f64 {
    match k {
        1 => 0.6745,
        3 => 0.8881,
        _ => 0.9441,
    }
}

/// Robust fit of the nominal arm extended by `causes`, starting at their values. `near` provides starting values of links, frames
/// and noise.
pub fn fit(
    subject: &Subject<'_>,
    causes: &[Cause],
    free_parameters: FreeParameters,
    near: Option<&Extended>,
) -> Extended {
    warm_fit(subject, causes, free_parameters, near).refine()
}

/// The same within a search: only to the tolerance of Gauss–Newton from `near`, without a covariance.
pub(super) fn warm_fit(
    subject: &Subject<'_>,
    causes: &[Cause],
    free_parameters: FreeParameters,
    near: Option<&Extended>,
) -> Extended {
    let observed = subject.observed;
    let dataset = &observed.dataset;
    let (start_model, start_frames, free) = start(subject, causes, free_parameters, true);
    let mut x: Vec<f64> = free.iter().map(|p| starting(p, near)).collect();
    let parameters: Vec<Parameter> = free.into_iter().map(|p| p.0).collect();
    let priors = subject.tolerance.priors_within(&parameters, &start_model, &start_frames);
    let n = dataset.rows.len();
    let (lengths, angles) = components(dataset.sensor);
    let per = lengths + angles;
    let mut sigma = near.map_or((0.1, 1e-3), |e| e.sigma);
    let mut robust_weight =
        near.filter(|e| e.robust_weight.len() == n).map_or_else(|| vec![1.0; n], |e| e.robust_weight.clone());
    let repeated = RepeatedPoses::of(dataset);
    let mut round = 0;
    let unweighted = vec![Weight { per_mm: 1.0, per_rad: 1.0 }; n];
    let plain_task = subject.problem((&start_model, &start_frames), &parameters, &priors, &unweighted);
    let (mut model, mut frames) = plain_task.apply(&x);
    let mut nearby = near.is_some() && free_parameters == FreeParameters::All;
    loop {
        round += 1;
        let base = rounding::weights(dataset, &model, &frames, &observed.angles, sigma.0, sigma.1);
        let problem = plain_task.reweighted(&with_robust_weights(&base, &robust_weight));
        let steps = Round::run(&problem, &mut x, nearby, near.is_some());
        nearby = matches!(steps, Round::Step(_));
        (model, frames) = problem.apply(&x);
        let plain = problem.unweighted_residuals(&x);
        let whitened = Whitened { base: &base, plain: &plain, per, repeated: repeated.as_ref() };
        let of_lengths = whitened.spread(0..lengths);
        let of_angles = if angles > 0 { whitened.spread(lengths..per) } else { 1.0 };
        let sizes = whitened.sizes([lengths, angles], [of_lengths, of_angles]);
        let next: Vec<f64> = sizes.iter().map(|s| robust_weight_of(*s)).collect();
        let moved = next.iter().zip(&robust_weight).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let settled = (of_lengths - 1.0).abs() < 1e-2 && (of_angles - 1.0).abs() < 1e-2 && moved < 5e-2;
        if (settled && round > 1) || round >= ROUNDS {
            let spent = steps.spent(&priors);
            let (by_length, length_share) = whitened.deviations(0..lengths, &robust_weight, spent);
            let (by_angle, angle_share) = whitened.deviations(lengths..per, &robust_weight, spent);
            let share = |count: usize| count as f64 / per as f64;
            let effective_share = share(lengths) * length_share + share(angles) * angle_share;
            let weights: Vec<Weight> = base
                .iter()
                .zip(by_length.iter().zip(&by_angle))
                .map(|(w, (length, angle))| Weight {
                    per_mm: (w.per_mm / length).min(MIN_SIGMA.0.recip()),
                    per_rad: (w.per_rad / angle).min(MIN_SIGMA.1.recip()),
                })
                .collect();
            let problem = plain_task.reweighted(&with_robust_weights(&weights, &robust_weight));
            let estimate = final_descent(&problem, &priors, x, nearby, near.is_some());
            let (model, frames) = problem.apply(&estimate.x);
            return Extended {
                causes: filled(causes, &model, &frames),
                parameters,
                priors,
                x: estimate.x.clone(),
                model,
                frames,
                robust_weight,
                sizes,
                weights,
                effective_share,
                sigma,
                estimate,
                problem,
            };
        }
        robust_weight = next;
        sigma = (
            updated_sigma(sigma.0, of_lengths, &base, true),
            updated_sigma(sigma.1, of_angles, &base, false),
        );
    }
}

/// The solver steps of one round.
enum Round {
    /// One Gauss–Newton step.
    Step(Step),
    /// A few Levenberg–Marquardt steps, with the covariance.
    Solved(Option<DMatrix<f64>>),
}

impl Round {
    /// Takes one Gauss–Newton step if the optimum is nearby and it descends, else a few Levenberg–Marquardt steps.
    fn run(problem: &CalibrationProblem, x: &mut Vec<f64>, nearby: bool, near: bool) -> Self {
        if nearby && let Some(step) = Step::take(problem, x) {
            return Self::Step(step);
        }
        // The weights still change, so convergence beyond a few steps would be wasted.
        let steps = if near { 1 } else { 3 };
        let rough = lm::Options { max_iterations: steps, cost_tolerance: 1e-4, ..lm::Options::default() };
        let estimate = lm::solve(problem, x, &rough);
        x.clone_from(&estimate.x);
        Self::Solved(estimate.covariance)
    }

    /// Effective number of parameters.
    fn spent(&self, priors: &[Prior]) -> f64 {
        let variances = match self {
            Self::Step(step) => step.variances(),
            Self::Solved(Some(covariance)) => covariance.diagonal().as_slice().to_vec(),
            Self::Solved(None) => Vec::new(),
        };
        effective_parameters(variances, priors)
    }
}

/// Residuals divided by the expected standard deviation of sensor and angles.
struct Whitened<'a> {
    base: &'a [Weight],
    plain: &'a [f64],
    /// Residuals of a row.
    per: usize,
    /// The pose of each row, if there are enough repeated readings.
    repeated: Option<&'a RepeatedPoses>,
}

impl Whitened<'_> {
    /// A residual of a row; 0 if not finite.
    fn scalar(&self, i: usize, c: usize) -> f64 {
        let w = &self.base[i];
        let value = self.plain[i * self.per + c] * if c < 3 { w.per_mm } else { w.per_rad };
        if value.is_finite() { value } else { 0.0 }
    }

    /// The sum of squares of some residuals of a row.
    fn squares(&self, i: usize, range: &Range<usize>) -> f64 {
        let w = &self.base[i];
        let row = &self.plain[i * self.per..(i + 1) * self.per];
        let whitened = row.iter().enumerate().map(|(c, r)| r * if c < 3 { w.per_mm } else { w.per_rad });
        whitened.skip(range.start).take(range.len()).map(|v| v * v).sum()
    }

    /// Their root mean square.
    fn size(&self, i: usize, range: Range<usize>) -> f64 {
        let size = (self.squares(i, &range) / range.len().max(1) as f64).sqrt();
        if size.is_finite() { size } else { 1e6 }
    }

    /// The standard deviation of all, from the median row.
    fn spread(&self, range: Range<usize>) -> f64 {
        let all: Vec<f64> = (0..self.base.len()).map(|i| self.size(i, range.clone())).collect();
        (median(&all).unwrap_or(1.0) / median_size(range.len())).clamp(1e-6, 1e6)
    }

    /// The size of each row, lengths and angles relative to their spreads.
    fn sizes(&self, [lengths, angles]: [usize; 2], [of_lengths, of_angles]: [f64; 2]) -> Vec<f64> {
        let size = |i: usize| {
            let a = self.size(i, 0..lengths) / of_lengths;
            if angles == 0 {
                return a;
            }
            let b = self.size(i, lengths..lengths + angles) / of_angles;
            (0.5 * (a * a + b * b)).sqrt()
        };
        (0..self.base.len()).map(size).collect()
    }

    /// Standard deviation of each row relative to the expected one, corrected for `spent` effective parameters, and the mean effective
    /// weight of a row (below 1 for repeated poses).
    fn deviations(&self, range: Range<usize>, robust_weight: &[f64], spent: f64) -> (Vec<f64>, f64) {
        let n = self.base.len();
        if range.is_empty() {
            return (vec![1.0; n], 1.0);
        }
        let scalars = (n * self.per) as f64;
        let usual = self.dispersion(range.clone(), robust_weight, ((scalars - spent) / scalars).max(0.05));
        let Some(repeated) = self.repeated else { return (vec![usual; n], 1.0) };
        let share = range.len() as f64 / self.per as f64;
        let parts = repeated.components(&range, |i, c| self.scalar(i, c), robust_weight, share * spent);
        let whole = parts.deviation().max(1e-6);
        let counts = repeated.effective_weights(&parts);
        let effective_share = counts.iter().sum::<f64>() / n as f64;
        (counts.into_iter().map(|counts| whole / counts.sqrt()).collect(), effective_share)
    }

    /// The scale for which the weighted sum of squares equals its degrees of freedom.
    fn dispersion(&self, range: Range<usize>, robust_weight: &[f64], freedom_share: f64) -> f64 {
        let of_row = |i: usize| {
            let row = self.squares(i, &range);
            if row.is_finite() { robust_weight[i] * row } else { 0.0 }
        };
        let sum: f64 = (0..self.base.len()).map(of_row).sum();
        let freedom = (self.base.len() * range.len()) as f64 * freedom_share;
        (sum / freedom.max(1.0)).sqrt().max(1e-6)
    }
}

/// Final descent with fixed weights. From a nearby fit it stops at the tolerance of a search, without a covariance.
fn final_descent(
    problem: &CalibrationProblem,
    priors: &[Prior],
    mut x: Vec<f64>,
    nearby: bool,
    near: bool,
) -> Estimate {
    if nearby && newton::descend_to(problem, &mut x, SEARCHED) {
        return Estimate {
            covariance: None,
            cost: problem.row_cost(&x) + prior_cost(priors, &x),
            evaluations: Evaluations::default(),
            termination: Termination::Cost,
            trace: Vec::new(),
            x,
        };
    }
    if near {
        // Relative to the cost, about half the number of rows: the same tolerance as above.
        let loose = lm::Options {
            cost_tolerance: 2.0 * SEARCHED,
            max_iterations: SEARCH_STEPS,
            ..lm::Options::default()
        };
        return Estimate { covariance: None, ..lm::solve(problem, &x, &loose) };
    }
    lm::solve(problem, &x, &lm::Options::default())
}

/// Updates the sensor's σ if the spread of the residuals is `spread` times the value expected from σ and the angles.
fn updated_sigma(sigma: f64, spread: f64, base: &[Weight], lengths: bool) -> f64 {
    let of = |w: &Weight| if lengths { w.per_mm } else { w.per_rad };
    let total = median(&base.iter().map(|w| 1.0 / of(w).powi(2)).collect::<Vec<_>>()).unwrap_or(1.0);
    let share = (total - sigma * sigma).max(0.0);
    let smallest = if lengths { MIN_SIGMA.0 } else { MIN_SIGMA.1 };
    (total * spread * spread - share).max(0.01 * sigma * sigma).sqrt().max(smallest)
}

/// Weights of the rows with Huber's included.
pub(super) fn with_robust_weights(weights: &[Weight], robust_weight: &[f64]) -> Vec<Weight> {
    weights
        .iter()
        .zip(robust_weight)
        .map(|(w, t)| Weight { per_mm: w.per_mm * t.sqrt(), per_rad: w.per_rad * t.sqrt() })
        .collect()
}

/// The causes with their fitted values.
pub(super) fn filled(causes: &[Cause], model: &Model, frames: &Frames) -> Vec<Cause> {
    let first = model.effects.len() - causes.iter().filter(|c| matches!(c, Cause::Arm(_))).count();
    let (mut effect, mut disturbance) = (first, frames.further_stations());
    causes
        .iter()
        .map(|cause| match cause {
            Cause::Arm(_) => {
                effect += 1;
                Cause::Arm(model.effects[effect - 1].clone())
            }
            Cause::Measurement(_) => {
                disturbance += 1;
                Cause::Measurement(frames.disturbances[disturbance - 1].clone())
            }
        })
        .collect()
}

impl Extended {
    /// Refines the fit to the optimum, with a covariance.
    pub(super) fn refine(self) -> Self {
        if self.estimate.covariance.is_some() {
            return self;
        }
        let p = self.parameters.len() as f64;
        let much = self.problem.rows() as f64 * p * p > MUCH_WORK;
        let tolerance = if much { FINE_ENOUGH } else { lm::Options::default().cost_tolerance };
        // Gauss–Newton from the optimum of the search; with its first damping Levenberg–Marquardt would creep along a valley that only
        // priors close, a hundred passes for a hundredth of χ².
        let mut x = self.x.clone();
        newton::descend_to(&self.problem, &mut x, 0.5 * tolerance);
        let options = lm::Options { cost_tolerance: tolerance, ..lm::Options::default() };
        let estimate = lm::solve(&self.problem, &x, &options);
        let (model, frames) = self.problem.apply(&estimate.x);
        let causes = filled(&self.causes, &model, &frames);
        Self { causes, x: estimate.x.clone(), model, frames, estimate, ..self }
    }

    /// The same fit with all parameters of its causes; those that no row reaches have their prior mean and variance.
    pub(super) fn whole(self, subject: &Subject<'_>) -> Self {
        let (model, frames, free) = start(subject, &self.causes, FreeParameters::All, false);
        let parameters: Vec<Parameter> = free.into_iter().map(|p| p.0).collect();
        if parameters.len() == self.parameters.len() {
            return self;
        }
        let places: Vec<Option<usize>> =
            parameters.iter().map(|p| self.parameters.iter().position(|q| q == p)).collect();
        let priors = subject.tolerance.priors_within(&parameters, &model, &frames);
        let x: Vec<f64> = places.iter().map(|k| k.map_or(0.0, |k| self.x[k])).collect();
        let covariance = self.estimate.covariance.as_ref().map(|own| {
            DMatrix::from_fn(places.len(), places.len(), |a, b| match (places[a], places[b]) {
                (Some(i), Some(j)) => own[(i, j)],
                (None, None) if a == b => priors[a].sigma.powi(2),
                _ => 0.0,
            })
        });
        let weights = with_robust_weights(&self.weights, &self.robust_weight);
        let problem = subject.problem((&model, &frames), &parameters, &priors, &weights);
        let estimate = Estimate { x: x.clone(), covariance, ..self.estimate };
        Self { parameters, priors, problem, x, estimate, ..self }
    }

    /// Indices in x of the parameters of cause `index`.
    pub fn parameter_indices(&self, index: usize) -> Vec<usize> {
        let arm = matches!(self.causes[index], Cause::Arm(_));
        let before = self.causes[..index].iter().filter(|c| matches!(c, Cause::Arm(_)) == arm).count();
        let own = self.causes.iter().filter(|c| matches!(c, Cause::Arm(_))).count();
        let first = if arm { self.model.effects.len() - own } else { self.frames.further_stations() };
        self.parameters
            .iter()
            .enumerate()
            .filter(|(_, p)| match **p {
                Parameter::Effect { index, .. } => arm && index == first + before,
                Parameter::Disturbance { index, .. } => !arm && index == first + before,
                _ => false,
            })
            .map(|(k, _)| k)
            .collect()
    }
}

impl From<&Extended> for Fitted {
    fn from(fit: &Extended) -> Self {
        Self {
            parameters: fit.parameters.clone(),
            priors: fit.priors.clone(),
            estimate: fit.estimate.clone(),
            model: fit.model.clone(),
            frames: fit.frames.clone(),
            sigma_mm: fit.sigma.0,
            sigma_rad: fit.sigma.1,
            problem: fit.problem.clone(),
            evaluations: fit.estimate.evaluations,
            rounds: vec![fit.estimate.trace.clone()],
        }
    }
}
