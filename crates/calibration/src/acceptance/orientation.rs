//! Acceptance of the target's orientation, by the same rule as its position.

use truegrind_math::statistics::ErrorSummary;

use super::decision::{Decision, Scatter, Uncertainty};

/// Result for the orientation. An error is the rotation angle between the measured orientation of the target and that under the model.
#[derive(Debug, Clone)]
pub struct Orientation {
    /// Errors of the nominal arm, with the sensor registered to it in the same way (rad).
    pub nominal: ErrorSummary,
    /// Errors of the estimated arm (rad).
    pub model: ErrorSummary,
    /// The same for each row, with the row's number in its file (rad).
    pub errors_rad: Vec<(usize, f64)>,
    /// Expanded uncertainty of 95.45 % (rad); 0 if unknown.
    pub uncertainty_rad: f64,
    /// Source of the uncertainty.
    pub uncertainty: Uncertainty,
    /// Scatter of repeated poses (rad), where any were repeated.
    pub scatter: Option<Scatter>,
    /// The largest accepted error (rad), if stated.
    pub tolerance_rad: Option<f64>,
    /// The decision; not evaluated without a tolerance.
    pub decision: Decision,
}
