//! Literal aggregates of plain numbers, parsed directly from bytes with `nom`: the fast path to the value of a robtarget or
//! jointtarget and to the byte range of each number.
//!
//! Signs, white space and comments may stand anywhere between; anything else (a name, arithmetic) gives `None`,
//! and the evaluator is used.

use nom::IResult;

use super::lexer;
use super::number;

/// The groups of a robtarget: trans, rot, robconf, extax.
pub const ROBTARGET: &[usize] = &[3, 4, 4, 6];
/// The groups of a jointtarget: robax, extax.
pub const JOINTTARGET: &[usize] = &[6, 6];

/// The numbers of a literal: their values, their decimals, and their byte ranges relative to the literal's first byte, sign included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Numbers {
    /// Values in order.
    pub values: [f64; 17],
    /// Decimals that each states.
    pub decimals: [u8; 17],
    /// First byte and one past the last.
    pub spans: [(u32, u32); 17],
}

type Rest<'s, O> = IResult<&'s [u8], O, ()>;

/// Reads an aggregate of aggregates of numbers with the given group lengths. Bytes after it are ignored.
pub fn numbers(text: &[u8], shape: &[usize]) -> Option<Numbers> {
    let mut found = Numbers::NONE;
    let (_, rest) = groups(text, shape, |number| signed(number).ok(), &mut found)?;
    symbol(b']')(rest).ok()?;
    Some(found)
}

/// The byte ranges of numbers whose values are known: [`numbers`] without parsing them again. `shape`: the groups that they
/// fill.
pub fn places(text: &[u8], shape: &[usize], values: &[f64]) -> Option<Numbers> {
    let passed = |number| {
        let rest = unsigned(number).0;
        match number::plain(rest) {
            Some((_, length, decimals)) => Some((&rest[length..], (0.0, decimals))),
            None => {
                let (after, text) = lexer::number(rest).ok()?;
                Some((after, (0.0, number::decimals(text))))
            }
        }
    };
    let mut found = Numbers::NONE;
    let (count, _) = groups(text, shape, passed, &mut found)?;
    found.values.get_mut(..values.len())?.copy_from_slice(values);
    (count == values.len()).then_some(found)
}

impl Numbers {
    const NONE: Numbers = Numbers { values: [0.0; 17], decimals: [0; 17], spans: [(0, 0); 17] };
}

/// The groups of an aggregate, each number taken by `read` with its decimals, into `found`; how many there are, and the bytes after the
/// last group.
#[inline]
fn groups<'s>(
    text: &'s [u8],
    shape: &[usize],
    read: impl Fn(&'s [u8]) -> Option<(&'s [u8], (f64, u8))>,
    found: &mut Numbers,
) -> Option<(usize, &'s [u8])> {
    let mut count = 0;
    let mut rest = symbol(b'[')(text).ok()?.0;
    for (index, &length) in shape.iter().enumerate() {
        if index > 0 {
            rest = symbol(b',')(rest).ok()?.0;
        }
        rest = symbol(b'[')(rest).ok()?.0;
        for position in 0..length {
            if position > 0 {
                rest = symbol(b',')(rest).ok()?.0;
            }
            let start = trivia(rest);
            let after;
            (after, (found.values[count], found.decimals[count])) = read(start)?;
            found.spans[count] = ((text.len() - start.len()) as u32, (text.len() - after.len()) as u32);
            count += 1;
            rest = after;
        }
        rest = symbol(b']')(rest).ok()?.0;
    }
    Some((count, rest))
}

/// White space and comments.
#[inline]
fn trivia(mut input: &[u8]) -> &[u8] {
    loop {
        match input.first() {
            Some(b' ' | b'\t' | b'\r' | b'\n' | 0x0B | 0x0C) => input = &input[1..],
            Some(b'!') => {
                let end = input.iter().position(|&byte| byte == b'\n').unwrap_or(input.len());
                input = &input[end..];
            }
            _ => return input,
        }
    }
}

/// A delimiter after trivia.
#[inline]
fn symbol(wanted: u8) -> impl Fn(&[u8]) -> Rest<'_, ()> {
    move |input| match trivia(input) {
        [first, rest @ ..] if *first == wanted => Ok((rest, ())),
        _ => Err(nom::Err::Error(())),
    }
}

/// A number with an optional sign, and its decimals.
#[inline]
fn signed(input: &[u8]) -> Rest<'_, (f64, u8)> {
    let (rest, negative) = unsigned(input);
    let (rest, value, decimals) = match number::plain(rest) {
        Some((value, length, decimals)) => (&rest[length..], value, decimals),
        None => {
            let (rest, text) = lexer::number(rest)?;
            (rest, number::value(text).ok_or(nom::Err::Error(()))?, number::decimals(text))
        }
    };
    Ok((rest, (if negative { -value } else { value }, decimals)))
}

/// The text after a sign, and whether the sign is a minus.
#[inline]
fn unsigned(input: &[u8]) -> (&[u8], bool) {
    match input {
        [b'-', rest @ ..] => (trivia(rest), true),
        [b'+', rest @ ..] => (trivia(rest), false),
        _ => (input, false),
    }
}
