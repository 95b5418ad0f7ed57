//! What shall change in a program, said without its language, and what became of it.
//!
//! The caller states per motion new values ([`Change`]); the dialect finds the bytes that carry them. Only numbers are
//! replaced where numbers stand; a declaration that several motions share is edited once where all agree on the new
//! value and nothing else reads it, and split otherwise; a computed target is replaced at its instruction.

use crate::edit::Edits;
use crate::motion::{Mark, MotionKind, Reason};

/// A new value for one target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NewTarget {
    /// Leave it as it is.
    Keep,
    /// Take it out: a circular motion without its circle point becomes a straight one.
    Drop,
    /// A new pose; external axes stay.
    Cartesian {
        /// Position in the object frame (mm).
        position_mm: [f64; 3],
        /// Quaternion w, x, y, z; the sign is chosen to agree with the old one.
        quaternion: [f64; 4],
        /// New configuration; `None` leaves the old.
        conf: Option<[i32; 4]>,
    },
    /// New joint angles (degrees); external axes stay. On an instruction with a Cartesian target this turns the
    /// instruction into its joint form (MoveL to MoveAbsJ).
    Joint {
        /// Robot axes (degrees).
        robot_deg: [f64; 6],
    },
}

/// Beyond these no arm stands, and no control reads what would be written (mm, degrees).
const FARTHEST_MM: f64 = 1e7;
const FARTHEST_DEG: f64 = 1e6;

impl NewTarget {
    /// Whether a control can hold its numbers.
    pub fn is_held(&self) -> bool {
        match self {
            NewTarget::Keep | NewTarget::Drop => true,
            NewTarget::Cartesian { position_mm, quaternion, .. } => {
                let square: f64 = quaternion.iter().map(|q| q * q).sum();
                position_mm.iter().all(|x| x.abs() <= FARTHEST_MM) && (0.25..=4.0).contains(&square)
            }
            NewTarget::Joint { robot_deg } => robot_deg.iter().all(|angle| angle.abs() <= FARTHEST_DEG),
        }
    }
}

impl Change {
    /// Whether a control can hold its numbers.
    pub fn is_held(&self) -> bool {
        self.targets.iter().chain(self.before.iter().map(|extra| &extra.target)).all(NewTarget::is_held)
    }
}

/// A motion to put before another; it takes speed, tool, work object and the process arguments from that one.
#[derive(Debug, Clone, PartialEq)]
pub struct Extra {
    /// [`MotionKind::Linear`] or [`MotionKind::Joint`] with a Cartesian target, [`MotionKind::AbsoluteJoint`] with joints.
    pub kind: MotionKind,
    /// The target; `conf: None` takes that of the instruction.
    pub target: NewTarget,
    /// External axes; `None` takes those of the instruction.
    pub external: Option<[Option<f64>; 6]>,
}

/// What shall change at one motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// Index into [`crate::motion::Listing::motions`].
    pub motion: u32,
    /// One per target of the motion, in the same order; empty leaves all.
    pub targets: Vec<NewTarget>,
    /// Motions to put before it, in the order in which the robot shall reach them.
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
    /// The zone of motions that are put in; fly-by.
    pub extra_zone: String,
    /// The mark to write into every file in which something changed.
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

/// What became of one change.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Outcome {
    /// Equal to the source to the printed decimals: no byte changed.
    Unchanged,
    /// The numbers were replaced where they stand (in the instruction or in the declaration).
    InPlace,
    /// A declaration that others use with another value was cloned under this name.
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
    pub outcomes: Vec<Outcome>,
}
