//! Tests of `report`.

mod compensation;
mod deviation;
mod examples;
mod identification;
mod robots;
mod study;
