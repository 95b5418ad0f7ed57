//! Tests of `report`.

mod compensation;
mod deviation;
mod examples;
mod formats;
mod identification;
mod numbers;
mod page;
mod parquet;
mod plots;
mod robots;
mod study;
