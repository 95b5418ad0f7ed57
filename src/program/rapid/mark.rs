//! The comment line that says that a file was compensated.
//!
//! `! truegrind 0.1.0 model 3f9a…`, on a line of its own after the line of the first MODULE.

use super::syntax::{RapidTree, Syntax};
use super::token::Token;
use crate::program::motion::Mark;

/// The mark of a file, where it has one: the first comment of this form.
pub fn find(tree: &RapidTree<'_>) -> Option<Mark> {
    read(tree.text(token(tree)?))
}

/// The token of the mark.
pub fn token(tree: &RapidTree<'_>) -> Option<u32> {
    // Long stretches hold no comment: that is told without looking at each token by itself.
    const STRETCH: usize = 4096;
    let comment = |kind: &&Token| **kind == Token::Comment;
    let stretches = tree.kinds().chunks(STRETCH).enumerate();
    let mut with_comments = stretches.filter(|(_, kinds)| kinds.iter().filter(comment).count() > 0);
    with_comments.find_map(|(stretch, kinds)| {
        let tokens = (stretch * STRETCH..).zip(kinds).filter(|(_, kind)| comment(kind));
        let mut tokens = tokens.map(|(token, _)| token as u32);
        tokens.find(|&token| read(tree.text(token)).is_some())
    })
}

/// Reads a comment as a mark.
pub fn read(comment: &[u8]) -> Option<Mark> {
    let text = std::str::from_utf8(comment).ok()?.trim_start_matches('!');
    let mut words = text.split_ascii_whitespace();
    if words.next() != Some("truegrind") {
        return None;
    }
    let version = words.next()?.to_owned();
    if words.next() != Some("model") {
        return None;
    }
    Some(Mark { version, model: words.next()?.to_owned() })
}

/// The comment of a mark.
pub fn text(mark: &Mark) -> String {
    format!("! truegrind {} model {}", mark.version, mark.model)
}

/// The byte after the line of the first MODULE, where the mark goes; `None` in a fragment.
pub fn place(tree: &RapidTree<'_>) -> Option<usize> {
    let module = tree.child_nodes(0).find(|&node| tree.nodes[node as usize].kind == Syntax::Module)?;
    let start = tree.start(tree.nodes[module as usize].first);
    let line = tree.source()[start..].iter().position(|&byte| byte == b'\n')?;
    Some(start + line + 1)
}

/// The line end that a file uses.
pub fn line_end(source: &[u8]) -> &'static [u8] {
    match source.iter().position(|&byte| byte == b'\n') {
        Some(at) if at > 0 && source[at - 1] == b'\r' => b"\r\n",
        _ => b"\n",
    }
}
