//! Unscented Kalman filter, then variable step-size Levenberg–Marquardt (UKF-VSLM).
//!
//! **Method** (ukf-vslm-2023, Algorithm 1). The filter makes T₃ sweeps over the data; its result is the start of T₉
//! iterations of eq. 15.
//! - [`Form::AsPrinted`]: both parts to the letter (see [`ukf`] and [`vslm`]), with line 17, X₀ = x_ukf, inside the
//!   loop: each iteration restarts from the filter's result and discards the previous one, while the step size decays.
//!   The final result is one sweep of tiny steps from the filter's result.
//! - [`Form::Robust`]: one sweep of the scaled filter with Q and R, then the robust step-size method until it
//!   converges.
//!
//! **Shapes, stops.** Those of the two parts; the termination is that of the second, or of the first if it failed.
//!
//! **Source and departures.** Li et al. 2023, Algorithm 1. T₃ and T₉ are not stated; Table IX's two iterations
//! of M9 are taken for both.
//!
//! **Checked against** the two parts, and batch least squares for the robust form.

use serde::{Deserialize, Serialize};

use crate::estimate::Estimate;
use crate::filter::ukf;
use crate::least_squares::{Form, vslm};
use crate::problem::Problem;

/// Options of [`solve`]: those of both parts.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case", deny_unknown_fields)]
pub struct Options {
    /// The filter.
    pub filter: ukf::Options,
    /// The search from the filter's result.
    pub search: vslm::Options,
    /// Seed of the filter; its own is not used.
    pub seed: u64,
}

impl Options {
    /// Algorithm 1 to the letter, two iterations of each part.
    pub fn as_printed() -> Self {
        let filter = ukf::Options { sweeps: 2, ..ukf::Options::as_printed() };
        let search = vslm::Options { restart: true, max_iterations: 2, ..vslm::Options::as_printed() };
        Self { filter, search, seed: 0 }
    }

    /// The form of the filter part, reported as the form of the whole.
    pub fn form(&self) -> Form {
        self.filter.form
    }
}

/// Filters, then searches. The trace has both parts, one after the other.
///
/// # Panics
/// If `start` does not have one entry for each parameter.
pub fn solve(problem: &dyn Problem, start: &[f64], options: &Options) -> Estimate {
    let filter = ukf::Options { seed: options.seed, ..options.filter.clone() };
    let first = ukf::solve(problem, start, &filter);
    if first.termination.is_failure() && !first.cost.is_finite() {
        return first;
    }
    let mut second = vslm::solve(problem, &first.x, &options.search);
    let mut trace = first.trace;
    for mut iteration in second.trace {
        iteration.evaluations.residuals += first.evaluations.residuals;
        iteration.evaluations.jacobians += first.evaluations.jacobians;
        trace.push(iteration);
    }
    second.trace = trace;
    second.evaluations.residuals += first.evaluations.residuals;
    second.evaluations.jacobians += first.evaluations.jacobians;
    second
}
