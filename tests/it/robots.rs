//! Tests of `robots`.
