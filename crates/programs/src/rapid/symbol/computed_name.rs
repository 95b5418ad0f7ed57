//! A computed name of a procedure: what the text determines of it.

use crate::rapid::syntax::{RapidTree, Syntax, arguments, parts};
use crate::rapid::token::{Token, folded};
use crate::tree::Child;

/// What the text determines of a computed name.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct NamePattern {
    pub(super) prefix: Vec<u8>,
    pub(super) suffix: Vec<u8>,
    /// Whether `prefix` is the whole name.
    whole: bool,
    /// Number of required arguments given.
    pub(super) given: usize,
}

/// The expression from which a call computes the name of what it calls: `%...%`, or the first argument of CallByVar.
pub(crate) fn computed_name(tree: &RapidTree<'_>, call: u32) -> Option<Child> {
    match tree.nodes.kind(call) {
        Syntax::LateCall => parts(tree, call).nth(1),
        _ => arguments(tree, call).find(|argument| !argument.optional)?.value,
    }
}

impl NamePattern {
    /// The pattern of what a call by a computed name calls.
    pub(super) fn of_call(tree: &RapidTree<'_>, call: u32) -> NamePattern {
        // CallByVar appends a number to the name that it is given.
        let numbered = tree.nodes.kind(call) == Syntax::Call;
        let given = arguments(tree, call).filter(|argument| !argument.optional).count();
        NamePattern::of(tree, (computed_name(tree, call), if numbered { 0 } else { given }, numbered))
    }

    /// The pattern of a string expression; `numbered` where a number is appended to it.
    pub(super) fn of(
        tree: &RapidTree<'_>,
        (name, given, numbered): (Option<Child>, usize, bool),
    ) -> NamePattern {
        let text = |part: Child| match part {
            Child::Token(token) if tree.kind(token) == Some(Token::String) => {
                let text = tree.text(token);
                text.get(1..text.len() - 1).map(folded)
            }
            _ => None,
        };
        let (mut prefix, mut suffix, mut whole) = (None, None, false);
        match name {
            Some(Child::Node(node)) if tree.nodes.kind(node) == Syntax::Binary => {
                prefix = parts(tree, node).next().and_then(text);
                suffix = parts(tree, node).last().and_then(text).filter(|_| !numbered);
            }
            Some(part) => {
                prefix = text(part);
                whole = prefix.is_some() && !numbered;
            }
            None => {}
        }
        NamePattern { prefix: prefix.unwrap_or_default(), suffix: suffix.unwrap_or_default(), whole, given }
    }

    pub(super) fn matches(&self, name: &[u8]) -> bool {
        if self.whole {
            *name == self.prefix[..]
        } else {
            name.starts_with(&self.prefix) && name.ends_with(&self.suffix)
        }
    }

    /// Whether every name that matches the other matches this.
    pub(super) fn covers(&self, other: &NamePattern) -> bool {
        !self.whole
            && self.given == other.given
            && other.prefix.starts_with(&self.prefix)
            && if other.whole {
                other.prefix.ends_with(&self.suffix)
            } else {
                other.suffix.ends_with(&self.suffix)
            }
    }
}
