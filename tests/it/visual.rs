//! Tests of `visual`.
