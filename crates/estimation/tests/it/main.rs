//! Tests of `estimation`: published problems, none of which knows a robot.

// A test that cannot go on panics.
#![allow(clippy::unwrap_used, clippy::print_stderr)]

mod residuals;
mod published;
mod nist;
mod levenberg_marquardt;
mod chaotic_search;
mod step_size;
mod filters;
mod swarms;
mod chaos;
mod triangular;
mod network;
