//! Dependence points down: between crates as ARCHITECTURE.md has it, and between the files of a crate without circles.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// What each crate may use of ours.
const USES: [(&str, &str); 13] = [
    ("math", ""),
    ("arm", "math"),
    ("programs", "math"),
    ("surfaces", "math"),
    ("estimation", "math"),
    ("calibration", "arm estimation math"),
    ("compensation", "arm math programs surfaces"),
    ("planning", "arm calibration compensation estimation math programs surfaces"),
    ("report", "arm calibration compensation math planning programs"),
    ("papers", "arm calibration compensation estimation math planning programs report surfaces"),
    ("pictures", "arm calibration compensation math surfaces"),
    ("testing", ""),
    ("measured", "arm calibration math planning"),
];

/// Crates that are only for tests.
const FOR_TESTS: [&str; 2] = ["testing", "measured"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).to_owned()
}

fn sources(folder: &Path, out: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            sources(&path, out);
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push(path);
        }
    }
}

/// The sources below `folder`, by their path from there, comments taken out.
fn code(folder: &Path) -> BTreeMap<String, String> {
    let mut files = Vec::new();
    sources(folder, &mut files);
    let strip = |text: String| text.lines().map(without_comment).collect::<Vec<_>>().join("\n");
    files
        .into_iter()
        .map(|file| {
            let name = file.strip_prefix(folder).unwrap().to_string_lossy().replace('\\', "/");
            (name, strip(fs::read_to_string(&file).unwrap()))
        })
        .collect()
}

fn without_comment(line: &str) -> &str {
    line.split("//").next().unwrap_or_default()
}

#[test]
fn crates_use_only_what_stands_below_them() {
    let folder = root().join("crates");
    let mut seen = BTreeSet::new();
    for (name, uses) in USES {
        let manifest = fs::read_to_string(folder.join(name).join("Cargo.toml")).unwrap();
        let table: toml::Table = manifest.parse().unwrap();
        let used: BTreeSet<&str> = table["dependencies"]
            .as_table()
            .unwrap()
            .keys()
            .filter_map(|key| key.strip_prefix("truegrind-"))
            .collect();
        assert_eq!(used, uses.split_whitespace().collect(), "{name}");
        assert!(table["package"].get("description").is_some_and(|text| text.as_str().is_some()), "{name}");
        seen.insert(name.to_owned());
    }
    let there: BTreeSet<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    assert_eq!(there, seen, "a crate has no place in the order");
}

/// The files of a crate that each file names: `modules` by their paths (`""` is `lib`).
fn graph(modules: &BTreeMap<String, String>) -> BTreeMap<&str, BTreeSet<&str>> {
    modules
        .iter()
        .map(|(name, text)| {
            let mut all = paths(text, name);
            all.extend(children(text, name));
            let named = all
                .iter()
                .filter_map(|path| {
                    // The longest beginning that is a file.
                    (0..=path.len()).rev().find_map(|n| modules.get_key_value(&path[..n].join("::")))
                })
                .map(|(other, _)| other.as_str())
                .filter(|other| other != name)
                .collect();
            (name.as_str(), named)
        })
        .collect()
}

/// The paths from the crate's root that a text names by `crate::`, `super::` or `self::`, groups taken apart.
fn paths(text: &str, module: &str) -> Vec<Vec<String>> {
    let word = |c: char| c.is_alphanumeric() || c == '_';
    let own: Vec<String> = module.split("::").filter(|part| !part.is_empty()).map(str::to_owned).collect();
    let mut out = Vec::new();
    for start in ["crate::", "super::", "self::"] {
        for (at, _) in text.match_indices(start) {
            let before = &text[..at];
            if before.ends_with(word) || before.ends_with(':') || before.ends_with('$') {
                continue;
            }
            let mut base = match start {
                "crate::" => Vec::new(),
                "super::" => own[..own.len().saturating_sub(1)].to_vec(),
                _ => own.clone(),
            };
            let mut rest = &text[at + start.len()..];
            while let Some(shorter) = rest.strip_prefix("super::") {
                base.pop();
                rest = shorter;
            }
            branches(rest, &base, &mut out);
        }
    }
    out
}

