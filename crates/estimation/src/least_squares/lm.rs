//! Levenberg–Marquardt.
//!
//! **Method.** x ← x − (JᵀJ + μI)⁻¹ Jᵀr (ltlm-2024 eq. 10).
//! - [`Form::AsPrinted`]: μ fixed (5 in the paper), parameters unscaled, every step taken.
//! - [`Form::Robust`]: the same step in parameters scaled by the largest column norms of J met so far, so that μ
//!   is a pure number; μ follows the gain ratio ϱ = (actual reduction) / (predicted reduction) after Nielsen. A step is
//!   accepted if it lowers the cost. An accepted step costs one pass over the rows, which computes cost and normal
//!   equations together; after a refused step the next trial is first tested by its cost alone. A first step that does not
//!   lower the cost is followed by a second one from where it ended: in a curved valley the first leaves the floor by the
//!   second order of its length, and the second returns to it.
//!
//! A problem with very many observations and a prior for every parameter is first solved on a random eighth of them,
//! thinned repeatedly while they are many, if the first step on all rows predicts a reduction above a tenth of the cost. A
//! pass over few rows is cheap, and its optimum is close to that of all rows. This also helps in a curved valley: many rows
//! make the directions that they determine so stiff that steps along directions determined by priors only (an outlet and
//! the base rotating together) leave the valley floor and are refused; few rows keep the valley wide. For the same reason μ
//! then starts near zero: even light damping relative to the information of many rows is strong relative to a prior, and
//! would stop the search far along the valley. All convergence tests use all rows.
//!
//! **Shapes.** x has p entries, J is n × p and is never stored: a pass over the rows gives the normal equations (p × p)
//! or, with [`Factorisation::Qr`], the triangular factor of J. Priors are additional rows.
//!
//! **Stops** (robust). *Cost*: the undamped model predicts a reduction below `cost_tolerance` · cost. *Gradient*: no
//! column of J has a cosine above `gradient_tolerance` with r. *Step*: ‖D h‖ below `step_tolerance` · ‖D x‖.
//! *SmallResidual*: cost below `small_cost`. As printed: relative change of cost or of x below tolerance, or
//! the iteration limit ("the desired accuracy or the maximum number of iterations"); neither number is stated
//! in the paper.
//!
//! **Source and departures.** Liu et al. 2024, eq. 10 (as printed). Its μ = 5 has no unit: it is negligible against JᵀJ of
//! parameters in radians, but slows every step against some hundred rows of millimetres per degree. Damping slows the
//! search; it is no prior. Eq. 8's 1/n does not change the step and is omitted. Robust: Moré, "The
//! Levenberg–Marquardt algorithm" (1978) for the scaling, Madsen, Nielsen, Tingleff, *Methods for non-linear
//! least squares problems* (2004), algorithm 3.16, for μ. Departures from the latter: μ starts near zero
//! (`initial_damping`), since priors regularise here; a step with less damping than 10⁻³ must achieve a quarter of its
//! predicted reduction, and a refusal raises μ to at least 10⁻³ at once; an almost perfect gain ratio divides μ by ten,
//! not by three; μ does not fall back below what was just refused; the corrective step (Nocedal and Wright, *Numerical
//! Optimization*, 2nd ed., §15.6: second-order correction); the start on few rows.
//!
//! **Checked against** the Moré–Garbow–Hillstrom problems and NIST StRD certified values, Cholesky against QR.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::estimate::{Estimate, Termination};
use crate::least_squares::damped::{DampedSystem, Linearisation, PredictedReduction};
use crate::least_squares::search::{DAMPING_RANGE, Damping, Point, Search, converged};
use crate::least_squares::{Factorisation, Form};
use crate::objective::Objective;
use crate::problem::Problem;

options! {
    /// Options of [`solve`]. The comments state which form uses a field if only one does.
    #[derive(Copy)]
    pub struct Options {
        /// As printed or robust.
        pub form: Form = Form::Robust,
        /// How the step is computed.
        pub factorisation: Factorisation = Factorisation::Cholesky,
        /// μ of the printed form, in the square of residual per parameter unit; 5 in the paper.
        pub mu: f64 = 5.0,
        /// First μ of the robust form, a pure number: relative to a unit diagonal.
        pub initial_damping: f64 = 1e-6,
        /// Whether the priors of the problem are used. The paper has none.
        pub priors: bool = true,
        /// Limit of trial steps.
        pub max_iterations: usize = 200,
        /// Stop when the predicted reduction is below this share of the cost.
        pub cost_tolerance: f64 = 1e-10,
        /// Stop when the largest cosine between residuals and a column of J is below this (robust).
        pub gradient_tolerance: f64 = 1e-12,
        /// Stop when the step is below this share of the parameters.
        pub step_tolerance: f64 = 1e-14,
        /// Stop when the cost itself is below this. Residuals are in units of their σ, so this is an absolute value.
        pub small_cost: f64 = 1e-20,
        /// Seed for the choice of observations on which a large problem is first solved; unused otherwise.
        pub seed: u64 = 0,
    }
}

