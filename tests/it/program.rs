//! Tests of `program`.

#![allow(clippy::unwrap_used)]

mod tree;
mod samples;
mod rewriting;
mod evaluation;
mod writing;
mod edits;
mod nc;
