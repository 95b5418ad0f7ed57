//! Tests of `program`.

mod tree;
