//! The comment line that marks a compensated file.
//!
//! `; truegrind 0.1.0 model 3f9a…` or `(truegrind 0.1.0 model 3f9a…)`, followed by `partial` if cuts may be corrected
//! in part, on its own line after the header lines of a file (tape start, program number, `BEGIN PGM`).

use std::ops::Range;

use super::dialect::Dialect;
use super::syntax::NcTree;
use super::token::Token;
use crate::motion::{Mark, is_uncorrected_comment};
use crate::tree::whole_line;

/// The mark of a file, if it has one.
pub fn find(tree: &NcTree<'_>) -> Option<Mark> {
    read(tree.text(token(tree)?))
}

/// The token of the mark.
pub fn token(tree: &NcTree<'_>) -> Option<u32> {
    let mut tokens = 0..tree.len() as u32;
    tokens.find(|&token| tree.kind(token) == Some(Token::Comment) && read(tree.text(token)).is_some())
}

/// The lines that state that the program is not corrected yet.
pub(super) fn uncorrected(tree: &NcTree<'_>) -> Vec<Range<usize>> {
    let comments = (0..tree.len() as u32).filter(|&token| tree.kind(token) == Some(Token::Comment));
    let marked = comments.filter(|&token| is_uncorrected_comment(tree.text(token)));
    marked.map(|token| whole_line(tree.source(), tree.range(token, token + 1))).collect()
}

/// Parses a comment as a mark.
///
/// ```
/// use truegrind_programs::motion::Mark;
/// use truegrind_programs::nc::{dialect::Dialect, mark};
///
/// let written = Mark { version: "0.1.0".into(), model: "3f9a".into(), partial: true };
/// let comment = mark::text(&written, Dialect::Fanuc);
/// assert_eq!(comment, "(truegrind 0.1.0 model 3f9a partial)");
/// assert_eq!(mark::read(comment.as_bytes()), Some(written));
/// assert_eq!(mark::read(b"(ROUGH PASS)"), None);
/// ```
pub fn read(comment: &[u8]) -> Option<Mark> {
    let text = comment.trim_ascii();
    let text = text.strip_prefix(b";").or_else(|| text.strip_prefix(b"("))?;
    if !text.trim_ascii_start().to_ascii_lowercase().starts_with(b"truegrind") {
        return None;
    }
    let text = std::str::from_utf8(text).ok()?.trim_end_matches(')');
    let mut words = text.split_ascii_whitespace();
    if !words.next()?.eq_ignore_ascii_case("truegrind") {
        return None;
    }
    let version = words.next()?.to_owned();
    if !words.next()?.eq_ignore_ascii_case("model") {
        return None;
    }
    let model = words.next()?.to_ascii_lowercase();
    Some(Mark {
        version,
        model,
        partial: words.next().is_some_and(|word| word.eq_ignore_ascii_case("partial")),
    })
}

/// The comment of a mark in the syntax of the dialect.
pub fn text(mark: &Mark, dialect: Dialect) -> String {
    let partial = if mark.partial { " partial" } else { "" };
    let text = format!("truegrind {} model {}{partial}", mark.version, mark.model);
    // On a Fanuc `;` is only the end of a block.
    if matches!(dialect, Dialect::Fanuc | Dialect::Iso) { format!("({text})") } else { format!("; {text}") }
}

/// The byte at which the mark is inserted: after the header lines.
pub fn place(tree: &NcTree<'_>, dialect: Dialect) -> usize {
    let source = tree.source();
    // The mark of a text in UTF-8 is no part of its first line.
    let mut place = if source.starts_with(b"\xEF\xBB\xBF") { 3 } else { 0 };
    let mut at = 0;
    let last = if source.contains(&b'\n') { b'\n' } else { b'\r' };
    while at < source.len() {
        let end = source[at..].iter().position(|&byte| byte == last).map_or(source.len(), |end| at + end + 1);
        let line = source[at..end].trim_ascii();
        let line = line.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(line);
        let upper = line.to_ascii_uppercase();
        let digits = upper.iter().take_while(|byte| byte.is_ascii_digit() || **byte == b' ').count();
        let stays = match dialect {
            Dialect::Heidenhain => upper[digits..].starts_with(b"BEGIN PGM"),
            Dialect::LinuxCnc => line.starts_with(b"%"),
            _ => {
                line.starts_with(b"%")
                    || upper.starts_with(b";$PATH")
                    || upper.starts_with(b"PROC ")
                    || matches!(upper.first(), Some(b'O' | b':'))
                        && upper.get(1).is_some_and(u8::is_ascii_digit)
                    // The name of a program of a Fanuc 30i.
                    || dialect.paren_comments() && line.starts_with(b"<") && line.contains(&b'>')
            }
        };
        // Empty lines before header lines are skipped.
        if stays {
            place = end;
        } else if !line.is_empty() {
            break;
        }
        at = end;
    }
    place
}
