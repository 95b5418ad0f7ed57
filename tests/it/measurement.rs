//! Tests of `measurement`.
