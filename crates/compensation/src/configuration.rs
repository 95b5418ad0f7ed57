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

/// The joints of a flange pose that states no configuration (NC), where nothing tells how the arm came there: the solution in
/// the branch in which it is stated to start, or the most usual one.
///
/// The usual one has the wrist in front of axis 1 and an elbow that is not turned back, and then the smallest sum of absolute joint angles,
/// whichever way the maker counts them: a tool that points down has axis 5 at +90° on an ABB and at −90° on a FANUC, and axis 4 at 0° on
/// both.
pub(crate) fn unstated(
    nominal: &Inverse<'_>,
    flange: &Pose,
    start: Option<&Joints>,
) -> Result<Joints, OutcomeReason> {
    if let Some(start) = start {
        return nominal.solve_near(flange, start).map(|s| s.joints).map_err(OutcomeReason::of_inverse);
    }
    const WRIST: i32 = 1;
    let unusual = |joints: &Joints| {
        let back = nominal.configuration(joints).cfx & !WRIST;
        (back, joints.abs().sum())
    };
    let all = nominal.all(flange).into_iter().map(|solution| (unusual(&solution.joints), solution.joints));
    if let Some((_, joints)) = all.min_by(|(a, _), (b, _)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))) {
        return Ok(joints);
    }
    // Where no configuration reaches the pose, what prevents the nearest one.
    let wanted = Configuration { cf1: 0, cf4: 0, cf6: 0, cfx: 0 };
    match nominal.solve_configured(flange, &wanted, None) {
        Err(InverseError::OtherConfiguration { nearest, .. }) => {
            nominal.solve_configured(flange, &nearest, None)
        }
        other => other,
    }
    .map(|s| s.joints)
    .map_err(OutcomeReason::of_inverse)
}

/// Whether the controller checks the configuration of a motion.
pub(crate) fn monitored(motion: &Motion) -> Switch {
    match motion.kind {
        MotionKind::Joint => motion.modal.conf_joint,
        _ => motion.modal.conf_linear,
    }
}
