//! What a block says, word by word.

use crate::motion::Reason;
use crate::nc::syntax::Word;

/// What a block says, word by word.
#[derive(Default)]
pub(super) struct Said<'s> {
    pub(super) node: u32,
    pub(super) words: Vec<Word<'s>>,
    pub(super) axes: [Option<usize>; 3],
    pub(super) abc: [Option<usize>; 3],
    pub(super) rpy: [Option<usize>; 3],
    pub(super) vector: [Option<usize>; 3],
    pub(super) centre: [Option<usize>; 3],
    pub(super) spin: Option<usize>,
    pub(super) radius: Option<usize>,
    pub(super) g: Vec<u32>,
    pub(super) m: Vec<u32>,
    pub(super) p: Option<usize>,
    pub(super) l: Option<usize>,
    pub(super) q: Option<usize>,
    pub(super) feed: Option<usize>,
    pub(super) h: Option<usize>,
    pub(super) d: Option<usize>,
    /// U, V, W, E: axes that are not followed.
    pub(super) others: bool,
    /// R0 (false), RL, RR, R+ and R- of Heidenhain.
    pub(super) compensates: Option<bool>,
    /// R+ and R-: the axes of the block go by the tool's radius farther or less far.
    pub(super) lengthens: bool,
    /// NX, NY, NZ: the surface normal.
    pub(super) normal: bool,
    /// LN: the block in which a tool vector may stand.
    pub(super) spatial: bool,
    /// Why the block is left though it moves as its words say: measuring, poles, angles of a contour.
    pub(super) aside: Option<Reason>,
    /// A word that is not known: what it is, and why.
    pub(super) unknown: Option<(String, Reason)>,
    /// A positioning block without L.
    pub(super) paraxial: bool,
    pub(super) opaque: bool,
    /// The opaque part may hold more than axes.
    pub(super) obscure: bool,
    pub(super) skippable: bool,
    /// G53, SUPA, M91.
    pub(super) machine: bool,
    /// FMAX.
    pub(super) rapid: bool,
    pub(super) turns: bool,
    /// Corners that are rounded or cut: `,R5`, `,C2`, RND=, CHF=, CHR=.
    pub(super) corner: bool,
}

impl Said<'_> {
    pub(super) fn moves(&self) -> bool {
        let any = |list: &[Option<usize>]| list.iter().any(Option::is_some);
        any(&self.axes) || any(&self.abc) || any(&self.rpy) || any(&self.vector) || self.spin.is_some()
    }
}
