//! Tests of `identification`.
