//! Runs that several jobs share and that go on where they were stopped: whatever starts, stops and repeats the jobs, what comes out is
//! byte for byte what one run writes, or an error that says what is missing.
//!
//! The class: a result that depends on which job did what, how often, when it was killed or what it did before.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use tempfile::TempDir;

use super::{CABLE, folder, truegrind};

const KINDS: &[&str] = if cfg!(feature = "parquet") {
    &["csv", "json", "md", "html", "parquet"]
} else {
    &["csv", "json", "md", "html"]
};

fn reports() -> Vec<String> {
    KINDS.iter().map(|kind| format!("--{kind}=all.{kind}")).collect()
}

/// Two models of one arm.
pub(super) fn models() -> &'static Path {
    static MODELS: OnceLock<TempDir> = OnceLock::new();
    let made = MODELS.get_or_init(|| {
        let dir = folder();
        fs::write(dir.path().join("data.csv"), CABLE).unwrap();
        for (name, share) in [("model.toml", "0.2"), ("other.toml", "0.3")] {
            let fit = ["identify", "data.csv", "--robot", "abb-irb-120", "--held-out", share, "-o", name];
            let (code, _, err) = truegrind(dir.path(), &fit);
            assert_eq!(code, 0, "{err}");
        }
        dir
    });
    made.path()
}

/// Programs of several languages, in folders, one in another character set and one that cannot be done.
fn plant() -> TempDir {
    let dir = folder();
    let at = dir.path();
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("programs");
    for name in ["model.toml", "other.toml"] {
        fs::copy(models().join(name), at.join(name)).unwrap();
    }
    for (from, to) in [
        ("straight.mod", "straight.mod"),
        ("circles.mod", "line 1/circles.mod"),
        ("told.mod", "line 1/old/told.mod"),
        ("fanuc.nc", "nc/fanuc.nc"),
        ("siemens.mpf", "nc/siemens.mpf"),
        ("straight.mod", "nc/straight.mod"),
    ] {
        let to = at.join("in").join(to);
        fs::create_dir_all(to.parent().unwrap()).unwrap();
        fs::copy(shipped.join(from), to).unwrap();
    }
    let mut latin = b"! Schl\xe4uche pr\xfcfen\n".to_vec();
    latin.extend(fs::read(shipped.join("straight.mod")).unwrap());
    fs::write(at.join("in/latin.mod"), latin).unwrap();
    fs::write(at.join("in/broken.pgf"), "<Program><Module>nowhere.mod</Module></Program>").unwrap();
    dir
}

/// All files below a folder but those that jobs keep for each other, with their bytes.
fn made(at: &Path, folder: &str) -> BTreeMap<PathBuf, Vec<u8>> {
    let (mut out, mut open) = (BTreeMap::new(), vec![at.join(folder)]);
    while let Some(next) = open.pop() {
        for path in super::files(&next) {
            let below = path.strip_prefix(at).unwrap().to_path_buf();
            let ours = ["done", "begun", "tables", "run.json"].map(|name| Path::new(folder).join(name));
            if path.is_dir() && !ours.contains(&below) {
                open.push(path);
            } else if path.is_file() && !ours.contains(&below) {
                out.insert(below, fs::read(&path).unwrap());
            }
        }
    }
    out
}

/// What one run writes: reports, programs, and its exit code.
fn one_run(at: &Path, arguments: &[&str]) -> (i32, String) {
    let reports = reports();
    let all: Vec<&str> = arguments.iter().copied().chain(reports.iter().map(String::as_str)).collect();
    let (code, out, err) = truegrind(at, &all);
    assert!(code == 0 || code == 1, "{all:?}: {err}");
    (code, out)
}

