//! Speeds of the joints at the rows of a path, also where it turns sharply: there they are not the mean of both sides.
//!
//! Let cₖ be the speed from row k − 1 to row k. A corner at row i has cᵢ before it and cᵢ₊₁ after it. A corner between rows i − 1 and i makes
//! cᵢ a mixture of the two speeds, cᵢ = s cᵢ₋₁ + (1 − s) cᵢ₊₁ with 0 < s < 1: then row i has the speed cᵢ₊₁ on both sides, and row i − 1 has cᵢ₋₁.

use crate::measurement::dataset::Rates;
use truegrind_arm::model::Joints;

/// Share s, and 1 − s, from which a speed is a mixture. Below, it may be that of a line that is slightly curved.
const MIXED: f64 = 0.1;

/// What such a speed may lack of a mixture, relative to the difference of the two speeds.
const NEAR: f64 = 0.1;

/// Difference of the speeds on either side, relative to the greater one, from which a path has a corner.
const CORNER: f64 = 0.5;

/// The speeds at row i, with the mean speed `mean` from the row before to the next, and cᵢ₋₁, cᵢ, cᵢ₊₁ and cᵢ₊₂, where known.
pub(super) fn rates(mean: Joints, [earlier, before, after, later]: [Option<Joints>; 4]) -> Rates {
    let (Some(before), Some(after)) = (before, after) else { return Rates::steady(mean) };
    if (after - before).norm() <= CORNER * before.norm().max(after.norm()) {
        return Rates::steady(mean);
    }
    if earlier.is_some_and(|earlier| is_mixture(&before, &earlier, &after)) {
        return Rates { mean, before: after, after };
    }
    if later.is_some_and(|later| is_mixture(&after, &before, &later)) {
        return Rates { mean, before, after: before };
    }
    Rates { mean, before, after }
}

/// Whether a speed is one of the two others for a part of its time, and the other for the rest.
fn is_mixture(speed: &Joints, first: &Joints, second: &Joints) -> bool {
    let (apart, from) = (first - second, speed - second);
    let share = from.dot(&apart) / apart.norm_squared();
    // A corner at the very row leaves a share of 0 or 1; the rest of a line does so too.
    (MIXED..1.0 - MIXED).contains(&share) && (from - apart * share).norm() < NEAR * apart.norm()
}
