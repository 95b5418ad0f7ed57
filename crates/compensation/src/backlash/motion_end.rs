//! Where motions end, and the sides on the way there.

use truegrind_arm::model::Joints;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::{Motion, MotionKind, Switch};

/// The side from which each joint came: −1 from below, +1 from above, 0 not known.
pub(crate) type JointSides = [i8; 6];

/// Where a motion ends.
#[derive(Debug, Clone, Copy)]
#[expect(clippy::large_enum_variant, reason = "nearly all are `At`")]
pub(crate) enum MotionEnd<'a> {
    /// The arm does not move (external axes alone).
    Unmoved,
    /// The text does not tell where the arm is afterwards.
    Unknown,
    /// At joints that are known.
    At(ReachedEnd<'a>),
}

/// The end of a motion with what is known of the way to it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ReachedEnd<'a> {
    /// The motion.
    pub(crate) motion: &'a Motion,
    /// Index of the mounting.
    pub(crate) frames_index: usize,
    /// What the controller is told, in the work object.
    pub(crate) commanded: Pose,
    /// Joints there.
    pub(crate) joints: Joints,
    /// The point on the arc of a circular motion.
    pub(crate) via: Option<Pose>,
    /// Where the links shall stand, if the end is corrected.
    pub(crate) links: Option<Joints>,
    /// Whether it is written as joints.
    pub(crate) as_joints: bool,
    /// Whether targets may be put in before it.
    pub(crate) may_insert: bool,
}

impl ReachedEnd<'_> {
    /// Whether its joints may go along a path, and whether they may go in proportion.
    pub(crate) fn path_kinds(&self) -> (bool, bool) {
        let wrist = self.motion.modal.wrist_interpolation != Switch::Off;
        match self.motion.kind {
            MotionKind::Linear | MotionKind::Circular => (true, wrist || self.as_joints),
            MotionKind::Joint => (self.motion.rapid, true),
            _ => (false, true),
        }
    }
}

/// The sides on the way to the end of a motion.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct BacklashSides {
    /// At the share 0 of the way, and from each share on at which a joint turns.
    pub(crate) turns: Vec<(f64, JointSides)>,
    /// At the end.
    pub(crate) end: JointSides,
    /// At the circle point, where there is one.
    pub(crate) via: JointSides,
}

impl BacklashSides {
    /// The side of a joint is not known.
    pub(crate) fn forget(&mut self, joint: usize) {
        (self.end[joint], self.via[joint]) = (0, 0);
        self.turns.iter_mut().for_each(|(_, sides)| sides[joint] = 0);
    }
}

/// The joints at places between the ends of a motion, by its share.
pub(crate) type SampledJoints = Vec<(f64, Joints)>;
