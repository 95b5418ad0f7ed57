//! What a rewrite must know beyond the listing: the state in which each motion's block is read, and the order of events.

use crate::nc::arc::Arc;
use crate::nc::modal_state::OrientationMode;

/// An event on the path through the blocks of a file, as far as it concerns positions and origins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum StateEvent {
    /// A file begins.
    FileStart,
    /// A motion of the listing.
    Motion(u32),
    /// These axes are unknown from here on: bits 0 to 2 X Y Z, 3 to 5 A B C.
    AxesUnknown(u8),
    /// Every position has coordinates that are larger by this (mm): the frame is another, of the same directions.
    FrameMoved([f64; 3]),
    /// Position and orientation are unknown from here on.
    PoseUnknown,
    /// The tool position is given these coordinates (G92).
    OriginSet {
        /// The coordinates (mm) of the named axes, where they and the position are known.
        stated: [Option<f64>; 3],
        /// The axes that are named.
        named: [bool; 3],
    },
    /// The coordinate shift of these axes is cancelled or stated in full, whatever the position.
    ShiftStated([bool; 3]),
    /// The same in a block that may be skipped.
    ShiftMaybeStated([bool; 3]),
    /// A saved coordinate shift is restored (G92.3).
    ShiftRestored,
    /// A join of control flow: another place of the file may lead here, or control flow may leave from here.
    Join,
    /// A branch: control flow may continue elsewhere in the file.
    Branch,
    /// An unmodified word depends on the tool position in these axes (bits as for [`StateEvent::AxesUnknown`]).
    PositionUsed {
        /// The axes.
        axes: u8,
        /// Whether the program reads the position, and does not set an origin there.
        read: bool,
    },
}

/// The arc of a block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BlockArc {
    pub(crate) arc: Arc,
    /// G3, and not G2.
    pub(crate) positive: bool,
    /// Whether its centre words are absolute.
    pub(crate) centre_absolute: bool,
}

/// The state in which the block of a motion is read, and how it is written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BlockContext {
    pub(crate) node: u32,
    pub(crate) absolute: bool,
    pub(crate) unit_mm: f64,
    /// Whether `absolute` is uncertain because of a join before the block.
    pub(crate) distance_mode_unknown: bool,
    /// The start (mm, coordinate shift included), as far as known.
    pub(crate) start: [Option<f64>; 3],
    /// A, B, C (or A2, B2, C2) before it.
    pub(crate) start_angles: [Option<f64>; 3],
    /// The same after it.
    pub(crate) angles: [Option<f64>; 3],
    /// The tool vector and the rotation about it (°) before it.
    pub(crate) start_vector: Option<([f64; 3], f64)>,
    /// The same after it.
    pub(crate) vector: Option<([f64; 3], f64)>,
    /// The coordinate shift (mm).
    pub(crate) shift: [Option<f64>; 3],
    pub(crate) orientation_mode: OrientationMode,
    pub(crate) vector_words: bool,
    pub(crate) arc: Option<BlockArc>,
    /// Whether a block may be inserted before it.
    pub(crate) insertable: bool,
    /// Whether words that it omits can be added, even though its motion is not modified.
    pub(crate) can_restate: bool,
    /// Whether the control may ignore a word of it, because its variable may never have been set (Fanuc).
    pub(crate) may_omit_words: bool,
    /// Whether it is a positioning block of Heidenhain without L.
    pub(crate) paraxial: bool,
    /// What its path depends on where it is not modified.
    pub(crate) start_dependency: StartDependency,
}

/// What the path of an unmodified motion depends on, besides its own words.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum StartDependency {
    /// Nothing: a straight motion may start elsewhere.
    Independent,
    /// The start point.
    Position,
    /// The start point and the direction of the motion that ends there.
    Tangent,
}
