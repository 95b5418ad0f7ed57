//! Least squares of one linearisation, and Gauss–Newton.
//!
//! **Method.** x ← x − (JᵀJ)⁻¹ Jᵀr (rls-2025 eq. 9; ukf-vslm-2023 eq. 13).
//! - [`Form::AsPrinted`]: one step from the start.
//! - [`Form::Robust`]: repeated, with scaled columns and priors, each step halved until it lowers the cost.
//!
//! **Shapes.** As in [`lm`](crate::least_squares::lm).
//!
//! **Stops.** As printed: after `max_iterations` steps (1), or *Singular* where JᵀJ cannot be inverted. Robust:
//! *Cost*, *Gradient* and *SmallResidual* as in `lm`; *Stalled* where thirty halvings do not help.
//!
//! **Source and departures.** Qiao et al. 2025, eq. 8 and 9 (the printed equations are lost in the text at hand
//! and reconstructed from their definitions); Li et al. 2023, eq. 13. Robust: Nocedal and Wright, *Numerical
//! Optimization*, 2nd ed., §10.3.
//!
//! **Checked against** linear problems (one step is exact) and the published minima that Gauss–Newton can
//! reach.

use crate::estimate::{Estimate, Termination};
use crate::least_squares::damped::{DampedSystem, Linearisation};
use crate::least_squares::search::Point;
use crate::least_squares::{Factorisation, Form};
use crate::objective::Objective;
use crate::problem::Problem;

options! {
    /// Options of [`solve`].
    #[derive(Copy)]
    pub struct Options {
        /// As printed or robust.
        pub form: Form = Form::Robust,
        /// How the step is computed.
        pub factorisation: Factorisation = Factorisation::Cholesky,
        /// Whether the priors of the problem are used.
        pub priors: bool = true,
        /// Step limit.
        pub max_iterations: usize = 50,
        /// Stop when the predicted reduction is below this share of the cost (robust).
        pub cost_tolerance: f64 = 1e-10,
        /// Stop when the largest cosine between residuals and a column of J is below this (robust).
        pub gradient_tolerance: f64 = 1e-12,
        /// Stop when the cost itself is below this (robust).
        pub small_cost: f64 = 1e-20,
        /// Unused: the method is deterministic. Present so that all methods have the same fields.
        pub seed: u64 = 0,
    }
}

impl Options {
    /// One step without priors.
    pub fn as_printed() -> Self {
        Self { form: Form::AsPrinted, priors: false, max_iterations: 1, ..Self::default() }
    }
}

/// Most halvings of one step.
const HALVINGS: usize = 30;

/// Minimises the cost of `problem` from `start`.
///
/// ```
/// use truegrind_estimation::examples::Valley;
/// use truegrind_estimation::least_squares::gauss_newton;
///
/// // From the usual start to the end of the valley.
/// let found = gauss_newton::solve(&Valley, &[-1.2, 1.0], &gauss_newton::Options::default());
/// assert!(found.termination.is_converged(), "{}", found.termination);
/// assert!((found.x[0] - 1.0).abs() < 1e-4 && (found.x[1] - 1.0).abs() < 1e-4);
/// ```
///
/// # Panics
/// If `start` does not have one entry for each parameter.
pub fn solve(problem: &dyn Problem, start: &[f64], options: &Options) -> Estimate {
    let p = start.len();
    let printed = options.form == Form::AsPrinted;
    let mut objective = Objective::new(problem, start, options.priors);
    let (mut here, mut trace) = Point::begin(&mut objective, start, options.factorisation);
    if !here.at.is_finite() {
        return here.finish(&objective, Termination::NotFinite, trace);
    }
    let mut system = if printed { DampedSystem::unscaled(p) } else { DampedSystem::new(p) };
    let mut trial = vec![0.0; p];
    for _ in 0..options.max_iterations {
        let cosine = system.enter(&here.at);
        let cost = here.at.cost();
        let end = here.end(options.small_cost, cosine, Some(options.gradient_tolerance));
        if let Some(end) = end.filter(|_| !printed) {
            return here.finish(&objective, end, trace);
        }
        let Some(predicted) = system.step(&here.at, 0.0, &here.x, &mut trial) else {
            return here.finish(&objective, Termination::Singular, trace);
        };
        if !printed && predicted.reduction <= options.cost_tolerance * cost {
            return here.finish(&objective, Termination::Cost, trace);
        }
        let mut at = Linearisation::at(&mut objective, &trial, options.factorisation);
        let mut length = predicted.step_norm;
        let mut halvings = 0;
        while !(printed || at.is_finite() && at.cost() < cost) {
            halvings += 1;
            if halvings > HALVINGS {
                return here.finish(&objective, Termination::Stalled, trace);
            }
            length *= 0.5;
            trial.iter_mut().zip(&here.x).for_each(|(trial, x)| *trial = x + 0.5 * (*trial - x));
            let new = objective.cost(&trial);
            if new.is_finite() && new < cost {
                at = Linearisation::at(&mut objective, &trial, options.factorisation);
            }
        }
        if !at.is_finite() {
            return here.finish(&objective, Termination::NotFinite, trace);
        }
        here = Point { x: trial.clone(), at };
        trace.push(here.entry(length, None, Some(cosine), &objective));
    }
    let end = if printed { Termination::DataProcessed } else { Termination::IterationLimit };
    here.finish(&objective, end, trace)
}
