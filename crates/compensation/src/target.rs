//! Targets: the joints of the original program, and the corrected joints and commanded poses.

pub(crate) mod at_pole;
pub(crate) mod intended_pose;
pub(crate) mod original_joints;
pub(crate) mod solve;
pub(crate) mod solved_target;
pub(crate) mod target_ranges;
