//! Targets in a stated orientation that is not quite the intended one, as near a pole of the words of orientation, where those of the intended
//! one may be far away ([`WordsAtPole`](truegrind_programs::nc::orientation::WordsAtPole)).
//!
//! Method. The commanded position moves by what the tool of the estimated arm misses, until it misses nothing. Both arms are nearly alike, so
//! that each round leaves about a thousandth.

use nalgebra::UnitQuaternion;

use crate::arms::Arms;
use crate::frames::frame_pair::ResolvedFrames;
use truegrind_arm::inverse::InverseError;
use truegrind_arm::model::Joints;
use truegrind_math::se3::Pose;

/// Rounds.
const ROUNDS: usize = 5;

/// The joints, near others, with which the tool is at the intended position if the controller is commanded this orientation, both in the work
/// object.
pub(crate) fn joints_in_orientation(
    commanded: UnitQuaternion<f64>,
    intended: &Pose,
    near: &Joints,
    frames: &ResolvedFrames,
    condition_index: usize,
    arms: &Arms<'_>,
) -> Result<Joints, InverseError> {
    let mut joints = *near;
    let mut told = frames.commanded.target_of(&arms.nominal.arm().forward(near));
    told.rotation = commanded;
    for _ in 0..ROUNDS {
        joints = arms.nominal.solve_near(&frames.commanded.flange_for(&told), &joints)?.joints;
        let reached = frames.real.target_of(&arms.conditions.arm(condition_index).forward(&joints));
        told.translation.vector += intended.translation.vector - reached.translation.vector;
    }
    Ok(joints)
}
