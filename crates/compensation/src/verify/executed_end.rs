//! Where a motion ends when an arm runs it.

use nalgebra::Vector3;
use truegrind_arm::estimated::RegisteredFrame;
use truegrind_arm::model::Joints;
use truegrind_math::se3::Pose;

/// End of a motion as executed.
#[derive(Debug, Clone)]
pub(crate) struct ExecutedEnd {
    pub(crate) motion: usize,
    pub(crate) frames_index: usize,
    /// Commanded pose in the work object.
    pub(crate) commanded: Pose,
    pub(crate) joints: Joints,
    /// Reached pose in the work object.
    pub(crate) reached: Pose,
    pub(crate) base_from_object: Pose,
    pub(crate) flange_from_tool: Pose,
    pub(crate) carried: Option<RegisteredFrame>,
    /// Condition under which the arm arrived.
    pub(crate) condition_index: usize,
    /// Of a circular motion the circle point as reached, in the work object; of a motion to joints the places at its quarters.
    pub(crate) on_the_way: Vec<Pose>,
}

/// The ends of a program by motion; `None` for a motion without one.
pub(crate) fn by_motion(ends: &[ExecutedEnd], motions: usize) -> Vec<Option<&ExecutedEnd>> {
    let mut out = vec![None; motions];
    for end in ends {
        out[end.motion] = Some(end);
    }
    out
}

/// From where the original intends the end of a motion to where the arm comes, in the axes of the base (mm).
pub(crate) fn deviation(intended: &ExecutedEnd, reached: &ExecutedEnd) -> Vector3<f64> {
    let in_object = reached.reached.translation.vector - intended.commanded.translation.vector;
    intended.base_from_object.rotation * in_object
}
