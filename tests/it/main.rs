//! The one integration-test binary; its modules mirror `src/`.

// A test that cannot go on panics, and one without its data says so.
#![allow(clippy::unwrap_used, clippy::print_stderr)]

mod absurd;
mod program;
mod surface;
mod estimation;
mod robots;
mod kinematics;
mod measurement;
mod identification;
mod diagnosis;
mod compensation;
mod planning;
mod comparison;
mod report;
mod visual;
mod command;
mod programs;
mod layers;
mod keys;
