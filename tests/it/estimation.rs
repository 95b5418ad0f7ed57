//! Tests of `estimation`.
