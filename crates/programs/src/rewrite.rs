//! Changes to a program, independent of its language, and their outcomes.
//!
//! The caller states new values per motion ([`Change`]); the dialect finds the bytes to edit. Only numbers are
//! replaced where numbers are written. A declaration that several motions share is edited once if all agree on the
//! new value and nothing else reads it, and split otherwise. A computed target is replaced in its instruction.

use crate::edit::Edits;
use crate::motion::{Mark, MotionKind, Reason};
use smallvec::SmallVec;
use truegrind_math::option_f64::OptionF64;

/// A new value for one target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NewTarget {
    /// Unchanged.
    Keep,
    /// Removed: a circular motion without its circle point becomes straight.
    Drop,
    /// A new pose; external axes are unchanged.
    Cartesian {
        /// Position in the object frame (mm).
        position_mm: [f64; 3],
        /// Quaternion w, x, y, z; the sign is chosen to agree with the old one.
        quaternion: [f64; 4],
        /// New configuration; `None` keeps the old one.
        conf: Option<[i32; 4]>,
    },
    /// New joint angles (degrees); external axes are unchanged. An instruction with a Cartesian target is replaced by
    /// its joint form (MoveL by MoveAbsJ).
    Joint {
        /// Robot axes (degrees).
        robot_deg: [f64; 6],
    },
}

/// Limits of positions (mm) and angles (°) that a control can read. A target may be read up to
/// [`MAX_POSITION_MM`](crate::motion::MAX_POSITION_MM), and what is corrected lies beyond it by a tool and a work object.
const MAX_WRITTEN_MM: f64 = 1e7;
const MAX_WRITTEN_DEG: f64 = 1e6;

impl NewTarget {
    /// Whether a control can represent its numbers.
    pub fn is_representable(&self) -> bool {
        match self {
            NewTarget::Keep | NewTarget::Drop => true,
            NewTarget::Cartesian { position_mm, quaternion, .. } => {
                let square: f64 = quaternion.iter().map(|q| q * q).sum();
                position_mm.iter().all(|x| x.abs() <= MAX_WRITTEN_MM) && (0.25..=4.0).contains(&square)
            }
            NewTarget::Joint { robot_deg } => robot_deg.iter().all(|angle| angle.abs() <= MAX_WRITTEN_DEG),
        }
    }
}

impl Change {
    /// Whether a control can represent its numbers.
    pub fn is_representable(&self) -> bool {
        self.targets
            .iter()
            .chain(self.before.iter().map(|extra| &extra.target))
            .all(NewTarget::is_representable)
    }
}

/// A motion to insert before another, from which it takes speed, tool, work object and process arguments.
#[derive(Debug, Clone, PartialEq)]
pub struct Extra {
    /// [`MotionKind::Linear`] or [`MotionKind::Joint`] with a Cartesian target, [`MotionKind::AbsoluteJoint`] with joints.
    pub kind: MotionKind,
    /// The target; `conf: None` takes that of the instruction.
    pub target: NewTarget,
    /// External axes; `None` takes those of the instruction.
    pub external: Option<[OptionF64; 6]>,
}

/// The change of one motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// Index into [`crate::motion::Listing::motions`].
    pub motion: u32,
    /// One per target of the motion, in the same order; empty keeps all.
    pub targets: SmallVec<[NewTarget; 1]>,
    /// Motions to insert before it, in the order of execution.
    pub before: Vec<Extra>,
}

impl Change {
    /// Whether a circular motion becomes straight.
    pub fn straightens(&self) -> bool {
        self.targets.contains(&NewTarget::Drop)
    }
}

/// How numbers are written. The decimals are the larger of these and those of the source.
#[derive(Debug, Clone, PartialEq)]
pub struct RewriteOptions {
    /// Decimals of positions in mm.
    pub position_decimals: u8,
    /// Decimals of quaternions.
    pub quaternion_decimals: u8,
    /// Decimals of joint angles in degrees.
    pub joint_decimals: u8,
    /// The zone of inserted motions; fly-by.
    pub extra_zone: String,
    /// The mark to write into every changed file.
    pub mark: Option<Mark>,
}

impl Default for RewriteOptions {
    fn default() -> Self {
        RewriteOptions {
            position_decimals: 4,
            quaternion_decimals: 7,
            joint_decimals: 6,
            extra_zone: "z1".into(),
            mark: None,
        }
    }
}

/// The outcome of one change.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RewriteOutcome {
    /// Equal to the source within the written decimals: no byte changed.
    Unchanged,
    /// The numbers were replaced in place (in the instruction or in the declaration).
    InPlace,
    /// A declaration that other motions use with another value was cloned under this name.
    Split(String),
    /// The argument was replaced by a literal in the instruction.
    Inlined,
    /// Nothing was changed.
    Refused(Reason),
}

/// The edits of one file.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct FileEdits {
    /// Sorted, disjoint edits; [`Edits::apply`] makes the new file.
    pub edits: Edits,
    /// Whether something changed but no mark could be written (a fragment without MODULE).
    pub unmarked: bool,
}

/// A rewritten program.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Rewritten {
    /// One per file, in the order in which the files were given.
    pub files: Vec<FileEdits>,
    /// One per change, in the same order.
    pub outcomes: Vec<RewriteOutcome>,
}
