//! Tests of `planning`.

// A test that cannot go on panics.
#![allow(clippy::unwrap_used, clippy::print_stderr)]

mod poses;
mod toolpath;
