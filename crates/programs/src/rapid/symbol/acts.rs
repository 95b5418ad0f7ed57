//! What does more than answer: an expression of which that is true is never replaced by its value, and never asked twice.
//!
//! Method: a statement acts where it changes what others see, moves, waits, reads a device or a clock, raises an error, or may
//! not end; a routine acts where one of its statements does, or a routine that it calls ([`super::Reach::acts`]). What is
//! not known acts.

use super::Symbols;
use crate::rapid::predefined;
use crate::rapid::syntax::{RapidTree, Syntax};
use crate::tree::Child;

impl Symbols {
    /// Whether an expression does more than answer: it calls a function of the program that acts, a predefined one that does
    /// more than compute, or one that is not known.
    pub fn acts(&self, tree: &RapidTree<'_>, scope: u32, expression: Child) -> bool {
        let Child::Node(node) = expression else { return false };
        (node..node + tree.nodes[node as usize].size).any(|node| {
            tree.nodes[node as usize].kind == Syntax::Function
                && match self.called(scope, tree.text(tree.nodes[node as usize].first)) {
                    own @ [_, ..] => own.iter().any(|routine| self.routines[*routine as usize].reach.acts),
                    [] => self.acts_itself(tree, scope, node),
                }
        })
    }

    /// Whether a node does more than answer by itself, whatever the routines of the program that it calls do.
    pub(super) fn acts_itself(&self, tree: &RapidTree<'_>, scope: u32, node: u32) -> bool {
        let found = tree.nodes[node as usize];
        match found.kind {
            Syntax::LateCall
            | Syntax::Raise
            | Syntax::Leave
            | Syntax::Goto
            | Syntax::While
            | Syntax::Connect
            | Syntax::Opaque
            | Syntax::Unwritten => true,
            // A predefined instruction does something, and a name of which there is no routine may.
            Syntax::Call => self.called(scope, tree.text(found.first)).is_empty(),
            Syntax::Function => {
                let name = tree.text(found.first);
                self.called(scope, name).is_empty() && !predefined::only_answers(name)
            }
            _ => false,
        }
    }
}
