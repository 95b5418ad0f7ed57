//! Targets in the numbers of a program: frames, poses, joint angles.

use nalgebra::{Quaternion, Translation3, UnitQuaternion};

use super::reason::Reason;
use truegrind_math::option_f64::OptionF64;
use truegrind_math::se3::Pose;

/// The largest plausible coordinate of a frame or target (mm), and joint angle (°).
pub const MAX_POSITION_MM: f64 = 1e6;

/// A frame as a program writes it: position and scalar-first quaternion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Position (mm).
    pub position_mm: [f64; 3],
    /// Quaternion w, x, y, z as written.
    pub quaternion: [f64; 4],
}

impl Frame {
    /// The identity.
    pub const IDENTITY: Frame = Frame { position_mm: [0.0; 3], quaternion: [1.0, 0.0, 0.0, 0.0] };

    /// The rigid motion, with the quaternion normalised.
    pub fn pose(&self) -> Pose {
        let [w, x, y, z] = self.quaternion;
        let [px, py, pz] = self.position_mm;
        Pose::from_parts(
            Translation3::new(px, py, pz),
            UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)),
        )
    }

    /// Checks that the frame is plausible.
    ///
    /// # Errors
    /// [`Reason::BeyondReach`] for a coordinate beyond [`MAX_POSITION_MM`], or one that is not finite.
    pub fn within_reach(self) -> Result<Frame, Reason> {
        let plausible = self.position_mm.iter().all(|coordinate| coordinate.abs() <= MAX_POSITION_MM);
        let finite = self.quaternion.iter().all(|part| part.is_finite());
        if plausible && finite { Ok(self) } else { Err(Reason::BeyondReach) }
    }

    /// The frame of a rigid motion.
    ///
    /// ```
    /// use truegrind_programs::motion::Frame;
    ///
    /// let frame = Frame { position_mm: [420.0, -10.5, 250.0], quaternion: [0.6, 0.0, 0.8, 0.0] };
    /// let back = Frame::from_pose(&frame.pose());
    /// assert_eq!(back.position_mm, frame.position_mm);
    /// assert!(back.quaternion.iter().zip(frame.quaternion).all(|(found, expected)| (found - expected).abs() < 1e-12));
    /// ```
    pub fn from_pose(pose: &Pose) -> Frame {
        let (t, q) = (pose.translation.vector, pose.rotation.quaternion());
        Frame { position_mm: [t.x, t.y, t.z], quaternion: [q.w, q.i, q.j, q.k] }
    }
}

/// A Cartesian target: the tool frame in the work object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobTarget {
    /// Position of the TCP in the object frame (mm).
    pub position_mm: [f64; 3],
    /// Orientation, w, x, y, z, as written.
    pub quaternion: [f64; 4],
    /// Configuration cf1, cf4, cf6, cfx.
    pub conf: [i32; 4],
    /// External axes [mm or degrees]; nothing where the program says "not connected" (9E9).
    pub external: [OptionF64; 6],
}

impl RobTarget {
    /// Position and orientation.
    pub fn frame(&self) -> Frame {
        Frame { position_mm: self.position_mm, quaternion: self.quaternion }
    }

    /// The rigid motion from object frame to tool frame, with the quaternion normalised.
    pub fn pose(&self) -> Pose {
        self.frame().pose()
    }
}

/// A target in joint angles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointTarget {
    /// Robot axes (degrees).
    pub robot_deg: [f64; 6],
    /// External axes [mm or degrees]; nothing where not connected.
    pub external: [OptionF64; 6],
}

/// The value of a target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TargetValue {
    /// A pose.
    Cartesian(RobTarget),
    /// Joint angles.
    Joint(JointTarget),
}

impl TargetValue {
    /// The Cartesian target, if it is one.
    pub fn cartesian(&self) -> Option<&RobTarget> {
        match self {
            TargetValue::Cartesian(target) => Some(target),
            TargetValue::Joint(_) => None,
        }
    }

    /// The external axes (mm or degrees).
    pub fn external(&self) -> &[OptionF64; 6] {
        match self {
            TargetValue::Cartesian(target) => &target.external,
            TargetValue::Joint(target) => &target.external,
        }
    }

    /// The joint target, if it is one.
    pub fn joint(&self) -> Option<&JointTarget> {
        match self {
            TargetValue::Joint(target) => Some(target),
            TargetValue::Cartesian(_) => None,
        }
    }
}
