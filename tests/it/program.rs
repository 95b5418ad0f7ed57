//! Tests of `program`.

#![allow(clippy::unwrap_used)]

mod tree;
mod grammar;
mod samples;
mod rewriting;
mod evaluation;
mod circumstances;
mod writing;
mod edits;
mod nc;
