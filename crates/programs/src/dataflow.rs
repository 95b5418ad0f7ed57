//! Program analysis, whatever the language: [`Lattice`], facts with a join, and their least fixpoint along the edges of a program. A
//! language brings its syntax tree, its side effects and its transfer function: RAPID in `rapid/flow`, NC in `nc/task`.
//!
//! - [`graph`]: where the edges are known beforehand, as those of calls are.
//! - [`walk`]: over structured statements, whose loops need no fixpoint: what a loop changes is unknown at its head and after it, which
//!   holds for every number of iterations.
//! - [`passes`]: where edges are found only while the text is read, as the jumps of NC are.
//!
//! Method: monotone frameworks (Nielson, Nielson, Hankin, Principles of Program Analysis, 1999, §2.4 and §6.1).

mod graph;
mod lattice;
mod passes;
mod walk;

pub(crate) use graph::{Edge, post_order, propagate};
pub(crate) use lattice::Lattice;
pub(crate) use passes::{Arrivals, read_until_stable};
pub(crate) use walk::{Control, Nesting, Transfer};
