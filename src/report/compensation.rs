//! What became of each motion of a program.

use serde_json::{Value, json};

use super::document::Document;
use super::table::Table;
use crate::compensation::deviation::PathReport;
use crate::compensation::rewrite::Plan;
use crate::program::motion::Listing;

/// One file of a program, by name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProgramFile {
    /// The file that was read.
    pub file: String,
    /// The file that was written; `None` where nothing was (dry run).
    pub output: Option<String>,
}

/// One row per motion. `files` in the order in which the listing counts them.
pub fn table(plan: &Plan, listing: &Listing, files: &[ProgramFile]) -> Table {
    let _ = (plan, listing, files);
    Table::new("", Vec::new())
}

/// Reasons why motions were left, refused or flagged, with counts and first lines.
pub fn reason_table(plan: &Plan, listing: &Listing, files: &[ProgramFile]) -> Table {
    let _ = (plan, listing, files);
    Table::new("", Vec::new())
}

/// The contract `truegrind.compensation/1`.
pub fn json(plan: &Plan, listing: &Listing, files: &[ProgramFile]) -> Value {
    let _ = (plan, listing, files);
    json!({ "schema": "truegrind.compensation/1" })
}

/// What fits a terminal: coverage, reasons, notes.
pub fn summary(plan: &Plan, listing: &Listing, files: &[ProgramFile]) -> Document {
    let _ = (plan, listing, files);
    Document::new("Compensation")
}

/// The page, with the deviation of the path where reports are given.
pub fn document(plan: &Plan, listing: &Listing, files: &[ProgramFile], reports: &[PathReport]) -> Document {
    let _ = (plan, listing, files, reports);
    Document::new("Compensation")
}
