//! Tests of `planning`.
