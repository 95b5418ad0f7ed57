//! Tests of `program`.

mod tree;
mod samples;
mod rewriting;
mod evaluation;
mod writing;
mod edits;
