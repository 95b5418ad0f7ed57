//! The text of a task but for the targets of its motions: no correction changes it, nor its place between the motions.

use std::collections::HashSet;

use super::instruction::{self, INSTRUCTIONS, Instruction};
use super::lexer::lex;
use super::task::Task;
use super::token::{Token, folded};
use crate::motion::{Motion, MotionTarget};
use crate::remainder::TextDifference;

impl Task<'_> {
    /// For each file with one the first difference from the original besides targets and inserted motions; `None` where the two have not
    /// the same number of files.
    pub fn text_differences(&self, original: &Task<'_>) -> Option<Vec<TextDifference>> {
        if self.sources.len() != original.sources.len() {
            return None;
        }
        let files = 0..self.sources.len();
        Some(files.filter_map(|file| difference([self, original], file)).collect())
    }

    /// The motions of a file whose targets a correction may change.
    fn changeable(&self, file: usize) -> Vec<&Motion> {
        let motions = self.listing.motions.iter();
        let motions =
            motions.filter(|motion| motion.place.file as usize == file && motion.reason().is_none());
        let mut motions: Vec<&Motion> = motions.collect();
        motions.sort_unstable_by_key(|motion| motion.statement);
        motions
    }
}

/// A token outside motions, or a motion.
struct Piece<'a> {
    /// The text without regard to case; empty for a motion.
    text: Vec<u8>,
    /// Where it begins.
    start: usize,
    /// The motion, with its tokens behind the name but for the targets.
    motion: Option<(&'a Motion, Vec<Vec<u8>>)>,
}

