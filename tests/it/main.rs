//! The one integration-test binary; its modules mirror `src/`.

// A test that cannot go on panics, and one without its data says so.
#![allow(clippy::unwrap_used, clippy::print_stderr)]

mod command;
mod programs;
mod layers;
mod literals;
mod units;
mod keys;
mod keys_of_runs;
