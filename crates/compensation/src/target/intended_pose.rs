//! The intended pose of a target in its work object.

use nalgebra::Vector3;

use truegrind_math::se3::Pose;
use truegrind_programs::motion::RobTarget;

/// The intended pose. A pose that the program states is not stored again for each of a million targets.
#[derive(Debug, Clone)]
pub(crate) enum IntendedPose<'a> {
    /// As the program states it.
    Stated(&'a RobTarget),
    /// Computed from a joint target.
    Computed(Box<Pose>),
}

impl IntendedPose<'_> {
    /// Its position (mm).
    pub(crate) fn position_mm(&self) -> Vector3<f64> {
        match self {
            IntendedPose::Stated(target) => target.position_mm.into(),
            IntendedPose::Computed(pose) => pose.translation.vector,
        }
    }

    /// The pose, with the quaternion normalised.
    pub(crate) fn pose(&self) -> Pose {
        match self {
            IntendedPose::Stated(target) => target.pose(),
            IntendedPose::Computed(pose) => **pose,
        }
    }
}
