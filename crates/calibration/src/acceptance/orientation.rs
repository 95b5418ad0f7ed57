//! The orientation of the target, judged as its position is, where the sensor measures it.

use truegrind_arm::model::Model;
use truegrind_math::statistics::ErrorSummary;

use super::decision::{Decision, Uncertainty};
use crate::identification::calibration::Frames;
use crate::identification::fit::Observations;
use crate::measurement::dataset::Reading;

/// What was found of the orientation. Errors are the angle of the turn between where the target was seen and where the arm says it is.
#[derive(Debug, Clone)]
pub struct Orientation {
    /// Of the arm of the data sheet, the sensor registered to it in the same way (rad).
    pub nominal: ErrorSummary,
    /// Of the estimated arm (rad).
    pub model: ErrorSummary,
    /// The same row by row, by the number of the row in its file (rad).
    pub errors_rad: Vec<(usize, f64)>,
    /// Expanded uncertainty, k = 2 (rad); 0 where it is not known.
    pub uncertainty_rad: f64,
    /// Where it comes from.
    pub uncertainty: Uncertainty,
    /// The largest error that is accepted (rad), where one was stated.
    pub tolerance_rad: Option<f64>,
    /// The decision; not evaluated without a tolerance.
    pub decision: Decision,
}

/// The error of each of these rows (rad); `None` where a reading has no orientation.
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
