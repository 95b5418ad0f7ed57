//! The words of one block, by what they state.

use crate::motion::Motion;
use crate::nc::dialect::Dialect;
use crate::nc::expression::literal;
use crate::nc::modal_state::OrientationMode;
use crate::nc::parser::word;
use crate::nc::syntax::{NcTree, Syntax, Word, WordValue};
use crate::nc::task::{BlockContext, Task, is_axis_name};
use crate::nc::token::Token;

/// The target words of a block.
#[derive(Default)]
pub(super) struct WordSlots<'s> {
    pub(super) axes: [Option<Word<'s>>; 3],
    pub(super) angles: [Option<Word<'s>>; 3],
    pub(super) vector: [Option<Word<'s>>; 3],
    pub(super) centre: [Option<Word<'s>>; 3],
    pub(super) spin: Option<Word<'s>>,
    pub(super) radius: Option<Word<'s>>,
    /// Whether a word may turn the tool, in whichever way orientations are stated.
    pub(super) turns: bool,
    pub(super) feed: Option<Word<'s>>,
    /// G90 or G91, as written.
    pub(super) distance: Option<Word<'s>>,
    /// G0 to G3, as written.
    pub(super) mode: Option<Word<'s>>,
    /// The first word after a block number.
    pub(super) first: Option<Word<'s>>,
    /// New words go after this token.
    pub(super) end: u32,
    /// The first token of the word before that.
    pub(super) last: u32,
}

/// Indices into the standard word order.
pub(super) const AXES: usize = 0;
pub(super) const ANGLES: usize = 3;
pub(super) const VECTOR: usize = 6;
pub(super) const SPIN: usize = 9;
pub(super) const CENTRE: usize = 10;
pub(super) const RADIUS: usize = 13;
pub(super) const ORDER: usize = 14;

impl<'s> WordSlots<'s> {
    /// The words in standard order.
    pub(super) fn order(&self) -> [Option<Word<'s>>; ORDER] {
        let mut order = [None; ORDER];
        order[AXES..ANGLES].copy_from_slice(&self.axes);
        order[ANGLES..VECTOR].copy_from_slice(&self.angles);
        order[VECTOR..SPIN].copy_from_slice(&self.vector);
        order[SPIN] = self.spin;
        order[CENTRE..RADIUS].copy_from_slice(&self.centre);
        order[RADIUS] = self.radius;
        order
    }

    /// The slot of a target word; after CR (`radius_block`) an R is a radius.
    fn slot(
        &mut self,
        tree: &NcTree<'_>,
        dialect: Dialect,
        context: &BlockContext,
        word: &Word<'_>,
        name: &[u8],
        radius_block: bool,
    ) -> Option<&mut Option<Word<'s>>> {
        let heidenhain = dialect == Dialect::Heidenhain;
        let at = |letter: u8, first: u8| usize::from(letter - first);
        Some(match *name {
            [letter @ b'X'..=b'Z'] => &mut self.axes[at(letter, b'X')],
            [b'I', letter @ b'X'..=b'Z'] if heidenhain => &mut self.axes[at(letter, b'X')],
            [b'C'] if heidenhain && word.value == WordValue::Absent => return None,
            [letter @ b'A'..=b'C'] if context.orientation_mode == OrientationMode::Angles => {
                &mut self.angles[at(letter, b'A')]
            }
            [b'I', letter @ b'A'..=b'C'] if heidenhain => &mut self.angles[at(letter, b'A')],
            [letter @ b'A'..=b'C', b'2'] if context.orientation_mode == OrientationMode::Rpy => {
                &mut self.angles[at(letter, b'A')]
            }
            [letter @ b'A'..=b'C', b'3'] => &mut self.vector[at(letter, b'A')],
            [b'T', letter @ b'X'..=b'Z'] if heidenhain => &mut self.vector[at(letter, b'X')],
            [letter @ b'I'..=b'K'] if context.vector_words && context.arc.is_none() => {
                &mut self.vector[at(letter, b'I')]
            }
            [letter @ b'I'..=b'K'] => &mut self.centre[at(letter, b'I')],
            [b'T', b'H', b'E', b'T', b'A'] => &mut self.spin,
            [b'R'] if heidenhain => match word.value {
                // R0: no radius compensation.
                WordValue::Literal { sign: None, .. }
                    if !radius_block || number_of(tree, word) == Some(0.0) =>
                {
                    return None;
                }
                WordValue::Absent => return None,
                _ => &mut self.radius,
            },
            [b'R'] => &mut self.radius,
            [b'C', b'R'] if dialect == Dialect::Siemens => &mut self.radius,
            _ => return None,
        })
    }
}

impl<'s> Task<'s> {
    /// The tree and dialect of a motion's file, and the words of its block.
    pub(super) fn block_words(
        &self,
        motion: &Motion,
        context: &BlockContext,
    ) -> (&NcTree<'s>, Dialect, WordSlots<'s>) {
        let file = motion.place.file as usize;
        let (tree, dialect) = (&self.trees[file], self.dialects[file]);
        (tree, dialect, slots(tree, dialect, context))
    }
}

/// Sorts the words of a block into slots.
fn slots<'s>(tree: &NcTree<'s>, dialect: Dialect, context: &BlockContext) -> WordSlots<'s> {
    let mut slots = WordSlots::default();
    let node = tree.nodes.get(context.node);
    if !matches!(node.kind, Syntax::Block | Syntax::Skippable) {
        return slots;
    }
    let (mut place, mut fallback) = (None, (node.end, node.first));
    let (mut comma, mut after_m) = (false, false);
    let mut radius_block = false;
    for child in tree.child_nodes(context.node) {
        let word = word(tree, child);
        let name = word.name.to_ascii_uppercase();
        radius_block |= &*name == b"CR";
        if slots.first.is_none() && &*name != b"N" {
            slots.first = Some(word);
        }
        // `,A45` is the angle of the line, `M118 X1` a value of the M word.
        if comma || after_m && dialect == Dialect::Heidenhain && is_axis_name(&name) {
            comma = false;
            continue;
        }
        comma = &*name == b",";
        slots.turns |= may_turn(&name);
        after_m |= &*name == b"M" && !matches!(number_of(tree, &word), Some(91.0 | 92.0));
        if let Some(slot) = slots.slot(tree, dialect, context, &word, &name, radius_block) {
            *slot = Some(word);
            place = Some((word.end, word.first));
            continue;
        }
        match &*name {
            b"F" => slots.feed = Some(word),
            b"G" | b"N" | b"L" | b"LN" => {
                fallback = (word.end, word.first);
                if let WordValue::Literal { sign: None, number } = word.value
                    && &*name == b"G"
                {
                    match literal(tree.text(number)) {
                        Some(90.0 | 91.0) => slots.distance = Some(word),
                        Some(0.0 | 1.0 | 2.0 | 3.0) => slots.mode = Some(word),
                        _ => {}
                    }
                }
            }
            _ => {}
        }
    }
    (slots.end, slots.last) = place.unwrap_or(fallback);
    slots
}

