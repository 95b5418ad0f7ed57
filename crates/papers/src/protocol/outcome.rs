//! Results of a method, case by case.

use serde::{Deserialize, Serialize};

use crate::experiment::{Method, Treatment};
use truegrind_calibration::identification::solver::Solver;
use truegrind_estimation::estimate::{Evaluations, Termination};
use truegrind_math::statistics::ErrorSummary;

/// A method over all cases.
#[derive(Debug, Clone)]
pub struct MethodResult {
    /// The method as stated in the experiment.
    pub method: Method,
    /// The solver.
    pub solver: &'static Solver,
    /// Treatment.
    pub treatment: Treatment,
    /// All its settings.
    pub settings: toml::Table,
    /// One outcome for each case, under the experiment's limits.
    pub outcomes: Vec<Outcome>,
    /// The same continued to convergence, for least-squares methods; counts start at the limited result.
    pub converged: Option<Vec<Outcome>>,
}

/// One method on one case.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Errors on held-out rows.
    pub held_out: ErrorSummary,
    /// Errors on the rows of the fit.
    pub fitted: ErrorSummary,
    /// Termination of the search.
    pub termination: Termination,
    /// Whether the method diverged: not finite, or ten times worse than registered frames alone.
    pub diverged: bool,
    /// Rows evaluated.
    pub evaluations: Evaluations,
    /// Iterations: steps, sweeps or generations.
    pub iterations: usize,
    /// Cost over the iterations.
    pub curve: Vec<CurvePoint>,
    /// Signed errors on held-out rows (mm).
    pub errors_mm: Vec<f64>,
    /// Deviations of the parameters from their start.
    pub x: Vec<f64>,
    /// Largest deviation of a link parameter, in manufacturing tolerances.
    pub farthest: f64,
    /// Wall-clock time while other threads were running (s). Differs between runs.
    pub seconds: f64,
}

/// A point of a convergence curve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CurvePoint {
    /// Iteration, 0 for the start.
    pub iteration: usize,
    /// Passes over the rows so far, including those with derivatives.
    pub passes: f64,
    /// Root mean square error of the fit (mm), with the fit's weights: of a length, or of the distance between two
    /// positions.
    pub rmse: f64,
}
