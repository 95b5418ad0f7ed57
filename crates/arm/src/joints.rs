//! Joint angles and their ranges.

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

/// Range and speed of the joints, in the controller's angles.
#[derive(Debug, Clone, PartialEq)]
pub struct Limits {
    /// Lowest angle (rad).
    pub min_rad: [f64; 6],
    /// Highest angle (rad).
    pub max_rad: [f64; 6],
    /// Highest speed [rad/s], where published.
    pub speed_rad_s: Option<[f64; 6]>,
}

impl Limits {
    /// The first joint (0-based) outside its range, if any.
    ///
    /// ```
    /// use truegrind_arm::model::Joints;
    /// use truegrind_arm::robots;
    ///
    /// // Axis 5 of an IRB 120 turns by 120° either way.
    /// let limits = robots::load("abb-irb-120")?.model.limits;
    /// assert_eq!(limits.violated(&Joints::zeros()), None);
    /// assert_eq!(limits.violated(&Joints::new(0.0, 0.0, 0.0, 0.0, 2.2, 0.0)), Some(4));
    /// # Ok::<(), robots::RobotError>(())
    /// ```
    pub fn violated(&self, q: &Joints) -> Option<usize> {
        (0..6).find(|&i| !(self.min_rad[i]..=self.max_rad[i]).contains(&q[i]))
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
