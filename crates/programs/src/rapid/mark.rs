//! The mark: the comment line that records that a file was compensated.
//!
//! `! truegrind 0.1.0 model 3f9a…`, followed by `partial` if cuts may be corrected in part, on a line of its own after the head of
//! each MODULE in which something changed: a controller keeps the modules of a file apart.

use std::ops::Range;

use super::syntax::{RapidTree, Syntax, node_kind, parts, token_kind, tokens_of};
use super::token::Token;
use crate::edit::{Edits, line_end};
use crate::motion::{Mark, is_uncorrected_comment};
use crate::tree::whole_line;

/// Present and future places of the marks of one file: all that is needed of its tree after listing.
#[derive(Debug, Clone)]
pub(super) struct Places {
    modules: Vec<Module>,
    /// The mark of the file.
    old: Option<Range<usize>>,
}

/// One module.
#[derive(Debug, Clone)]
struct Module {
    bytes: Range<usize>,
    /// The mark that it has; that of the file, where it is the only module.
    old: Option<Range<usize>>,
    /// Where a mark goes, and whether a line begins there.
    place: (usize, bool),
    /// The lines that state that the program is not yet corrected.
    uncorrected: Vec<Range<usize>>,
}

impl Places {
    /// The marks of a file.
    pub(super) fn of(tree: &RapidTree<'_>) -> Self {
        let whole = 0..tree.len() as u32;
        let modules = modules(tree);
        let alone = modules.len() == 1;
        let range = |token: u32| tree.range(token, token + 1);
        let module = |module: u32| {
            let node = tree.nodes.get(module);
            let tokens = if alone { whole.clone() } else { node.first..node.end };
            Module {
                bytes: tree.range(node.first, node.end),
                old: token_in(tree, tokens.clone()).map(range),
                place: place(tree, module),
                uncorrected: uncorrected(tree, tokens),
            }
        };
        let modules: Vec<Module> = modules.into_iter().map(module).collect();
        let old = match modules.as_slice() {
            [module] => module.old.clone(),
            _ => token_in(tree, whole).map(range),
        };
        Self { modules, old }
    }

    /// Edits that put `comment` into every changed module.
    pub(super) fn edits(&self, source: &[u8], edits: &Edits, comment: &[u8]) -> Edits {
        let mut changed = vec![self.modules.len() == 1; self.modules.len()];
        if self.modules.len() > 1 {
            for (range, _) in edits.iter() {
                let at = self.modules.partition_point(|module| module.bytes.start <= range.start);
                if at > 0 && range.start < self.modules[at - 1].bytes.end {
                    changed[at - 1] = true;
                }
            }
        }
        let mut marks = Edits::new();
        let end = line_end(source);
        for (module, _) in self.modules.iter().zip(&changed).filter(|(_, changed)| **changed) {
            let (place, begins_line) = module.place;
            match &module.old {
                Some(old) => marks.replace(old.clone(), comment),
                None if begins_line => marks.insert(place, &[comment, end].concat()),
                None => marks.insert(place, &[end, comment, end].concat()),
            }
            module.uncorrected.iter().for_each(|line| marks.replace(line.clone(), b""));
        }
        if marks.is_empty()
            && let Some(old) = &self.old
        {
            marks.replace(old.clone(), comment);
        }
        marks
    }
}

/// The mark of a file, where it has one: the first comment of this form.
pub fn find(tree: &RapidTree<'_>) -> Option<Mark> {
    read(tree.text(token_in(tree, 0..tree.len() as u32)?))
}

/// The token of the mark among some tokens.
fn token_in(tree: &RapidTree<'_>, tokens: Range<u32>) -> Option<u32> {
    // Long stretches without a comment are skipped at once.
    const STRETCH: usize = 128;
    let is_comment = |kind: &Token| *kind == Token::Comment;
    let holds_comment = |kinds: &[Token]| kinds.iter().fold(false, |any, kind| any | is_comment(kind));
    let first = tokens.start as usize;
    let stretches = tree.kinds()[first..tokens.end as usize].chunks(STRETCH);
    let mut stretches = (first..).step_by(STRETCH).zip(stretches);
    stretches.find_map(|(first, kinds)| {
        if !holds_comment(kinds) {
            return None;
        }
        let comments = (first..).zip(kinds).filter(|(_, kind)| is_comment(kind));
        let mut comments = comments.map(|(token, _)| token as u32);
        comments.find(|&token| read(tree.text(token)).is_some())
    })
}

/// The lines among some tokens that state that the program is not yet corrected: the comment with the blanks before it, and
/// its line end where it is alone on the line.
fn uncorrected(tree: &RapidTree<'_>, tokens: Range<u32>) -> Vec<Range<usize>> {
    let first = tokens.start as usize;
    let kinds = (first..).zip(&tree.kinds()[first..tokens.end as usize]);
    let comments = kinds.filter(|(_, kind)| **kind == Token::Comment).map(|(token, _)| token as u32);
    let meant = comments.filter(|&token| is_uncorrected_comment(tree.text(token)));
    meant.map(|token| whole_line(tree.source(), tree.range(token, token + 1))).collect()
}

/// Reads a comment as a mark.
pub fn read(comment: &[u8]) -> Option<Mark> {
    // Hardly any comment is a mark.
    let begins = comment.iter().position(|byte| *byte != b'!' && !byte.is_ascii_whitespace())?;
    if !comment[begins..].starts_with(b"truegrind") {
        return None;
    }
    let text = std::str::from_utf8(comment).ok()?.trim_start_matches('!');
    let mut words = text.split_ascii_whitespace();
    if words.next() != Some("truegrind") {
        return None;
    }
    let version = words.next()?.to_owned();
    if words.next() != Some("model") {
        return None;
    }
    Some(Mark { version, model: words.next()?.to_owned(), partial: words.next() == Some("partial") })
}

/// The comment of a mark.
pub fn text(mark: &Mark) -> String {
    format!("! truegrind {} model {}{}", mark.version, mark.model, if mark.partial { " partial" } else { "" })
}

/// The modules of a file; a fragment has none.
fn modules(tree: &RapidTree<'_>) -> Vec<u32> {
    tree.child_nodes(0).filter(|&node| tree.nodes.kind(node) == Syntax::Module).collect()
}

/// Where the mark of a module goes, and whether a line begins there: after the line on which its head ends, or, where it
/// has no other line, behind its head.
fn place(tree: &RapidTree<'_>, module: u32) -> (usize, bool) {
    let node = tree.nodes.get(module);
    let mut head = node.first + 1;
    for part in parts(tree, module).skip(1) {
        match (node_kind(tree, part), token_kind(tree, part)) {
            (Some(Syntax::Attributes), _) | (_, Some(Token::Ident)) => head = tokens_of(tree, part).1,
            _ => break,
        }
    }
    let span = tree.range(node.first, node.end);
    let behind = tree.range(node.first, head).end;
    let last = line_end(tree.source()).last();
    match tree.source()[behind..span.end].iter().position(|byte| Some(byte) == last) {
        Some(line) => (behind + line + 1, true),
        None => (behind, false),
    }
}