/// Names of the targets that the motions of two versions name: a correction edits their declarations and adds copies.
fn declared(tasks: [&Task<'_>; 2]) -> HashSet<Vec<u8>> {
    let declarations = tasks.into_iter().flat_map(|task| &task.listing.declarations);
    declarations.map(|declaration| folded(declaration.name.as_bytes())).collect()
}

/// The pieces of a file but for the declarations of these targets.
fn pieces<'a>(task: &'a Task<'_>, file: usize, declared: &HashSet<Vec<u8>>) -> Vec<Piece<'a>> {
    let tree = lex(task.sources[file]);
    let motions = task.changeable(file);
    let mut next = 0;
    let (mut out, mut statement): (Vec<Piece<'a>>, usize) = (Vec::new(), 0);
    for token in 0..tree.len() as u32 {
        let start = tree.start(token);
        while motions.get(next).is_some_and(|motion| motion.statement.end as usize <= start) {
            next += 1;
        }
        if tree.kind(token).is_none_or(Token::is_trivia) {
            continue;
        }
        let text = folded(tree.text(token));
        match motions.get(next).filter(|motion| motion.statement.start as usize <= start) {
            Some(motion) if motion.statement.start as usize == start => {
                out.push(Piece { text: Vec::new(), start, motion: Some((*motion, Vec::new())) });
                statement = out.len();
                continue;
            }
            Some(motion) => {
                if let Some(Piece { motion: Some((_, rest)), .. }) = out.last_mut() {
                    add_to_rest(rest, text, start, motion);
                }
                continue;
            }
            None => out.push(Piece { text, start, motion: None }),
        }
        if tree.kind(token) == Some(Token::Semicolon) {
            if let Some(begin) = declaration(&out[statement..], declared) {
                out.truncate(statement + begin);
            }
            statement = out.len();
        }
    }
    out
}

/// Adds a token of a motion unless it belongs to a target. Of a target, its name (`ToPoint:=`) and the comma behind it do not count either: a
/// circle that becomes straight loses its first.
fn add_to_rest(rest: &mut Vec<Vec<u8>>, text: Vec<u8>, start: usize, motion: &Motion) {
    let is_within = |target: &MotionTarget| {
        (target.argument.start as usize..target.argument.end as usize).contains(&start)
    };
    if motion.targets.iter().any(is_within) {
        if rest.last().is_some_and(|before| before == b":=") {
            rest.truncate(rest.len() - 2.min(rest.len()));
        }
        if rest.last().is_none_or(|before| !before.is_empty()) {
            // Stands for the target until the comma.
            rest.push(Vec::new());
        }
        return;
    }
    if rest.last().is_some_and(Vec::is_empty) {
        rest.pop();
        if text == b"," {
            return;
        }
    }
    rest.push(text);
}

/// Whether a correction may have written one motion for another: it changes targets, writes joints for poses and lines for circles.
fn is_corrected(was: &Piece<'_>, is: &Piece<'_>) -> bool {
    let (Some((was, had)), Some((is, has))) = (&was.motion, &is.motion) else { return false };
    let find = |name: &str| instruction::find(name.as_bytes()).map(|index| &INSTRUCTIONS[index]);
    let is_named = |name: Option<&str>| name.is_some_and(|name| name.eq_ignore_ascii_case(&is.instruction));
    let form = find(&was.instruction);
    let line = form.and_then(Instruction::line_form);
    let may_become = is_named(Some(&was.instruction))
        || is_named(form.and_then(|form| form.joint_form))
        || is_named(line.map(|line| line.name))
        || is_named(line.and_then(|line| line.joint_form));
    may_become && had == has
}

/// Where the declaration of one of these targets begins in a statement, behind words that end without a semicolon.
fn declaration(statement: &[Piece<'_>], declared: &HashSet<Vec<u8>>) -> Option<usize> {
    let word = |at: usize| statement.get(at).map(|piece| piece.text.as_slice());
    let at =
        statement.iter().position(|piece| matches!(piece.text.as_slice(), b"const" | b"var" | b"pers"))?;
    let is_target = matches!(word(at + 1), Some(b"robtarget" | b"jointtarget"))
        && word(at + 2).is_some_and(|name| declared.contains(name));
    let is_local = at.checked_sub(1).and_then(word).is_some_and(|word| matches!(word, b"local" | b"task"));
    is_target.then_some(if is_local { at - 1 } else { at })
}

/// The first pieces that differ, each by its index: of the changed version, and of the original. Between two other pieces the motions of the
/// original must be among those of the changed version, in their order; what is inserted there is judged with its targets.
fn first_difference(here: &[Piece<'_>], there: &[Piece<'_>]) -> Option<[usize; 2]> {
    let run = |pieces: &[Piece<'_>], from: usize| {
        pieces[from..].iter().take_while(|piece| piece.motion.is_some()).count()
    };
    let (mut at, mut was_at) = (0, 0);
    loop {
        let [end, was_end] = [at + run(here, at), was_at + run(there, was_at)];
        let (begin, was_begin, mut behind) = (at, was_at, at);
        for index in at..end {
            if was_at < was_end && is_corrected(&there[was_at], &here[index]) {
                (was_at, behind) = (was_at + 1, index + 1);
            }
        }
        if was_at < was_end {
            // Without insertions the first that differs shows more.
            let mut pairs = (begin..end).zip(was_begin..was_end);
            let apart = pairs.find(|(is, was)| !is_corrected(&there[*was], &here[*is]));
            let same_length = end - begin == was_end - was_begin;
            return Some(apart.filter(|_| same_length).map_or([behind, was_at], |(is, was)| [is, was]));
        }
        at = end;
        match [here.get(at), there.get(was_at)] {
            [None, None] => return None,
            [Some(a), Some(b)] if a.text == b.text && b.motion.is_none() => {
                (at, was_at) = (at + 1, was_at + 1)
            }
            _ => return Some([at, was_at]),
        }
    }
}

fn difference([changed, original]: [&Task<'_>; 2], file: usize) -> Option<TextDifference> {
    let declared = declared([changed, original]);
    let [here, there] = [changed, original].map(|task| pieces(task, file, &declared));
    let [at, was_at] = first_difference(&here, &there)?;
    let [start, was_start] = [here.get(at), there.get(was_at)].map(|piece| piece.map(|piece| piece.start));
    let sources = [changed, original].map(|task| task.sources[file]);
    let in_motion = [here.get(at), there.get(was_at)]
        .iter()
        .all(|piece| piece.is_some_and(|piece| piece.motion.is_some()));
    Some(TextDifference { in_motion, ..TextDifference::at(file, sources, [start, was_start]) })
}
