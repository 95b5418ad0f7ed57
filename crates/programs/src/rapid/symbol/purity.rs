//! Purity: an impure expression is never replaced by its value and never evaluated twice.
//!
//! Method: a statement is impure where it changes what others see, moves, waits, reads a device or a clock, raises an error, or
//! may not terminate; a routine where one of its statements is, or a routine that it calls ([`super::SideEffects::impure`]).
//! Unknown code is impure.

use super::Symbols;
use crate::rapid::predefined;
use crate::rapid::syntax::{RapidTree, Syntax};
use crate::tree::Child;

impl Symbols {
    /// Whether an expression calls an impure function of the program, a predefined one that does more than compute, or an
    /// unknown one.
    pub fn is_impure(&self, tree: &RapidTree<'_>, scope: u32, expression: Child) -> bool {
        let Child::Node(node) = expression else { return false };
        (node..tree.nodes.subtree_end(node)).any(|node| {
            tree.nodes.kind(node) == Syntax::Function
                && match self.callees(scope, tree.text(tree.nodes.first(node))) {
                    callees @ [_, ..] => callees.iter().any(|routine| self.effects_of(*routine).impure),
                    [] => self.is_node_impure(tree, scope, node),
                }
        })
    }

    /// Whether a node is impure, the routines of the program that it calls not counted.
    pub(super) fn is_node_impure(&self, tree: &RapidTree<'_>, scope: u32, node: u32) -> bool {
        let found = tree.nodes.get(node);
        match found.kind {
            Syntax::LateCall
            | Syntax::Raise
            | Syntax::Leave
            | Syntax::Goto
            | Syntax::While
            | Syntax::Connect
            | Syntax::Opaque
            | Syntax::Unwritten => true,
            // A predefined instruction acts, and an unknown routine may.
            Syntax::Call => self.callees(scope, tree.text(found.first)).is_empty(),
            Syntax::Function => {
                let name = tree.text(found.first);
                self.callees(scope, name).is_empty() && !predefined::is_pure(name)
            }
            _ => false,
        }
    }
}
