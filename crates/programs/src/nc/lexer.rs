//! The lexer: bytes to tokens.
//!
//! Every byte belongs to exactly one token. A comment in parentheses ends with its line; a line that begins with `%`
//! is one token.

use super::dialect::{Dialect, is_okuma};
use super::expression::is_function;
use super::syntax::Syntax;
use super::token::Token;
use crate::tree::Tree;

/// Splits a file into tokens.
pub fn lex(source: &[u8], dialect: Dialect) -> Tree<'_, Token, Syntax> {
    if source.len() >= u32::MAX as usize || is_binary(source) {
        let mut tree = Tree::new(source, 1);
        tree.push(Token::Unknown, 0);
        return tree;
    }
    let mut tree = Tree::new(source, source.len() / 2);
    // Old tapes end their lines with CR alone.
    let cr = !source.contains(&b'\n');
    let mut at = 0;
    let mut line_begins = true;
    // The last token of the line: a name in angle brackets only follows `#` or the O of a subprogram.
    let mut before = Token::LineEnd;
    // Whether the line before is a comment that continues (Heidenhain).
    let mut comment_continues = false;
    // No closing angle bracket before this byte; avoids repeated searches of a line.
    let mut unclosed_to = 0;
    while at < source.len() {
        let rest = &source[at..];
        let (kind, length) = match rest[0] {
            // A block number begins a new block.
            byte if comment_continues
                && !is_space(byte)
                && !byte.is_ascii_digit()
                && !matches!(byte, b'\r' | b'\n') =>
            {
                (Token::Comment, to_line_end(rest, cr))
            }
            b'\r' if cr => (Token::LineEnd, 1),
            b'*' if dialect == Dialect::Heidenhain && begins_block(&source[..at]) => {
                (Token::Comment, to_line_end(rest, cr))
            }
            b'<' if dialect == Dialect::LinuxCnc && matches!(before, Token::Hash | Token::Address) => {
                angle_bracket_name(source, at, &mut unclosed_to)
            }
            _ => token(rest, dialect, line_begins, cr),
        };
        comment_continues = match kind {
            Token::Comment => {
                dialect == Dialect::Heidenhain
                    && rest[..length].trim_ascii_end().ends_with(b"~")
                    && (comment_continues || is_numbered_comment(&source[..at]))
            }
            Token::LineEnd => comment_continues && before == Token::Comment,
            _ => comment_continues && kind == Token::Space,
        };
        tree.push(kind, at);
        if kind == Token::LineEnd {
            tree.line_starts(at + length);
        }
        line_begins = kind == Token::LineEnd || line_begins && matches!(kind, Token::Space);
        if kind != Token::Space {
            before = kind;
        }
        at += length;
    }
    tree
}

