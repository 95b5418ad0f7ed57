//! A problem with its priors and a count of evaluated rows, used by every solver.

use std::ops::Range;

use nalgebra::DVector;

use crate::estimate::Evaluations;
use crate::problem::{NormalEquations, Prior, Problem, add_prior_gradient, prior_cost};

/// A problem with its priors, counting what is evaluated.
pub struct Objective<'a> {
    /// The rows.
    pub problem: &'a dyn Problem,
    /// Priors of the parameters; none for a method without priors.
    pub priors: &'a [Prior],
    /// Rows evaluated so far.
    pub evaluations: Evaluations,
}

impl<'a> Objective<'a> {
    /// Starts with a count of zero.
    ///
    /// # Panics
    /// If `start` does not have one entry for each parameter: a programming error.
    pub fn new(problem: &'a dyn Problem, start: &[f64], with_priors: bool) -> Self {
        assert_eq!(start.len(), problem.parameters(), "the start must have one entry for each parameter");
        let priors = if with_priors { problem.priors() } else { &[] };
        Self { problem, priors, evaluations: Evaluations::default() }
    }

    /// Cost with priors: one pass of residuals.
    pub fn cost(&mut self, x: &[f64]) -> f64 {
        self.evaluations.residuals += self.problem.rows() as u64;
        self.problem.row_cost(x) + prior_cost(self.priors, x)
    }

    /// Normal equations with priors (lower triangle): one pass of Jacobians.
    pub fn normal_equations(&mut self, x: &[f64]) -> NormalEquations {
        self.evaluations.jacobians += self.problem.rows() as u64;
        let mut equations = self.problem.normal_equations(x);
        equations.add_priors(self.priors, x);
        equations
    }

    /// Cost and gradient with priors: one pass of Jacobians without their products.
    pub fn gradient(&mut self, x: &[f64]) -> (f64, DVector<f64>) {
        self.evaluations.jacobians += self.problem.rows() as u64;
        let (cost, mut gradient) = self.problem.gradient(x);
        add_prior_gradient(self.priors, x, &mut gradient);
        (cost + prior_cost(self.priors, x), gradient)
    }

    /// Residuals and derivatives (column-major) of a block of rows.
    pub fn jacobian(&mut self, x: &[f64], rows: Range<usize>, residuals: &mut [f64], jacobian: &mut [f64]) {
        self.evaluations.jacobians += rows.len() as u64;
        self.problem.jacobian(x, rows, residuals, jacobian);
    }

    /// Residuals of a block of rows.
    pub fn residuals(&mut self, x: &[f64], rows: Range<usize>, out: &mut [f64]) {
        self.evaluations.residuals += rows.len() as u64;
        self.problem.residuals(x, rows, out);
    }
}

/// Whether cost and derivatives are finite.
pub fn is_finite(equations: &NormalEquations) -> bool {
    equations.cost.is_finite() && equations.gradient.iter().all(|g| g.is_finite()) && {
        let a = &equations.matrix;
        (0..a.ncols()).all(|j| (j..a.nrows()).all(|i| a[(i, j)].is_finite()))
    }
}
