//! Joint angles.

use std::ops::Index;

use nalgebra::Vector6;

/// Joint angles of the controller (rad).
pub type Joints = Vector6<f64>;

/// Joint angles of the mapped arm (rad): each the rotation of its own axis, before the effects.
/// [`Model::mapped`](crate::model::Model::mapped) makes them of the controller's; kernels take them as arrays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MappedJoints(pub Vector6<f64>);

impl Index<usize> for MappedJoints {
    type Output = f64;

    fn index(&self, joint: usize) -> &f64 {
        &self.0[joint]
    }
}

impl From<MappedJoints> for [f64; 6] {
    fn from(mapped: MappedJoints) -> [f64; 6] {
        mapped.0.into()
    }
}

/// The largest difference between joints of the same number (rad); one that is not a number counts as the largest of all.
#[inline(always)]
pub(crate) fn max_joint_difference(a: &Joints, b: &Joints) -> f64 {
    let mut out = 0.0;
    for joint in 0..6 {
        let apart = (a[joint] - b[joint]).abs();
        out = if apart <= out { out } else { apart };
    }
    out
}
