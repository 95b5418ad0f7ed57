//! The catalogue of arms and the page of one arm: link table, ranges, masses, published poses, sources.

use serde_json::Value;

use super::document::Document;
use super::table::Table;
use crate::robots::Robot;

/// Name, maker, rated load, reach and program language of each arm.
pub fn catalogue_table(robots: &[Robot]) -> Table {
    let _ = robots;
    Table::new("", Vec::new())
}

/// The page of one arm.
pub fn document(robot: &Robot) -> Document {
    Document::new(robot.sheet.name.clone())
}

/// The data sheet as it stands, for programs.
pub fn json(robot: &Robot) -> Value {
    serde_json::to_value(&robot.sheet).unwrap_or(Value::Null)
}
