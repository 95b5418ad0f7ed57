//! What is read and what is written: no input and no second output is ever overwritten, and outputs are handled as `cp`
//! would handle them.
//!
//! The class: a file is known by itself, not by its name and not by a list of what a verb reads. So every verb is walked with
//! every kind of input and every option that names an output, and `--help` says whether the walk is complete.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use rayon::prelude::*;
use tempfile::TempDir;

use super::verbs::{CELL, Verb, verbs};
use super::{CABLE, folder, truegrind};

/// A folder with every kind of input.
fn inputs() -> &'static Path {
    static INPUTS: OnceLock<TempDir> = OnceLock::new();
    let made = INPUTS.get_or_init(|| {
        let dir = folder();
        let at = dir.path();
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let put = |name: &str, text: &str| fs::write(at.join(name), text).unwrap();
        put("data.csv", CABLE);
        put("other.csv", CABLE);
        let arms = include_str!("../../../crates/arm/src/robots/abb.toml");
        let second = arms.match_indices("[[robot]]").nth(1).map_or(arms.len(), |(at, _)| at);
        put("robot.toml", &arms[..second]);
        let recipe = include_str!("../../data/irb120-cable.toml");
        put("recipe.toml", &recipe.replace("robot = \"abb-irb-120\"", "robot = \"robot.toml\""));
        for name in ["plate.toml", "plate.stl"] {
            fs::copy(root.join("surfaces").join(name), at.join(name)).unwrap();
        }
        put("cell.toml", "[[tool]]\nname = \"tSpindle\"\norigin = \"metrology\"\n");
        put(
            "mine.toml",
            "name = \"mine\"\ntitle = \"Mine\"\npaper = \"ours\"\n[methods]\nreference = \"B\"\n[methods.protocol]\nrows = \
             100\nheld_out = 0.2\ncases = 2\n[[methods.method]]\nid = \"A\"\nname = \"EKF\"\nsolver = \"ekf\"\ntreatment = \
             \"sound\"\n[[methods.method]]\nid = \"B\"\nname = \"LM\"\nsolver = \"lm\"\ntreatment = \"sound\"\n",
        );
        put("task.pgf", "<Program><Module>listed.mod</Module><Module>other.mod</Module></Program>");
        for run in [
            &["identify", "data.csv", "--robot", "abb-irb-120", "-o", "model.toml"][..],
            &["diagnose", "data.csv", "--robot", "abb-irb-120", "--json", "why.json"],
            &["simulate", "recipe.toml", "-o", "again.csv", "--arm", "actual.toml"],
            &["simulate", "recipe.toml", "-o", "later.csv", "--seed", "7"],
            &["path", "plate.toml", "--robot", "abb-irb-120", "-o", "a.mod"],
        ] {
            let (code, _, err) = truegrind(at, run);
            assert!(code < 2, "{run:?}: {err}");
        }
        let shared = ["compensate", "a.mod", "--model", "model.toml", "-o", "shared", "--resume"];
        let (code, _, err) = truegrind(at, &shared);
        assert!(code < 2, "{err}");
        fs::create_dir(at.join("days")).unwrap();
        for copy in ["a2.mod", "listed.mod", "days/b.mod", "days/c.mod"] {
            fs::copy(at.join("a.mod"), at.join(copy)).unwrap();
        }
        put("other.mod", "MODULE other\nENDMODULE\n");
        for day in ["days/one.csv", "days/two.csv"] {
            put(day, CABLE);
        }
        dir
    });
    made.path()
}

/// A copy of the inputs that one run may try to spoil.
fn copied() -> TempDir {
    let dir = folder();
    copy_all(inputs(), dir.path());
    dir
}

fn copy_all(from: &Path, to: &Path) {
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let to = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            fs::create_dir(&to).unwrap();
            copy_all(&entry.path(), &to);
        } else {
            fs::copy(entry.path(), to).unwrap();
        }
    }
}

