//! Tests of `compensation`.