/// The first token and its length.
#[inline]
fn token(rest: &[u8], dialect: Dialect, line_begins: bool, cr: bool) -> (Token, usize) {
    let second = rest.get(1).copied().unwrap_or(0);
    let two = |wanted: u8, both: Token, single: Token| if second == wanted { (both, 2) } else { (single, 1) };
    match rest[0] {
        b'\n' => (Token::LineEnd, 1),
        b'\r' if second == b'\n' => (Token::LineEnd, 2),
        b' ' | b'\t' | b'\r' | 0x0B | 0x0C | 0x1A | 0x00 | 0xA0 => (Token::Space, run(rest, is_space)),
        0xEF if rest.starts_with(b"\xEF\xBB\xBF") => (Token::Space, 3),
        b'0'..=b'9' => (Token::Number, number(rest, dialect)),
        b'.' if second.is_ascii_digit() => (Token::Number, number(rest, dialect)),
        b'$' if line_begins && dialect.paren_comments() && is_okuma(&rest[..to_line_end(rest, cr)]) => {
            (Token::Tape, to_line_end(rest, cr))
        }
        b'A'..=b'Z' | b'a'..=b'z' | b'_' | b'$' => word(rest, dialect),
        // The end of a block on a Fanuc: what stands behind it is another block, and no comment.
        b';' if dialect == Dialect::Fanuc && !line_begins && !is_comment_or_blank(&rest[1..], cr) => {
            (Token::Unknown, 1)
        }
        b';' => (Token::Comment, to_line_end(rest, cr)),
        b'%' if line_begins => (Token::Tape, to_line_end(rest, cr)),
        // An unclosed comment swallows the next blocks, or stops the control.
        b'(' if matches!(dialect, Dialect::Fanuc | Dialect::LinuxCnc) && !closes_comment(rest) => {
            (Token::Unknown, to_line_end(rest, cr))
        }
        b'(' if dialect.paren_comments() => (Token::Comment, paren_comment(rest)),
        b'"' => (Token::String, quoted(rest, b'"')),
        b'\'' => (Token::String, quoted(rest, b'\'')),
        b'+' => (Token::Plus, 1),
        b'-' => (Token::Minus, 1),
        // The end of a block on old tapes.
        b'*' if dialect.paren_comments() && ends_line(&rest[1..], cr) => (Token::Comment, 1),
        b'*' => two(b'*', Token::Power, Token::Star),
        b'^' if dialect == Dialect::Heidenhain => (Token::Power, 1),
        b'%' if dialect == Dialect::Heidenhain => (Token::Percent, 1),
        b'/' => (Token::Slash, 1),
        b'=' => two(b'=', Token::EqualEqual, Token::Equal),
        b'<' if second == b'>' => (Token::NotEqual, 2),
        b'<' => two(b'=', Token::LessEqual, Token::Less),
        b'>' => two(b'=', Token::GreaterEqual, Token::Greater),
        b'[' => (Token::BracketOpen, 1),
        b']' => (Token::BracketClose, 1),
        b'(' => (Token::ParenOpen, 1),
        b')' => (Token::ParenClose, 1),
        b',' => (Token::Comma, 1),
        b':' => (Token::Colon, 1),
        b'#' => (Token::Hash, 1),
        _ => (Token::Unknown, 1),
    }
}

/// A name in angle brackets, or a `<` that is not closed on its line.
fn angle_bracket_name(source: &[u8], at: usize, unclosed_to: &mut usize) -> (Token, usize) {
    let rest = &source[at..];
    if at >= *unclosed_to {
        let end = rest.iter().position(|&byte| matches!(byte, b'>' | b'\n' | b'\r'));
        if let Some(end) = end.filter(|&end| rest[end] == b'>') {
            return (Token::Name, end + 1);
        }
        *unclosed_to = at + end.unwrap_or(rest.len());
    }
    match rest.get(1) {
        Some(b'>') => (Token::NotEqual, 2),
        _ => (Token::Less, 1),
    }
}

/// Whether only a block number precedes on the line: there a star begins a heading, elsewhere it multiplies.
fn begins_block(before: &[u8]) -> bool {
    let last = before.iter().rev().find(|byte| !byte.is_ascii_digit() && !is_space(**byte));
    last.is_none_or(|byte| matches!(byte, b'\n' | b'\r'))
}

/// Whether a comment after these bytes is a numbered block of its own, and not a continuation: only then do the lines
/// after its `~` belong to it.
fn is_numbered_comment(before: &[u8]) -> bool {
    let line = before.iter().rposition(|&byte| matches!(byte, b'\n' | b'\r')).map_or(0, |at| at + 1);
    let number = before[line..].trim_ascii();
    !number.is_empty()
        && number.iter().all(u8::is_ascii_digit)
        && !before[..line].trim_ascii_end().ends_with(b"~")
}

fn is_space(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | 0x0B | 0x0C | 0x1A | 0x00 | 0xA0)
}

/// Whether only white space follows on the line.
fn ends_line(rest: &[u8], cr: bool) -> bool {
    let next = rest.iter().find(|&&byte| !matches!(byte, b' ' | b'\t') && (cr || byte != b'\r'));
    next.is_none_or(|&byte| byte == b'\n' || byte == b'\r')
}

fn run(rest: &[u8], wanted: impl Fn(u8) -> bool) -> usize {
    rest.iter().take_while(|&&byte| wanted(byte)).count().max(1)
}

fn to_line_end(rest: &[u8], cr: bool) -> usize {
    let last = if cr { b'\r' } else { b'\n' };
    let end = rest.iter().position(|&byte| byte == last).unwrap_or(rest.len());
    if end > 1 && rest[end - 1] == b'\r' { end - 1 } else { end }
}

