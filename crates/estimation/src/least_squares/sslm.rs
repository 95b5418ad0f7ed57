//! Levenberg–Marquardt with a step size found by search (SSLM).
//!
//! **Method.** x ← x − δ (JᵀJ + λI)⁻¹ Jᵀr with a step size δ that is adjusted during the search.
//! - [`Form::AsPrinted`]: δ decays once for each iteration, δ₀ = 0.8, factor 0.95 (ukf-vslm-2023 eq. 15).
//! - [`Form::Robust`]: small fixed damping of scaled columns; δ minimises the parabola through the cost at 0,
//!   its slope there and the cost at 1, safeguarded to [0.1, 0.5] at each further trial until the cost falls
//!   enough (Armijo).
//!
//! **Shapes.** As in [`lm`](crate::least_squares::lm).
//!
//! **Stops.** As `lm`; *Stalled* where no step size along the direction lowers the cost.
//!
//! **Source and departures.** ltlm-2024, Table 5, M6: "a dynamic adjustment mechanism for the algorithm's step
//! size", without an equation; its reference is ukf-vslm-2023, whose eq. 15 is therefore taken as the printed
//! form (the same recurrence as [`vslm`] with decay per iteration). The exact form of M6 is not known. Robust:
//! Nocedal and Wright, *Numerical Optimization*, 2nd ed., §3.5.
//!
//! **Checked against** published minima.

use crate::estimate::{Estimate, Termination};
use crate::least_squares::damped::{DampedSystem, Linearisation};
use crate::least_squares::search::Point;
use crate::least_squares::{Factorisation, Form, vslm};
use crate::objective::Objective;
use crate::problem::Problem;

options! {
    /// Options of [`solve`].
    #[derive(Copy)]
    pub struct Options {
        /// As printed or robust.
        pub form: Form = Form::Robust,
        /// λ of the printed form.
        pub lambda: f64 = 5.0,
        /// δ₀ of the printed form.
        pub step_size: f64 = 0.8,
        /// Decay factor of δ in the printed form.
        pub decay_factor: f64 = 0.95,
        /// Damping of the robust form, a pure number.
        pub damping: f64 = 1e-6,
        /// How the robust form computes its direction.
        pub factorisation: Factorisation = Factorisation::Cholesky,
        /// Whether the priors of the problem are used.
        pub priors: bool = true,
        /// Iteration limit.
        pub max_iterations: usize = 200,
        /// Stop when the predicted reduction (as printed: the relative change) is below this share of the cost.
        pub cost_tolerance: f64 = 1e-10,
        /// Stop when the largest cosine between residuals and a column of J is below this (robust).
        pub gradient_tolerance: f64 = 1e-12,
        /// Stop when the cost itself is below this.
        pub small_cost: f64 = 1e-20,
        /// Unused: the method is deterministic. Present so that all methods have the same fields.
        pub seed: u64 = 0,
    }
}

impl Options {
    /// Equation 15 with its constants, 60 iterations, no priors.
    pub fn as_printed() -> Self {
        Self { form: Form::AsPrinted, priors: false, max_iterations: 60, ..Self::default() }
    }
}

/// Share of the predicted reduction that a step must achieve (Armijo).
const SUFFICIENT: f64 = 1e-4;

/// Most trial step sizes along one direction.
const TRIALS: usize = 20;

/// Minimises the cost of `problem` from `start`.
///
/// ```
/// use truegrind_estimation::examples::Valley;
/// use truegrind_estimation::least_squares::sslm;
///
/// // From the usual start to the end of the valley.
/// let found = sslm::solve(&Valley, &[-1.2, 1.0], &sslm::Options::default());
/// assert!(found.termination.is_converged(), "{}", found.termination);
/// assert!((found.x[0] - 1.0).abs() < 1e-4 && (found.x[1] - 1.0).abs() < 1e-4);
/// ```
///
/// # Panics
/// If `start` does not have one entry for each parameter.
pub fn solve(problem: &dyn Problem, start: &[f64], options: &Options) -> Estimate {
    if options.form == Form::AsPrinted {
        let printed = vslm::Options {
            form: Form::AsPrinted,
            decay: vslm::Decay::PerIteration,
            lambda: options.lambda,
            step_size: options.step_size,
            decay_factor: options.decay_factor,
            factorisation: options.factorisation,
            priors: options.priors,
            max_iterations: options.max_iterations,
            cost_tolerance: options.cost_tolerance,
            small_cost: options.small_cost,
            ..vslm::Options::default()
        };
        return vslm::solve(problem, start, &printed);
    }
    let p = start.len();
    let mut objective = Objective::new(problem, start, options.priors);
    let (mut here, mut trace) = Point::begin(&mut objective, start, options.factorisation);
    if !here.at.is_finite() {
        return here.finish(&objective, Termination::NotFinite, trace);
    }
    let mut system = DampedSystem::new(p);
    let (mut full, mut trial) = (vec![0.0; p], vec![0.0; p]);
    for _ in 0..options.max_iterations {
        let cosine = system.enter(&here.at);
        let cost = here.at.cost();
        if let Some(end) = here.end(options.small_cost, cosine, Some(options.gradient_tolerance)) {
            return here.finish(&objective, end, trace);
        }
        let Some(predicted) = system.step(&here.at, options.damping, &here.x, &mut full) else {
            return here.finish(&objective, Termination::Singular, trace);
        };
        if predicted.reduction <= options.cost_tolerance * cost {
            return here.finish(&objective, Termination::Cost, trace);
        }
        // With little damping the slope along the step is −2 × the predicted reduction.
        let slope = -2.0 * predicted.reduction;
        let mut delta = 1.0;
        let mut trials = 0;
        let at = loop {
            trial.iter_mut().zip(&here.x).zip(&full).for_each(|((t, x), full)| *t = x + delta * (full - x));
            let enough = cost + SUFFICIENT * delta * slope;
            let new = if trials == 0 {
                let at = Linearisation::at(&mut objective, &trial, options.factorisation);
                if at.is_finite() && at.cost() <= enough {
                    break at;
                }
                at.cost()
            } else {
                let new = objective.cost(&trial);
                if new <= enough {
                    let at = Linearisation::at(&mut objective, &trial, options.factorisation);
                    if at.is_finite() {
                        break at;
                    }
                }
                new
            };
            trials += 1;
            if trials == TRIALS {
                return here.finish(&objective, Termination::Stalled, trace);
            }
            let parabola = -slope * delta * delta / (2.0 * (new - cost - slope * delta));
            delta = if parabola.is_finite() { parabola.clamp(0.1 * delta, 0.5 * delta) } else { 0.1 * delta };
        };
        here.at = at;
        std::mem::swap(&mut here.x, &mut trial);
        trace.push(here.entry(delta * predicted.step_norm, Some(delta), Some(cosine), &objective));
    }
    here.finish(&objective, Termination::IterationLimit, trace)
}
