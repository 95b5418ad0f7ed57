//! By how much a fit understates its uncertainty, as held-out errors show.

use crate::identification::calibration::CalibrationProblem;
use crate::identification::fit::{Fitted, Observations};
use crate::identification::linearised_readings::ROWS;
use crate::identification::rounding;
use crate::measurement::dataset::Dataset;
use truegrind_arm::estimated::StageErrors;
use truegrind_estimation::problem::Problem;

/// Mean square of the held-out residuals, each divided by the σ that the training fit predicts for it, and at least 1.
/// It is 1 where the predicted uncertainty is right, and where the fit predicts none. `None` without held-out rows or
/// finite residuals.
pub fn inflation_from_rows(training: &Fitted, held: &Observations) -> Option<f64> {
    let (Some(covariance), x) = (&training.estimate.covariance, &training.estimate.x) else {
        return Some(1.0);
    };
    if held.dataset.rows.is_empty() {
        return None;
    }
    if x.is_empty() {
        return Some(1.0);
    }
    let subsample = held.subsample();
    let held = subsample.as_ref().unwrap_or(held);
    let (sigma_mm, sigma_rad) = (training.sigma_mm, training.sigma_rad);
    let weights = rounding::weights(
        &held.dataset,
        &training.model,
        &training.frames,
        &held.angles,
        sigma_mm,
        sigma_rad,
    );
    let problem = CalibrationProblem::new(
        &held.dataset,
        training.problem.start(),
        training.problem.starting_frames(),
        &training.parameters,
        &[],
        &weights,
    );
    let (residuals, transposed) = problem.linearise(x);
    let mut sum = 0.0;
    // In pieces: there can be a million rows.
    for from in (0..residuals.len()).step_by(ROWS) {
        let slopes = transposed.columns(from, ROWS.min(residuals.len() - from));
        let known = covariance * slopes;
        for (k, r) in residuals.iter().skip(from).take(slopes.ncols()).enumerate() {
            sum += r * r / (1.0 + slopes.column(k).dot(&known.column(k)).max(0.0));
        }
    }
    at_least_1(sum / residuals.len() as f64)
}

/// Squared held-out error relative to its expectation, and at least 1: with k parameters determined by n readings it is
/// (n + k) / (n − k) times that of the fit. `None` where the errors do not tell.
pub fn inflation_from_errors(fitted: &Fitted, dataset: &Dataset, errors: &StageErrors) -> Option<f64> {
    let per = fitted.problem.rows_per_observation();
    let n = (dataset.rows.len() * per) as f64;
    let shares = fitted.sigmas().into_iter().zip(&fitted.priors);
    let spent: f64 = shares.map(|(s, p)| (1.0 - (s / p.sigma).powi(2)).clamp(0.0, 1.0)).sum();
    let expected = (n + spent) / (n - spent).max(0.05 * n).max(1.0);
    at_least_1((errors.held_out.rmse / errors.fitted.rmse).powi(2) / expected)
}

/// An unknown inflation is not the least one.
fn at_least_1(inflation: f64) -> Option<f64> {
    inflation.is_finite().then(|| inflation.max(1.0))
}
