//! What the figures of a deviation are called, and what must be said beside them.

use super::side::{AFTER, has};
use truegrind_compensation::deviation::{After, PathReport};

pub(super) const REMAINDER: &str = "A predicted remainder is what rounding, interpolation and inverse kinematics leave under the \
    very model that made the correction. It does not say how far the real arm will be off: the predicted 1σ and the \
    model's held-out error do.";

/// Short heading and key of the columns after the correction.
pub(super) fn words(after: After) -> (&'static str, &'static str) {
    match after {
        After::PredictedRemainder => ("remainder", "predicted_remainder"),
        After::Achieved => ("achieved", "achieved"),
    }
}

/// What the figures after the correction are.
pub(super) fn meaning(after: After) -> &'static str {
    match after {
        After::PredictedRemainder => "predicted remainder",
        After::Achieved => "achieved",
    }
}

/// A remainder is far smaller than a deviation.
pub(super) fn decimals(after: After) -> usize {
    match after {
        After::PredictedRemainder => 4,
        After::Achieved => 3,
    }
}

/// Model with its held-out error.
pub(super) fn named(report: &PathReport) -> String {
    match report.held_out_mm {
        Some(mm) => format!("{} (held-out error {mm:.3} mm RMSE)", report.model),
        None => format!("{} (held-out error not known)", report.model),
    }
}

pub(super) fn notes(report: &PathReport) -> Vec<String> {
    let mut notes = vec![
        "Positions and vectors in the axes of the work object; d is reached minus intended.".to_owned(),
        if report.points.iter().any(|point| point.normal.is_some()) {
            "\"normal\" is signed along the outward surface normal: positive stands off the surface, negative digs in."
                .to_owned()
        } else {
            "No surface is known, so nothing is stated along a normal.".to_owned()
        },
    ];
    if report.after == After::PredictedRemainder && has(report, AFTER) {
        notes.push(REMAINDER.to_owned());
    }
    notes
}
