//! The node kinds of NC syntax trees, and the typed view of a word.
//!
//! A file is a list of blocks (lines), a block a list of words. A word is a name with a value: a number, an
//! expression, or arguments.

use super::token::Token;
use crate::tree::Tree;

/// The syntax tree of one NC file.
pub type NcTree<'s> = Tree<'s, Token, Syntax>;

/// A kind of node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Syntax {
    /// The whole file.
    File,
    /// One line with at least one word.
    Block,
    /// A block with block skip (`/`).
    Skippable,
    /// A word.
    Word,
    /// Unreadable text, to the end of the line.
    Opaque,
}

/// The value of a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WordValue {
    /// None: a bare word.
    Absent,
    /// A literal: its sign, if any, and its number.
    Literal {
        /// The token of the sign.
        sign: Option<u32>,
        /// The token of the number.
        number: u32,
    },
    /// An expression, as tokens `first..end`.
    Expression {
        /// First token.
        first: u32,
        /// One past the last.
        end: u32,
    },
    /// Arguments in parentheses, the parentheses included.
    Arguments {
        /// The opening parenthesis.
        first: u32,
        /// One past the closing one.
        end: u32,
    },
}

/// A word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Word<'s> {
    /// Its first token.
    pub first: u32,
    /// One past its last token.
    pub end: u32,
    /// The bytes of its name, `#` for a variable.
    pub name: &'s [u8],
    /// The index in brackets after the name (`$P_UIFR[1]`, `R[5]`), as tokens without the brackets.
    pub index: Option<(u32, u32)>,
    /// Its value.
    pub value: WordValue,
    /// Whether an equals sign precedes the value.
    pub assigned: bool,
}

impl Word<'_> {
    /// Whether this is its name, ignoring case.
    pub fn is(&self, name: &str) -> bool {
        self.name.eq_ignore_ascii_case(name.as_bytes())
    }

    /// The address in upper case, if the name is one letter.
    pub fn address(&self) -> Option<u8> {
        match self.name {
            [letter] => Some(letter.to_ascii_uppercase()),
            _ => None,
        }
    }
}
