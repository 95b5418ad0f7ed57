//! Labels and notes of deviation tables.

use super::side::{AFTER, has};
use truegrind_compensation::deviation::{After, PathReport};

pub(super) const REMAINDER: &str = "The predicted remainder is the deviation that the correcting model itself expects: rounding, interpolation, inverse kinematics, and the \
    placement if only the shape is corrected. It does not predict the deviation of the real arm; the predicted 1σ and the held-out error of \
    the model do.";

/// Heading and key of the columns after the correction.
pub(super) fn words(after: After) -> (&'static str, &'static str) {
    match after {
        After::PredictedRemainder => ("remainder", "predicted_remainder"),
        After::Achieved => ("achieved", "achieved"),
    }
}

/// Meaning of the values after the correction.
pub(super) fn meaning(after: After) -> &'static str {
    match after {
        After::PredictedRemainder => "predicted remainder",
        After::Achieved => "achieved",
    }
}

/// A remainder is far smaller than a deviation, so it has more decimals.
pub(super) fn decimals(after: After) -> usize {
    match after {
        After::PredictedRemainder => 4,
        After::Achieved => 3,
    }
}

/// Name of the model with its held-out error.
pub(super) fn named(report: &PathReport) -> String {
    match report.held_out_mm {
        Some(mm) => format!("{} (held-out error {mm:.3} mm RMSE)", report.model),
        None => format!("{} (held-out error unknown)", report.model),
    }
}

pub(super) fn notes(report: &PathReport) -> Vec<String> {
    let mut notes = vec![
        "Positions and vectors in the work object frame; d is reached minus intended position; turn is the angle between reached \
         and intended orientation of the tool."
            .to_owned(),
        if report.points.iter().any(|point| point.normal.is_some()) {
            "\"normal\" is signed along the outward surface normal: positive is off the surface, negative is too deep."
                .to_owned()
        } else {
            "No surface is given, so there are no deviations along a normal.".to_owned()
        },
    ];
    if report.after == After::PredictedRemainder && has(report, AFTER) {
        notes.push(REMAINDER.to_owned());
    }
    notes
}
