//! One block: its words, by what they state. Fields of word indices index `words`.

use crate::motion::Reason;
use crate::nc::syntax::Word;

/// One block: its words, by what they state.
#[derive(Default)]
pub(super) struct Block<'s> {
    pub(super) node: u32,
    pub(super) words: Vec<Word<'s>>,
    pub(super) axes: [Option<usize>; 3],
    pub(super) abc: [Option<usize>; 3],
    pub(super) rpy: [Option<usize>; 3],
    pub(super) vector: [Option<usize>; 3],
    pub(super) centre: [Option<usize>; 3],
    pub(super) spin: Option<usize>,
    pub(super) radius: Option<usize>,
    /// G codes in tenths: 434 for G43.4.
    pub(super) g: Vec<u32>,
    pub(super) m: Vec<u32>,
    pub(super) p: Option<usize>,
    pub(super) l: Option<usize>,
    pub(super) q: Option<usize>,
    pub(super) feed: Option<usize>,
    pub(super) h: Option<usize>,
    pub(super) d: Option<usize>,
    pub(super) flags: Flags,
    /// Why the motion does not follow from the axis words alone: probing, polar coordinates, contour angles.
    pub(super) unmodelled: Option<Reason>,
    /// An unknown word, and why it is unknown.
    pub(super) unknown_word: Option<(String, Reason)>,
}

/// What holds for a block as a whole.
#[derive(Default)]
pub(super) struct Flags {
    /// U, V, W, E: axes that are not modelled.
    pub(super) other_axes: bool,
    /// R0 (false), RL, RR, R+ and R- of Heidenhain.
    pub(super) radius_compensation: Option<bool>,
    /// R+ and R-: the motion of a paraxial block is lengthened or shortened by the tool radius.
    pub(super) paraxial_compensation: bool,
    /// NX, NY, NZ: the surface normal.
    pub(super) surface_normal: bool,
    /// LN: the only Heidenhain block that takes a tool vector.
    pub(super) is_ln: bool,
    /// A positioning block without L (Heidenhain).
    pub(super) paraxial: bool,
    /// Whether part of the block could not be read.
    pub(super) opaque: bool,
    /// Whether that part may hold more than axis words.
    pub(super) opaque_may_set: bool,
    /// Block skip (`/`).
    pub(super) skippable: bool,
    /// G53, SUPA, M91.
    pub(super) machine_coordinates: bool,
    /// FMAX.
    pub(super) rapid: bool,
    /// TURN, AR, I1, J1, K1: arcs of several turns, by their angle, or through a point.
    pub(super) special_arc: bool,
    /// A rounded or chamfered corner at its end: `,R5`, `,C2`, RND=, CHF=, CHR=.
    pub(super) corner: bool,
    /// The same at the end of every block from here on, or no longer: RNDM=.
    pub(super) modal_corner: Option<bool>,
}

impl Block<'_> {
    pub(super) fn has_motion_words(&self) -> bool {
        let any = |list: &[Option<usize>]| list.iter().any(Option::is_some);
        any(&self.axes) || any(&self.abc) || any(&self.rpy) || any(&self.vector) || self.spin.is_some()
    }
}
