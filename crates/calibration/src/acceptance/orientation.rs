//! Acceptance of the target's orientation, by the same rule as its position.

use truegrind_arm::model::Model;
use truegrind_math::statistics::ErrorSummary;

use super::decision::{Decision, Uncertainty};
use crate::identification::calibration::Frames;
use crate::identification::fit::Observations;
use crate::measurement::dataset::Reading;

/// Result for the orientation. An error is the rotation angle between the measured orientation of the target and that under the model.
#[derive(Debug, Clone)]
pub struct Orientation {
    /// Errors of the nominal arm, with the sensor registered to it in the same way (rad).
    pub nominal: ErrorSummary,
    /// Errors of the estimated arm (rad).
    pub model: ErrorSummary,
    /// The same for each row, with the row's number in its file (rad).
    pub errors_rad: Vec<(usize, f64)>,
    /// Expanded uncertainty, k = 2 (rad); 0 if unknown.
    pub uncertainty_rad: f64,
    /// Source of the uncertainty.
    pub uncertainty: Uncertainty,
    /// The largest accepted error (rad), if stated.
    pub tolerance_rad: Option<f64>,
    /// The decision; not evaluated without a tolerance.
    pub decision: Decision,
}

/// The error of each of these rows (rad); `None` if a reading has no orientation.
pub(super) fn errors(
    observed: &Observations,
    rows: &[usize],
    model: &Model,
    frames: &Frames,
) -> Option<Vec<f64>> {
    let error = |&row: &usize| {
        let row = &observed.dataset.rows[row];
        let Reading::Pose(seen) = &row.reading else { return None };
        let flange = model.at_condition(&row.condition).forward(&row.joints);
        let target = flange.rotation * frames.flange_from_target.rotation;
        Some((frames.base_from_sensor.rotation * seen.rotation).angle_to(&target))
    };
    rows.iter().map(error).collect()
}
