//! Tests of the calibration, room by room.

// A test that cannot go on panics.
#![allow(clippy::unwrap_used, clippy::print_stderr)]
mod acceptance;
mod measurement;
mod identification;
mod diagnosis;
mod tracking;
