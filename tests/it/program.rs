//! Tests of `program`.

mod tree;
mod samples;
mod rewriting;