impl Options {
    /// The paper's setting: μ = 5, unscaled, no prior.
    pub fn as_printed() -> Self {
        Self { form: Form::AsPrinted, priors: false, ..Self::default() }
    }
}

/// Minimises the cost of `problem` from `start`.
///
/// ```
/// use truegrind_estimation::estimate::Termination;
/// use truegrind_estimation::examples::Valley;
/// use truegrind_estimation::least_squares::lm;
///
/// // From the usual start to the end of the valley.
/// let found = lm::solve(&Valley, &[-1.2, 1.0], &lm::Options::default());
/// assert!((found.x[0] - 1.0).abs() < 1e-6 && (found.x[1] - 1.0).abs() < 1e-6);
/// // The termination shows the iteration limit, and a start that is not finite.
/// let short = lm::solve(&Valley, &[-1.2, 1.0], &lm::Options { max_iterations: 2, ..lm::Options::default() });
/// assert_eq!(short.termination, Termination::IterationLimit);
/// let lost = lm::solve(&Valley, &[f64::NAN, 1.0], &lm::Options::default());
/// assert!(lost.termination.is_failure() && lost.covariance.is_none());
/// ```
///
/// # Panics
/// If `start` does not have one entry for each parameter.
pub fn solve(problem: &dyn Problem, start: &[f64], options: &Options) -> Estimate {
    let mut objective = Objective::new(problem, start, options.priors);
    match options.form {
        Form::AsPrinted => fixed_damping(&mut objective, start, options),
        Form::Robust => gain_ratio(&mut objective, start, options),
    }
}

/// If the first step predicts a reduction above this share of the cost, the search starts on few rows.
const FAR: f64 = 0.1;

/// Fewest observations per parameter in a thinned problem.
const FEW_PER_PARAMETER: usize = 150;

/// One out of this number of observations is used; the subset can be thinned again.
const ONE_OF: usize = 8;

/// The optimum of a subset of the observations: a random one from each of equally long sections, so that the subset has no
/// period of the record.
fn on_few_rows(objective: &mut Objective<'_>, start: &[f64], options: &Options) -> Option<Vec<f64>> {
    // Without priors the optimum of few rows can be far away in directions that they hardly determine.
    let held = objective.priors.len() == start.len() && objective.priors.iter().all(|p| p.sigma.is_finite());
    if !held {
        return None;
    }
    let problem = objective.problem;
    let all = problem.rows() / problem.rows_per_observation().max(1);
    let few = all / ONE_OF;
    if few < FEW_PER_PARAMETER * start.len().max(1) {
        return None;
    }
    let mut random = ChaCha8Rng::seed_from_u64(options.seed);
    let part = |k: usize| k * all / few;
    let chosen: Vec<usize> = (0..few).map(|k| random.random_range(part(k)..part(k + 1))).collect();
    let thinned = problem.subsample(&chosen)?;
    // Damping is relative to the information of the rows. It must not exceed that of the priors.
    let options = Options { initial_damping: DAMPING_RANGE.0, ..*options };
    let found = solve(thinned.as_ref(), start, &options);
    objective.evaluations.residuals += found.evaluations.residuals;
    objective.evaluations.jacobians += found.evaluations.jacobians;
    found.x.iter().all(|x| x.is_finite()).then_some(found.x)
}

