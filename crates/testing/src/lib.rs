//! Helpers shared by the tests of several crates; independent of robots.

// A test that cannot go on panics.
#![allow(clippy::unwrap_used, clippy::missing_panics_doc)]

pub mod absurd;
pub mod keys;
