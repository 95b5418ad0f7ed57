//! Tests of `program`.

#![allow(clippy::unwrap_used)]

mod tree;
mod grammar;
mod samples;
mod rewriting;
mod side_effects;
mod slow;
mod numbers;
mod evaluation;
mod circumstances;
mod writing;
mod edits;
mod nc;
