//! How far each point of a path is off, before and after.

use serde_json::{Value, json};

use super::document::Document;
use super::table::Table;
use crate::compensation::deviation::PathReport;

/// One row per path point of one program under one model, all columns.
pub fn table(report: &PathReport) -> Table {
    let _ = report;
    Table::new("", Vec::new())
}

/// The block of ltlm-2024 Table 8: before compensation, then one row per model.
pub fn block_table(reports: &[PathReport]) -> Table {
    let _ = reports;
    Table::new("", Vec::new())
}

/// RMS deviation as it stands and after the rigid motion that fits the path best.
pub fn registered_table(reports: &[PathReport]) -> Table {
    let _ = reports;
    Table::new("", Vec::new())
}

/// Points that were refused, flagged or left, by line.
pub fn flag_table(report: &PathReport) -> Table {
    let _ = report;
    Table::new("", Vec::new())
}

/// The page: one section per program. Reports of one program with several models stand together.
pub fn document(reports: &[PathReport]) -> Document {
    let _ = reports;
    Document::new("Deviation")
}

/// Everything; schema `truegrind.deviation/1`.
pub fn json(reports: &[PathReport]) -> Value {
    let _ = reports;
    json!({})
}
