//! Gauss–Newton steps from a nearby start, for fits within a search and refits of folds.
//!
//! **Method.** With N = JᵀWJ + Λ and g = JᵀWr + Λ(x − m), x ← x − t N⁻¹g, t the first of 1, 1/2, 1/4, 1/8 that does not raise
//! the cost. A step is judged by its cost alone, and no covariance is computed: one pass over the rows with derivatives and one
//! without make a step.
//!
//! **Shapes.** x, m and g have p entries, N is p × p; priors are the problem's own.
//!
//! **Stopping rule.** The predicted decrease of χ²/2 is below 10⁻⁷ for each scalar row, for this step or (from the ratio of the last
//! two, at least a twentieth) for all further steps together. Fails if no step length lowers the cost, or after eight steps: the
//! caller then continues with Levenberg–Marquardt.
//!
//! **Source and departures.** Nocedal and Wright, *Numerical Optimization*, 2nd ed., §10.3. Other than
//! [`gauss_newton`](truegrind_estimation::least_squares::gauss_newton) it stops at an absolute predicted decrease: scores of
//! candidates are compared by differences of χ² of about 1, far above it.
//!
//! **Checked against** Levenberg–Marquardt on a fit with effects.

use nalgebra::DMatrix;

use super::algebra::{back_and_forth, factored, solved};
use truegrind_estimation::objective::Objective;
use truegrind_estimation::problem::Problem;

/// Predicted decrease for each scalar row below which a problem counts as solved.
pub(super) const CONVERGED: f64 = 1e-7;

/// Most steps.
const STEPS: usize = 8;

/// Smallest assumed ratio of predicted decreases from step to step: with nonzero residuals, Gauss–Newton converges linearly.
const FASTEST: f64 = 0.05;

/// Largest assumed ratio.
const SLOWEST: f64 = 0.95;

/// Relative increase of the cost that counts as rounding.
const ROUNDING: f64 = 1e-10;

/// Step lengths that are tried, each half of the one before.
const LENGTHS: usize = 4;

/// A step from x, or of length 0 at the optimum.
pub(super) struct Step {
    /// L of N = L Lᵀ before the step.
    lower: DMatrix<f64>,
    /// Decrease of the cost that the full step predicts.
    predicted: f64,
    /// t, or 0 where the predicted decrease is below rounding.
    length: f64,
}

impl Step {
    /// Moves `x`; `None`, with `x` unchanged, where the cost would rise or N is not positive definite.
    pub(super) fn take(problem: &dyn Problem, x: &mut Vec<f64>) -> Option<Self> {
        let mut objective = Objective::new(problem, x, true);
        let normal = objective.normal_equations(x);
        let mut lower = normal.matrix;
        factored(&mut lower).then_some(())?;
        let step = back_and_forth(&lower, &normal.gradient)?;
        let predicted = 0.5 * step.dot(&normal.gradient);
        let mut length = 1.0;
        for _ in 0..LENGTHS {
            let candidate: Vec<f64> = x.iter().zip(step.iter()).map(|(x, s)| x - length * s).collect();
            // Written so that a NaN cost is rejected.
            if objective.cost(&candidate) <= normal.cost * (1.0 + ROUNDING) {
                *x = candidate;
                return Some(Self { lower, predicted, length });
            }
            length *= 0.5;
        }
        (predicted < CONVERGED * problem.rows() as f64).then_some(Self { lower, predicted, length: 0.0 })
    }

    /// Variances of the parameters: the diagonal of N⁻¹.
    pub(super) fn variances(&self) -> Vec<f64> {
        let p = self.lower.nrows();
        solved(&self.lower, DMatrix::identity(p, p)).column_iter().map(|c| c.norm_squared()).collect()
    }
}

/// Moves `x` to the optimum; `false` if it did not converge.
pub fn descend(problem: &dyn Problem, x: &mut Vec<f64>) -> bool {
    descend_to(problem, x, CONVERGED)
}

/// The same to a predicted decrease of `tolerance` for each scalar row.
pub(super) fn descend_to(problem: &dyn Problem, x: &mut Vec<f64>, tolerance: f64) -> bool {
    let enough = tolerance * problem.rows() as f64;
    let mut last = f64::MIN_POSITIVE;
    for _ in 0..STEPS {
        let Some(step) = Step::take(problem, x) else { return false };
        // Ratio for the geometric series of all further predicted decreases.
        let share = if step.length < 1.0 { SLOWEST } else { (step.predicted / last).clamp(FASTEST, SLOWEST) };
        if step.predicted < enough || share / (1.0 - share) * step.predicted < enough {
            return true;
        }
        last = step.predicted;
    }
    false
}
