//! Steps of a fit whose weights still change: the normal matrix of some weights as a metric for the steps under others.
//!
//! With JᵀWJ made once, weights W' that differ little give N = c JᵀWJ + Λ, c the ratio of the sums of the weights, and the
//! step −N⁻¹(Jᵀ W' r + Λx) with the true gradient. It converges to the same point as Newton's, by a factor of the size of
//! the difference for each step, and costs a pass over the rows without their products. Source: the H-algorithm of Huber and
//! Dutter, in Huber, Robust Statistics, 1981, section 7.8. Departure: the matrix is weighted, and made anew where the weights
//! of lengths and angles went apart.

use nalgebra::DMatrix;

use super::algebra::{back_and_forth, factored, solved};
use crate::estimation::problem::{Prior, Problem, prior_cost};
use crate::identification::calibration::{Calibration, Weight};

/// Where weights changed by more than this beside each other, their normal matrix is made anew.
const APART: f64 = 1.25;

/// The normal matrix of some weights, as a metric for the steps under others.
pub(super) struct Metric {
    /// JᵀWJ.
    square: DMatrix<f64>,
    /// Sums of the squared weights of lengths and angles.
    weight: [f64; 2],
    /// L of N.
    lower: DMatrix<f64>,
    /// c of that factor.
    scale: f64,
    /// Fall of the cost that the last step promised.
    pub(super) promise: f64,
}

/// c may change by this share before N is factored anew.
const STALE: f64 = 0.03;

/// Sums of squared weights.
fn weight_of(weights: &[Weight]) -> [f64; 2] {
    weights.iter().fold([0.0; 2], |[a, b], w| [a + w.per_mm * w.per_mm, b + w.per_rad * w.per_rad])
}

impl Metric {
    /// One step of `x` under `weights`; `None` where it would not lower the cost, `x` then stays.
    pub(super) fn step(
        kept: Option<Self>,
        task: &Calibration,
        weights: &[Weight],
        angles: bool,
        priors: &[Prior],
        x: &mut Vec<f64>,
    ) -> Option<Self> {
        let weight = weight_of(weights);
        let grown = |m: &Self| {
            let lengths = weight[0] / m.weight[0];
            [lengths, if angles { weight[1] / m.weight[1] } else { lengths }]
        };
        let fits = |m: &Self| {
            let [a, b] = grown(m);
            m.square.nrows() == x.len() && a / b < APART && b / a < APART
        };
        let (mut metric, mut gradient) = match kept.filter(fits) {
            Some(metric) => (metric, task.gradient(x)),
            None => {
                let made = task.normal_equations(x);
                let lower = DMatrix::zeros(0, 0);
                (Self { square: made.matrix, weight, lower, scale: 0.0, promise: 0.0 }, made.gradient)
            }
        };
        let [a, b] = grown(&metric);
        for (k, prior) in priors.iter().enumerate() {
            gradient[k] += prior.sigma.powi(-2) * (x[k] - prior.mean);
        }
        let scale = (a * b).sqrt();
        if !((scale / metric.scale - 1.0).abs() < STALE) {
            metric.lower = &metric.square * scale;
            for (k, prior) in priors.iter().enumerate() {
                metric.lower[(k, k)] += prior.sigma.powi(-2);
            }
            factored(&mut metric.lower).then_some(())?;
            metric.scale = scale;
        }
        let step = back_and_forth(&metric.lower, &gradient)?;
        metric.promise = 0.5 * step.dot(&gradient);
        let there: Vec<f64> = x.iter().zip(step.iter()).map(|(x, s)| x - s).collect();
        let cost = |x: &[f64]| task.row_cost(x) + prior_cost(priors, x);
        // A cost that is no number is no lower one.
        (cost(&there) <= cost(x) * (1.0 + 1e-9)).then(|| {
            *x = there;
            metric
        })
    }

    /// Parameters that the rows determine, each counted by the share that its prior does not.
    pub(super) fn spent(&self, priors: &[Prior]) -> f64 {
        let p = priors.len();
        let inverse = solved(&self.lower, DMatrix::identity(p, p));
        let known = inverse.column_iter().zip(priors);
        known.map(|(c, prior)| (1.0 - c.norm_squared() / prior.sigma.powi(2)).clamp(0.0, 1.0)).sum()
    }
}