/// Whether only a comment in parentheses, or nothing, follows on the line.
fn is_comment_or_blank(rest: &[u8], cr: bool) -> bool {
    ends_line(rest, cr) || rest.iter().find(|byte| !is_space(**byte)) == Some(&b'(')
}

/// Whether a comment in parentheses ends on its line.
fn closes_comment(rest: &[u8]) -> bool {
    let end = rest.iter().find(|byte| matches!(**byte, b')' | b'\n' | b'\r'));
    end == Some(&b')')
}

fn paren_comment(rest: &[u8]) -> usize {
    let end = rest.iter().position(|&byte| matches!(byte, b')' | b'\n' | b'\r')).unwrap_or(rest.len());
    if rest.get(end) != Some(&b')') {
        return end;
    }
    // Nested brackets: surplus closing ones at the end of the line belong to the comment.
    let more = rest[end..].iter().take_while(|&&byte| matches!(byte, b')' | b' ' | b'\t')).count();
    let closes = rest[end..end + more].iter().rposition(|&byte| byte == b')').map_or(1, |last| last + 1);
    if matches!(rest.get(end + more), None | Some(b'\r' | b'\n')) { end + closes } else { end + 1 }
}

/// A string to its closing quote, at most to the end of the line.
fn quoted(rest: &[u8], mark: u8) -> usize {
    let end = rest[1..].iter().position(|&byte| byte == mark || matches!(byte, b'\n' | b'\r'));
    match end {
        Some(end) if rest[1 + end] == mark => end + 2,
        Some(end) => end + 1,
        None => rest.len(),
    }
}

/// Digits with at most one decimal point, or a comma (Heidenhain).
fn number(rest: &[u8], dialect: Dialect) -> usize {
    let digits = |from: usize| from + rest[from..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    let whole = digits(0);
    let end = match rest.get(whole) {
        Some(b'.') => digits(whole + 1),
        Some(b',')
            if dialect == Dialect::Heidenhain && rest.get(whole + 1).is_some_and(u8::is_ascii_digit) =>
        {
            digits(whole + 1)
        }
        _ => whole,
    };
    // 1.5EX-3 of Siemens.
    if dialect == Dialect::Siemens && rest[end..].len() > 2 && rest[end..end + 2].eq_ignore_ascii_case(b"EX")
    {
        let sign = usize::from(matches!(rest[end + 2], b'+' | b'-'));
        let last = digits(end + 2 + sign);
        if last > end + 2 + sign {
            return last;
        }
    }
    end
}

/// An address or a name.
fn word(rest: &[u8], dialect: Dialect) -> (Token, usize) {
    let letter = |byte: u8| byte.is_ascii_alphabetic() || matches!(byte, b'_' | b'$');
    let letters = run(rest, letter);
    if dialect != Dialect::Siemens {
        // XSQRT[16]: an address followed by a function.
        let applies = dialect == Dialect::LinuxCnc
            && letters > 2
            && !is_function(&rest[..letters])
            && is_function(&rest[1..letters]);
        return if (letters == 1 || applies) && rest[0].is_ascii_alphabetic() {
            (Token::Address, 1)
        } else {
            (Token::Name, letters)
        };
    }
    let all = run(rest, |byte| letter(byte) || byte.is_ascii_digit());
    if letters > 1 || !rest[0].is_ascii_alphabetic() {
        return (Token::Name, all);
    }
    // A3=, R12=, M3=3: one letter with a number is a name if a value is assigned to it.
    let numbered = 1 + rest[1..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    let after = rest[numbered..].iter().position(|byte| !matches!(byte, b' ' | b'\t'));
    let next = after.map(|after| &rest[numbered + after..]);
    let assigned = next.is_some_and(|next| next[0] == b'=' && next.get(1) != Some(&b'='));
    if numbered > 1 && (assigned || next.is_some_and(|next| next[0] == b'[' && after == Some(0))) {
        return (Token::Name, numbered);
    }
    (Token::Address, 1)
}

/// Whether the bytes are not text.
fn is_binary(source: &[u8]) -> bool {
    let sample = &source[..source.len().min(4096)];
    let control = sample
        .iter()
        .filter(|&&byte| byte < 9 && byte != 0 || (14..32).contains(&byte) && byte != 0x1A)
        .count();
    let zero = sample.iter().filter(|&&byte| byte == 0).count();
    control * 50 > sample.len() || zero * 4 > sample.len()
}
