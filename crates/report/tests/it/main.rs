//! Tests of `report`.

// A test that cannot go on panics.
#![allow(clippy::unwrap_used, clippy::print_stderr)]

mod compensation;
mod deviation;
mod diagnosis;
mod examples;
mod fleet;
mod formats;
mod identification;
mod kept;
mod numbers;
mod page;
#[cfg(feature = "parquet")]
mod parquet;
mod plots;
mod robots;
mod study;
