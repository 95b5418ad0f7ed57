//! The text of NC files besides the words that a correction writes: no correction changes it.
//!
//! A correction writes positions, orientations and arcs, and the motion code of an arc that becomes straight. It inserts blocks that
//! repeat the feed and G90 or G91 of the block behind them. Feeds are therefore compared apart, each after another one.

use std::collections::BTreeSet;

use super::dialect::Dialect;
use super::expression::literal;
use super::parser::word;
use super::rewrite::may_get_words;
use super::syntax::{NcTree, Syntax, Word, WordValue};
use super::task::Task;
use crate::remainder::{TextDifference, Version, first_difference};

/// The words of a file, with where each begins.
type Words = Vec<(Vec<u8>, usize)>;

impl Task<'_> {
    /// For each file the first difference from the original, and the first in its feeds; `None` where the two have not the same number of
    /// files.
    pub fn text_differences(&self, original: &Task<'_>) -> Option<Vec<TextDifference>> {
        if self.trees.len() != original.trees.len() {
            return None;
        }
        let mut found = Vec::new();
        for file in 0..self.trees.len() {
            let [(here, feeds), (there, feeds_there)] =
                [self, original].map(|task| task.unchanging_words(file));
            let [source, source_there] = [self, original].map(|task| task.trees[file].source());
            let version = |source, words| Version { source, words };
            found.extend(first_difference(file, [version(source, here), version(source_there, there)]));
            found
                .extend(first_difference(file, [version(source, feeds), version(source_there, feeds_there)]));
        }
        Some(found)
    }

    /// The words of a file that no correction changes, and its feeds.
    fn unchanging_words(&self, file: usize) -> (Words, Words) {
        let (tree, dialect) = (&self.trees[file], self.dialects[file]);
        let blocks = self.motion_blocks(file);
        let (mut words, mut feeds): (Words, Words) = Default::default();
        let mut last_feed = Vec::new();
        for block in tree.child_nodes(0) {
            if tree.nodes.kind(block) == Syntax::Skippable {
                words.push((b"/".to_vec(), tree.start(tree.nodes.first(block))));
            }
            if tree.nodes.kind(block) == Syntax::Opaque {
                let node = tree.nodes.get(block);
                words.push((text(tree, node.first, node.end), tree.start(node.first)));
            }
            // A feed that has moved to a block between other words differs, too.
            let place = words.len();
            let written = blocks.get(block);
            for child in tree.child_nodes(block) {
                let node = tree.nodes.get(child);
                let text = text(tree, node.first, node.end);
                let start = tree.start(node.first);
                let word = (node.kind == Syntax::Word).then(|| word(tree, child));
                if word.as_ref().is_some_and(|word| word.address() == Some(b'F')) {
                    if last_feed != text {
                        feeds.push(([&text, place.to_string().as_bytes()].join(&b'@'), start));
                        last_feed = text;
                    }
                } else if !word.as_ref().is_some_and(|word| written.may_write(tree, dialect, word)) {
                    words.push((text, start));
                }
            }
        }
        (words, feeds)
    }

    /// The blocks of a file that move.
    fn motion_blocks(&self, file: usize) -> MotionBlocks {
        let mut blocks = MotionBlocks::default();
        for (motion, context) in self.listing.motions.iter().zip(&self.contexts) {
            if motion.place.file as usize == file {
                blocks.all.insert(context.node);
                if may_get_words(motion, context) {
                    blocks.written.insert(context.node);
                }
            }
        }
        blocks
    }
}

/// The blocks of a file that move, by node.
#[derive(Default)]
struct MotionBlocks {
    all: BTreeSet<u32>,
    /// Those whose positions a correction may write.
    written: BTreeSet<u32>,
}

impl MotionBlocks {
    fn get(&self, block: u32) -> Written {
        match (self.all.contains(&block), self.written.contains(&block)) {
            (_, true) => Written::Positions,
            (true, false) => Written::ArcCode,
            _ => Written::Nothing,
        }
    }
}

/// What a correction may write in a block.
#[derive(Clone, Copy, PartialEq)]
enum Written {
    Positions,
    /// G2 or G3, where an arc before has become straight.
    ArcCode,
    Nothing,
}

impl Written {
    fn may_write(self, tree: &NcTree<'_>, dialect: Dialect, word: &Word<'_>) -> bool {
        match self {
            Written::Nothing => false,
            Written::ArcCode => matches!(code(tree, word), Some(2.0 | 3.0)),
            Written::Positions => {
                matches!(code(tree, word), Some(0.0 | 1.0 | 2.0 | 3.0 | 90.0 | 91.0))
                    || is_position(dialect, word)
            }
        }
    }
}

/// The number of a G word.
fn code(tree: &NcTree<'_>, word: &Word<'_>) -> Option<f64> {
    match word.value {
        WordValue::Literal { sign: None, number } if word.address() == Some(b'G') => {
            literal(tree.text(number))
        }
        _ => None,
    }
}

/// Whether a word states a position, an orientation or an arc, or is the L that such words need.
fn is_position(dialect: Dialect, word: &Word<'_>) -> bool {
    let name = word.name.to_ascii_uppercase();
    let has_value = word.value != WordValue::Absent;
    match (&*name, dialect) {
        (b"L", Dialect::Heidenhain) => true,
        ([b'I', b'X'..=b'Z' | b'A'..=b'C'] | [b'T', b'X'..=b'Z'], Dialect::Heidenhain) => has_value,
        ([b'A'..=b'C', b'2' | b'3'] | b"THETA" | b"CR", Dialect::Siemens) => has_value,
        ([b'X'..=b'Z' | b'A'..=b'C' | b'I'..=b'K' | b'R'], _) => has_value,
        _ => false,
    }
}

/// Tokens without white space and comments, in upper case.
fn text(tree: &NcTree<'_>, first: u32, end: u32) -> Vec<u8> {
    let tokens = (first..end).filter(|token| tree.kind(*token).is_none_or(|kind| !kind.is_trivia()));
    tokens.flat_map(|token| tree.text(token).to_ascii_uppercase()).collect()
}
