//! Helpers shared by the tests of several crates; independent of robots.

// Test helpers panic on failure.
#![allow(clippy::unwrap_used, clippy::missing_panics_doc)]

pub mod absurd;
pub mod keys;
