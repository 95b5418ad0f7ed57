//! The model extended by causes: a robust fit of frames, links and causes together.
//!
//! Method: iteratively reweighted least squares with Huber's weight min(1, k/s), s the size of a row's whitened residual
//! and k = 2. A bounded influence, not a redescending one: a block of rows that was shifted still pulls, so that its cause can
//! be found, while single wild rows pull no more than a bad normal one. Scale by the median, refined at the end so that
//! the weighted sum of squares has its degrees of freedom. Source: Huber, Robust Statistics, 1981, chapter 7.
//!
//! Near another fit the steps are Gauss and Newton's (see `newton`) as long as they descend. A search leaves it at that; any
//! other fit ends with Levenberg and Marquardt.

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
use truegrind_estimation::problem::{Prior, Problem, prior_cost};
use truegrind_math::statistics::median;

/// What is diagnosed: the rows, the data sheet, and where the frames start.
#[derive(Debug, Clone, Copy)]
pub struct Subject<'a> {
    /// The rows.
    pub observed: &'a Observations,
    /// The data sheet's arm.
    pub nominal: &'a Model,
    /// Starting frames, without disturbances.
    pub frames: &'a Frames,
    /// Priors of links and frames.
    pub tolerance: &'a Tolerance,
}

/// Which parameters a fit frees.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Freedom {
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
    /// The problem, with robust weights.
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
    /// How many witnesses a row is of what the model gets wrong, on average: fewer than one where poses were read again.
    pub witnesses: f64,
    /// Standard deviation of a reading (mm), and of an orientation (rad).
    pub sigma: (f64, f64),
    /// What the solver said, with the covariance of the parameters; without it in the middle of a search.
    pub estimate: Estimate,
}

/// Bend of Huber's weight, in standard deviations.
const BEND: f64 = 2.0;

/// No sensor reads better than this (mm, rad). Fewer rows than parameters fit without any error: what is then held is held
/// by the priors, which must not be lost beside weights without bound.
const FINEST: (f64, f64) = (1e-3, 1e-6);

/// What a search leaves unsolved of a fit, in χ²/2 for each scalar row: what is linear about the fit takes it up, and merits are
/// compared in units of χ².
const SEARCHED: f64 = 1e-5;

/// Scalar rows times squared parameters from which a last word need not be so long.
const MUCH_WORK: f64 = 1e8;

/// What is then left of the cost.
const FINE_ENOUGH: f64 = 1e-8;

/// At most this many rounds of solver and weights.
const ROUNDS: usize = 8;

/// Which knots of a map a row of the data set reaches; all for another effect.
fn reached(subject: &Subject<'_>, effect: &Effect) -> Vec<bool> {
    let Effect::GearMap(map) = effect else { return vec![true; effect.parameters().len()] };
    let mut out = vec![false; map.knots_rad.len()];
    for row in subject.observed.dataset.rows.iter() {
        let knots = map.reached((subject.nominal.joint_map * row.joints)[map.joint]);
        knots.into_iter().for_each(|k| out[k] = true);
    }
    out
}

