//! Tests of `report`.

mod compensation;
mod deviation;
mod examples;
mod formats;
mod identification;
mod numbers;
mod page;
mod plots;
mod robots;
mod study;
