//! Tests of `programs`.

// A test that cannot go on panics.
#![allow(clippy::unwrap_used, clippy::print_stderr)]

mod tree;
mod grammar;
mod samples;
mod rewriting;
mod side_effects;
mod slow;
mod numbers;
mod evaluation;
mod modal_state;
mod error_handlers;
mod known_data;
mod persistent;
mod wrappers;
mod writing;
mod edits;
mod nc;
