//! The joints that the controller selects for a pose and its stated configuration.

use crate::plan::reason::OutcomeReason;
use truegrind_arm::inverse::configuration::Configuration;
use truegrind_arm::inverse::{Inverse, InverseError};
use truegrind_arm::model::Joints;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::{Motion, MotionKind, RobTarget, Switch};

/// The joints that the controller selects for a flange pose with the configuration of a target.
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
        // Some arms do not use cfx: the quarter turns alone may still select one solution.
        Err(error @ InverseError::OtherConfiguration { nearest, .. }) => {
            let all = nominal.all(flange);
            // Where no configuration reaches the pose, report what prevents the nearest one.
            if all.is_empty() {
                let other = nominal.solve_configured(flange, &nearest, near).err();
                return Err(OutcomeReason::of_inverse(other.unwrap_or(error)));
            }
            let mut fitting = all.iter().filter(|s| wanted.overshoot_rad(&s.joints) <= 1e-6);
            match (fitting.next(), fitting.next(), monitored) {
                (Some(only), None, _) => Ok(only.joints),
                // Unmonitored and without reference joints: the branch that matches the quarter turns best.
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
