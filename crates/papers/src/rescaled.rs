//! A problem with its parameters in other units.
//!
//! Damping that is added to an unscaled JᵀJ depends on the unit of angles: μ = 5 is negligible against the square of some
//! hundred millimetres per radian, but slows every step against the square of some millimetres per degree. The papers
//! state no unit, so both are run.

use std::ops::Range;

use truegrind_estimation::estimate::Estimate;
use truegrind_estimation::problem::{NormalEquations, Prior, Problem};

/// `inner` with parameter k in units of `scale[k]`: x of the inner problem is `scale` · x.
pub struct Rescaled<'a> {
    inner: &'a dyn Problem,
    scale: Vec<f64>,
    priors: Vec<Prior>,
}

impl<'a> Rescaled<'a> {
    /// Scales the parameters of `inner`.
    pub fn new(inner: &'a dyn Problem, scale: Vec<f64>) -> Self {
        let prior = |(p, s): (&Prior, &f64)| Prior { mean: p.mean / s, sigma: p.sigma / s };
        let priors = inner.priors().iter().zip(&scale).map(prior).collect();
        Self { inner, scale, priors }
    }

    fn outside(&self, x: &[f64]) -> Vec<f64> {
        x.iter().zip(&self.scale).map(|(x, s)| x * s).collect()
    }

    /// Converts an estimate of this problem to one of the inner problem.
    pub fn back(&self, mut estimate: Estimate) -> Estimate {
        estimate.x = self.outside(&estimate.x);
        if let Some(covariance) = &mut estimate.covariance {
            for j in 0..covariance.ncols() {
                for i in 0..covariance.nrows() {
                    covariance[(i, j)] *= self.scale[i] * self.scale[j];
                }
            }
        }
        estimate
    }
}

impl Problem for Rescaled<'_> {
    fn parameters(&self) -> usize {
        self.inner.parameters()
    }

    fn rows(&self) -> usize {
        self.inner.rows()
    }

    fn rows_per_observation(&self) -> usize {
        self.inner.rows_per_observation()
    }

    fn priors(&self) -> &[Prior] {
        &self.priors
    }

    fn residuals(&self, x: &[f64], rows: Range<usize>, out: &mut [f64]) {
        self.inner.residuals(&self.outside(x), rows, out);
    }

    fn jacobian(&self, x: &[f64], rows: Range<usize>, residuals: &mut [f64], jacobian: &mut [f64]) {
        let n = rows.len();
        self.inner.jacobian(&self.outside(x), rows, residuals, jacobian);
        for (k, scale) in self.scale.iter().enumerate() {
            jacobian[k * n..(k + 1) * n].iter_mut().for_each(|j| *j *= scale);
        }
    }

    fn row_cost(&self, x: &[f64]) -> f64 {
        self.inner.row_cost(&self.outside(x))
    }

    fn normal_equations(&self, x: &[f64]) -> NormalEquations {
        let mut equations = self.inner.normal_equations(&self.outside(x));
        for (j, by_column) in self.scale.iter().enumerate() {
            equations.gradient[j] *= by_column;
            for (i, by_row) in self.scale.iter().enumerate() {
                equations.matrix[(i, j)] *= by_row * by_column;
            }
        }
        equations
    }
}
