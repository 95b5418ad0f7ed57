//! Lexer: bytes to tokens, with `nom` (RAPID kernel reference, chapter 2).
//!
//! Every byte ends up in exactly one token, whatever the file holds. The lexer works on bytes and never transcodes:
//! controllers write Latin-1, people write UTF-8 and GBK into comments, and none of these can hide a `"`, `!`, `;` or
//! line end in the second byte of a character. There is no `\"` escape in RAPID strings.

use nom::branch::alt;
use nom::bytes::complete::{tag, tag_no_case, take, take_while, take_while1};
use nom::character::complete::digit1;
use nom::combinator::recognize;
use nom::{IResult, Parser};
use rayon::prelude::*;

use super::syntax::Syntax;
use super::token::{Token, keyword};
use crate::tree::Tree;

type Bytes<'s> = &'s [u8];
type Lexed<'s, O = Bytes<'s>> = IResult<Bytes<'s>, O, ()>;

/// The placeholders of the editor; programs with them are legal.
const PLACEHOLDERS: [&str; 13] =
    ["TDN", "DDN", "RDN", "PAR", "ALT", "DIM", "SMT", "VAR", "EIT", "CSE", "EXP", "ARG", "ID"];

/// Greatest distance between the two `%%%` of a header (bytes).
const HEADER_LIMIT: usize = 1024;

/// Larger files are lexed on all threads (bytes).
const LARGE: usize = 1 << 20;

/// The bytes that are a token whatever follows.
const ALONE: [Option<Token>; 256] = {
    const BYTES: [(u8, Token); 16] = [
        (b',', Token::Comma),
        (b'[', Token::BracketOpen),
        (b']', Token::BracketClose),
        (b'-', Token::Minus),
        (b';', Token::Semicolon),
        (b'\\', Token::Backslash),
        (b'(', Token::ParenOpen),
        (b')', Token::ParenClose),
        (b'{', Token::BraceOpen),
        (b'}', Token::BraceClose),
        (b'+', Token::Plus),
        (b'*', Token::Star),
        (b'/', Token::Slash),
        (b'=', Token::Equal),
        (b'?', Token::Question),
        (b'|', Token::Pipe),
    ];
    let mut alone = [None; 256];
    let mut k = 0;
    while k < BYTES.len() {
        alone[BYTES[k].0 as usize] = Some(BYTES[k].1);
        k += 1;
    }
    alone
};

/// The bytes of names and reserved words.
const IN_NAMES: [bool; 256] = {
    let mut inside = [false; 256];
    let mut byte = 0;
    while byte < inside.len() {
        inside[byte] = byte >= 0x80 || byte as u8 == b'_' || (byte as u8).is_ascii_alphanumeric();
        byte += 1;
    }
    inside
};

/// Splits a file into tokens.
///
/// A large file is cut where a line begins with something other than white space: only white space and the
/// header extend over the end of a line, so the tokens are the same as of the whole.
pub fn lex(source: &[u8]) -> Tree<'_, Token, Syntax> {
    if source.len() >= u32::MAX as usize || is_binary(source) {
        let mut tree = Tree::new(source, 1);
        tree.push(Token::Unknown, 0);
        return tree;
    }
    lex_text(source)
}

/// Splits the text of a program into tokens.
pub(super) fn lex_text(source: &[u8]) -> Tree<'_, Token, Syntax> {
    let mut tree = Tree::new(source, source.len() / 2);
    let cuts = cuts(source);
    let Some(&first) = cuts.first() else {
        tokens(source, 0..source.len(), &mut tree);
        return tree;
    };
    let ends = cuts[1..].iter().copied().chain([source.len()]);
    let later: Vec<std::ops::Range<usize>> = cuts.iter().zip(ends).map(|(&from, to)| from..to).collect();
    let ((), later) = rayon::join(
        || tokens(source, 0..first, &mut tree),
        || -> Vec<_> {
            let part = |range: &std::ops::Range<usize>| {
                let mut part = Tree::part(source, range.len() / 2);
                tokens(source, range.clone(), &mut part);
                part
            };
            later.par_iter().map(part).collect()
        },
    );
    tree.append(&later);
    tree
}

/// Where to cut a large file, one part for each thread.
fn cuts(source: &[u8]) -> Vec<usize> {
    let parts =
        if source.len() < LARGE { 1 } else { rayon::current_num_threads().min(source.len() / LARGE + 1) };
    let mut cuts: Vec<usize> = Vec::new();
    for part in 1..parts {
        let mut at = part * (source.len() / parts);
        let cut = loop {
            let Some(line) = source[at..].iter().position(|&byte| byte == b'\n') else { break source.len() };
            let begin = source[at + line..].iter().position(|&byte| !is_space(byte));
            let Some(begin) = begin.map(|begin| at + line + begin) else { break source.len() };
            // Not within what may be a header.
            let near = &source[begin.saturating_sub(HEADER_LIMIT + 8)..begin];
            if !near.windows(3).any(|three| three == b"%%%") {
                break begin;
            }
            at = begin;
        };
        if cut < source.len() && cuts.last().is_none_or(|&last| last < cut) {
            cuts.push(cut);
        }
    }
    cuts
}

