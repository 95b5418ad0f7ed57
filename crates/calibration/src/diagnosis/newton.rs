//! Gauss–Newton from nearby: what a search needs of a fit, and a fold of its refit.
//!
//! **Method.** With N = JᵀWJ + Λ and g = JᵀWr + Λ(x − m), x ← x − t N⁻¹g, t the first of 1, 1/2, 1/4, 1/8 that does not raise
//! the cost. A step is judged by its cost alone, and no covariance is computed: one pass over the rows with derivatives and one
//! without make a step.
//!
//! **Shapes.** x, m and g have p entries, N is p × p; priors are the problem's own.
//!
//! **Stops.** Where a step promises less than 10⁻⁷ for each scalar row, in units of χ²/2, or where the fall from the step before
//! to this one, to a twentieth at most, says so of all that would follow. Not at all where no length lowers the cost, or after eight
//! steps: the caller then goes on with Levenberg and Marquardt.
//!
//! **Source and departures.** Nocedal and Wright, *Numerical Optimization*, 2nd ed., §10.3. Other than
//! [`gauss_newton`](truegrind_estimation::least_squares::gauss_newton) it stops at an absolute promise: scores of candidates are
//! compared by differences of χ² of about 1, and what is left over is far below.
//!
//! **Checked against** Levenberg–Marquardt on a fit with effects.

use nalgebra::DMatrix;

use super::algebra::{back_and_forth, factored, solved};
use truegrind_estimation::objective::Objective;
use truegrind_estimation::problem::Problem;

/// Promise for each scalar row below which a problem counts as solved.
const NEAR: f64 = 1e-7;

/// Most steps.
const STEPS: usize = 8;

/// Promises are not counted on to fall below this share from step to step: with residuals that remain, Gauss and Newton
/// converge linearly.
const STEADY: f64 = 0.05;

/// They are counted on to fall by a twentieth.
const SLOW: f64 = 0.95;

/// A cost may rise by this share, which is rounding.
const ROUNDING: f64 = 1e-10;

/// Lengths that are tried, each half of the one before.
const LENGTHS: usize = 4;

/// A step from x, or the finding that x is where it should be.
pub(super) struct Step {
    /// L of N = L Lᵀ before the step.
    lower: DMatrix<f64>,
    /// Fall of the cost that the whole step promised.
    promise: f64,
    /// t, or 0 where the promise is less than what costs can be told apart by.
    length: f64,
}

impl Step {
    /// Moves `x`; `None` where the cost would rise, or where N is not positive definite: `x` then stays.
    pub(super) fn taken(problem: &dyn Problem, x: &mut Vec<f64>) -> Option<Self> {
        let mut objective = Objective::new(problem, x, true);
        let normal = objective.normal_equations(x);
        let mut lower = normal.matrix;
        factored(&mut lower).then_some(())?;
        let step = back_and_forth(&lower, &normal.gradient)?;
        let promise = 0.5 * step.dot(&normal.gradient);
        let mut length = 1.0;
        for _ in 0..LENGTHS {
            let there: Vec<f64> = x.iter().zip(step.iter()).map(|(x, s)| x - length * s).collect();
            // A cost that is no number is no lower one.
            if objective.cost(&there) <= normal.cost * (1.0 + ROUNDING) {
                *x = there;
                return Some(Self { lower, promise, length });
            }
            length *= 0.5;
        }
        (promise < NEAR * problem.rows() as f64).then_some(Self { lower, promise, length: 0.0 })
    }

    /// Variances of the parameters: the diagonal of N⁻¹.
    pub(super) fn variances(&self) -> Vec<f64> {
        let p = self.lower.nrows();
        solved(&self.lower, DMatrix::identity(p, p)).column_iter().map(|c| c.norm_squared()).collect()
    }
}

/// Moves `x` to the optimum; `false` where that did not come about.
pub fn descend(problem: &dyn Problem, x: &mut Vec<f64>) -> bool {
    descend_to(problem, x, NEAR)
}

/// The same up to a promise of `near` for each scalar row.
pub(super) fn descend_to(problem: &dyn Problem, x: &mut Vec<f64>, near: f64) -> bool {
    let enough = near * problem.rows() as f64;
    let mut last = f64::MIN_POSITIVE;
    for _ in 0..STEPS {
        let Some(step) = Step::taken(problem, x) else { return false };
        // What all further steps would promise, as far as the steps before this one tell.
        let share = if step.length < 1.0 { SLOW } else { (step.promise / last).clamp(STEADY, SLOW) };
        if step.promise < enough || share / (1.0 - share) * step.promise < enough {
            return true;
        }
        last = step.promise;
    }
    false
}
