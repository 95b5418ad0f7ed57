//! A small Levenberg–Marquardt solver for up to a dozen unknowns on a manifold.
//!
//! Stops after 100 steps, when a step gains less than 1e-14 of the cost, or when no damping lowers the cost.

use nalgebra::{DMatrix, DVector};
use truegrind_math::work::checkpoint;

/// Normal equations, accumulated row by row.
#[derive(Debug, Clone)]
pub(super) struct Normal {
    /// JᵀJ.
    pub(super) matrix: DMatrix<f64>,
    /// Jᵀr.
    pub(super) gradient: DVector<f64>,
    /// rᵀr.
    pub(super) cost: f64,
}

impl Normal {
    pub(super) fn new(size: usize) -> Self {
        Self { matrix: DMatrix::zeros(size, size), gradient: DVector::zeros(size), cost: 0.0 }
    }

    /// Adds the row ∂r/∂x with its residual r.
    pub(super) fn add(&mut self, row: &[f64], residual: f64) {
        let columns = self.matrix.as_mut_slice().chunks_exact_mut(row.len());
        for ((column, a), gradient) in columns.zip(row).zip(self.gradient.iter_mut()) {
            if *a != 0.0 {
                column.iter_mut().zip(row).for_each(|(entry, b)| *entry += a * b);
                *gradient += a * residual;
            }
        }
        self.cost += residual * residual;
    }
}

/// Minimises the cost from `start`; `rows` fills the normal equations at a state, `moved` applies a step to a state.
/// Returns the final cost and state.
pub(super) fn fit<S: Clone>(
    start: S,
    size: usize,
    rows: impl Fn(&S, &mut Normal),
    moved: impl Fn(&S, &DVector<f64>) -> S,
) -> (f64, S) {
    let at = |state: &S| {
        checkpoint();
        let mut normal = Normal::new(size);
        rows(state, &mut normal);
        normal
    };
    let mut state = start;
    let mut normal = at(&state);
    let mut damping = 1e-6;
    for _ in 0..100 {
        let mut improved = false;
        while damping < 1e12 {
            let mut matrix = normal.matrix.clone();
            let floor = normal.matrix.diagonal().max() * 1e-12;
            for k in 0..size {
                matrix[(k, k)] += damping * normal.matrix[(k, k)].max(floor);
            }
            let Some(factor) = matrix.cholesky() else {
                damping *= 10.0;
                continue;
            };
            let next = moved(&state, &-factor.solve(&normal.gradient));
            let there = at(&next);
            if there.cost < normal.cost {
                improved = normal.cost - there.cost > 1e-14 * normal.cost;
                (state, normal) = (next, there);
                damping = (damping * 0.1).max(1e-14);
                break;
            }
            damping *= 10.0;
        }
        if !improved {
            break;
        }
    }
    (normal.cost, state)
}
