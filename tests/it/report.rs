//! Tests of `report`.

mod formats;
mod numbers;
mod page;
mod plots;
