//! The text of a task outside its motions and the targets that they name: no correction changes it.

use std::collections::HashSet;

use super::lexer::lex;
use super::task::Task;
use super::token::{Token, folded};
use crate::motion::Span;
use crate::remainder::{TextDifference, Version, first_difference};

impl Task<'_> {
    /// For each file with one the first difference from the original outside motions and declared targets; `None` where the two have not
    /// the same number of files.
    pub fn text_differences(&self, original: &Task<'_>) -> Option<Vec<TextDifference>> {
        if self.sources.len() != original.sources.len() {
            return None;
        }
        let files = 0..self.sources.len();
        Some(files.filter_map(|file| difference([self, original], file)).collect())
    }

    /// The motions of a file whose targets a correction may change.
    fn changeable(&self, file: usize) -> Vec<Span> {
        let motions = self.listing.motions.iter();
        let motions =
            motions.filter(|motion| motion.place.file as usize == file && motion.reason().is_none());
        let mut spans: Vec<Span> = motions.map(|motion| motion.statement).collect();
        spans.sort_unstable();
        spans
    }
}

/// Names of the targets that the motions of two versions name: a correction edits their declarations and adds copies.
fn declared(tasks: [&Task<'_>; 2]) -> HashSet<Vec<u8>> {
    let declarations = tasks.into_iter().flat_map(|task| &task.listing.declarations);
    declarations.map(|declaration| folded(declaration.name.as_bytes())).collect()
}

/// The tokens of a file outside the motions and the declarations of these targets: the text without regard to case, and where each begins.
fn tokens(task: &Task<'_>, file: usize, declared: &HashSet<Vec<u8>>) -> Vec<(Vec<u8>, usize)> {
    let tree = lex(task.sources[file]);
    let spans = task.changeable(file);
    let mut next = 0;
    let (mut out, mut statement) = (Vec::new(), 0);
    for token in 0..tree.len() as u32 {
        let start = tree.start(token);
        while spans.get(next).is_some_and(|span| span.end as usize <= start) {
            next += 1;
        }
        let is_changeable = spans.get(next).is_some_and(|span| span.start as usize <= start);
        if is_changeable || tree.kind(token).is_none_or(Token::is_trivia) {
            continue;
        }
        out.push((folded(tree.text(token)), start));
        if tree.kind(token) == Some(Token::Semicolon) {
            if let Some(begin) = declaration(&out[statement..], declared) {
                out.truncate(statement + begin);
            }
            statement = out.len();
        }
    }
    out
}

/// Where the declaration of one of these targets begins in a statement, behind words that end without a semicolon.
fn declaration(statement: &[(Vec<u8>, usize)], declared: &HashSet<Vec<u8>>) -> Option<usize> {
    let word = |at: usize| statement.get(at).map(|(text, _)| text.as_slice());
    let at = statement.iter().position(|(text, _)| matches!(text.as_slice(), b"const" | b"var" | b"pers"))?;
    let is_target = matches!(word(at + 1), Some(b"robtarget" | b"jointtarget"))
        && word(at + 2).is_some_and(|name| declared.contains(name));
    let is_local = at.checked_sub(1).and_then(word).is_some_and(|word| matches!(word, b"local" | b"task"));
    is_target.then_some(if is_local { at - 1 } else { at })
}

fn difference([changed, original]: [&Task<'_>; 2], file: usize) -> Option<TextDifference> {
    let declared = declared([changed, original]);
    let versions = [changed, original]
        .map(|task| Version { source: task.sources[file], words: tokens(task, file, &declared) });
    first_difference(file, versions)
}