/// The start of a fit: nominal arm and frames with the causes at size 0, what is free, and the sizes that the causes have. With
/// `seen` a knot that no row reaches is not free: it is where its prior holds it, and changes nothing about the others.
fn start(
    subject: &Subject<'_>,
    causes: &[Cause],
    freedom: Freedom,
    seen: bool,
) -> (Model, Frames, Vec<(Parameter, Option<f64>)>) {
    let (mut model, mut frames) = (subject.nominal.clone(), subject.frames.clone());
    let links = if freedom == Freedom::All { link_parameters(&model) } else { Vec::new() };
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

/// Where a parameter starts: at the size that its cause has, or where links and frames were in another fit.
fn starting((parameter, size): &(Parameter, Option<f64>), near: Option<&Extended>) -> f64 {
    size.unwrap_or_else(|| {
        near.and_then(|e| e.parameters.iter().position(|q| q == parameter).map(|k| e.x[k])).unwrap_or(0.0)
    })
}

/// Scalars of one observation: lengths, angles.
fn components(sensor: Sensor) -> (usize, usize) {
    match sensor {
        Sensor::Cable => (1, 0),
        Sensor::Position => (3, 0),
        Sensor::Pose => (3, 3),
    }
}

/// Median of √(χ²ₖ/k), which turns a median of sizes into a standard deviation.
fn median_size(k: usize) -> f64 {
    match k {
        1 => 0.6745,
        3 => 0.8881,
        _ => 0.9441,
    }
}

/// Fits the nominal arm extended by `causes` robustly, from the sizes that the causes have. `near` gives starting values of
/// links and frames, and of the noise.
pub fn fit(subject: &Subject<'_>, causes: &[Cause], freedom: Freedom, near: Option<&Extended>) -> Extended {
    warm_fit(subject, causes, freedom, near).refine()
}

/// The same for a search: where `near` is near enough for Gauss and Newton, as close to the optimum as they stop, and without a
/// covariance.
pub(super) fn warm_fit(
    subject: &Subject<'_>,
    causes: &[Cause],
    freedom: Freedom,
    near: Option<&Extended>,
) -> Extended {
    let observed = subject.observed;
    let dataset = &observed.dataset;
    let (start_model, start_frames, free) = start(subject, causes, freedom, true);
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
    let plain_task =
        CalibrationProblem::new(dataset, &start_model, &start_frames, &parameters, &priors, &unweighted);
    let (mut model, mut frames) = plain_task.apply(&x);
    let mut nearby = near.is_some() && freedom == Freedom::All;
    loop {
        round += 1;
        let base = rounding::weights(dataset, &model, &frames, &observed.angles, sigma.0, sigma.1);
        let problem = plain_task.reweighted(&with_robust_weights(&base, &robust_weight));
        let gone = Gone::one(&problem, &mut x, nearby, near.is_some());
        nearby = matches!(gone, Gone::Step(_));
        (model, frames) = problem.apply(&x);
        let plain = problem.unweighted_residuals(&x);
        let whitened = Whitened { base: &base, plain: &plain, per, repeated: repeated.as_ref() };
        let of_lengths = whitened.spread(0..lengths);
        let of_angles = if angles > 0 { whitened.spread(lengths..per) } else { 1.0 };
        let sizes = whitened.sizes([lengths, angles], [of_lengths, of_angles]);
        let next: Vec<f64> = sizes.iter().map(|s| (BEND / s).min(1.0)).collect();
        let moved = next.iter().zip(&robust_weight).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let settled = (of_lengths - 1.0).abs() < 1e-2 && (of_angles - 1.0).abs() < 1e-2 && moved < 5e-2;
        if (settled && round > 1) || round >= ROUNDS {
            let spent = gone.spent(&priors);
            let (by_length, length_witnesses) = whitened.deviations(0..lengths, &robust_weight, spent);
            let (by_angle, angle_witnesses) = whitened.deviations(lengths..per, &robust_weight, spent);
            let share = |count: usize| count as f64 / per as f64;
            let witnesses = share(lengths) * length_witnesses + share(angles) * angle_witnesses;
            let weights: Vec<Weight> = base
                .iter()
                .zip(by_length.iter().zip(&by_angle))
                .map(|(w, (length, angle))| Weight {
                    per_mm: (w.per_mm / length).min(FINEST.0.recip()),
                    per_rad: (w.per_rad / angle).min(FINEST.1.recip()),
                })
                .collect();
            let problem = plain_task.reweighted(&with_robust_weights(&weights, &robust_weight));
            let estimate = descended(&problem, &priors, x, nearby);
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
                witnesses,
                sigma,
                estimate,
                problem,
            };
        }
        robust_weight = next;
        sigma = (narrowed(sigma.0, of_lengths, &base, true), narrowed(sigma.1, of_angles, &base, false));
    }
}

/// How a round of a fit went on.
enum Gone {
    /// By a step of Gauss and Newton.
    Step(Step),
    /// By a few of Levenberg and Marquardt, with the covariance there.
    Solved(Option<DMatrix<f64>>),
}

impl Gone {
    /// Goes on by one step where the optimum is nearby and that is taken, else by a few.
    fn one(problem: &CalibrationProblem, x: &mut Vec<f64>, nearby: bool, near: bool) -> Self {
        if nearby && let Some(step) = Step::take(problem, x) {
            return Self::Step(step);
        }
        // Weights still change: what is beyond a few steps would be thrown away.
        let steps = if near { 1 } else { 3 };
        let rough = lm::Options { max_iterations: steps, cost_tolerance: 1e-4, ..lm::Options::default() };
        let estimate = lm::solve(problem, x, &rough);
        x.clone_from(&estimate.x);
        Self::Solved(estimate.covariance)
    }

    /// Degrees of freedom that are used up: each parameter counts by the share that its prior does not determine.
    fn spent(&self, priors: &[Prior]) -> f64 {
        let variances = match self {
            Self::Step(step) => step.variances(),
            Self::Solved(Some(covariance)) => covariance.diagonal().as_slice().to_vec(),
            Self::Solved(None) => Vec::new(),
        };
        priors.iter().zip(&variances).map(|(p, v)| (1.0 - v / p.sigma.powi(2)).clamp(0.0, 1.0)).sum()
    }
}

