//! Task lists (`.pgf`): the modules that a controller loads together, as a small XML file.

use nom::bytes::complete::{tag, take_until};
use nom::sequence::delimited;
use nom::{IResult, Parser};

use super::token::display;

/// The file names in the `<Module>` elements, in order. Anything else in the file is passed over.
pub fn modules(source: &[u8]) -> Vec<String> {
    let mut found = Vec::new();
    let mut rest = source;
    while let Ok((after, name)) = module(rest) {
        found.push(display(name.trim_ascii()));
        rest = after;
    }
    found
}

fn module(input: &[u8]) -> IResult<&[u8], &[u8], ()> {
    let (input, _) = take_until("<Module>").parse(input)?;
    delimited(tag("<Module>"), take_until("</Module>"), tag("</Module>")).parse(input)
}