/// The same by `gather`, compared with what one run left in another folder.
fn gathered_like(one: &Path, (code, out): &(i32, String), at: &Path, work: &str, more: &[&str]) {
    let reports = reports();
    let mut all = vec!["gather", work];
    all.extend(more);
    all.extend(reports.iter().map(String::as_str));
    let (found, printed, err) = truegrind(at, &all);
    assert!(found == *code && printed == *out, "{found}, expected {code}:\n{printed}{err}\nexpected\n{out}");
    for kind in KINDS {
        let name = format!("all.{kind}");
        assert!(fs::read(one.join(&name)).unwrap() == fs::read(at.join(&name)).unwrap(), "{name} differs");
    }
}

const COMPENSATE: [&str; 6] = ["compensate", "in", "--model", "model.toml", "-o", "real"];

fn with<'a>(base: &[&'a str], more: &[&'a str]) -> Vec<&'a str> {
    [base, more].concat()
}

/// Records without an entry for every motion make every report but --json; whoever asks for that one is told that the programs have to
/// be done again, and gets the same bytes then.
#[test]
fn brief_records_make_every_report_but_one() {
    let (one, many) = (plant(), plant());
    let expected = one_run(one.path(), &COMPENSATE);
    let at = many.path();
    let (code, _, err) = truegrind(at, &with(&COMPENSATE, &["--resume", "--brief-records"]));
    assert!(code < 2, "{err}");
    let (code, _, err) = truegrind(at, &["gather", "real", "--csv", "all.csv", "--html", "all.html"]);
    assert_eq!(code, expected.0, "{err}");
    for name in ["all.csv", "all.html"] {
        assert!(
            fs::read(one.path().join(name)).unwrap() == fs::read(at.join(name)).unwrap(),
            "{name} differs"
        );
    }
    let (code, _, err) = truegrind(at, &["gather", "real", "--json", "all.json"]);
    // What could not be done has no entries, and is complete.
    assert!(code == 2 && err.contains("7 of 8 units are missing") && !at.join("all.json").exists(), "{err}");
    let (code, _, err) = truegrind(at, &with(&COMPENSATE, &["--resume", "--json", "some.json"]));
    assert!(code < 2, "{err}");
    gathered_like(one.path(), &expected, at, "real", &[]);
    // Whole records serve who wants less.
    let before: BTreeMap<PathBuf, Vec<u8>> = super::files(&at.join("real/done"))
        .into_iter()
        .map(|path| (path.clone(), fs::read(path).unwrap()))
        .collect();
    let (code, _, err) = truegrind(at, &with(&COMPENSATE, &["--resume", "--brief-records"]));
    assert!(code < 2, "{err}");
    let failed = |text: &[u8]| String::from_utf8_lossy(text).contains("\"ended\":\"failed\"");
    assert!(before.iter().all(|(path, text)| failed(text) || fs::read(path).unwrap() == *text));
    let (code, _, err) =
        truegrind(at, &["compensate", "in", "--model", "model.toml", "-o", "real", "--brief-records"]);
    assert!(code == 2 && err.contains("--brief-records"), "{err}");
}

#[test]
fn shares_put_together_are_what_one_run_writes() {
    let (one, many) = (plant(), plant());
    let expected = one_run(one.path(), &with(&COMPENSATE, &["--diff", "all.diff"]));
    let at = many.path();
    for share in ["2/3", "1/3", "3/3"] {
        let diff = format!("{}.diff", &share[..1]);
        let csv = format!("{}.csv", &share[..1]);
        let job = with(
            &COMPENSATE,
            &["--shard", share, "--resume", "--diff", &diff, "--csv", &csv, "--threads", "1"],
        );
        let (code, _, err) = truegrind(at, &job);
        assert!(code < 2, "{err}");
    }
    if cfg!(feature = "parquet") {
        let tables: BTreeSet<PathBuf> = super::files(&at.join("real/tables")).into_iter().collect();
        let named = |k: u32| at.join(format!("real/tables/share-{k}-of-3.parquet"));
        assert_eq!(tables, (1..=3).map(named).collect());
        // The same as by name.
        let own = ["--shard", "2/3", "--resume", "--parquet", "own.parquet", "--diff", "2.diff"];
        let job = with(&COMPENSATE, &own);
        let (code, _, err) = truegrind(at, &job);
        assert!(code < 2, "{err}");
        assert_eq!(fs::read(at.join("own.parquet")).unwrap(), fs::read(named(2)).unwrap());
    }
    gathered_like(one.path(), &expected, at, "real", &["--diff", "all.diff"]);
    assert!(fs::read(one.path().join("all.diff")).unwrap() == fs::read(at.join("all.diff")).unwrap());
    assert_eq!(made(one.path(), "real"), made(at, "real"));
    // Every program in one share and in no other.
    let rows = |name: &str| -> Vec<String> {
        let text = fs::read_to_string(at.join(name)).unwrap();
        text.lines().skip(1).map(str::to_owned).collect()
    };
    let mut parts: Vec<String> = ["1.csv", "2.csv", "3.csv"].iter().flat_map(|name| rows(name)).collect();
    let mut all = rows("all.csv");
    assert!(parts.len() == 8 && all.iter().any(|row| row.contains("failed")), "{all:?}");
    parts.sort();
    all.sort();
    assert_eq!(parts, all);
    // What is done may be kept in another folder than what is written.
    let (code, _, err) =
        truegrind(at, &with(&COMPENSATE, &["--work", "elsewhere/kept", "--diff", "one.diff"]));
    assert!(code < 2, "{err}");
    gathered_like(one.path(), &expected, at, "elsewhere/kept", &[]);
    // One run that goes on, over the same folder, says the same.
    let again = one_run(at, &with(&COMPENSATE, &["--resume", "--diff", "again.diff"]));
    assert_eq!(again, expected);
    gathered_like(one.path(), &expected, at, "real", &[]);
}

/// Tables of shares are those of the run as it is asked for now: another model or another number of shares leaves none of the last
/// one's beside them, which whoever reads the folder as one table would count twice.
#[cfg(feature = "parquet")]
#[test]
fn tables_of_another_run_do_not_stay_beside_those_of_this_one() {
    let dir = plant();
    let at = dir.path();
    let names = || -> Vec<String> {
        let files = super::files(&at.join("real/tables"));
        let mut names: Vec<String> =
            files.iter().map(|path| path.file_name().unwrap().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    };
    for (more, expected) in [
        (&["--shard", "1/2"][..], &["share-1-of-2.parquet"][..]),
        (&["--shard", "2/2"], &["share-1-of-2.parquet", "share-2-of-2.parquet"]),
        (&["--shard", "02/10"], &["share-02-of-10.parquet"]),
        (&["--shard", "2/10", "--tolerance", "0.07"], &["share-02-of-10.parquet"]),
        (&["--shard", "1/10", "--tolerance", "0.07"], &["share-01-of-10.parquet", "share-02-of-10.parquet"]),
        (&["--resume"], &[]),
    ] {
        let (code, _, err) = truegrind(at, &with(&COMPENSATE, more));
        assert!(code < 2, "{err}");
        assert_eq!(names(), expected, "{more:?}");
    }
}

#[test]
fn shares_of_a_deviation_put_together_are_what_one_run_writes() {
    let (one, many) = (plant(), plant());
    let base = ["deviation", "in", "--model", "model.toml", "other.toml"];
    let expected = one_run(one.path(), &base);
    let at = many.path();
    let (code, _, err) = truegrind(at, &with(&base, &["--shard", "1/2"]));
    assert!(code == 2 && err.contains("--work FOLDER is missing"), "{err}");
    for share in ["1/2", "2/2"] {
        let (code, _, err) = truegrind(at, &with(&base, &["--work", "kept", "--shard", share, "--resume"]));
        assert!(code < 2, "{err}");
    }
    gathered_like(one.path(), &expected, at, "kept", &[]);
}

#[test]
fn arms_of_a_fleet_give_one_table_however_they_are_shared() {
    let (one, many) = (folder(), folder());
    for dir in [&one, &many] {
        let at = dir.path().join("fleet");
        fs::create_dir_all(at.join("hall 2")).unwrap();
        fs::write(at.join("arm-1.csv"), CABLE).unwrap();
        fs::write(at.join("hall 2/arm-2.csv"), include_str!("../../data/irb120-rounded.csv")).unwrap();
        fs::write(at.join("broken.csv"), "q1,q2\n1,2\n").unwrap();
    }
    let base = ["diagnose", "fleet", "--robot", "abb-irb-120", "-o", "models"];
    let expected = one_run(one.path(), &base);
    assert!(expected.1.contains("Largest gain: fleet/arm-1.csv") && expected.0 == 1, "{}", expected.1);
    let at = many.path();
    for share in ["1/2", "2/2"] {
        let (code, _, err) = truegrind(at, &with(&base, &["--shard", share, "--resume"]));
        assert!(code < 2, "{err}");
    }
    gathered_like(one.path(), &expected, at, "models", &[]);
    let models = made(at, "models");
    assert_eq!(made(one.path(), "models"), models);
    for name in ["models/arm-1.html", "models/arm-1.json", "models/hall 2/arm-2.html"] {
        assert!(models.contains_key(Path::new(name)), "{name}: {:?}", models.keys());
    }
    let table = fs::read_to_string(at.join("all.csv")).unwrap();
    let broken = table.lines().find(|line| line.contains("broken.csv")).unwrap();
    assert!(broken.contains("failed") && table.lines().count() == 4, "{table}");
    // By itself an arm is diagnosed as before, and to the same model.
    let alone = ["diagnose", "fleet/arm-1.csv", "--robot", "abb-irb-120", "-o", "alone.toml"];
    let (code, _, err) = truegrind(at, &alone);
    assert!(code < 2, "{err}");
    assert!(fs::read(at.join("alone.toml")).unwrap() == models[Path::new("models/arm-1.toml")]);
}

/// The records of a run, each with what tells whether it was written again.
#[cfg(unix)]
fn records(at: &Path, work: &str) -> BTreeMap<String, u64> {
    use std::os::unix::fs::MetadataExt;
    let all = super::files(&at.join(work).join("done")).into_iter();
    let name = |path: &PathBuf| path.file_name().unwrap().to_string_lossy().into_owned();
    all.filter(|path| !name(path).starts_with('.'))
        .map(|path| (name(&path), fs::metadata(&path).unwrap().ino()))
        .collect()
}

/// A job in the background.
fn started(at: &Path, arguments: &[&str]) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_truegrind"));
    command.current_dir(at).args(arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

/// Copies of a program, enough that a job does not end at once.
fn copies(at: &Path, count: usize) {
    let text = fs::read_to_string(at.join("in/line 1/circles.mod")).unwrap();
    for number in 0..count {
        fs::write(at.join(format!("in/copy{number:03}.mod")), format!("! {number}\n{text}")).unwrap();
    }
}

#[cfg(unix)]
#[test]
fn a_run_that_was_killed_goes_on_with_the_rest() {
    let (one, many) = (plant(), plant());
    for dir in [&one, &many] {
        copies(dir.path(), 60);
    }
    let expected = one_run(one.path(), &COMPENSATE);
    let at = many.path();
    let job = with(&COMPENSATE, &["--resume", "--threads", "1"]);
    let mut child = started(at, &job);
    let begin = Instant::now();
    let done = at.join("real/done");
    while !done.is_dir() || super::files(&done).len() < 12 {
        assert!(begin.elapsed() < Duration::from_secs(120), "no record comes");
        assert!(child.try_wait().unwrap().is_none(), "it ended before it was killed");
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let before = records(at, "real");
    assert!((10..68).contains(&before.len()), "{}", before.len());
    // What is not there is said by name.
    let (code, _, err) = truegrind(at, &["gather", "real"]);
    assert!(code == 2 && err.contains(&format!("{} of 68 units are missing", 68 - before.len())), "{err}");
    let (code, _, err) = truegrind(at, &job);
    assert!(code < 2, "{err}");
    let after = records(at, "real");
    assert_eq!(after.len(), 68);
    let broken = fs::read_to_string(at.join("real/run.json")).unwrap().contains("broken.pgf");
    let again = before.iter().filter(|(name, inode)| after[*name] != **inode).count();
    // The one that cannot be done is tried again.
    assert!(broken && again <= 1, "{again} were done twice");
    assert!(super::files(&at.join("real/begun")).is_empty());
    gathered_like(one.path(), &expected, at, "real", &[]);
    assert_eq!(made(one.path(), "real"), made(at, "real"));
}

#[test]
fn what_is_missing_is_listed_by_share_and_name() {
    let dir = plant();
    let at = dir.path();
    let (code, _, err) = truegrind(at, &["gather", "real"]);
    assert!(code == 2 && err.contains("run.json: not found"), "{err}");
    let (code, _, err) = truegrind(at, &with(&COMPENSATE, &["--list-units"]));
    assert!(code == 0 && !at.join("real/straight.mod").exists(), "{err}");
    let (code, _, err) = truegrind(at, &["gather", "real"]);
    assert!(
        code == 2 && err.contains("8 of 8 units are missing") && err.contains("in/line 1/circles.mod"),
        "{err}"
    );
    let (code, _, err) = truegrind(at, &with(&COMPENSATE, &["--shard", "1/2", "--resume"]));
    assert!(code < 2, "{err}");
    let (code, _, err) = truegrind(at, &["gather", "real", "--csv", "all.csv"]);
    assert!(code == 2 && err.contains("share 2/2") && !err.contains("share 1/2"), "{err}");
    assert!(!at.join("all.csv").exists());
    for (share, what) in [("0/2", "counted from 1"), ("3/2", "counted from 1"), ("x", "I/N")] {
        let (code, _, err) = truegrind(at, &with(&COMPENSATE, &["--shard", share]));
        assert!(code == 2 && err.contains(what), "{err}");
    }
    // The units of a list alone, as a scheduler hands them out.
    let list =
        r#"[{"under": "in", "paths": ["in/straight.mod"]}, {"under": "in", "paths": ["in/nc/fanuc.nc"]}]"#;
    fs::write(at.join("some.json"), list).unwrap();
    let (code, out, err) = truegrind(at, &with(&COMPENSATE, &["--units", "some.json", "--resume"]));
    assert!(code < 2 && out.contains("2 programs"), "{out}{err}");
    fs::write(at.join("names.json"), r#"["in/straight.mod"]"#).unwrap();
    let (code, _, err) = truegrind(at, &with(&COMPENSATE, &["--units", "names.json"]));
    assert!(code == 2 && err.contains("line 1, column ") && err.contains("no list of units"), "{err}");
    assert!(!err.contains("struct"), "{err}");
}

#[cfg(unix)]
#[test]
fn whatever_changes_what_comes_out_reuses_nothing_stale() {
    let dir = plant();
    let at = dir.path();
    let job = |more: &[&str]| {
        let base = if more.contains(&"--model") {
            with(&["compensate", "in", "-o", "real"], more)
        } else {
            with(&COMPENSATE, more)
        };
        let (code, _, err) = truegrind(at, &with(&base, &["--resume"]));
        assert!(code < 2, "{err}");
        records(at, "real")
    };
    let first = job(&[]);
    assert_eq!(first.len(), 8);
    let news = |now: &BTreeMap<String, u64>, old: &BTreeMap<String, u64>| {
        now.iter().filter(|(name, inode)| old.get(*name) != Some(inode)).count()
    };
    // Nothing changed: only what failed is tried again, and the number of threads changes nothing.
    let same = job(&["--threads", "2", "--csv", "rows.csv"]);
    assert!(news(&same, &first) <= 1, "{}", news(&same, &first));
    let mut last = same;
    for change in
        [&["--model", "other.toml"][..], &["--tolerance", "0.07"], &["--cell", "cell.toml"], &["--partial"]]
    {
        fs::write(at.join("cell.toml"), "[[tool]]\nname = \"tNone\"\norigin = \"metrology\"\n").unwrap();
        let now = job(change);
        assert_eq!(news(&now, &last), 8, "{change:?}");
        last = now;
    }
    // The content of the cell file counts, its name does not make it another.
    fs::write(at.join("cell.toml"), "[[tool]]\nname = \"tOther\"\norigin = \"metrology\"\n").unwrap();
    let now = job(&["--cell", "cell.toml"]);
    assert_eq!(news(&now, &last), 8);
    // Back to the first: all of it is there, but its outputs were written over by the others since.
    let back = job(&[]);
    let one = plant();
    let written = one_run(one.path(), &COMPENSATE);
    gathered_like(one.path(), &written, at, "real", &[]);
    assert_eq!(made(one.path(), "real"), made(at, "real"));
    // One program changes: it alone is done again, and until then it counts as missing.
    let program = at.join("in/straight.mod");
    let text = fs::read_to_string(&program).unwrap();
    fs::write(&program, format!("! changed\n{text}")).unwrap();
    let (code, _, err) = truegrind(at, &["gather", "real"]);
    assert!(code == 2 && err.contains("1 of 8") && err.contains("in/straight.mod"), "{err}");
    let now = job(&[]);
    assert!((1..=2).contains(&news(&now, &back)), "{}", news(&now, &back));
    // An output changes: it alone is done again.
    fs::write(at.join("real/latin.mod"), "edited").unwrap();
    let (code, _, err) = truegrind(at, &["gather", "real"]);
    assert!(code == 2 && err.contains("outputs changed after they were written: real/latin.mod"), "{err}");
    job(&[]);
    assert!(fs::read(at.join("real/latin.mod")).unwrap().starts_with(b"! Schl\xe4uche"));
    let (code, _, err) = truegrind(at, &["gather", "real"]);
    assert!(code < 2, "{err}");
}

#[test]
fn two_jobs_on_one_folder_at_the_same_time_are_as_one() {
    let (one, many) = (plant(), plant());
    for dir in [&one, &many] {
        copies(dir.path(), 20);
    }
    let expected = one_run(one.path(), &COMPENSATE);
    let at = many.path();
    let job = with(&COMPENSATE, &["--resume", "--threads", "2"]);
    let jobs: Vec<Child> = (0..3).map(|_| started(at, &job)).collect();
    for mut job in jobs {
        assert!(job.wait().unwrap().code().is_some_and(|code| code < 2));
    }
    gathered_like(one.path(), &expected, at, "real", &[]);
    assert_eq!(made(one.path(), "real"), made(at, "real"));
    assert!(super::files(&at.join("real/begun")).is_empty());
}

/// A program whose correction is larger than any file may be: the system kills whoever writes it, every time.
#[cfg(unix)]
#[test]
fn a_unit_that_always_kills_its_worker_is_listed_and_takes_no_other_along() {
    use std::os::unix::process::ExitStatusExt;
    let dir = plant();
    let at = dir.path();
    copies(at, 6);
    let text = fs::read_to_string(at.join("in/straight.mod")).unwrap();
    let filled = format!("{}{text}", "! a comment that fills the file\n".repeat(8000));
    fs::write(at.join("in/copy002big.mod"), filled).unwrap();
    let job = with(&COMPENSATE, &["--resume", "--threads", "2"]);
    let mut killed = 0;
    let ended = loop {
        let quoted = job.iter().map(|word| format!("'{word}'")).collect::<Vec<_>>().join(" ");
        let line = format!("ulimit -f 300; exec '{}' {quoted}", env!("CARGO_BIN_EXE_truegrind"));
        let done = Command::new("sh").current_dir(at).args(["-c", &line]).output().unwrap();
        match done.status.signal() {
            Some(_) => killed += 1,
            None => break done,
        }
        assert!(killed < 10, "it is tried for ever");
    };
    // Once before units are noted, then three times by this one.
    assert_eq!(killed, 4);
    assert_eq!(ended.status.code(), Some(1), "{}", String::from_utf8_lossy(&ended.stderr));
    let (code, _, err) = truegrind(at, &["gather", "real", "--csv", "all.csv"]);
    assert_eq!(code, 1, "{err}");
    let table = fs::read_to_string(at.join("all.csv")).unwrap();
    let failed: BTreeSet<&str> = table
        .lines()
        .filter(|line| line.contains(",failed,"))
        .map(|line| line.split(',').next().unwrap())
        .collect();
    assert_eq!(failed, BTreeSet::from(["in/broken.pgf", "in/copy002big.mod"]), "{table}");
    assert!(table.contains("processing it crashed 3 times"), "{table}");
    // It is not tried again, unless that is asked for.
    let (code, _, err) = truegrind(at, &job);
    assert!(code == 1, "{err}");
    let (code, _, err) = truegrind(at, &COMPENSATE);
    assert!(code == 1, "{err}");
    assert!(at.join("real/copy002big.mod").is_file());
}

/// Every example of deploy/ is asked of the command line itself, so that none goes on with an option that is gone.
#[test]
fn the_commands_of_the_deployment_examples_are_understood() {
    let deploy = Path::new(env!("CARGO_MANIFEST_DIR")).join("deploy");
    let dir = plant();
    let mut seen = 0;
    for path in super::files(&deploy) {
        let mut text = fs::read_to_string(&path).unwrap().replace("\\\n", " ");
        // What the shell counts.
        while let Some((before, (_, after))) =
            text.split_once("$((").and_then(|(before, rest)| Some((before, rest.split_once("))")?)))
        {
            text = format!("{before}1{after}");
        }
        let is_example = path.extension().is_some_and(|ending| ending != "md");
        let known_before = seen;
        for line in text.lines().filter(|line| !line.trim_start().starts_with('#')) {
            let verbs = ["compensate", "deviation", "diagnose", "gather"];
            // As a shell line, or as the words of a list.
            let plain = line.replace(['"', '\'', '[', ']', ','], " ");
            let words: Vec<&str> = plain.split_whitespace().collect();
            let Some(at) = words.iter().position(|word| verbs.contains(word)) else { continue };
            let before = words[..at].last().copied().unwrap_or_default();
            if !["truegrind", "=", "exec", "/usr/local/bin/truegrind"].contains(&before) {
                continue;
            }
            let end = words[at..].iter().position(|word| [":::", "|", "&&", ";", "||"].contains(word));
            let words = &words[at..at + end.unwrap_or(words.len() - at)];
            let is_share = |word: &str| word.contains(['$', '{']) && word.contains('/');
            let mut command: Vec<&str> =
                words.iter().map(|word| if is_share(word) { "1/8" } else { *word }).collect();
            // Parsed and no more: the first thing that a verb looks at is not there.
            let nowhere = dir.path().join("nowhere");
            fs::create_dir_all(&nowhere).unwrap();
            command.retain(|word| *word != "--resume");
            let (code, _, err) = truegrind(&nowhere, &command);
            let parsed = !err.contains("Usage:") && !err.contains("--help");
            assert!(parsed && code == 2, "{}: {line}\n{err}", path.display());
            seen += 1;
        }
        assert!(!is_example || seen > known_before, "{}: no command is found in it", path.display());
    }
    assert_eq!(seen, 7);
}
