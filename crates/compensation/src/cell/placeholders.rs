//! Entries of a cell file that are still to be filled in: the skeleton of a cell says `"?"` where only a person knows.
//!
//! Such a file is read, so that it can be filled in piece by piece, and nothing is corrected with it.

use serde::de::DeserializeOwned;
use toml::{Table, Value};

/// What stands where a person has to say something.
pub(crate) const MARK: &str = "?";

/// Reads a cell file, and says what is open in it. Where nothing is, the text itself is read, so that errors have their line.
pub(crate) fn read<T: DeserializeOwned>(text: &str) -> Result<(T, Vec<String>), toml::de::Error> {
    if !text.contains("\"?\"") && !text.contains("'?'") {
        return Ok((toml::from_str(text)?, Vec::new()));
    }
    let mut table: Table = text.parse()?;
    let mut open = Vec::new();
    for key in ["robot", "angles"] {
        if takes_away(&mut table, key) {
            open.push(format!("{key} = \"?\": {}", expected(key)));
        }
    }
    for kind in ["tool", "wobj", "external"] {
        let Some(Value::Array(entries)) = table.get_mut(kind) else { continue };
        for entry in entries.iter_mut().filter_map(Value::as_table_mut) {
            entries_open(kind, entry, &mut open);
        }
    }
    Ok((table.try_into()?, open))
}

/// Takes the open keys out of one entry; what must be there gets a value that is never used.
fn entries_open(kind: &str, entry: &mut Table, open: &mut Vec<String>) {
    let named = if kind == "external" { "axis" } else { "name" };
    let name = entry.get(named).and_then(Value::as_str).unwrap_or(MARK).to_owned();
    for key in ["origin", "position_mm", "quaternion_wxyz", "teaching_deg", "taught_with", "carries"] {
        if !takes_away(entry, key) {
            continue;
        }
        open.push(format!("{kind} \"{name}\": {key} = \"?\": {}", expected(key)));
        match key {
            "origin" => drop(entry.insert(key.to_owned(), Value::String("taught".to_owned()))),
            "carries" => drop(entry.insert(key.to_owned(), Value::String("other".to_owned()))),
            // What says nothing without a key that is open is no error yet.
            "position_mm" => drop(entry.remove("quaternion_wxyz")),
            "teaching_deg" => ["taught_with", "teaches"].iter().for_each(|key| drop(entry.remove(*key))),
            _ => {}
        }
    }
}

/// Whether a key was open; it is gone then.
fn takes_away(table: &mut Table, key: &str) -> bool {
    let is_open = table.get(key).and_then(Value::as_str) == Some(MARK);
    if is_open {
        table.remove(key);
    }
    is_open
}

/// What belongs there.
fn expected(key: &str) -> &'static str {
    match key {
        "robot" => "write the robot's name, or remove the line",
        "angles" => "write abc, wpr, rxyz or rotation-vector: what A, B and C of the programs mean",
        "origin" => {
            "write \"metrology\" (its numbers are true: CAD, a measuring machine, a tracker) or \"taught\" (with the arm, before it \
             was calibrated)"
        }
        "position_mm" => {
            "write where it lies, [x, y, z] in mm: a tool on the flange, a work object in the robot's base"
        }
        "quaternion_wxyz" => "write how it is turned, [w, x, y, z], or remove the line where it is not",
        "teaching_deg" => "write the joint angles (°) of the teaching points, or remove the line",
        "taught_with" => "write the name of the tool that touched the teaching points, or remove the line",
        _ => "write \"base\" (the axis carries the robot) or \"other\"",
    }
}
