//! Tests of `comparison`: statistics against published tables, experiments as data, protocols, tracking.

// A test that cannot go on panics.
#![allow(clippy::unwrap_used, clippy::print_stderr)]

mod statistics;
mod experiment;
mod protocol;
mod degradation;
mod grinding;
mod fixture;
