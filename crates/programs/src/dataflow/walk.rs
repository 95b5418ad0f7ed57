//! The transfer function of a language, taken over the statements of its tree.

use super::lattice::Lattice;

/// What a node is for the flow of control.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Control {
    /// One after another: its children.
    Sequence,
    /// No control flow of its own: [`Transfer::transfer`].
    Simple,
    /// A simple one that may be skipped.
    Skippable,
    /// A condition and what it guards.
    Optional,
    /// One of its branches.
    Branches,
    /// A branch; whether it is taken where no other is.
    Branch {
        /// ELSE, DEFAULT.
        otherwise: bool,
    },
    /// Any number of times its children.
    Loop,
    /// Entered from anywhere in the routine, and never from the statement before it.
    Handler,
    /// Entered from the statement before it and from anywhere.
    Label,
    /// A condition or bound.
    Expression,
    /// Another routine.
    Apart,
}

/// Control structures around a statement.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Nesting {
    pub(crate) in_loop: bool,
    pub(crate) conditional: bool,
    /// Whether a condition guards this statement alone.
    pub(crate) guarded: bool,
}

/// The transfer function of a language, over the nodes of a [`crate::tree::Tree`].
pub(crate) trait Transfer {
    /// The abstract state before a statement.
    type State: Lattice;

    /// The current state.
    fn state(&mut self) -> &mut Self::State;
    /// The number of nodes in a subtree.
    fn size(&self, node: u32) -> u32;
    /// What a node is.
    fn control(&self, node: u32) -> Control;
    /// The state after a simple statement.
    fn transfer(&mut self, node: u32, nesting: Nesting);
    /// Joins the state with those of every point of the routine.
    fn join_any_point(&mut self);
    /// The state after a condition or bound.
    fn evaluate(&mut self, _node: u32) {}
    /// At the head of a loop: what the loop changes is unknown.
    fn enter_loop(&mut self, _node: u32) {}
    /// After a loop that was entered with `before`.
    fn leave_loop(&mut self, _node: u32, _before: &Self::State) {}
    /// At the end of a handler.
    fn end_handler(&mut self, _node: u32, _end: Self::State) {}
    /// Whether control may pass all branches although one of them is for all other cases.
    fn may_pass_branches(&self) -> bool {
        false
    }

    /// Takes the state through the children of a node.
    fn walk(&mut self, node: u32, nesting: Nesting) {
        let (mut child, end) = (node + 1, node + self.size(node));
        while child < end {
            self.step(child, nesting);
            child += self.size(child);
        }
    }

    /// Takes the state through a node.
    fn step(&mut self, node: u32, nesting: Nesting) {
        let conditional = Nesting { conditional: true, guarded: false, ..nesting };
        let guarded = Nesting { guarded: true, ..conditional };
        match self.control(node) {
            Control::Sequence => self.walk(node, nesting),
            Control::Simple | Control::Branch { .. } => self.transfer(node, nesting),
            kind @ (Control::Skippable | Control::Optional) => {
                self.conditions(node);
                let skipped = self.state().clone();
                match kind {
                    Control::Skippable => self.transfer(node, guarded),
                    _ => self.walk(node, guarded),
                }
                self.state().join(&skipped);
            }
            Control::Branches => self.branches(node, conditional),
            Control::Loop => {
                let before = self.state().clone();
                self.enter_loop(node);
                self.walk(node, Nesting { in_loop: true, guarded: false, ..nesting });
                self.state().join(&before);
                self.leave_loop(node, &before);
            }
            Control::Handler => {
                let before = self.state().clone();
                self.join_any_point();
                self.walk(node, conditional);
                let end = std::mem::replace(self.state(), before);
                self.end_handler(node, end);
            }
            Control::Label => self.join_any_point(),
            Control::Expression => self.evaluate(node),
            Control::Apart => {}
        }
    }

    /// The conditions of a statement or branch.
    fn conditions(&mut self, node: u32) {
        let (mut child, end) = (node + 1, node + self.size(node));
        while child < end {
            if self.control(child) == Control::Expression {
                self.evaluate(child);
            }
            child += self.size(child);
        }
    }

    /// Branches: a condition is evaluated before its branch and all that follow.
    fn branches(&mut self, node: u32, nesting: Nesting) {
        let (mut joined, mut complete) = (None, false);
        let (mut child, end) = (node + 1, node + self.size(node));
        while child < end {
            if let Control::Branch { otherwise } = self.control(child) {
                self.conditions(child);
                complete |= otherwise;
                let before = self.state().clone();
                self.walk(child, nesting);
                let after = std::mem::replace(self.state(), before);
                joined.join(&Some(after));
            } else {
                self.evaluate(child);
            }
            child += self.size(child);
        }
        if let Some(joined) = joined {
            let passed = std::mem::replace(self.state(), joined);
            if !complete || self.may_pass_branches() {
                self.state().join(&passed);
            }
        }
    }
}
