//! What came out of a method, case by case.

use serde::{Deserialize, Serialize};

use crate::experiment::{Method, Treatment};
use truegrind_calibration::identification::solver::Solver;
use truegrind_estimation::estimate::{Evaluations, Termination};
use truegrind_math::statistics::ErrorSummary;

/// A method over all cases.
#[derive(Debug, Clone)]
pub struct MethodResult {
    /// What the experiment says of it.
    pub method: Method,
    /// The solver.
    pub solver: &'static Solver,
    /// How it was set to work.
    pub treatment: Treatment,
    /// All its settings.
    pub settings: toml::Table,
    /// One outcome for each case, as the experiment limits it.
    pub outcomes: Vec<Outcome>,
    /// The same continued until it has converged, for least-squares methods; counted from where it was stopped.
    pub converged: Option<Vec<Outcome>>,
}

/// One method on one case.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Errors on held-out rows.
    pub held_out: ErrorSummary,
    /// Errors on the rows of the fit.
    pub fitted: ErrorSummary,
    /// How the search ended.
    pub termination: Termination,
    /// Whether the result is none: not finite, or ten times worse than registered frames alone.
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
    /// How far the farthest link parameter went, in manufacturing tolerances.
    pub farthest: f64,
    /// Wall clock, while other threads worked too. Not the same in every run.
    pub seconds: f64,
}

/// A point of a convergence curve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CurvePoint {
    /// Iteration, 0 for the start.
    pub iteration: usize,
    /// Passes over the rows so far, those with derivatives counted too.
    pub passes: f64,
    /// Root of the mean square of the fit's errors (mm), by the fit's weights: of a length, or of the distance between two
    /// positions.
    pub rmse: f64,
}
