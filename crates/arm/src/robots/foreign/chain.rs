//! A foreign arm: six joints and the fixed transforms between them, as the file describes them.

use nalgebra::{Matrix6, UnitQuaternion, UnitVector3, Vector3};

use crate::body::Body;
use crate::joints::Joints;
use crate::robots::sheet::Dialect;
use truegrind_math::se3::Pose;

/// One joint: its frame in the one before, and its axis.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Step {
    /// Fixed transform that comes before the turn.
    pub(super) before: Pose,
    /// Axis of the turn, in the joint's own frame.
    pub(super) axis: UnitVector3<f64>,
}

/// A foreign arm.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ForeignArm {
    /// The joints from base to flange.
    pub(super) steps: [Step; 6],
    /// From the sixth joint's frame to the flange.
    pub(super) after: Pose,
    /// Direction of gravity in the file's base.
    pub(super) gravity: Vector3<f64>,
    /// Lowest and highest angle of each joint (°), where all are stated.
    pub(super) limits_deg: Option<[[f64; 2]; 6]>,
    /// Highest speeds (°/s), where all are stated.
    pub(super) speed_deg_s: Option<[f64; 6]>,
    /// Link rotations per rotation of the controller's joints, where that is not the identity.
    pub(super) joint_map: Option<Matrix6<f64>>,
    /// Mass of each link, its centre in the base with all joints at zero (mm).
    pub(super) masses: Option<[Body; 6]>,
    /// Maker, designation, program language, where stated.
    pub(super) maker: String,
    pub(super) designation: String,
    pub(super) dialect: Option<Dialect>,
    /// Source of the numbers.
    pub(super) source: String,
    /// Meshes that the file names for drawing.
    pub(super) visuals: Vec<Mesh>,
    /// Notes for the user.
    pub(super) notes: Vec<String>,
}

/// A mesh that a file names for drawing.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Mesh {
    /// How many of the six joints move it.
    pub(super) joints: usize,
    /// Its pose in the file's base with all joints at zero.
    pub(super) place: Pose,
    /// Its file, as it is named.
    pub(super) file: String,
    /// Millimetres for each of its units, along its own axes.
    pub(super) unit_mm: [f64; 3],
}

impl ForeignArm {
    /// The frame of each joint in the base, all joints at zero; the flange last.
    pub(super) fn frames(&self) -> [Pose; 7] {
        let mut pose = Pose::identity();
        let mut out = [Pose::identity(); 7];
        for (place, step) in out.iter_mut().zip(&self.steps) {
            pose *= step.before;
            *place = pose;
        }
        out[6] = pose * self.after;
        out
    }

    /// The flange in the base for link rotations (rad): the file's own product of transforms.
    pub(super) fn forward(&self, joints: &Joints) -> Pose {
        let turned = |step: &Step, angle: f64| {
            step.before
                * Pose::from_parts(Default::default(), UnitQuaternion::from_axis_angle(&step.axis, angle))
        };
        let steps = self.steps.iter().zip(joints.iter());
        steps.fold(Pose::identity(), |pose, (step, angle)| pose * turned(step, *angle)) * self.after
    }
}

/// A joint about its own z.
pub(super) fn about_z(before: Pose) -> Step {
    Step { before, axis: Vector3::z_axis() }
}

/// Roll, pitch and yaw about the fixed x, y and z (rad), as URDF has them.
pub(super) fn from_rpy(position_mm: Vector3<f64>, [roll, pitch, yaw]: [f64; 3]) -> Pose {
    Pose::from_parts(position_mm.into(), UnitQuaternion::from_euler_angles(roll, pitch, yaw))
}
