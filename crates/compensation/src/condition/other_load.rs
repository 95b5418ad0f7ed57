//! Loads other than that of the measurement, under a deflection that holds for that one alone.

use super::overload::rated_payload_kg;
use super::payload::payload_at;
use crate::options::Options;
use crate::plan::MotionOutcome;
use truegrind_arm::estimated::Estimated;
use truegrind_programs::motion::Listing;

/// Share of the rated payload, or else of the measured load, by which a load may differ and still count as the same.
const SAME_LOAD: f64 = 0.05;

/// A load up to this (kg) is none: tool0 weighs a gram.
const NO_LOAD_KG: f64 = 0.1;

/// Whether the deflection of an arm is not known under a load of `kg`: that of a joint was identified without the masses of the arm, under
/// another load. Where the compliance of the joint itself is known, what was identified without masses only adds to those of the arm.
pub fn is_other_load(kg: f64, arm: &Estimated) -> bool {
    let measured_kg = arm.condition.payload_kg.unwrap_or(0.0);
    let same_kg = SAME_LOAD * rated_payload_kg(&arm.robot).unwrap_or(measured_kg);
    let effects = || arm.model.effects.iter().filter(|effect| !effect.is_zero());
    let follows = |joint| effects().any(|effect| effect.needs_torque() && effect.joint() == joint);
    let holds_for_one = effects().any(|effect| effect.holds_for_one_load() && !follows(effect.joint()));
    holds_for_one && (kg - measured_kg).abs() > same_kg.max(NO_LOAD_KG)
}

/// How many corrected motions carry such a load.
pub(crate) fn other_loads(
    listing: &Listing,
    arm: &Estimated,
    options: &Options,
    outcomes: &[MotionOutcome],
) -> usize {
    let kg = |index: usize| match &options.loads {
        Some(loads) => payload_at(loads, index, &listing.motions[index], listing).map(|load| load.mass_kg),
        None => options.condition.payload_kg,
    };
    let corrected = outcomes.iter().filter(|outcome| outcome.status.is_written());
    corrected.filter_map(|outcome| kg(outcome.motion as usize)).filter(|kg| is_other_load(*kg, arm)).count()
}
