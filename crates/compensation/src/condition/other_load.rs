//! Loads other than that of the measurement, under a deflection that holds for that one alone.

use super::overload::rated_payload_kg;
use super::payload::payload_at;
use truegrind_arm::condition::Condition;
use truegrind_arm::effect::Effect;
use truegrind_arm::effect::base_tilt::TiltTerm;
use truegrind_arm::estimated::Estimated;
use truegrind_arm::gravity::STANDARD_GRAVITY;
use truegrind_programs::motion::Listing;
use truegrind_programs::motion::load::Loads;

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
    let follows = |joint| effects().any(|effect| effect.depends_on_load() && effect.joint() == joint);
    let holds_for_one = effects().any(|effect| effect.holds_for_one_load() && !follows(effect.joint()));
    holds_for_one && (kg - measured_kg).abs() > same_kg.max(NO_LOAD_KG)
}

/// Mass of the links beyond the base over the rated payload, of usual arms: 3 to 6.
const MOVING_MASS: f64 = 4.0;

/// What such a load would move the flange by with the arm stretched out (mm), if the links weigh what those of usual arms do: a deflection
/// that was identified without masses is compliance times mass.
fn deflection_mm(kg: f64, arm: &Estimated) -> f64 {
    let measured_kg = arm.condition.payload_kg.unwrap_or(0.0);
    let Some(rated_kg) = rated_payload_kg(&arm.robot) else { return f64::INFINITY };
    let reach_m = |joint: usize| {
        arm.model.links[joint..].iter().map(|link| link.a_mm.abs() + link.d_mm.abs()).sum::<f64>() * 1e-3
    };
    // Compliance times mass, and the lever of the load.
    let of_effect = |effect: &Effect| match effect {
        Effect::LumpedCompliance(e) => {
            let upright = e.lump.iter().filter(|lump| lump.axis.is_none() && lump.moment.is_none());
            upright.map(|lump| lump.factor.abs()).sum::<f64>() * reach_m(e.joint).powi(2)
        }
        Effect::LinkBending(e) if e.frame.is_some() => {
            e.compliance_rad_per_nm.abs() * reach_m(e.joint).powi(2)
        }
        Effect::BaseTilt(e) => {
            let lumped = e.term.iter().filter(|term| term.frame.is_some());
            let of =
                |term: &TiltTerm| term.tilt_rad_per_nm.abs() * reach_m(0) + term.sway_mm_per_nm.abs() * 1e-3;
            lumped.map(of).sum::<f64>() * reach_m(0)
        }
        _ => 0.0,
    };
    let compliance = arm.model.effects.iter().map(of_effect).sum::<f64>() / (MOVING_MASS * rated_kg);
    compliance * (kg - measured_kg).abs() * STANDARD_GRAVITY * 1e3
}

/// How many of some motions, each with its σ (mm), carry such a load, and one that would move the flange by more than is stated of them.
pub(crate) fn other_loads(
    listing: &Listing,
    arm: &Estimated,
    (loads, condition): (Option<&Loads>, &Condition),
    motions: impl Iterator<Item = (usize, Option<f64>)> + Clone,
) -> usize {
    let kg = |index: usize| match loads {
        Some(loads) => payload_at(loads, index, &listing.motions[index], listing).map(|load| load.mass_kg),
        None => condition.payload_kg,
    };
    let stated = motions.clone().filter_map(|(_, sigma_mm)| sigma_mm).fold(0.0, f64::max);
    let matters = |kg: &f64| is_other_load(*kg, arm) && deflection_mm(*kg, arm) > stated;
    motions.filter_map(|(motion, _)| kg(motion)).filter(matters).count()
}
