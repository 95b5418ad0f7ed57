//! Recursive estimation: one observation at a time, with the parameters as a constant or slowly drifting state.
//!
//! | file | method | rows per observation of m rows, p parameters |
//! |---|---|---|
//! | [`ekf`] | extended Kalman filter | m with derivatives |
//! | [`ukf`] | unscented Kalman filter, scaled; and as ukf-vslm-2023 prints it | (2p + 1)m |
//! | [`ukf_vslm`] | UKF, then variable step-size Levenberg–Marquardt (ukf-vslm-2023, Algorithm 1) | sum of both |
//! | [`pf`] | particle filter | at least one per particle |
//! | [`rls`] | recursive least squares, square-root form (rls-2025 eq. 8 to 14) | m with derivatives, once |
//!
//! A filter predicts the residual of an observation at the current state; the "measured" value is zero. The noise has
//! variance 1, since residuals are divided by their standard deviation. The initial state is the mean of the prior, or
//! `start` for a parameter without a prior; the initial covariance is diagonal, with the priors' variances, or
//! `unknown_sigma²` without a prior.

pub mod ekf;
pub mod ukf;
pub mod ukf_vslm;
pub mod pf;
mod ordered;
pub mod rls;

use nalgebra::{DMatrix, DVector};

use crate::estimate::{Estimate, Iteration, Termination};
use crate::objective::Objective;
use crate::problem::{Problem, prior_cost};

/// Innovation of one observation, before the update.
#[derive(Debug, Clone, PartialEq)]
pub struct Innovation {
    /// Predicted residual, m entries, in standard deviations of the measurement.
    pub residual: DVector<f64>,
    /// Its covariance S, m × m: uncertainty of the state plus noise.
    pub covariance: DMatrix<f64>,
    /// Normalised innovation squared rᵀS⁻¹r: χ² with m degrees of freedom if model and noise are correct.
    pub nis: f64,
}

/// Initial state of a filter: mean and covariance of the priors, or `start` and `unknown_sigma` without a prior.
pub fn prior_state(problem: &dyn Problem, start: &[f64], unknown_sigma: f64) -> (DVector<f64>, DMatrix<f64>) {
    let mut x = DVector::from_column_slice(start);
    let mut variances = DVector::from_element(start.len(), unknown_sigma * unknown_sigma);
    for (k, prior) in problem.priors().iter().enumerate().filter(|(_, prior)| prior.sigma.is_finite()) {
        x[k] = prior.mean;
        variances[k] = prior.sigma * prior.sigma;
    }
    (x, DMatrix::from_diagonal(&variances))
}

/// Sum of the row costs and priors at a filter's state, as an entry of its trace.
fn entry(objective: &mut Objective<'_>, x: &DVector<f64>, step_norm: f64) -> Iteration {
    let cost = objective.cost(x.as_slice());
    let row_cost = Some(cost - prior_cost(objective.priors, x.as_slice()));
    Iteration { cost, row_cost, step_norm, evaluations: objective.evaluations, ..Iteration::default() }
}

/// A finished filter as an estimate. The last entry of the trace holds the cost at `x`.
fn finish(
    objective: &Objective<'_>,
    x: &DVector<f64>,
    covariance: Option<DMatrix<f64>>,
    termination: Termination,
    trace: Vec<Iteration>,
) -> Estimate {
    let cost = trace.last().map_or(f64::NAN, |last| last.cost);
    let covariance = covariance.filter(|c| c.iter().all(|v| v.is_finite()));
    Estimate {
        x: x.as_slice().to_vec(),
        covariance,
        cost,
        evaluations: objective.evaluations,
        termination,
        trace,
    }
}

/// A filter that has processed all data.
fn finish_processed(
    objective: &Objective<'_>,
    x: &DVector<f64>,
    covariance: Option<DMatrix<f64>>,
    trace: Vec<Iteration>,
) -> Estimate {
    let finite = trace.iter().all(|i| i.cost.is_finite());
    let end = if finite { Termination::DataProcessed } else { Termination::NotFinite };
    finish(objective, x, covariance, end, trace)
}

/// Makes a covariance exactly symmetric after a rounded update.
fn symmetrise(matrix: &mut DMatrix<f64>) {
    for j in 0..matrix.ncols() {
        for i in j + 1..matrix.nrows() {
            let mean = 0.5 * (matrix[(i, j)] + matrix[(j, i)]);
            matrix[(i, j)] = mean;
            matrix[(j, i)] = mean;
        }
    }
}