fn arguments<'a>(verb: &Verb, more: &[&'a str]) -> Vec<&'a str> {
    let needs = if more.iter().any(|word| word.starts_with("-o")) { &[][..] } else { verb.needs };
    [verb.base, needs, more].concat()
}

#[test]
fn the_walk_knows_every_verb_and_every_option() {
    let dir = folder();
    let long = |text: &str| -> BTreeSet<String> {
        let words = text
            .split(|c: char| c.is_whitespace() || matches!(c, ',' | '[' | '=' | '`' | '(' | ')' | '.' | ':'));
        words.filter(|word| word.starts_with("--") && word.len() > 2).map(str::to_owned).collect()
    };
    let (_, help, _) = truegrind(dir.path(), &["--help"]);
    let commands = help.split_once("Commands:").unwrap().1.split_once("Options:").unwrap().0;
    let walked: BTreeSet<&str> = verbs().iter().map(|verb| verb.base[0]).collect();
    for line in commands.lines().filter(|line| line.starts_with("  ") && !line.starts_with("   ")) {
        let verb = line.split_whitespace().next().unwrap();
        // What reads no file, or writes into a folder of its own; `view` shows what was written.
        if ["demo", "help", "view", "completions", "man"].contains(&verb) {
            continue;
        }
        assert!(walked.contains(verb), "{verb} is not walked");
        let (_, help, _) = truegrind(dir.path(), &[verb, "--help"]);
        let options = help.split_once("Options:").unwrap().1;
        let verbs = verbs();
        let these = || verbs.iter().filter(|v| v.base[0] == verb);
        let others = these().flat_map(|v| v.others.iter().copied().flatten());
        let mut known: BTreeSet<String> =
            these().flat_map(|v| v.outputs).chain(others).map(|option| (*option).to_owned()).collect();
        known.extend(["--output", "--help"].map(str::to_owned));
        known.extend(CELL.map(str::to_owned));
        let heads: String = options
            .lines()
            .filter(|l| l.trim_start().starts_with('-') && l.len() - l.trim_start().len() <= 6)
            // The option alone: what its description names is not its own.
            .map(|l| format!("{}\n", l.trim_start().split("  ").next().unwrap_or_default()))
            .collect();
        let unknown: Vec<String> = long(&heads).difference(&known).cloned().collect();
        assert!(unknown.is_empty(), "{verb}: {unknown:?} is neither an output nor anything else in the walk");
    }
}

#[test]
fn no_input_of_any_kind_is_overwritten_by_any_output() {
    let verbs = verbs();
    let walk: Vec<(&Verb, &str, &str)> = verbs
        .iter()
        .flat_map(|verb| verb.inputs.iter().map(move |input| (verb, *input)))
        .flat_map(|(verb, input)| verb.outputs.iter().map(move |output| (verb, input, *output)))
        .collect();
    assert!(walk.len() > 150);
    inputs();
    let failed: Vec<String> = walk
        .par_iter()
        .enumerate()
        .filter_map(|(index, (verb, input, output))| {
            let dir = copied();
            let at = dir.path();
            // The file under another name, each way in turn.
            let named = match index % 4 {
                0 => (*input).to_owned(),
                1 => format!("./{input}"),
                #[cfg(unix)]
                2 => {
                    std::os::unix::fs::symlink(at.join(input), at.join("link")).unwrap();
                    "link".to_owned()
                }
                _ => {
                    fs::hard_link(at.join(input), at.join("second")).unwrap();
                    "second".to_owned()
                }
            };
            let run = arguments(verb, &[output, &named]);
            let (code, out, err) = truegrind(at, &run);
            let kept = fs::read(at.join(input)).unwrap() == fs::read(inputs().join(input)).unwrap();
            let told = code == 2 && err.contains("never overwritten");
            (!kept || !told).then(|| format!("{run:?} ({input}): kept {kept}, {code}: {out}{err}"))
        })
        .collect();
    assert!(failed.is_empty(), "{} of {}:\n{}", failed.len(), walk.len(), failed.join("\n"));
}

