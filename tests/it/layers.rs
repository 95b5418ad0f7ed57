//! Dependence points down: no module names one that stands above it in ARCHITECTURE.md.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// What each room may use, itself apart.
fn allowed() -> BTreeMap<&'static str, Vec<&'static str>> {
    let all_below_six = vec![
        "math",
        "kinematics",
        "program",
        "surface",
        "robots",
        "measurement",
        "estimation",
        "identification",
        "diagnosis",
        "compensation",
        "planning",
        "comparison",
    ];
    BTreeMap::from([
        ("math", vec![]),
        ("kinematics", vec!["math"]),
        ("program", vec!["math"]),
        ("surface", vec!["math"]),
        ("robots", vec!["math", "kinematics"]),
        ("measurement", vec!["math", "kinematics"]),
        ("estimation", vec!["math"]),
        ("identification", vec!["math", "kinematics", "measurement", "estimation"]),
        ("diagnosis", vec!["math", "kinematics", "measurement", "estimation", "identification"]),
        ("compensation", vec!["math", "kinematics", "program", "surface"]),
        (
            "planning",
            vec!["math", "kinematics", "measurement", "estimation", "identification", "program", "surface"],
        ),
        (
            "comparison",
            vec![
                "math",
                "kinematics",
                "program",
                "surface",
                "measurement",
                "estimation",
                "identification",
                "compensation",
                "planning",
            ],
        ),
        ("report", all_below_six.clone()),
        ("visual", all_below_six),
    ])
}

/// The rooms that a source text names through `crate::`, `truegrind::`, or `super::` paths that leave its own room.
/// `depth` is the number of modules between the crate and this file's own (1 for `src/math.rs`).
fn named(text: &str, depth: usize) -> Vec<(usize, String)> {
    let mut out = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let code = line.split("//").next().unwrap_or_default();
        for root in ["crate::", "truegrind::"] {
            for (at, _) in code.match_indices(root) {
                if code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == '$') {
                    continue;
                }
                let rest = &code[at + root.len()..];
                if let Some(group) = rest.strip_prefix('{') {
                    let group = group.split('}').next().unwrap_or_default();
                    out.extend(group.split(',').map(|item| (number + 1, first(item.trim()))));
                } else {
                    out.push((number + 1, first(rest)));
                }
            }
        }
        // super:: as often as the file is deep leads out of the room.
        let climb = "super::".repeat(depth);
        for (at, _) in code.match_indices(&climb) {
            if !code[..at].ends_with("super::") {
                out.push((number + 1, first(&code[at + climb.len()..])));
            }
        }
    }
    out.retain(|(_, name)| !name.is_empty());
    out
}

fn first(path: &str) -> String {
    path.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
}

fn sources(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, out);
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push(path);
        }
    }
}

/// Upward uses in one file: `relative` is its path below `src`.
fn violations(relative: &Path, text: &str) -> Vec<String> {
    let parts: Vec<String> =
        relative.with_extension("").iter().map(|p| p.to_string_lossy().into_owned()).collect();
    let allowed = allowed();
    let Some(may) = allowed.get(parts[0].as_str()) else { return Vec::new() };
    named(text, parts.len())
        .into_iter()
        .filter(|(_, used)| allowed.contains_key(used.as_str()))
        .filter(|(_, used)| *used != parts[0] && !may.contains(&used.as_str()))
        .map(|(line, used)| format!("{}:{line}: {} uses {used}", relative.display(), parts[0]))
        .collect()
}

#[test]
fn dependence_points_down() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&root, &mut files);
    assert!(files.len() > 50, "the sources are read");
    let found: Vec<String> = files
        .iter()
        .flat_map(|f| violations(f.strip_prefix(&root).unwrap(), &fs::read_to_string(f).unwrap()))
        .collect();
    assert!(found.is_empty(), "upward uses:\n{}", found.join("\n"));
}

#[test]
fn every_room_is_in_the_list() {
    let lib = include_str!("../../src/lib.rs");
    let rooms: Vec<&str> =
        lib.lines().filter_map(|l| l.strip_prefix("pub mod ")).map(|l| l.trim_end_matches(';')).collect();
    assert!(rooms.len() >= 11);
    for room in rooms {
        assert!(allowed().contains_key(room), "{room} has no place in the order");
    }
}

#[test]
fn a_fixture_that_points_upward_fails() {
    let upward = "use crate::kinematics::model::Model;\nuse super::super::report::table;\n";
    let found = violations(Path::new("estimation/filter.rs"), upward);
    assert_eq!(found.len(), 2, "{found:?}");
    let grouped = violations(Path::new("math.rs"), "use crate::{kinematics::link, report};\n");
    assert_eq!(grouped.len(), 2, "{grouped:?}");
    let down =
        violations(Path::new("kinematics/model.rs"), "use crate::math::se3::Pose;\nuse super::link::Link;\n");
    assert!(down.is_empty(), "{down:?}");
}

#[test]
fn only_visual_names_rerun_and_only_cli_opens_files_or_prints() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&root, &mut files);
    for file in files {
        let relative = file.strip_prefix(&root).unwrap().to_owned();
        let room = relative.iter().next().unwrap().to_string_lossy().trim_end_matches(".rs").to_owned();
        let text = fs::read_to_string(&file).unwrap();
        let code: String =
            text.lines().map(|l| l.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n");
        if room != "visual" {
            assert!(!code.contains("rerun::"), "{} names rerun", relative.display());
        }
        if room != "cli" && room != "main" {
            for word in ["std::fs", "File::open", "println!(", "eprintln!("] {
                assert!(!code.contains(word), "{} has {word}", relative.display());
            }
        }
    }
}

/// Files are opened in one place and things are printed in one place: only there is an input known by itself, and only
/// there is text of others made harmless.
#[test]
fn only_one_file_opens_files_and_only_one_prints() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&root, &mut files);
    let reading = [
        "fs::read(",
        "fs::read_to_string",
        "File::open",
        "OpenOptions",
        "fs::write",
        "File::create",
        "fs::copy",
        "fs::rename",
    ];
    let printing = ["println!(", "print!(", "io::stdout()", "io::stderr()"];
    for file in &files {
        let name = file.strip_prefix(&root).unwrap().to_string_lossy().replace('\\', "/");
        let text = fs::read_to_string(file).unwrap();
        for (number, line) in text.lines().enumerate() {
            let code = line.split("//").next().unwrap_or_default();
            let opens = reading.iter().any(|word| code.contains(word)) && !name.starts_with("cli/files");
            // The ledger asks where stdout goes, the spinner draws itself.
            let prints = printing.iter().any(|word| code.contains(word))
                && !["cli/outputs.rs", "cli/progress.rs", "cli/files/ledger.rs"].contains(&name.as_str());
            assert!(!opens && !prints, "{name}:{}: {line}", number + 1);
        }
    }
}
