//! Placeholders of a cell file: the template contains `"?"` where only a person knows the value.
//!
//! Such a file can be read, so that it can be filled in step by step, but nothing is corrected with it.

use serde::de::DeserializeOwned;
use toml::{Table, Value};
use truegrind_math::toml_text::{TomlError, read as read_whole, read_table};

/// The placeholder.
pub(crate) const MARK: &str = "?";

/// Reads a cell file and lists its placeholders. Without any, the text itself is read, so that errors state their line.
pub(crate) fn read<T: DeserializeOwned>(text: &str) -> Result<(T, Vec<String>), TomlError> {
    if !text.contains("\"?\"") && !text.contains("'?'") {
        return Ok((read_whole(text)?, Vec::new()));
    }
    let mut table: Table = text.parse()?;
    let mut open = Vec::new();
    for key in ["robot", "control", "angles"] {
        if remove_placeholder(&mut table, key) {
            open.push(format!("{key} = \"?\": {}", expected(key)));
        }
    }
    for kind in ["tool", "wobj", "external"] {
        let Some(Value::Array(entries)) = table.get_mut(kind) else { continue };
        for entry in entries.iter_mut().filter_map(Value::as_table_mut) {
            remove_placeholders(kind, entry, &mut open);
        }
    }
    Ok((read_table(table)?, open))
}

/// Removes placeholders from one entry; required keys get a value that is never used.
fn remove_placeholders(kind: &str, entry: &mut Table, open: &mut Vec<String>) {
    let named = if kind == "external" { "axis" } else { "name" };
    let name = entry.get(named).and_then(Value::as_str).unwrap_or(MARK).to_owned();
    for key in ["origin", "position_mm", "quaternion_wxyz", "teaching_deg", "taught_with", "carries"] {
        if !remove_placeholder(entry, key) {
            continue;
        }
        open.push(format!("{kind} \"{name}\": {key} = \"?\": {}", expected(key)));
        match key {
            "origin" => drop(entry.insert(key.to_owned(), Value::String("taught".to_owned()))),
            "carries" => drop(entry.insert(key.to_owned(), Value::String("other".to_owned()))),
            // A key that depends on a placeholder is no error yet.
            "position_mm" => drop(entry.remove("quaternion_wxyz")),
            "teaching_deg" => ["taught_with", "teaches"].iter().for_each(|key| drop(entry.remove(*key))),
            _ => {}
        }
    }
}

/// Removes a key whose value is the placeholder; returns whether it did.
fn remove_placeholder(table: &mut Table, key: &str) -> bool {
    let is_open = table.get(key).and_then(Value::as_str) == Some(MARK);
    if is_open {
        table.remove(key);
    }
    is_open
}

/// What to write instead.
fn expected(key: &str) -> &'static str {
    match key {
        "robot" => "write the robot's name, or remove the line",
        "control" => "write fanuc, siemens, linuxcnc, heidenhain or iso: the control that runs the programs",
        "angles" => "write abc, wpr, rxyz or rotation-vector: the convention of A, B and C in the programs",
        "origin" => {
            "write \"metrology\" (its numbers are exact: CAD, a measuring machine, a tracker) or \"taught\" \
             (with the arm, before it was calibrated)"
        }
        "position_mm" => {
            "write its position, [x, y, z] in mm: a tool on the flange, a work object in the robot's base"
        }
        "quaternion_wxyz" => "write its orientation, [w, x, y, z], or remove the line if it has none",
        "teaching_deg" => "write the joint angles (°) of the teaching points, or remove the line",
        "taught_with" => "write the name of the tool that touched the teaching points, or remove the line",
        _ => "write \"base\" (the axis carries the robot) or \"other\"",
    }
}