/// The modules that a text declares and names by their bare name.
fn children(text: &str, module: &str) -> Vec<Vec<String>> {
    let declared = text.lines().filter_map(|line| line.trim().strip_suffix(';')?.rsplit_once("mod "));
    declared
        .map(|(_, child)| child)
        .filter(|child| {
            text.match_indices(&format!("{child}::"))
                .any(|(at, _)| !text[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == ':'))
        })
        .map(|child| {
            module.split("::").filter(|part| !part.is_empty()).chain([child]).map(str::to_owned).collect()
        })
        .collect()
}

/// What a use tree stands for: `a::{b, c::d}` gives two paths.
fn branches(tree: &str, base: &[String], out: &mut Vec<Vec<String>>) {
    let mut path = base.to_vec();
    let mut rest = tree.trim_start();
    loop {
        if let Some(inside) = rest.strip_prefix('{') {
            let (mut depth, mut from) = (0, 0);
            for (at, c) in inside.char_indices() {
                match c {
                    '{' => depth += 1,
                    '}' if depth == 0 => return branches(&inside[from..at], &path, out),
                    '}' => depth -= 1,
                    ',' if depth == 0 => {
                        branches(&inside[from..at], &path, out);
                        from = at + 1;
                    }
                    _ => {}
                }
            }
            return;
        }
        let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
        if end == 0 {
            break;
        }
        path.push(rest[..end].to_owned());
        match rest[end..].strip_prefix("::") {
            Some(next) => rest = next,
            None => break,
        }
    }
    out.push(path);
}

/// Groups of files that reach each other, each with more than one.
fn circles<'g>(graph: &BTreeMap<&'g str, BTreeSet<&'g str>>) -> Vec<BTreeSet<&'g str>> {
    let reach = |from: &'g str| {
        let mut seen = BTreeSet::new();
        let mut open = vec![from];
        while let Some(at) = open.pop() {
            for next in graph.get(at).into_iter().flatten() {
                if seen.insert(*next) {
                    open.push(next);
                }
            }
        }
        seen
    };
    let all: BTreeMap<&str, BTreeSet<&str>> = graph.keys().map(|name| (*name, reach(name))).collect();
    let mut out: Vec<BTreeSet<&str>> = Vec::new();
    for (name, reached) in &all {
        if reached.contains(name) && !out.iter().any(|circle| circle.contains(name)) {
            out.push(reached.iter().filter(|other| all[**other].contains(name)).copied().collect());
        }
    }
    out
}

fn modules(folder: &Path) -> BTreeMap<String, String> {
    let name = |file: &str| match file.trim_end_matches(".rs") {
        "lib" | "main" => String::new(),
        other => other.replace('/', "::"),
    };
    code(folder).into_iter().map(|(file, text)| (name(&file), text)).collect()
}

#[test]
fn the_files_of_a_crate_form_no_circle() {
    for (name, _) in USES {
        let modules = modules(&root().join("crates").join(name).join("src"));
        let found = circles(&graph(&modules));
        assert!(found.is_empty(), "{name}: {found:#?}");
    }
    let found = modules(&root().join("src"));
    let found = circles(&graph(&found)).into_iter().map(|c| format!("{c:?}")).collect::<Vec<_>>();
    assert!(found.is_empty(), "the command line: {found:#?}");
}

/// The class: a test that nobody runs. Libraries are built for tests once (`test = false`), so a test beside their code is not.
#[test]
fn no_test_stands_where_it_never_runs() {
    for (name, _) in USES.into_iter().filter(|(name, _)| *name != "testing") {
        let dead: Vec<String> = code(&root().join("crates").join(name).join("src"))
            .into_iter()
            .filter(|(_, text)| text.contains("cfg(test)") || text.contains("#[test]"))
            .map(|(file, _)| file)
            .collect();
        assert!(dead.is_empty(), "{name}: to be moved to its tests/it or its documentation: {dead:?}");
    }
}

