//! What `docs/json.md` says of JSON and CSV: every key and column that a verb writes stands in its section.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use serde_json::Value;

use super::{folder, truegrind};

const DOCUMENT: &str = include_str!("../../../docs/json.md");
const ROWS: &str = include_str!("../../data/irb120-tracker.csv");
const RECIPE: &str = include_str!("../../data/irb120-tracker.toml");
const PROGRAM: &str = "MODULE M\n PERS tooldata t:=[TRUE,[[0,0,100],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];\n PROC main()\n\
                       MoveJ [[400,0,400],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,t;\n\
                       MoveL [[420,30,400],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,t;\n ENDPROC\nENDMODULE\n";

/// The words in backticks of the section for all, and of the one whose heading holds `name`.
fn documented(name: &str) -> BTreeSet<&'static str> {
    let headed = |part: &&str| {
        let heading = part.lines().next().unwrap_or_default();
        heading == "For all" || heading.contains(name)
    };
    let parts: Vec<&str> =
        DOCUMENT.split("\n## ").flat_map(|part| part.split("\n### ")).filter(headed).collect();
    assert_eq!(parts.len(), 2, "{name} has no section of its own");
    parts.iter().flat_map(|part| part.split('`').skip(1).step_by(2)).collect()
}

/// All keys of a value; those of `serials` are the user's.
fn keys(value: &Value, out: &mut BTreeSet<String>) {
    match value {
        Value::Object(all) => all.iter().for_each(|(key, inner)| {
            out.insert(key.clone());
            if key != "serials" {
                keys(inner, out);
            }
        }),
        Value::Array(all) => all.iter().for_each(|inner| keys(inner, out)),
        _ => {}
    }
}

/// Runs a verb with `--json` and `--csv`, and compares the keys of both with the document. Gives the JSON.
fn compared(at: &Path, section: &str, arguments: &[&str]) -> Value {
    let (code, _, err) = truegrind(at, &[arguments, &["--json", "o.json", "--csv", "o.csv"]].concat());
    assert!(code < 2, "{arguments:?}: {err}");
    let json: Value = serde_json::from_slice(&fs::read(at.join("o.json")).unwrap()).unwrap();
    let table = fs::read_to_string(at.join("o.csv")).unwrap();
    let mut found: BTreeSet<String> = BTreeSet::new();
    keys(&json, &mut found);
    assert!(found.len() > 5 && json["schema"].is_string(), "{json}");
    found.extend(table.lines().next().unwrap().split(',').map(str::to_owned));
    let documented = documented(section);
    let missing: Vec<&String> = found.iter().filter(|key| !documented.contains(key.as_str())).collect();
    assert!(missing.is_empty(), "docs/json.md, section {section}: {missing:?} are not in it");
    assert!(documented.contains("schema"), "{section}");
    for file in ["o.json", "o.csv"] {
        fs::remove_file(at.join(file)).unwrap();
    }
    json
}

#[test]
fn every_key_and_column_is_documented() {
    let dir = folder();
    let at = dir.path();
    fs::create_dir_all(at.join("arms")).unwrap();
    fs::create_dir_all(at.join("programs")).unwrap();
    for (file, text) in [
        ("poses.csv", ROWS),
        ("arms/one.csv", ROWS),
        ("arms/two.csv", "q1,q2\n"),
        ("later.toml", &RECIPE.replace("seed = 121", "seed = 122")),
        ("a.mod", PROGRAM),
        ("programs/a.mod", PROGRAM),
        ("programs/b.mod", "MODULE B\nENDMODULE\n"),
    ] {
        fs::write(at.join(file), text).unwrap();
    }
    let (code, _, err) = truegrind(at, &["simulate", "later.toml", "-o", "later.csv"]);
    assert_eq!(code, 0, "{err}");
    let robot = ["--robot", "abb-irb-120"];
    let with = |first: &[&'static str], more: &[&'static str]| [first, &robot, more].concat();
    let found = compared(at, "identification/1", &with(&["identify", "poses.csv"], &[]));
    assert_eq!(found["verdict"]["status"], "not-evaluated", "no limit was stated");
    compared(at, "diagnosis/1", &with(&["diagnose", "poses.csv"], &["-o", "model.toml", "--allow-doubtful"]));
    compared(at, "fleet/1", &with(&["diagnose", "arms"], &["-o", "models", "--allow-doubtful"]));
    let plan =
        with(&["plan", "--sensor", "position", "--poses", "8", "--candidates", "60"], &["-o", "p.mod"]);
    compared(at, "plan/1", &plan);
    let model = ["--model", "model.toml"];
    let of = |first: &[&'static str], more: &[&'static str]| [first, &model, more].concat();
    let accept = of(&["accept", "later.csv"], &["--tolerance", "1", "--sensor-uncertainty", "0.02"]);
    compared(at, "acceptance/1", &accept);
    compared(at, "track-report/1", &of(&["track", "later.csv"], &["-o", "out", "--date", "2026-05-05"]));
    let written = compared(at, "compensation/1", &of(&["compensate", "a.mod"], &["-o", "b.mod"]));
    let copied = fs::read(at.join("b.mod")).unwrap() == PROGRAM.as_bytes();
    assert_eq!(written["programs"][0]["unchanged"], copied);
    compared(at, "compensation/1", &of(&["compensate", "programs"], &["-o", "many"]));
    compared(at, "deviation/1", &of(&["deviation", "a.mod"], &[]));
}
