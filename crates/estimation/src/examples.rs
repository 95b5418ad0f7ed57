//! Two problems for the examples of the solvers.

use std::ops::Range;

use crate::problem::{Prior, Problem};

/// Rosenbrock's valley: 10 (y − x²) and 1 − x, which vanish at (1, 1). Its usual start is (−1.2, 1).
#[derive(Debug)]
pub struct Valley;

impl Problem for Valley {
    fn parameters(&self) -> usize {
        2
    }

    fn rows(&self) -> usize {
        2
    }

    fn residuals(&self, x: &[f64], rows: Range<usize>, out: &mut [f64]) {
        out.copy_from_slice(&[10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]][rows]);
    }

    fn jacobian(&self, x: &[f64], rows: Range<usize>, residuals: &mut [f64], jacobian: &mut [f64]) {
        self.residuals(x, rows.clone(), residuals);
        let columns = jacobian.chunks_mut(rows.len()).zip([[-20.0 * x[0], -1.0], [10.0, 0.0]]);
        columns.for_each(|(column, whole)| column.copy_from_slice(&whole[rows.clone()]));
    }
}

/// A straight line a + b t, read at t = 0 to 5 with σ = 0.02, near (1.50, 0.20); priors of σ = 5.
#[derive(Debug)]
pub struct Line;

impl Line {
    const READ: [f64; 6] = [1.52, 1.69, 1.91, 2.08, 2.33, 2.49];
    const SIGMA: f64 = 0.02;
}

impl Problem for Line {
    fn parameters(&self) -> usize {
        2
    }

    fn rows(&self) -> usize {
        Self::READ.len()
    }

    fn residuals(&self, x: &[f64], rows: Range<usize>, out: &mut [f64]) {
        for (out, t) in out.iter_mut().zip(rows) {
            *out = (x[0] + x[1] * t as f64 - Self::READ[t]) / Self::SIGMA;
        }
    }

    fn jacobian(&self, x: &[f64], rows: Range<usize>, residuals: &mut [f64], jacobian: &mut [f64]) {
        self.residuals(x, rows.clone(), residuals);
        let (offset, slope) = jacobian.split_at_mut(rows.len());
        offset.fill(1.0 / Self::SIGMA);
        slope.iter_mut().zip(rows).for_each(|(slope, t)| *slope = t as f64 / Self::SIGMA);
    }

    fn priors(&self) -> &[Prior] {
        &[Prior { mean: 0.0, sigma: 5.0 }; 2]
    }
}
