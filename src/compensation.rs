//! From an estimated arm and a program to a program that the real arm runs right.
//!
//! [`deviation`] holds what both rewriting and reporting speak of: the points of a path, how far the arm is off at
//! each, before and after.

pub mod deviation;
