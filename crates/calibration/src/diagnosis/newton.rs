//! Gauss–Newton steps from a nearby start, for fits within a search and refits of folds.
//!
//! **Method.** With N = JᵀWJ + Λ and g = JᵀWr + Λ(x − m), x ← x − t N⁻¹g, t the first of at most four lengths from 1 down that does
//! not raise the cost. A step is judged by its cost alone, and no covariance is computed: one pass over the rows with derivatives and
//! one without make a step. With many parameters the products of derivatives take most of the time, so N is kept as long as steps
//! contract quickly, and only g is computed anew.
//!
//! **Shapes.** x, m and g have p entries, N is p × p; priors are the problem's own.
//!
//! **Stopping rule.** The predicted decrease of χ²/2 is below 10⁻⁷ for each scalar row, for this step or (from the ratio of the last
//! two, at least a twentieth) for all further steps together. Fails if no step length lowers the cost, or after too many steps: the
//! caller then continues with Levenberg–Marquardt.
//!
//! **Source and departures.** Nocedal and Wright, *Numerical Optimization*, 2nd ed., §10.3. Other than
//! [`gauss_newton`](truegrind_estimation::least_squares::gauss_newton) it stops at an absolute predicted decrease: scores of
//! candidates are compared by differences of χ² of about 1, far above it.
//!
//! **Checked against** Levenberg–Marquardt on a fit with effects.

use nalgebra::{DMatrix, DVector};

use super::algebra::{back_and_forth, factored, solved};
use truegrind_estimation::objective::Objective;
use truegrind_estimation::problem::Problem;

/// Predicted decrease for each scalar row below which a problem counts as solved.
pub(super) const CONVERGED: f64 = 1e-7;

/// Most steps.
const STEPS: usize = 24;

/// Smallest assumed ratio of predicted decreases from step to step: with nonzero residuals, Gauss–Newton converges linearly.
const MIN_DECREASE_RATIO: f64 = 0.05;

/// Largest assumed ratio.
const MAX_DECREASE_RATIO: f64 = 0.95;

/// Relative increase of the cost that counts as rounding.
const ROUNDING: f64 = 1e-10;

/// Step lengths that are tried.
const LENGTHS: usize = 4;

/// Next length after one that raises the cost, as a share of it: where the parabola through what is known has its minimum, in this
/// range.
const SHORTER: (f64, f64) = (0.25, 0.5);

/// From this number of parameters the products of columns take most of a pass, and N is kept for several steps.
const MANY_PARAMETERS: usize = 100;

/// Ratio of predicted decreases up to which N is kept.
const CONTRACTING: f64 = 0.2;

/// A step from x, or none at the optimum.
pub(super) struct Step {
    /// L of N = L Lᵀ before the step.
    lower: DMatrix<f64>,
}

impl Step {
    /// Moves `x`; `None`, with `x` unchanged, where the cost would rise or N is not positive definite.
    pub(super) fn take(problem: &dyn Problem, x: &mut Vec<f64>) -> Option<Self> {
        let mut objective = Objective::new(problem, x, true);
        let here = Quadratic::at(&mut objective, x)?;
        let (direction, predicted) = here.step()?;
        let length = move_down(&mut objective, x, &direction, here.cost, predicted);
        let done = length > 0.0 || predicted < CONVERGED * problem.rows() as f64;
        done.then_some(Self { lower: here.lower })
    }

    /// Variances of the parameters: the diagonal of N⁻¹.
    pub(super) fn variances(&self) -> Vec<f64> {
        let p = self.lower.nrows();
        solved(&self.lower, DMatrix::identity(p, p)).column_iter().map(|c| c.norm_squared()).collect()
    }
}

/// The cost near a point.
struct Quadratic {
    cost: f64,
    gradient: DVector<f64>,
    /// L of N = L Lᵀ, here or at an earlier point.
    lower: DMatrix<f64>,
}

impl Quadratic {
    /// `None` where N is not positive definite.
    fn at(objective: &mut Objective<'_>, x: &[f64]) -> Option<Self> {
        let normal = objective.normal_equations(x);
        let mut lower = normal.matrix;
        factored(&mut lower).then_some(Self { cost: normal.cost, gradient: normal.gradient, lower })
    }

    /// N⁻¹g, and the decrease of the cost that this step predicts.
    fn step(&self) -> Option<(DVector<f64>, f64)> {
        let direction = back_and_forth(&self.lower, &self.gradient)?;
        let predicted = 0.5 * direction.dot(&self.gradient);
        Some((direction, predicted))
    }

    /// Cost and gradient at `x`, with the same N.
    fn follow(&mut self, objective: &mut Objective<'_>, x: &[f64]) {
        (self.cost, self.gradient) = objective.gradient(x);
    }
}

/// Moves `x` along −`direction` to the first length tried that does not raise the cost, and returns that length; 0, with `x` unchanged,
/// if there is none.
fn move_down(
    objective: &mut Objective<'_>,
    x: &mut Vec<f64>,
    direction: &DVector<f64>,
    cost: f64,
    predicted: f64,
) -> f64 {
    let mut length = 1.0;
    for _ in 0..LENGTHS {
        let candidate: Vec<f64> = x.iter().zip(direction.iter()).map(|(x, s)| x - length * s).collect();
        let new = objective.cost(&candidate);
        // Written so that a NaN cost is rejected.
        if new <= cost * (1.0 + ROUNDING) {
            *x = candidate;
            return length;
        }
        // c(t) = c − 2 t · predicted + a t²: the minimum lies at predicted / a.
        let lowest = predicted * length / (new - cost + 2.0 * length * predicted);
        let share = if lowest.is_finite() { lowest.clamp(SHORTER.0, SHORTER.1) } else { SHORTER.0 };
        length *= share;
    }
    0.0
}

/// Moves `x` to the optimum; `false` if it did not converge.
pub fn descend(problem: &dyn Problem, x: &mut Vec<f64>) -> bool {
    descend_to(problem, x, CONVERGED)
}

/// The same to a predicted decrease of `tolerance` for each scalar row.
pub(super) fn descend_to(problem: &dyn Problem, x: &mut Vec<f64>, tolerance: f64) -> bool {
    let enough = tolerance * problem.rows() as f64;
    let mut objective = Objective::new(problem, x, true);
    let Some(mut here) = Quadratic::at(&mut objective, x) else { return false };
    let mut last = f64::MIN_POSITIVE;
    for _ in 0..STEPS {
        let Some((direction, predicted)) = here.step() else { return false };
        let length = move_down(&mut objective, x, &direction, here.cost, predicted);
        if length == 0.0 && predicted >= CONVERGED * problem.rows() as f64 {
            return false;
        }
        // Ratio for the geometric series of all further predicted decreases.
        let share = if length < 1.0 {
            MAX_DECREASE_RATIO
        } else {
            (predicted / last).clamp(MIN_DECREASE_RATIO, MAX_DECREASE_RATIO)
        };
        if predicted < enough || share / (1.0 - share) * predicted < enough {
            return true;
        }
        last = predicted;
        let kept = x.len() >= MANY_PARAMETERS && length == 1.0 && {
            here.follow(&mut objective, x);
            here.step().is_some_and(|(_, next)| next <= CONTRACTING * predicted)
        };
        if !kept {
            let Some(new) = Quadratic::at(&mut objective, x) else { return false };
            here = new;
        }
    }
    false
}