/// Residuals over what the sensor and the angles promise.
struct Whitened<'a> {
    base: &'a [Weight],
    plain: &'a [f64],
    /// Residuals of a row.
    per: usize,
    /// Which rows are of one pose, where poses were read again.
    repeated: Option<&'a RepeatedPoses>,
}

impl Whitened<'_> {
    /// A residual of a row; nothing where it is no number.
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

    /// How large each row is, lengths and angles over their spreads.
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

    /// What each row deviates by, over what sensor and angles promise, when `spent` parameters are paid for, and how many witnesses
    /// a row is: readings of one pose are fewer than they are many.
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
        let witnesses = counts.iter().sum::<f64>() / n as f64;
        (counts.into_iter().map(|counts| whole / counts.sqrt()).collect(), witnesses)
    }

    /// The scale under which the weighted squares have their degrees of freedom.
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

/// The end of a fit under weights that stay.
fn descended(problem: &CalibrationProblem, priors: &[Prior], mut x: Vec<f64>, nearby: bool) -> Estimate {
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
    if nearby {
        // A promise is held against the cost, half the rows: the same as above.
        let loose = lm::Options { cost_tolerance: 2.0 * SEARCHED, ..lm::Options::default() };
        return Estimate { covariance: None, ..lm::solve(problem, &x, &loose) };
    }
    lm::solve(problem, &x, &lm::Options::default())
}

/// The sensor's σ after the spread of whole residuals turned out `spread` times what σ and the angles' share promised.
fn narrowed(sigma: f64, spread: f64, base: &[Weight], lengths: bool) -> f64 {
    let of = |w: &Weight| if lengths { w.per_mm } else { w.per_rad };
    let total = median(&base.iter().map(|w| 1.0 / of(w).powi(2)).collect::<Vec<_>>()).unwrap_or(1.0);
    let share = (total - sigma * sigma).max(0.0);
    let smallest = if lengths { FINEST.0 } else { FINEST.1 };
    (total * spread * spread - share).max(0.01 * sigma * sigma).sqrt().max(smallest)
}

fn with_robust_weights(weights: &[Weight], robust_weight: &[f64]) -> Vec<Weight> {
    weights
        .iter()
        .zip(robust_weight)
        .map(|(w, t)| Weight { per_mm: w.per_mm * t.sqrt(), per_rad: w.per_rad * t.sqrt() })
        .collect()
}

/// The causes with the values that the fit gave them.
pub(super) fn filled(causes: &[Cause], model: &Model, frames: &Frames) -> Vec<Cause> {
    let first = model.effects.len() - causes.iter().filter(|c| matches!(c, Cause::Arm(_))).count();
    let (mut effect, mut disturbance) = (first, 0);
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
    /// The fit with the solver's last word on it: at the optimum, with a covariance.
    pub(super) fn refine(self) -> Self {
        if self.estimate.covariance.is_some() {
            return self;
        }
        let p = self.parameters.len() as f64;
        let much = self.problem.rows() as f64 * p * p > MUCH_WORK;
        let tolerance = if much { FINE_ENOUGH } else { lm::Options::default().cost_tolerance };
        let options = lm::Options { cost_tolerance: tolerance, ..lm::Options::default() };
        let estimate = lm::solve(&self.problem, &self.x, &options);
        let (model, frames) = self.problem.apply(&estimate.x);
        let causes = filled(&self.causes, &model, &frames);
        Self { causes, x: estimate.x.clone(), model, frames, estimate, ..self }
    }

    /// The same fit with all parameters of its causes, those that no row reaches with what their priors say of them.
    pub(super) fn whole(self, subject: &Subject<'_>) -> Self {
        let (model, frames, free) = start(subject, &self.causes, Freedom::All, false);
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
        let dataset = &subject.observed.dataset;
        let problem = CalibrationProblem::new(dataset, &model, &frames, &parameters, &priors, &weights);
        let estimate = Estimate { x: x.clone(), covariance, ..self.estimate };
        Self { parameters, priors, problem, x, estimate, ..self }
    }

    /// Places in x of the parameters of cause `index`.
    pub fn parameter_indices(&self, index: usize) -> Vec<usize> {
        let arm = matches!(self.causes[index], Cause::Arm(_));
        let before = self.causes[..index].iter().filter(|c| matches!(c, Cause::Arm(_)) == arm).count();
        let own = self.causes.iter().filter(|c| matches!(c, Cause::Arm(_))).count();
        let first = if arm { self.model.effects.len() - own } else { 0 };
        self.parameters
            .iter()
            .enumerate()
            .filter(|(_, p)| match **p {
                Parameter::Effect { index, .. } => arm && index == first + before,
                Parameter::Disturbance { index, .. } => !arm && index == before,
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