fn gain_ratio(objective: &mut Objective<'_>, start: &[f64], options: &Options) -> Estimate {
    let p = start.len();
    let (mut here, mut trace) = Point::begin(objective, start, options.factorisation);
    if !here.at.is_finite() {
        return here.finish(objective, Termination::NotFinite, trace);
    }
    let mut system = DampedSystem::new(p);
    let mut damping = Damping::new(options.initial_damping);
    let mut trial = vec![0.0; p];
    let mut cosine = system.enter(&here.at);
    trace[0].gradient_norm = Some(cosine);
    if let Some(predicted) = system.step(&here.at, damping.mu, &here.x, &mut trial)
        && predicted.reduction > FAR * here.at.cost()
        && let Some(x) = on_few_rows(objective, &here.x, options)
    {
        damping = Damping::new(DAMPING_RANGE.0);
        let at = Linearisation::at(objective, &x, options.factorisation);
        if at.is_finite() && at.cost() < here.at.cost() {
            here = Point { x, at };
            cosine = system.enter(&here.at);
            trace.push(here.entry(0.0, None, Some(cosine), objective));
        }
    }
    for _ in 0..options.max_iterations {
        if let Some(end) = here.end(options.small_cost, cosine, Some(options.gradient_tolerance)) {
            return here.finish(objective, end, trace);
        }
        let Some(predicted) = system.step(&here.at, damping.mu, &here.x, &mut trial) else {
            damping.refuse();
            if damping.is_exhausted() {
                return here.finish(objective, Termination::Singular, trace);
            }
            continue;
        };
        let search = Search {
            damping,
            cosine,
            cost_tolerance: options.cost_tolerance,
            step_tolerance: options.step_tolerance,
        };
        if let Some(end) = converged(&mut system, &here, &predicted, &search) {
            return here.finish(objective, end, trace);
        }
        let reached = attempt(objective, &mut system, &damping, &here, &predicted, &mut trial, options);
        if let Some((at, gain)) = reached {
            damping.accept(gain);
            here.at = at;
            std::mem::swap(&mut here.x, &mut trial);
            cosine = system.enter(&here.at);
            trace.push(here.entry(predicted.step_norm, Some(damping.mu), Some(cosine), objective));
            continue;
        }
        trace.push(here.entry(0.0, Some(damping.mu), Some(cosine), objective));
        damping.refuse();
        if damping.is_exhausted() {
            return here.finish(objective, Termination::Stalled, trace);
        }
    }
    here.finish(objective, Termination::IterationLimit, trace)
}

/// The problem linearised at `trial` and the gain ratio there, if that is acceptable. A first trial that is not is corrected by a
/// second step from where it ended.
fn attempt(
    objective: &mut Objective<'_>,
    system: &mut DampedSystem,
    damping: &Damping,
    here: &Point,
    predicted: &PredictedReduction,
    trial: &mut [f64],
    options: &Options,
) -> Option<(Linearisation, f64)> {
    let gain = |cost: f64| (here.at.cost() - cost) / predicted.reduction;
    // After a refusal only the cost is evaluated first: it is several times cheaper than the derivatives.
    if damping.refusals > 0 && !damping.is_acceptable(gain(objective.cost(trial))) {
        return None;
    }
    let mut at = Linearisation::at(objective, trial, options.factorisation);
    if at.is_finite() && !damping.is_acceptable(gain(at.cost())) {
        let corrected = system.correct(&at, damping.mu, trial);
        if !corrected || !damping.is_acceptable(gain(objective.cost(trial))) {
            return None;
        }
        at = Linearisation::at(objective, trial, options.factorisation);
    }
    let gain = gain(at.cost());
    (at.is_finite() && damping.is_acceptable(gain)).then_some((at, gain))
}

fn fixed_damping(objective: &mut Objective<'_>, start: &[f64], options: &Options) -> Estimate {
    let p = start.len();
    let (mut here, mut trace) = Point::begin(objective, start, options.factorisation);
    if !here.at.is_finite() {
        return here.finish(objective, Termination::NotFinite, trace);
    }
    let mut system = DampedSystem::unscaled(p);
    let mut trial = vec![0.0; p];
    for _ in 0..options.max_iterations {
        let cosine = system.enter(&here.at);
        if let Some(end) = here.end(options.small_cost, cosine, None) {
            return here.finish(objective, end, trace);
        }
        let Some(predicted) = system.step(&here.at, options.mu, &here.x, &mut trial) else {
            return here.finish(objective, Termination::Singular, trace);
        };
        let at = Linearisation::at(objective, &trial, options.factorisation);
        if !at.is_finite() {
            return here.finish(objective, Termination::NotFinite, trace);
        }
        let (before, after) = (here.at.cost(), at.cost());
        let size = system.scaled_norm(&here.x);
        here = Point { x: trial.clone(), at };
        trace.push(here.entry(predicted.step_norm, Some(options.mu), Some(cosine), objective));
        if (before - after).abs() <= options.cost_tolerance * before {
            return here.finish(objective, Termination::Cost, trace);
        }
        if predicted.step_norm <= options.step_tolerance * (size + options.step_tolerance) {
            return here.finish(objective, Termination::Step, trace);
        }
    }
    here.finish(objective, Termination::IterationLimit, trace)
}
