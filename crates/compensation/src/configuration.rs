//! Which joints the controller takes for a pose and the configuration that is stated with it.

use crate::plan::reason::OutcomeReason;
use truegrind_arm::inverse::configuration::Configuration;
use truegrind_arm::inverse::{Inverse, InverseError};
use truegrind_arm::model::Joints;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::{Motion, MotionKind, RobTarget, Switch};

/// The joints that the controller takes for a flange pose with a target's configuration.
pub(crate) fn configured(
    nominal: &Inverse<'_>,
    flange: &Pose,
    target: &RobTarget,
    monitored: Switch,
    near: Option<&Joints>,
) -> Result<Joints, OutcomeReason> {
    let [cf1, cf4, cf6, cfx] = target.conf;
    let wanted = Configuration { cf1, cf4, cf6, cfx };
    if monitored == Switch::Off
        && let Some(near) = near
    {
        return nominal.solve_near(flange, near).map(|s| s.joints).map_err(OutcomeReason::of_inverse);
    }
    match nominal.solve_configured(flange, &wanted, near) {
        Ok(solution) => Ok(solution.joints),
        // Some arms do not use cfx: the quarter turns alone may still single out one solution.
        Err(error @ InverseError::OtherConfiguration { nearest, .. }) => {
            let all = nominal.all(flange);
            // Where no configuration reaches it, none was asked for in vain: what forbids the nearest is the reason.
            if all.is_empty() {
                let other = nominal.solve_configured(flange, &nearest, near).err();
                return Err(OutcomeReason::of_inverse(other.unwrap_or(error)));
            }
            let mut fitting = all.iter().filter(|s| wanted.overshoot_rad(&s.joints) <= 1e-6);
            match (fitting.next(), fitting.next(), monitored) {
                (Some(only), None, _) => Ok(only.joints),
                // Not monitored and nothing to be near to: the branch that keeps to the quarters best.
                (_, _, Switch::Off) => all
                    .iter()
                    .min_by(|a, b| {
                        wanted.overshoot_rad(&a.joints).total_cmp(&wanted.overshoot_rad(&b.joints))
                    })
                    .map(|s| s.joints)
                    .ok_or_else(|| OutcomeReason::of_inverse(error)),
                _ => Err(OutcomeReason::of_inverse(error)),
            }
        }
        Err(error) => Err(OutcomeReason::of_inverse(error)),
    }
}

/// Whether the controller checks the configuration of a motion.
pub(crate) fn monitored(motion: &Motion) -> Switch {
    match motion.kind {
        MotionKind::Joint => motion.modal.conf_joint,
        _ => motion.modal.conf_linear,
    }
}
