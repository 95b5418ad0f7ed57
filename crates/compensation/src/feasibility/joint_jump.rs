//! How far a correction turns the joints at a target, and which solution the controller selects there.
//!
//! Method. Far from singularities a correction of 1 mm moves each joint by about 1 mm over half an arm's length; at distance
//! d from a singularity, by 1/d times that or more. A correction is written only where no joint changes by more than
//! [`Options::joint_gain`] times its size, and nowhere closer to a singularity than [`Options::min_singularity`].
//!
//! The written configuration is read again as the controller reads it. With its sign, cfx identifies one solution; where the
//! text states another cfx (some arms do not use it), the written numbers are solved again.

use crate::arms::Arms;
use crate::configuration::configured;
use crate::frames::frame_pair::FramePair;
use crate::options::Options;
use crate::plan::reason::OutcomeReason;
use crate::target::solved_target::SolvedTarget;
use truegrind_arm::inverse::Inverse;
use truegrind_arm::model::Joints;
use truegrind_math::se3::{Pose, angle_bound_rad};
use truegrind_programs::motion::{RobTarget, Switch};

/// Largest difference between the joints that the controller computes from written numbers and the intended ones (rad).
const SAME_RAD: f64 = 1e-6;

/// The singularity distance before the correction is computed where that after is below so many times the bound.
const SINGULARITY_WATCH: f64 = 20.0;

/// What the controller computes from the numbers of one target.
pub(crate) struct WrittenTarget<'a> {
    /// Its frames, as the controller holds them.
    pub(crate) frames: &'a FramePair,
    /// Flange pose that the controller computes.
    pub(crate) flange: &'a Pose,
    /// The same from the numbers as written.
    pub(crate) read_back: &'a Pose,
    /// Its joints for them.
    pub(crate) joints: &'a Joints,
    /// The target, where its configuration applies.
    pub(crate) stated: Option<&'a RobTarget>,
}

/// Why a target must not be corrected, because of its joint motion or because the controller selects other joints.
/// `singularity`: singularity distance of the corrected joints.
pub(crate) fn target_fault(
    solved: &SolvedTarget<'_>,
    singularity: f64,
    replay: &WrittenTarget<'_>,
    arms: &Arms<'_>,
    options: &Options,
) -> Option<OutcomeReason> {
    let flanges = || [replay.frames.flange_for(&solved.intended.pose()), *replay.flange];
    let joints = [&solved.before, replay.joints];
    if let Some(joint_jump) = joint_jump(flanges, joints, &arms.nominal, options) {
        return Some(joint_jump);
    }
    if singularity < SINGULARITY_WATCH * options.min_singularity
        && arms.nominal.singularity(&solved.before) < options.min_singularity
    {
        return Some(OutcomeReason::NearSingularity);
    }
    let stated = replay.stated.filter(|stated| stated.conf[3] != solved.conf.cfx)?;
    // The quarter turns are written, but cfx is not that of these joints, so another solution can match
    // better.
    let conf = [solved.conf.cf1, solved.conf.cf4, solved.conf.cf6, stated.conf[3]];
    let written = RobTarget { conf, ..*stated };
    let taken = configured(&arms.nominal, replay.read_back, &written, Switch::On, Some(replay.joints));
    let same = taken.is_ok_and(|taken| (taken - replay.joints).amax() < SAME_RAD);
    (!same).then_some(OutcomeReason::OtherBranch)
}

/// The joint that a correction turns too far.
pub(super) fn joint_jump(
    flanges: impl FnOnce() -> [Pose; 2],
    joints: [&Joints; 2],
    nominal: &Inverse<'_>,
    options: &Options,
) -> Option<OutcomeReason> {
    let change = joints[1] - joints[0];
    let joint = change.iamax();
    let turned = change[joint].abs();
    if turned <= options.free_joint_change_rad {
        return None;
    }
    let [from, to] = flanges();
    let most = (options.joint_gain * flange_travel(&from, &to, nominal)).max(options.free_joint_change_rad);
    (!(turned <= most)).then(|| OutcomeReason::JointJump {
        joint: joint as u8,
        deg: turned.to_degrees(),
        most_deg: most.to_degrees(),
        on_the_way: false,
    })
}

/// Whether an inserted target turns a joint too far relative to the original program. `intended` and `commanded`: poses in
/// the work object.
pub(crate) fn jumps_joint(
    [intended, commanded]: [&Pose; 2],
    joints: &Joints,
    mounting: &FramePair,
    arms: &Arms<'_>,
    options: &Options,
) -> bool {
    let [intended, commanded] = [intended, commanded].map(|pose| mounting.flange_for(pose));
    let before = arms.nominal.solve_near(&intended, joints);
    before.is_ok_and(|before| {
        joint_jump(|| [intended, commanded], [&before.joints, joints], &arms.nominal, options).is_some()
    })
}

/// Distance of two flange poses: displacement over half an arm's length, plus rotation (rad).
pub(super) fn flange_travel(from: &Pose, to: &Pose, nominal: &Inverse<'_>) -> f64 {
    let shift = (to.translation.vector - from.translation.vector).norm();
    shift / nominal.length_mm() + from.rotation.angle_to(&to.rotation)
}

/// An upper bound of [`flange_travel`].
pub(super) fn travel_bound(from: &Pose, to: &Pose, nominal: &Inverse<'_>) -> f64 {
    let shift = (to.translation.vector - from.translation.vector).norm();
    shift / nominal.length_mm() + angle_bound_rad(&from.rotation, &to.rotation)
}
