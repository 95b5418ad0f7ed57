//! Tests of `planning`.

mod poses;
