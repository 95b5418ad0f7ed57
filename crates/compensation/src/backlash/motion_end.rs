//! Ends of motions, and the backlash sides along the segments to them.

use truegrind_arm::model::Joints;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::{Motion, MotionKind, Switch};

/// Side from which each joint arrived: −1 from below, +1 from above, 0 unknown.
pub(crate) type JointSides = [i8; 6];

/// End of a motion.
#[derive(Debug, Clone, Copy)]
#[expect(clippy::large_enum_variant, reason = "nearly all are `At`")]
pub(crate) enum MotionEnd<'a> {
    /// The arm does not move (external axes alone).
    Unmoved,
    /// The program does not determine where the arm is afterwards.
    Unknown,
    /// At known joints.
    At(ReachedEnd<'a>),
}

/// A known end of a motion, with what is known of the segment to it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ReachedEnd<'a> {
    /// The motion.
    pub(crate) motion: &'a Motion,
    /// Index of its frames in the frame table.
    pub(crate) frames_index: usize,
    /// Commanded pose in the work object.
    pub(crate) commanded: Pose,
    /// Commanded joints.
    pub(crate) joints: Joints,
    /// Circle point of a circular motion.
    pub(crate) via: Option<Pose>,
    /// Required link angles, if the end is corrected.
    pub(crate) links: Option<Joints>,
    /// Whether it is written as a joint target.
    pub(crate) as_joints: bool,
    /// Whether targets may be inserted before it.
    pub(crate) may_insert: bool,
}

impl ReachedEnd<'_> {
    /// Whether the joints may follow a Cartesian path, and whether they may move in proportion.
    pub(crate) fn path_kinds(&self) -> (bool, bool) {
        let wrist = self.motion.modal.wrist_interpolation != Switch::Off;
        match self.motion.kind {
            MotionKind::Linear | MotionKind::Circular => (true, wrist || self.as_joints),
            MotionKind::Joint => (self.motion.rapid, true),
            _ => (false, true),
        }
    }
}

/// Backlash sides along the segment to the end of a motion.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct BacklashSides {
    /// From the start, and from each share at which a joint reverses.
    pub(crate) turns: Vec<(f64, JointSides)>,
    /// At the end.
    pub(crate) end: JointSides,
    /// At the circle point, if any.
    pub(crate) via: JointSides,
}

impl BacklashSides {
    /// Marks the side of a joint as unknown.
    pub(crate) fn forget(&mut self, joint: usize) {
        (self.end[joint], self.via[joint]) = (0, 0);
        self.turns.iter_mut().for_each(|(_, sides)| sides[joint] = 0);
    }
}

/// Joints at shares between the ends of a motion.
pub(crate) type SampledJoints = Vec<(f64, Joints)>;
