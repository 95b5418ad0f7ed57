//! Bytes to tokens.
//!
//! Every byte ends up in exactly one token, whatever the file holds. A comment in parentheses ends at its line; a line
//! that begins with `%` is one token.

use super::dialect::Dialect;
use super::syntax::Syntax;
use super::token::Token;
use crate::program::tree::Tree;

/// Splits a file into tokens.
pub fn lex(source: &[u8], dialect: Dialect) -> Tree<'_, Token, Syntax> {
    if source.len() >= u32::MAX as usize || is_binary(source) {
        let mut tree = Tree::new(source, 1);
        tree.push(Token::Unknown, 0);
        return tree;
    }
    let mut tree = Tree::new(source, source.len() / 2);
    let mut at = 0;
    let mut line_begins = true;
    // What stood before in the line: a name in pointed brackets only follows `#` or the O of a subprogram.
    let mut before = Token::LineEnd;
    while at < source.len() {
        let rest = &source[at..];
        let (kind, length) = token(rest, dialect, line_begins, before);
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
fn token(rest: &[u8], dialect: Dialect, line_begins: bool, before: Token) -> (Token, usize) {
    let second = rest.get(1).copied().unwrap_or(0);
    let two = |wanted: u8, both: Token, single: Token| if second == wanted { (both, 2) } else { (single, 1) };
    match rest[0] {
        b'\n' => (Token::LineEnd, 1),
        b'\r' if second == b'\n' => (Token::LineEnd, 2),
        b' ' | b'\t' | b'\r' | 0x0B | 0x0C | 0x1A | 0x00 | 0xA0 => (Token::Space, run(rest, is_space)),
        0xEF if rest.starts_with(b"\xEF\xBB\xBF") => (Token::Space, 3),
        b'0'..=b'9' => (Token::Number, number(rest, dialect)),
        b'.' if second.is_ascii_digit() => (Token::Number, number(rest, dialect)),
        b'A'..=b'Z' | b'a'..=b'z' | b'_' | b'$' => word(rest, dialect),
        b';' => (Token::Comment, to_line_end(rest)),
        b'%' if line_begins => (Token::Tape, to_line_end(rest)),
        b'(' if dialect.paren_comments() => (Token::Comment, paren_comment(rest)),
        b'*' if dialect == Dialect::Heidenhain => (Token::Comment, to_line_end(rest)),
        b'"' => (Token::String, quoted(rest, b'"')),
        b'\'' => (Token::String, quoted(rest, b'\'')),
        b'<' if dialect == Dialect::LinuxCnc && matches!(before, Token::Hash | Token::Address) => {
            let end = rest.iter().position(|&byte| matches!(byte, b'>' | b'\n' | b'\r'));
            match end.filter(|&end| rest[end] == b'>') {
                Some(end) => (Token::Name, end + 1),
                None => (Token::Less, 1),
            }
        }
        b'+' => (Token::Plus, 1),
        b'-' => (Token::Minus, 1),
        // The end of a block on old tapes.
        b'*' if dialect.paren_comments() && ends_line(&rest[1..]) => (Token::Comment, 1),
        b'*' => two(b'*', Token::Power, Token::Star),
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

fn is_space(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | 0x0B | 0x0C | 0x1A | 0x00 | 0xA0)
}

/// Whether nothing but white space follows on the line.
fn ends_line(rest: &[u8]) -> bool {
    let next = rest.iter().find(|&&byte| !matches!(byte, b' ' | b'\t' | b'\r'));
    next.is_none_or(|&byte| byte == b'\n')
}

fn run(rest: &[u8], wanted: impl Fn(u8) -> bool) -> usize {
    rest.iter().take_while(|&&byte| wanted(byte)).count().max(1)
}

fn to_line_end(rest: &[u8]) -> usize {
    let end = rest.iter().position(|&byte| byte == b'\n').unwrap_or(rest.len());
    if end > 1 && rest[end - 1] == b'\r' { end - 1 } else { end }
}

fn paren_comment(rest: &[u8]) -> usize {
    let end = rest.iter().position(|&byte| matches!(byte, b')' | b'\n' | b'\r')).unwrap_or(rest.len());
    if rest.get(end) == Some(&b')') { end + 1 } else { end }
}

/// A quoted piece to its closing mark, at most to the end of the line.
fn quoted(rest: &[u8], mark: u8) -> usize {
    let end = rest[1..].iter().position(|&byte| byte == mark || matches!(byte, b'\n' | b'\r'));
    match end {
        Some(end) if rest[1 + end] == mark => end + 2,
        Some(end) => end + 1,
        None => rest.len(),
    }
}

/// Digits with at most one point; Heidenhain also writes a comma.
fn number(rest: &[u8], dialect: Dialect) -> usize {
    let digits = |from: usize| from + rest[from..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    let whole = digits(0);
    let mantissa = match rest.get(whole) {
        Some(b'.') => digits(whole + 1),
        Some(b',')
            if dialect == Dialect::Heidenhain && rest.get(whole + 1).is_some_and(u8::is_ascii_digit) =>
        {
            digits(whole + 1)
        }
        _ => whole,
    };
    mantissa + if dialect == Dialect::Siemens { exponent(&rest[mantissa..]) } else { 0 }
}

/// The exponent of a Siemens number: EX with a sign or none, and digits.
fn exponent(rest: &[u8]) -> usize {
    let Some(after) = rest.get(..2).filter(|two| two.eq_ignore_ascii_case(b"EX")).map(|_| &rest[2..]) else {
        return 0;
    };
    let sign = usize::from(matches!(after.first(), Some(b'+' | b'-')));
    let digits = after[sign..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    if digits == 0 { 0 } else { 2 + sign + digits }
}

/// An address or a name.
fn word(rest: &[u8], dialect: Dialect) -> (Token, usize) {
    let letter = |byte: u8| byte.is_ascii_alphabetic() || matches!(byte, b'_' | b'$');
    let letters = run(rest, letter);
    if dialect != Dialect::Siemens {
        return if letters == 1 && rest[0].is_ascii_alphabetic() {
            (Token::Address, 1)
        } else {
            (Token::Name, letters)
        };
    }
    let all = run(rest, |byte| letter(byte) || byte.is_ascii_digit());
    if letters > 1 || !rest[0].is_ascii_alphabetic() {
        return (Token::Name, all);
    }
    // A3=, R12=, M3=3: one letter with a number is a name where a value is assigned to it.
    let numbered = 1 + rest[1..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    let after = rest[numbered..].iter().position(|byte| !matches!(byte, b' ' | b'\t'));
    let next = after.map(|after| &rest[numbered + after..]);
    let assigned = next.is_some_and(|next| next[0] == b'=' && next.get(1) != Some(&b'='));
    if numbered > 1 && (assigned || next.is_some_and(|next| next[0] == b'[' && after == Some(0))) {
        return (Token::Name, numbered);
    }
    (Token::Address, 1)
}

/// Whether the bytes are no text.
fn is_binary(source: &[u8]) -> bool {
    let sample = &source[..source.len().min(4096)];
    let control = sample
        .iter()
        .filter(|&&byte| byte < 9 && byte != 0 || (14..32).contains(&byte) && byte != 0x1A)
        .count();
    let zero = sample.iter().filter(|&&byte| byte == 0).count();
    control * 50 > sample.len() || zero * 4 > sample.len()
}