fn is_space(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | b'\n' | b'\r' | 0x0B | 0x0C | 0x1A | 0xA0)
}

/// The tokens of a part of a file that begins and ends between tokens.
fn tokens(source: &[u8], range: std::ops::Range<usize>, tree: &mut Tree<'_, Token, Syntax>) {
    let text = &source[..range.end];
    let mut at = range.start;
    // Some tokens at once: one by one, the room for each would be looked at in two lists.
    let (mut kinds, mut starts) = ([Token::End; 64], [0; 64]);
    while at < text.len() {
        let mut count = 0;
        while count < kinds.len()
            && let Some(&first) = text.get(at)
        {
            let rest = &text[at..];
            let (kind, length) = match ALONE[usize::from(first)] {
                Some(kind) => (kind, 1),
                None if first.is_ascii_digit() => (Token::Number, number_length(rest)),
                None if is_space(first) => (Token::Space, space(rest, at, tree)),
                None => token(rest, at, tree),
            };
            (kinds[count], starts[count]) = (kind, at as u32);
            count += 1;
            at += length;
        }
        tree.extend(&kinds[..count], &starts[..count]);
    }
}

/// The length of white space; records the beginnings of lines.
#[inline]
fn space(input: Bytes<'_>, at: usize, tree: &mut Tree<'_, Token, Syntax>) -> usize {
    let mut index = 0;
    while let Some(&byte) = input.get(index) {
        match byte {
            b'\n' => tree.line_starts(at + index + 1),
            // A carriage return alone ends a line too.
            b'\r' if input.get(index + 1) != Some(&b'\n') => tree.line_starts(at + index + 1),
            byte if is_space(byte) => {}
            _ => break,
        }
        index += 1;
    }
    index
}

/// One token that is neither white space nor [`ALONE`] nor begins with a digit, and its length.
fn token(input: Bytes<'_>, at: usize, tree: &mut Tree<'_, Token, Syntax>) -> (Token, usize) {
    let Ok((rest, kind)) = other(input) else { return (Token::Unknown, 1) };
    let length = input.len() - rest.len();
    if kind == Token::Header {
        for (index, _) in input[..length].iter().enumerate().filter(|&(_, &byte)| byte == b'\n') {
            tree.line_starts(at + index + 1);
        }
    }
    (kind, length)
}

