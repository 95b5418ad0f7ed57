//! Gauss–Newton steps near an optimum: what a search needs of a fit, and a fold of its refit.
//!
//! With N = JᵀWJ + Λ and g = JᵀWr + Λ(x − m), a step is x ← x − t N⁻¹g, t the first of 1, 1/2, 1/4, 1/8 that does not raise the
//! cost. Near an optimum with fixed weights a step leaves little, so that one pass over the rows with derivatives and one
//! without make a step, and no covariance is paid for. Where no step lowers the cost, the caller goes on with Levenberg and
//! Marquardt.

use nalgebra::DMatrix;

use super::algebra::{back_and_forth, factored, solved};
use crate::estimation::problem::{Prior, Problem, prior_cost};

/// A task counts as solved where a step promises less than this for each scalar row, in units of χ²/2: what tells two
/// candidates apart is some thousands of rows times as much.
const NEAR: f64 = 1e-7;

/// Most steps of [`descend`].
const STEPS: usize = 8;

/// A cost may rise by this share, which is rounding.
const ROUNDING: f64 = 1e-10;

/// How often a step that raises the cost is halved.
const HALVINGS: usize = 4;

/// A step that was taken.
pub(super) struct Step {
    /// L of N = L Lᵀ before the step.
    lower: DMatrix<f64>,
    /// Fall of the cost that the whole step promised.
    promise: f64,
    /// t.
    length: f64,
}

impl Step {
    /// Takes a step of `x`; `None` where it would raise the cost, or where N is not positive definite: `x` then stays.
    pub(super) fn taken(task: &dyn Problem, priors: &[Prior], x: &mut Vec<f64>) -> Option<Self> {
        let mut normal = task.normal_equations(x);
        for (k, prior) in priors.iter().enumerate() {
            normal.matrix[(k, k)] += prior.sigma.powi(-2);
            normal.gradient[k] += prior.sigma.powi(-2) * (x[k] - prior.mean);
        }
        let before = normal.cost + prior_cost(priors, x);
        let mut lower = normal.matrix;
        factored(&mut lower).then_some(())?;
        let step = back_and_forth(&lower, &normal.gradient)?;
        let promise = 0.5 * step.dot(&normal.gradient);
        let mut length = 1.0;
        for _ in 0..HALVINGS {
            let there: Vec<f64> = x.iter().zip(step.iter()).map(|(x, s)| x - length * s).collect();
            let after = task.row_cost(&there) + prior_cost(priors, &there);
            // A cost that is no number is no lower one.
            if after <= before * (1.0 + ROUNDING) {
                *x = there;
                return Some(Self { lower, promise, length });
            }
            length *= 0.5;
        }
        // What is promised is less than what the cost can be told by.
        (promise < NEAR * task.rows() as f64).then_some(Self { lower, promise, length: 0.0 })
    }

    /// Parameters that the rows determine, each counted by the share that its prior does not.
    pub(super) fn spent(&self, priors: &[Prior]) -> f64 {
        let p = priors.len();
        let inverse = solved(&self.lower, DMatrix::identity(p, p));
        let known = inverse.column_iter().zip(priors);
        known.map(|(c, prior)| (1.0 - c.norm_squared() / prior.sigma.powi(2)).clamp(0.0, 1.0)).sum()
    }
}

/// Steps until the optimum is reached; `false` where that did not come about.
pub(super) fn descend(task: &dyn Problem, priors: &[Prior], x: &mut Vec<f64>) -> bool {
    let enough = NEAR * task.rows() as f64;
    let mut last = 0.0;
    for _ in 0..STEPS {
        let Some(step) = Step::taken(task, priors, x) else { return false };
        // Whole steps fall by a steady share at worst: the next would promise this.
        let falls = step.length >= 1.0 && step.promise < last;
        if step.promise < enough || (falls && step.promise * step.promise / last < enough) {
            return true;
        }
        last = step.promise;
    }
    false
}
