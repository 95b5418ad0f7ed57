//! Whether a pose leaves the measured region, whole turns of a joint aside.

use truegrind_arm::effect::Effect;
use truegrind_arm::estimated::Estimated;
use truegrind_arm::model::Joints;
use truegrind_arm::region::{NearestSample, Outside};

const TURN_DEG: f64 = 360.0;

/// [`truegrind_arm::region::Region::outside_along`] of a joint vector (rad). A joint stands alike after a whole turn, unless an effect of it
/// depends on more than the angle within a turn.
pub fn outside_along(arm: &Estimated, q: &Joints, last: &mut NearestSample) -> Option<Outside> {
    arm.region.outside_along(&in_measured_turns(arm, q), last)
}

/// The joint vector with each joint turned back by whole turns to where it was measured.
fn in_measured_turns(arm: &Estimated, q: &Joints) -> Joints {
    let (low, high) = (&arm.region.min_deg, &arm.region.max_deg);
    Joints::from_fn(|joint, _| {
        let degrees = q[joint].to_degrees();
        let turns = ((degrees - (low[joint] + high[joint]) / 2.0) / TURN_DEG).round();
        let is_within = (low[joint]..=high[joint]).contains(&degrees);
        if is_within || turns == 0.0 || !stands_alike_after_a_turn(arm, joint) {
            return q[joint];
        }
        (degrees - TURN_DEG * turns).to_radians()
    })
}

fn stands_alike_after_a_turn(arm: &Estimated, joint: usize) -> bool {
    let is_whole = arm.model.joint_map.column(joint).iter().all(|turns| turns.fract() == 0.0);
    is_whole
        && arm.model.effects.iter().all(|effect| match effect {
            Effect::JointCompliance(_)
            | Effect::LumpedCompliance(_)
            | Effect::JointStiffness(_)
            | Effect::TorquePowers(_)
            | Effect::LinkBending(_)
            | Effect::GearTwoJoints(_)
            | Effect::Backlash(_)
            | Effect::LoadedBacklash(_)
            | Effect::ThermalDrift(_)
            | Effect::AxisWobble(_)
            | Effect::BaseTilt(_)
            | Effect::LinkTwist(_) => true,
            Effect::JointCoupling(_) | Effect::SmoothCorrection(_) => false,
            _ => effect.joint() != Some(joint),
        })
}
