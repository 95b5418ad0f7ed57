//! What an identification found.

use serde_json::{Value, json};

use super::document::Document;
use super::table::Table;
use crate::identification::identify::Identification;
use crate::measurement::dataset::Dataset;

/// The whole page. `dataset` is the one that was identified from.
pub fn document(found: &Identification, dataset: &Dataset) -> Document {
    let _ = dataset;
    Document::new(found.estimated.robot.clone())
}

/// What fits a terminal: verdict, key figures, the table of stages.
pub fn summary(found: &Identification) -> Document {
    Document::new(found.estimated.robot.clone())
}

/// Errors of each stage, on the rows of the fit and on held-out rows.
pub fn stage_table(found: &Identification) -> Table {
    let _ = found;
    Table::new("", Vec::new())
}

/// The arm's parameters: nominal, estimated ± σ, deviation; angles in degrees.
pub fn parameter_table(found: &Identification) -> Table {
    let _ = found;
    Table::new("", Vec::new())
}

/// Sensor frame, outlets, zeros and the touched point.
pub fn frame_table(found: &Identification) -> Table {
    let _ = found;
    Table::new("", Vec::new())
}

/// Error of each held-out row, frames registered and geometry.
pub fn held_out_table(found: &Identification) -> Table {
    let _ = found;
    Table::new("", Vec::new())
}

/// Everything, with the error of each held-out row; schema `truegrind.identification/1`.
pub fn json(found: &Identification, dataset: &Dataset) -> Value {
    let _ = dataset;
    json!({ "robot": found.estimated.robot })
}