#[inline]
fn other(input: Bytes<'_>) -> Lexed<'_, Token> {
    let one = |kind| Ok((&input[1..], kind));
    let two = |second: u8, both, single| match input.get(1) {
        Some(&byte) if byte == second => Ok((&input[2..], both)),
        _ => Ok((&input[1..], single)),
    };
    match input[0] {
        b'a'..=b'z' | b'A'..=b'Z' | b'_' | 0xC0.. => word(input),
        b'.' if input.get(1).is_some_and(u8::is_ascii_digit) => {
            number(input).map(|(rest, _)| (rest, Token::Number))
        }
        b'.' => one(Token::Dot),
        b':' => two(b'=', Token::Assign, Token::Colon),
        b'!' => {
            take_while(|byte| byte != b'\n' && byte != b'\r').parse(input).map(|(r, _)| (r, Token::Comment))
        }
        b'"' => string(input),
        b'>' => two(b'=', Token::GreaterEqual, Token::Greater),
        b'<' => match placeholder(input) {
            Ok(found) => Ok(found),
            Err(_) => match input.get(1) {
                Some(b'>') => Ok((&input[2..], Token::NotEqual)),
                Some(b'=') => Ok((&input[2..], Token::LessEqual)),
                _ => one(Token::Less),
            },
        },
        b'%' => header(input).or_else(|_| one(Token::Percent)),
        _ => one(Token::Unknown),
    }
}

/// A number: decimal with optional fraction and exponent, or binary, octal, decimal, hexadecimal with its prefix.
/// The sign is no part of it.
#[inline]
pub fn number(input: Bytes<'_>) -> Lexed<'_> {
    match number_length(input) {
        0 => Err(nom::Err::Error(())),
        length => take(length).parse(input),
    }
}

/// The length of a number; 0 where there is none.
#[inline]
fn number_length(input: Bytes<'_>) -> usize {
    let second = input.get(1);
    match input.first() {
        Some(b'0') if second.is_some_and(u8::is_ascii_alphabetic) => {
            if let Ok((rest, _)) = prefixed(input) {
                return input.len() - rest.len();
            }
        }
        Some(b'0'..=b'9') => {}
        Some(b'.') if second.is_some_and(u8::is_ascii_digit) => {}
        _ => return 0,
    }
    input.first_chunk().and_then(short_decimal).unwrap_or_else(|| decimal(input))
}

/// A number with the prefix of its base.
fn prefixed(input: Bytes<'_>) -> Lexed<'_> {
    alt((
        recognize((tag_no_case("0x"), take_while1(|byte: u8| byte.is_ascii_hexdigit()))),
        recognize((tag_no_case("0b"), take_while1(|byte| matches!(byte, b'0' | b'1')))),
        recognize((tag_no_case("0o"), take_while1(|byte| matches!(byte, b'0'..=b'7')))),
        recognize((tag_no_case("0d"), digit1)),
    ))
    .parse(input)
}

/// The length of a decimal number that begins with a digit, or with a point and a digit.
#[cold]
fn decimal(input: Bytes<'_>) -> usize {
    let digits = |at: usize| at + input[at..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    let mut end = digits(0);
    if input.get(end) == Some(&b'.') {
        end = digits(end + 1);
    }
    if matches!(input.get(end), Some(b'e' | b'E')) {
        let from = end + 1 + usize::from(matches!(input.get(end + 1), Some(b'+' | b'-')));
        let exponent = input.get(from..).map_or(from, |_| digits(from));
        if exponent > from {
            end = exponent;
        }
    }
    end
}

/// The same, if it ends before the last of sixteen bytes, all at once: the lengths of numbers are unpredictable, and a loop over
/// single digits would end with a mispredicted branch.
#[inline]
fn short_decimal(sixteen: &[u8; 16]) -> Option<usize> {
    let mut others = no_digits(u128::from_le_bytes(*sixteen));
    let first = |others: u128| others.trailing_zeros() as usize / 8;
    let mut end = first(others);
    if *sixteen.get(end)? == b'.' {
        others &= others - 1;
        end = first(others);
    }
    if matches!(*sixteen.get(end)?, b'e' | b'E') {
        let from = end + 1 + usize::from(matches!(sixteen.get(end + 1)?, b'+' | b'-'));
        let digits = first(others.checked_shr(8 * from as u32)?);
        if digits > 0 {
            end = from + digits;
        }
    }
    (end < sixteen.len()).then_some(end)
}

/// The highest bit of each of sixteen bytes that is no digit.
#[inline]
fn no_digits(sixteen: u128) -> u128 {
    const ONES: u128 = u128::MAX / 0xFF;
    const LOW: u128 = 0x7F * ONES;
    // Digits become 0 to 9, and with 0x76 more the highest bit is set from 10 on.
    let value = sixteen ^ (0x30 * ONES);
    (((value & LOW) + 0x76 * ONES) | value) & !LOW
}

/// An identifier or reserved word. Bytes from 0x80 belong to it: Latin-1 letters, and the pieces of letters of other
/// encodings.
#[inline]
fn word(input: Bytes<'_>) -> Lexed<'_, Token> {
    // Blanks of UTF-8: byte order mark, ideographic space, no-break space.
    match input {
        [0xEF, 0xBB, 0xBF, rest @ ..] | [0xE3, 0x80, 0x80, rest @ ..] | [0xC2, 0xA0, rest @ ..] => {
            return Ok((rest, Token::Space));
        }
        _ => {}
    }
    let length = input.iter().take_while(|byte| IN_NAMES[usize::from(**byte)]).count();
    let (text, rest) = input.split_at(length);
    Ok((rest, keyword(text).unwrap_or(Token::Ident)))
}

/// A string to its closing quote; `""` is a quote in it. Without a closing quote it ends with the line.
fn string(input: Bytes<'_>) -> Lexed<'_, Token> {
    let mut rest = &input[1..];
    loop {
        (rest, _) = take_while(|byte| !matches!(byte, b'"' | b'\n' | b'\r')).parse(rest)?;
        match rest {
            [b'"', b'"', after @ ..] => rest = after,
            [b'"', after @ ..] => return Ok((after, Token::String)),
            _ => return Ok((rest, Token::OpenString)),
        }
    }
}

fn placeholder(input: Bytes<'_>) -> Lexed<'_, Token> {
    let inner = &input[1..];
    let name = PLACEHOLDERS
        .iter()
        .find(|name| inner.starts_with(name.as_bytes()) && inner.get(name.len()) == Some(&b'>'))
        .ok_or(nom::Err::Error(()))?;
    Ok((&inner[name.len() + 1..], Token::Placeholder))
}

/// `%%%` VERSION and LANGUAGE lines `%%%`.
fn header(input: Bytes<'_>) -> Lexed<'_, Token> {
    let (rest, _) = tag("%%%").parse(input)?;
    let within = &rest[..rest.len().min(HEADER_LIMIT)];
    let close = within.windows(3).position(|three| three == b"%%%").ok_or(nom::Err::Error(()))?;
    Ok((&rest[close + 3..], Token::Header))
}

/// Whether the bytes are no text: an encoded module, or not a program at all.
fn is_binary(source: &[u8]) -> bool {
    let sample = &source[..source.len().min(4096)];
    let control = sample.iter().filter(|&&byte| byte < 9 || (14..32).contains(&byte) && byte != 0x1A).count();
    control * 50 > sample.len()
}
