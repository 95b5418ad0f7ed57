//! The words of one block, by what they say.

use crate::nc::dialect::Dialect;
use crate::nc::expression::literal;
use crate::nc::machine::Turn;
use crate::nc::parser::word;
use crate::nc::syntax::{Belongs, NcTree, Syntax, Word};
use crate::nc::task::Written;
use crate::nc::token::Token;

/// The words of a block that say where to go.
#[derive(Default)]
pub(super) struct Slots<'s> {
    pub(super) axes: [Option<Word<'s>>; 3],
    pub(super) angles: [Option<Word<'s>>; 3],
    pub(super) vector: [Option<Word<'s>>; 3],
    pub(super) centre: [Option<Word<'s>>; 3],
    pub(super) spin: Option<Word<'s>>,
    pub(super) radius: Option<Word<'s>>,
    pub(super) feed: Option<Word<'s>>,
    /// G90 or G91, as written.
    pub(super) distance: Option<Word<'s>>,
    /// G0 to G3, as written.
    pub(super) mode: Option<Word<'s>>,
    /// The first word after a block number.
    pub(super) first: Option<Word<'s>>,
    /// After which token new words go.
    pub(super) end: u32,
    /// The last word before that.
    pub(super) last: u32,
}

/// Places in the order of words.
pub(super) const AXES: usize = 0;
pub(super) const ANGLES: usize = 3;
pub(super) const VECTOR: usize = 6;
pub(super) const SPIN: usize = 9;
pub(super) const CENTRE: usize = 10;
pub(super) const RADIUS: usize = 13;
pub(super) const ORDER: usize = 14;

impl<'s> Slots<'s> {
    /// In the order in which controls list them.
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
}

/// The words of a block by what they are.
pub(super) fn slots<'s>(tree: &NcTree<'s>, dialect: Dialect, written: &Written) -> Slots<'s> {
    let mut slots = Slots::default();
    let node = tree.nodes[written.node as usize];
    if !matches!(node.kind, Syntax::Block | Syntax::Skippable) {
        return slots;
    }
    let (mut place, mut fallback) = (None, (node.end, node.first));
    let (mut comma, mut after_m) = (false, false);
    let mut radius_block = false;
    for child in tree.child_nodes(written.node) {
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
        after_m |= &*name == b"M" && !matches!(number_of(tree, &word), Some(91.0 | 92.0));
        let at = |letter: u8, first: u8| usize::from(letter - first);
        let mut says_where = true;
        match &*name {
            [letter @ b'X'..=b'Z'] => slots.axes[at(*letter, b'X')] = Some(word),
            [b'I', letter @ b'X'..=b'Z'] if dialect == Dialect::Heidenhain => {
                slots.axes[at(*letter, b'X')] = Some(word);
            }
            [b'C'] if dialect == Dialect::Heidenhain && word.belongs == Belongs::Nothing => {
                says_where = false
            }
            [letter @ b'A'..=b'C'] if written.turn == Turn::Angles => {
                slots.angles[at(*letter, b'A')] = Some(word);
            }
            [b'I', letter @ b'A'..=b'C'] if dialect == Dialect::Heidenhain => {
                slots.angles[at(*letter, b'A')] = Some(word);
            }
            [letter @ b'A'..=b'C', b'2'] if written.turn == Turn::Rpy => {
                slots.angles[at(*letter, b'A')] = Some(word);
            }
            [letter @ b'A'..=b'C', b'3'] => slots.vector[at(*letter, b'A')] = Some(word),
            [b'T', letter @ b'X'..=b'Z'] if dialect == Dialect::Heidenhain => {
                slots.vector[at(*letter, b'X')] = Some(word);
            }
            [letter @ b'I'..=b'K'] if written.vector_words && written.arc.is_none() => {
                slots.vector[at(*letter, b'I')] = Some(word);
            }
            [letter @ b'I'..=b'K'] => slots.centre[at(*letter, b'I')] = Some(word),
            b"THETA" => slots.spin = Some(word),
            b"R" if dialect != Dialect::Heidenhain => slots.radius = Some(word),
            b"R" => match word.belongs {
                Belongs::Literal { sign: None, .. }
                    if !radius_block || number_of(tree, &word) == Some(0.0) =>
                {
                    says_where = false;
                }
                Belongs::Nothing => says_where = false,
                _ => slots.radius = Some(word),
            },
            b"CR" if dialect == Dialect::Siemens => slots.radius = Some(word),
            b"F" => {
                slots.feed = Some(word);
                says_where = false;
            }
            b"G" | b"N" | b"L" | b"LN" => {
                fallback = (word.end, word.first);
                if let Belongs::Literal { sign: None, number } = word.belongs
                    && &*name == b"G"
                {
                    match literal(tree.text(number)) {
                        Some(90.0 | 91.0) => slots.distance = Some(word),
                        Some(0.0 | 1.0 | 2.0 | 3.0) => slots.mode = Some(word),
                        _ => {}
                    }
                }
                says_where = false;
            }
            _ => says_where = false,
        }
        if says_where {
            place = Some((word.end, word.first));
        }
    }
    (slots.end, slots.last) = place.unwrap_or(fallback);
    slots
}

fn number_of(tree: &NcTree<'_>, word: &Word<'_>) -> Option<f64> {
    match word.belongs {
        Belongs::Literal { number, .. } => literal(tree.text(number)),
        _ => None,
    }
}

fn is_axis_name(name: &[u8]) -> bool {
    matches!(name, [b'X'..=b'Z' | b'A'..=b'C' | b'U'..=b'W'])
        || matches!(name, [b'I', b'X'..=b'Z' | b'A'..=b'C' | b'U'..=b'W'])
}

/// Whether a word says by itself that it is an increment (IC, IX) or not (AC).
pub(super) fn said(tree: &NcTree<'_>, dialect: Dialect, word: &Word<'_>) -> Option<bool> {
    if dialect == Dialect::Heidenhain {
        return Some(word.name.len() == 2 && word.name[0] | 32 == b'i');
    }
    let Belongs::Expression { first, .. } = word.belongs else { return None };
    if dialect != Dialect::Siemens || tree.kind(first) != Some(Token::Name) {
        return None;
    }
    match &*tree.text(first).to_ascii_uppercase() {
        b"IC" => Some(true),
        b"AC" | b"DC" | b"ACP" | b"ACN" => Some(false),
        _ => None,
    }
}

/// Whether white space stands before the word that begins with this token (or it begins its line).
pub(super) fn spaced(tree: &NcTree<'_>, token: u32) -> bool {
    token == 0 || tree.kind(token - 1).is_some_and(|kind| kind.is_trivia() || kind == Token::Slash)
}