#[test]
fn no_two_outputs_are_one_file() {
    inputs();
    let verbs = verbs();
    let walk: Vec<(&Verb, usize)> =
        verbs.iter().flat_map(|verb| (1..verb.outputs.len()).map(move |second| (verb, second))).collect();
    let failed: Vec<String> = walk
        .par_iter()
        .filter_map(|(verb, second)| {
            let dir = copied();
            let at = dir.path();
            let first = verb.outputs[second - 1];
            let other = verb.outputs[*second];
            fs::write(at.join("old"), "old").unwrap();
            fs::hard_link(at.join("old"), at.join("older")).unwrap();
            let pair = [["x.out", "./x.out"], ["old", "older"], ["-", "/dev/stdout"]][second % 3];
            let takes_stdout = ![first, other].iter().any(|o| ["--parquet", "--rrd", "--state"].contains(o));
            let pair = if pair[0] == "-" && !takes_stdout { ["y", "y"] } else { pair };
            let named = |option: &str, file: &str| {
                if option == "-o" { format!("-o{file}") } else { format!("{option}={file}") }
            };
            let both = [named(first, pair[0]), named(other, pair[1])];
            let run = arguments(verb, &[&both[0], &both[1]]);
            let (code, out, err) = truegrind(at, &run);
            let told = ["the second", "two outputs"].iter().any(|words| err.contains(words));
            let kept = fs::read_to_string(at.join("old")).unwrap() == "old" && !at.join("x.out").exists();
            (code != 2 || !told || !kept).then(|| format!("{run:?}: {code}: {out}{err}"))
        })
        .collect();
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

/// `path` makes a small program at once: what is looked at is how it is put there.
fn put(at: &Path, output: &str, before: &str) -> (i32, String) {
    let script = format!("{before}exec \"$0\" path plate.toml --robot abb-irb-120 -o '{output}'");
    let run = std::process::Command::new("sh")
        .current_dir(at)
        .args(["-c", &script, env!("CARGO_BIN_EXE_truegrind")])
        .output()
        .unwrap();
    (run.status.code().unwrap_or(-1), String::from_utf8_lossy(&run.stderr).into_owned())
}

fn plate() -> TempDir {
    let dir = folder();
    for name in ["plate.toml", "plate.stl"] {
        fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join("surfaces").join(name), dir.path().join(name))
            .unwrap();
    }
    dir
}

