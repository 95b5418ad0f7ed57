//! How blocks are written, and in which order what happens: what a rewrite must know beside the listing.

use crate::nc::arc::Arc;
use crate::nc::machine::Turn;

/// What a rewrite must know of the order of blocks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Event {
    /// A file begins.
    Start,
    /// A motion of the listing.
    Motion(u32),
    /// These axes are not known from here on: bits 0 to 2 X Y Z, 3 to 5 A B C.
    Lost(u8),
    /// Position and orientation are not known from here on.
    Unknown,
    /// The place where the tool stands gets these values (G92); of the axes that are named some may not be known.
    Shift {
        /// The values (mm), where value and place are known.
        stated: [Option<f64>; 3],
        /// The axes that are named.
        named: [bool; 3],
    },
    /// The shift of these axes ends, or is said whole: wherever the tool stands.
    Placed([bool; 3]),
    /// The same in a block that may be skipped.
    MaybePlaced([bool; 3]),
    /// A shift that was kept holds again (G92.3).
    Restored,
    /// As [`Event::Unknown`], at a place that can be reached from elsewhere, or from which another place can.
    Join,
    /// Another place of the file can be reached from here.
    Jump,
    /// Something that stays counts from where the tool stands in these axes (bits as for [`Event::Lost`]): an origin is set by a
    /// word that is not followed, or a position is read.
    Held {
        /// The axes.
        axes: u8,
        /// Whether a position is read, and no origin set.
        read: bool,
    },
}

/// How a motion is written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Written {
    /// Its block.
    pub(crate) node: u32,
    pub(crate) absolute: bool,
    pub(crate) unit_mm: f64,
    /// Whether it is not known that `absolute` holds: ways meet before it.
    pub(crate) counting_open: bool,
    /// Where it starts (mm, shifts included), as far as known.
    pub(crate) start: [Option<f64>; 3],
    /// A, B, C (or A2, B2, C2) before it.
    pub(crate) start_angles: [Option<f64>; 3],
    /// The same after it.
    pub(crate) angles: [Option<f64>; 3],
    /// The tool vector and the turn about it before it.
    pub(crate) start_vector: Option<([f64; 3], f64)>,
    /// The same after it.
    pub(crate) vector: Option<([f64; 3], f64)>,
    pub(crate) shift: [Option<f64>; 3],
    pub(crate) turn: Turn,
    pub(crate) vector_words: bool,
    /// The arc, with whether it turns positively and whether its centre is absolute.
    pub(crate) arc: Option<(Arc, bool, bool)>,
    /// Whether a block may stand before it.
    pub(crate) insertable: bool,
    /// Whether words that it leaves out can be said again though it stays.
    pub(crate) restates: bool,
    /// Whether a word of it may say nothing, because its variable may never have been set (Fanuc).
    pub(crate) may_lack: bool,
    /// Whether it is a positioning block of Heidenhain without L.
    pub(crate) paraxial: bool,
    /// What its way hangs on where it stays as it is.
    pub(crate) needs: Needs,
}

/// What the way of a motion that stays hangs on, beside its own words.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Needs {
    /// Nothing: a straight one only begins elsewhere.
    Nothing,
    /// Where it starts.
    Start,
    /// Where it starts, and in which direction the motion before comes there.
    Tangent,
}