fn number_of(tree: &NcTree<'_>, word: &Word<'_>) -> Option<f64> {
    match word.value {
        WordValue::Literal { number, .. } => literal(tree.text(number)),
        _ => None,
    }
}

fn may_turn(name: &[u8]) -> bool {
    matches!(
        name,
        [b'A'..=b'C'] | [b'A'..=b'C', b'1'..=b'9'] | [b'I', b'A'..=b'C'] | [b'T', b'X'..=b'Z'] | b"THETA"
    )
}

/// Whether a word itself states an increment (IC, IX) or an absolute value (AC).
pub(super) fn states_increment(tree: &NcTree<'_>, dialect: Dialect, word: &Word<'_>) -> Option<bool> {
    if dialect == Dialect::Heidenhain {
        return Some(word.name.len() == 2 && word.name[0] | 32 == b'i');
    }
    let WordValue::Expression { first, .. } = word.value else { return None };
    if dialect != Dialect::Siemens || tree.kind(first) != Some(Token::Name) {
        return None;
    }
    match &*tree.text(first).to_ascii_uppercase() {
        b"IC" => Some(true),
        b"AC" | b"DC" | b"ACP" | b"ACN" => Some(false),
        _ => None,
    }
}

/// Whether white space or the line start precedes the word that begins with this token.
pub(super) fn spaced(tree: &NcTree<'_>, token: u32) -> bool {
    token == 0 || tree.kind(token - 1).is_some_and(|kind| kind.is_trivia() || kind == Token::Slash)
}