#[cfg(unix)]
#[test]
fn outputs_are_handled_as_cp_would() {
    use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};
    let dir = plate();
    let at = dir.path();
    let mode = |name: &str| fs::metadata(at.join(name)).unwrap().permissions().mode() & 0o777;
    let is_program = |name: &str| fs::read_to_string(at.join(name)).unwrap().starts_with("MODULE");
    // A new file: what the system gives to new files.
    for (umask, expected) in [("022", 0o644), ("027", 0o640), ("077", 0o600), ("0", 0o666)] {
        let name = format!("new-{umask}.mod");
        assert_eq!(put(at, &name, &format!("umask {umask}; ")).0, 0);
        assert_eq!(mode(&name), expected, "umask {umask}");
    }
    // One that is there keeps its own.
    for bits in [0o600, 0o664, 0o755] {
        fs::write(at.join("old.mod"), "old").unwrap();
        fs::set_permissions(at.join("old.mod"), fs::Permissions::from_mode(bits)).unwrap();
        assert_eq!(put(at, "old.mod", "").0, 0);
        assert!(mode("old.mod") == bits && is_program("old.mod"), "{bits:o}: {:o}", mode("old.mod"));
    }
    // A read-only one stays, whoever asks.
    fs::write(at.join("fixed.mod"), "fixed").unwrap();
    fs::set_permissions(at.join("fixed.mod"), fs::Permissions::from_mode(0o444)).unwrap();
    let (code, err) = put(at, "fixed.mod", "");
    assert!(code == 2 && err.contains("fixed.mod is read-only"), "{err}");
    assert_eq!(fs::read_to_string(at.join("fixed.mod")).unwrap(), "fixed");
    // A link is followed, to a file that is not there yet too; the link stays one.
    fs::create_dir(at.join("far")).unwrap();
    fs::write(at.join("far/there.mod"), "old").unwrap();
    for (link, to) in [("a.mod", "far/there.mod"), ("b.mod", "far/not-yet.mod")] {
        symlink(to, at.join(link)).unwrap();
        assert_eq!(put(at, link, "").0, 0, "{link}");
        assert!(is_program(to) && fs::symlink_metadata(at.join(link)).unwrap().is_symlink(), "{link}");
    }
    symlink("round.mod", at.join("round.mod")).unwrap();
    assert_eq!(put(at, "round.mod", "").0, 2);
    // A file with two names keeps both, longer and shorter than what was there.
    for old in ["short".to_owned(), "long ".repeat(100_000)] {
        let _ = fs::remove_file(at.join("two.mod"));
        fs::write(at.join("one.mod"), &old).unwrap();
        fs::hard_link(at.join("one.mod"), at.join("two.mod")).unwrap();
        assert_eq!(put(at, "two.mod", "").0, 0);
        assert_eq!(fs::read(at.join("one.mod")).unwrap(), fs::read(at.join("new-022.mod")).unwrap());
        assert_eq!(fs::metadata(at.join("two.mod")).unwrap().nlink(), 2);
    }
    // What does not fit leaves what was there, under both names.
    fs::write(at.join("one.mod"), "short").unwrap();
    let (code, err) = put(at, "two.mod", "trap '' XFSZ; ulimit -f 8; ");
    assert!(code == 2 && err.contains("nothing was changed"), "{err}");
    assert_eq!(fs::read_to_string(at.join("one.mod")).unwrap(), "short");
    // A folder, a device, the standard output by its other name.
    assert!(put(at, "far", "").1.contains("far is a folder"));
    assert_eq!(put(at, "/dev/null", "").0, 0);
    assert_eq!(put(at, "/dev/stdout", "").0, 0);
    // Nothing is left beside them.
    let left: Vec<PathBuf> = super::files(at).into_iter().filter(|p| p.extension().is_none()).collect();
    assert_eq!(left, [at.join("far")]);
}

/// The owner of a file that is there keeps it; only the superuser can put that to the test.
#[cfg(unix)]
#[test]
fn a_file_of_another_owner_stays_theirs() {
    use std::os::unix::fs::{MetadataExt, chown};
    let dir = plate();
    let at = dir.path();
    fs::write(at.join("theirs.mod"), "old").unwrap();
    if chown(at.join("theirs.mod"), Some(12345), Some(12345)).is_err() {
        return;
    }
    assert_eq!(put(at, "theirs.mod", "").0, 0);
    let meta = fs::metadata(at.join("theirs.mod")).unwrap();
    assert_eq!((meta.uid(), meta.gid()), (12345, 12345));
}

#[cfg(unix)]
#[test]
fn the_standard_output_never_goes_into_an_input() {
    let dir = folder();
    let at = dir.path();
    fs::write(at.join("data.csv"), CABLE).unwrap();
    let into = fs::OpenOptions::new().append(true).open(at.join("data.csv")).unwrap();
    let run = std::process::Command::new(env!("CARGO_BIN_EXE_truegrind"))
        .current_dir(at)
        .args(["identify", "data.csv", "--robot", "abb-irb-120", "--csv"])
        .stdout(into)
        .output()
        .unwrap();
    assert_eq!(run.status.code(), Some(2), "{}", String::from_utf8_lossy(&run.stderr));
    assert_eq!(fs::read_to_string(at.join("data.csv")).unwrap(), CABLE);
}

#[test]
fn a_measurement_in_a_watched_folder_is_no_table_of_ours() {
    let dir = copied();
    let at = dir.path();
    let run = ["track", "days", "--model", "model.toml", "-o", "made", "--csv", "days/one.csv"];
    let (code, _, err) = truegrind(at, &run);
    assert!(code == 2 && err.contains("never overwritten"), "{err}");
    assert_eq!(fs::read_to_string(at.join("days/one.csv")).unwrap(), CABLE);
}
