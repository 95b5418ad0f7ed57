//! What tests of several crates share. Nothing here knows what a robot is.

// A test that cannot go on panics.
#![allow(clippy::unwrap_used, clippy::missing_panics_doc)]

pub mod absurd;
pub mod keys;