#[test]
fn a_circle_is_found_through_groups_and_climbing_paths() {
    let of = |files: &[(&str, &str)]| {
        files.iter().map(|(name, text)| ((*name).to_owned(), (*text).to_owned())).collect::<BTreeMap<_, _>>()
    };
    let round = of(&[
        ("", "mod a; mod b;"),
        ("a", "use crate::{c::x, b::{self, y}};"),
        ("b", "use super::b::inner;"),
        ("b::inner", "use super::super::a::Thing;"),
        ("c", ""),
    ]);
    let found = circles(&graph(&round));
    assert_eq!(found, [BTreeSet::from(["a", "b", "b::inner"])]);
    let bare = of(&[("", "pub mod a;"), ("a", "mod b;\nuse b::f;"), ("a::b", "use super::T;")]);
    assert_eq!(circles(&graph(&bare)), [BTreeSet::from(["a", "a::b"])]);
    let down = of(&[("", ""), ("a", "use crate::b::f;"), ("b", "use self::inner::g;"), ("b::inner", "")]);
    assert!(circles(&graph(&down)).is_empty());
}

/// Files are opened in one place and things are printed in one place: only there is an input known by itself, and only
/// there is text of others made harmless. Libraries do neither, and only the pictures know Rerun.
#[test]
fn only_one_file_opens_files_and_only_one_prints() {
    const OPENS: [&str; 9] = [
        "std::fs",
        "fs::read(",
        "fs::read_to_string",
        "File::open",
        "OpenOptions",
        "fs::write",
        "File::create",
        "fs::copy",
        "fs::rename",
    ];
    const PRINTS: [&str; 6] =
        ["println!(", "print!(", "eprintln!(", "eprint!(", "io::stdout()", "io::stderr()"];
    let mut read = 0;
    for (name, _) in USES.iter().filter(|(name, _)| !FOR_TESTS.contains(name)) {
        for (file, text) in code(&root().join("crates").join(name).join("src")) {
            read += 1;
            for word in OPENS.iter().chain(&PRINTS) {
                assert!(!text.contains(word), "crates/{name}/src/{file} has {word}");
            }
            assert!(
                *name == "pictures" || !text.contains("re_sdk"),
                "crates/{name}/src/{file} names Rerun's SDK"
            );
        }
    }
    assert!(read > 50, "the sources are read");
    for (file, text) in code(&root().join("src")) {
        assert!(!text.contains("re_sdk"), "src/{file} names Rerun's SDK");
        let opens = OPENS[1..].iter().find(|word| text.contains(**word));
        assert!(opens.is_none() || file.starts_with("cli/files"), "src/{file} has {}", opens.unwrap());
        // The ledger asks where stdout goes, the spinner draws itself.
        let may = ["cli/terminal.rs", "cli/progress.rs", "cli/files/ledger.rs"].contains(&file.as_str());
        let prints = ["println!(", "print!(", "io::stdout()", "io::stderr()"]
            .iter()
            .find(|word| text.contains(**word));
        assert!(may || prints.is_none(), "src/{file} has {}", prints.unwrap());
    }
}

/// Two roundings of it would make a load of a program weigh another than what it was fitted with. Simulators of tests are independent on purpose.
#[test]
fn the_number_of_gravity_stands_in_one_file() {
    let mut found = Vec::new();
    for (name, _) in USES {
        for (file, text) in code(&root().join("crates").join(name).join("src")) {
            if ["9.806", "9.81", "9_806", "9806"].iter().any(|number| text.contains(number)) {
                found.push(format!("{name}/{file}"));
            }
        }
    }
    assert_eq!(found, ["arm/gravity.rs"]);
}
