//! The binary as a user runs it: exit codes, streams, files, and what bad input gets.

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use tempfile::TempDir;

mod accept;
mod compare;
mod defect;
mod belonging;
mod files;
mod fits;
mod input;
mod json;
mod manual;
mod nc;
#[cfg(feature = "visual")]
mod pictures;
mod robots;
mod same;
mod shares;
mod text;
mod verbs;

const CABLE: &str = include_str!("../data/irb120-cable.csv");

fn truegrind(folder: &Path, arguments: &[&str]) -> (i32, String, String) {
    let output =
        Command::cargo_bin("truegrind").unwrap().current_dir(folder).args(arguments).output().unwrap();
    let text = |b: &[u8]| String::from_utf8_lossy(b).into_owned();
    (output.status.code().unwrap_or(-1), text(&output.stdout), text(&output.stderr))
}

fn folder() -> TempDir {
    tempfile::tempdir().unwrap()
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut out: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    out.sort();
    out
}

/// The shipped measurements with every cell of some columns passed through `change`.
fn changed(columns: &[&str], change: impl Fn(usize, &str) -> String) -> String {
    let mut lines = CABLE.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let mut out = header.join(",") + "\n";
    for (row, line) in lines.enumerate() {
        let cells: Vec<String> = line
            .split(',')
            .zip(&header)
            .map(|(cell, name)| if columns.contains(name) { change(row, cell) } else { cell.to_owned() })
            .collect();
        out += &(cells.join(",") + "\n");
    }
    out
}

/// The shipped tracker's rows with every reading too long by `error`.
fn scaled(error: f64) -> String {
    let mut lines = include_str!("../data/irb120-tracker.csv").lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let mut out = header.join(",") + "\n";
    for line in lines {
        let cells = line.split(',').zip(&header).map(|(cell, name)| match name.strip_prefix("measured_") {
            Some(_) => format!("{:.7}", cell.parse::<f64>().unwrap() * (1.0 + error)),
            None => cell.to_owned(),
        });
        out += &(cells.collect::<Vec<_>>().join(",") + "\n");
    }
    out
}

/// The words of a page, whose options are marked so that they are not broken.
fn words_of(page: &str) -> String {
    page.replace("<span class=\"option\">", "").replace("</span>", "")
}

/// A model whose data do not promise that programs gain is written, and used, only where that is asked for; identify,
/// diagnose and all their outputs call it doubtful first, in the same words.
#[test]
fn a_doubtful_model_needs_a_flag_to_be_written_and_to_be_used() {
    let dir = folder();
    let at = dir.path();
    fs::write(at.join("data.csv"), scaled(0.005)).unwrap();
    let program = "MODULE m\nPROC main()\nMoveJ [[400,0,400],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;\nENDPROC\nENDMODULE\n";
    fs::write(at.join("in.mod"), program).unwrap();
    let word = "The model is doubtful and needs --allow-doubtful";
    for verb in ["identify", "diagnose"] {
        let begin = [verb, "data.csv", "--robot", "abb-irb-120", "-o", "m.toml"];
        let (code, _, err) =
            truegrind(at, &[&begin[..], &["--json", "o.json", "--html", "o.html", "--md", "o.md"]].concat());
        assert_eq!(code, 2, "{verb}: {err}");
        assert!(err.contains("--allow-doubtful") && err.contains("too long"), "{verb}: {err}");
        assert!(!at.join("m.toml").exists(), "{verb}");
        let json: serde_json::Value =
            serde_json::from_str(&fs::read_to_string(at.join("o.json")).unwrap()).unwrap();
        assert_eq!(json["verdict"]["status"], "doubtful", "{verb}");
        for page in ["o.html", "o.md"] {
            let text = words_of(&fs::read_to_string(at.join(page)).unwrap());
            assert!(text.contains(word), "{verb} {page}");
            assert!(
                !text.contains("The model may be used") && !text.contains("No limits were stated"),
                "{verb} {page}"
            );
        }
        let (code, _, err) = truegrind(at, &[&begin[..], &["--allow-doubtful"]].concat());
        assert_eq!(code, 1, "{verb}: {err}");
        let compensate = ["compensate", "in.mod", "--model", "m.toml", "-o", "out.mod"];
        let (code, _, err) = truegrind(at, &compensate);
        assert_eq!(code, 2, "{verb}: {err}");
        assert!(err.contains("doubtful") && !at.join("out.mod").exists(), "{verb}: {err}");
        let (code, _, err) = truegrind(at, &[&compensate[..], &["--allow-doubtful"]].concat());
        assert!(code < 2 && err.contains("doubtful"), "{verb}: {err}");
        // Who only looks at what it would do is told so too, and not refused.
        let (code, _, err) = truegrind(at, &["deviation", "in.mod", "--model", "m.toml"]);
        assert!(code < 2 && err.contains("this model is doubtful"), "{verb}: {err}");
        fs::remove_file(at.join("m.toml")).unwrap();
        fs::remove_file(at.join("out.mod")).unwrap();
    }
}

#[test]
fn identify_path_compensate_deviation_as_in_the_readme() {
    let dir = folder();
    let at = dir.path();
    fs::write(at.join("data.csv"), CABLE).unwrap();
    fs::write(at.join("blade.toml"), include_str!("../../surfaces/blade.toml")).unwrap();
    fs::write(at.join("recipe.toml"), include_str!("../data/irb120-cable.toml")).unwrap();
    let (code, out, err) = truegrind(
        at,
        &["identify", "data.csv", "--robot", "abb-irb-120", "-o", "model.toml", "--json", "id.json"],
    );
    assert_eq!(code, 0, "{err}");
    assert!(out.contains("held"), "the summary states held-out errors:\n{out}");
    let json: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(at.join("id.json")).unwrap()).unwrap();
    assert!(json.is_object());
    let (code, _, err) = truegrind(at, &["path", "blade.toml", "--robot", "abb-irb-120", "-o", "blade.mod"]);
    assert_eq!(code, 0, "{err}");
    let original = fs::read(at.join("blade.mod")).unwrap();
    let (code, out, err) = truegrind(
        at,
        &[
            "compensate",
            "blade.mod",
            "--model",
            "model.toml",
            "-o",
            "out.mod",
            "--surface",
            "blade.toml",
            "--json",
        ],
    );
    assert!(code == 0 || code == 1, "{err}");
    let contract: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(contract["schema"], "truegrind.compensation/1");
    let motions = contract["programs"][0]["motions"].as_array().unwrap();
    assert!(motions.len() > 300);
    for motion in motions {
        assert!(motion["line"].as_u64().unwrap() > 0);
        let status = motion["status"].as_str().unwrap();
        assert!(["changed", "left", "refused", "flagged"].contains(&status), "{status}");
    }
    assert_eq!(fs::read(at.join("blade.mod")).unwrap(), original, "the input stays");
    let rewritten = fs::read(at.join("out.mod")).unwrap();
    assert_ne!(rewritten, original);
    // The same model again: nothing is written.
    let (code, out, _) =
        truegrind(at, &["compensate", "out.mod", "--model", "model.toml", "-o", "twice.mod"]);
    assert_eq!((code, out.contains("already compensated")), (1, true), "{out}");
    assert!(!at.join("twice.mod").exists());
    // The simulated actual arm runs both: the rewritten program is better.
    let (code, _, err) = truegrind(at, &["simulate", "recipe.toml", "-o", "again.csv", "--arm", "arm.toml"]);
    assert_eq!(code, 0, "{err}");
    assert_eq!(fs::read_to_string(at.join("again.csv")).unwrap(), CABLE, "the recipe makes the shipped file");
    let (code, out, err) = truegrind(
        at,
        &[
            "deviation",
            "out.mod",
            "--model",
            "nominal",
            "--robot",
            "abb-irb-120",
            "--intended",
            "blade.mod",
            "--actual",
            "arm.toml",
            "--surface",
            "blade.toml",
            "--csv",
            "table.csv",
            "--json",
        ],
    );
    assert_eq!(code, 0, "{err}");
    let report: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert!(report.is_object());
    assert!(fs::read_to_string(at.join("table.csv")).unwrap().lines().count() > 300);
}

#[test]
fn the_model_nominal_copies_the_bytes() {
    let dir = folder();
    let at = dir.path();
    let source = "MODULE m\r\n  ! \u{e4}\r\n  PROC main()\r\n    MoveL [[400,0,500],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z1,tool0;\r\n  ENDPROC\r\nENDMODULE\r\n";
    fs::write(at.join("p.mod"), source).unwrap();
    let (code, _, err) = truegrind(
        at,
        &["compensate", "p.mod", "--model", "nominal", "--robot", "abb-irb-120", "-o", "q.mod"],
    );
    assert_eq!(code, 0, "{err}");
    assert_eq!(fs::read(at.join("q.mod")).unwrap(), source.as_bytes());
}

#[test]
fn inputs_are_never_overwritten() {
    let dir = folder();
    let at = dir.path();
    fs::write(at.join("data.csv"), CABLE).unwrap();
    for output in ["data.csv", "./data.csv"] {
        let (code, _, err) = truegrind(at, &["identify", "data.csv", "--robot", "abb-irb-120", "-o", output]);
        assert_eq!(code, 2);
        assert!(err.contains("never overwritten"), "{err}");
    }
    assert_eq!(fs::read_to_string(at.join("data.csv")).unwrap(), CABLE);
    let (code, _, err) =
        truegrind(at, &["identify", "data.csv", "--robot", "abb-irb-120", "-o", "no/model.toml"]);
    assert_eq!(code, 2);
    assert!(err.contains("does not exist"), "{err}");
}

#[test]
fn a_full_disk_leaves_nothing() {
    // /dev/full takes no byte: the write fails after the work.
    if !Path::new("/dev/full").exists() {
        return;
    }
    let dir = folder();
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_truegrind"))
        .current_dir(dir.path())
        .args(["robots", "abb-irb-120"])
        .stdout(fs::File::options().write(true).open("/dev/full").unwrap())
        .output()
        .unwrap();
    assert_ne!(output.status.code(), Some(0), "a result that could not be printed is no success");
}

#[test]
fn a_reader_that_has_seen_enough_is_no_fault() {
    let dir = folder();
    // A pipe whose other end is closed before anything is written.
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_truegrind"))
        .current_dir(dir.path())
        .args(["demo", "-o", "made"])
        .stdout(writer)
        .output()
        .unwrap();
    let err = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{err}");
    assert!(dir.path().join("made/blade-compensated.mod").exists() && !err.contains("panicked"), "{err}");
}

#[test]
fn a_file_that_does_not_fit_is_not_there_at_all() {
    // No file may grow beyond some kilobytes, which is what a full disk comes to.
    if cfg!(not(target_os = "linux")) {
        return;
    }
    let dir = folder();
    let at = dir.path();
    fs::write(at.join("data.csv"), CABLE).unwrap();
    fs::write(at.join("model.toml"), "old").unwrap();
    let command = "trap '' XFSZ; ulimit -f 8; exec \"$0\" identify data.csv --robot abb-irb-120 -o model.toml --csv few.csv";
    let output = std::process::Command::new("sh")
        .current_dir(at)
        .args(["-c", command, env!("CARGO_BIN_EXE_truegrind")])
        .output()
        .unwrap();
    let err = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{err}");
    assert!(err.contains("model.toml") && err.contains("nothing was changed"), "{err}");
    assert_eq!(files(at).len(), 2, "neither the other file nor a part of one: {:?}", files(at));
    assert_eq!(fs::read_to_string(at.join("model.toml")).unwrap(), "old", "what was there stays");
}

#[test]
fn outliers_are_found_listed_and_do_no_harm() {
    let number = |c: &str| c.parse::<f64>().unwrap();
    let dir = folder();
    let at = dir.path();
    let rmse = |name: &str, text: &str| {
        fs::write(at.join(name), text).unwrap();
        let (code, out, err) = truegrind(at, &["identify", name, "--robot", "abb-irb-120", "--json"]);
        assert_eq!(code, 0, "{err}");
        let _ = out;
        let (_, _, _) = (code, &out, &err);
        let model = format!("{name}.toml");
        let (code, _, err) = truegrind(at, &["identify", name, "--robot", "abb-irb-120", "-o", &model]);
        assert_eq!(code, 0, "{err}");
        let arm =
            truegrind::arm::estimated::Estimated::from_toml(&fs::read_to_string(at.join(&model)).unwrap())
                .unwrap();
        (arm.calibrated.held_out.rmse, arm.provenance.set_aside)
    };
    let (clean, none) = rmse("clean.csv", CABLE);
    assert!(none.is_empty(), "nothing is set aside on clean data: {none:?}");
    let off = |row: usize, c: &str| match row {
        40 => format!("{:.3}", number(c) + 500.0),
        99 | 150 | 222 => format!("{:.3}", number(c) + 5.0),
        _ => c.to_owned(),
    };
    let (dirty, mut set_aside) = rmse("dirty.csv", &changed(&["L"], off));
    set_aside.sort_unstable();
    // As the spreadsheet counts them: below the header, from 1.
    assert_eq!(set_aside, [42, 101, 152, 224]);
    assert!(dirty < 1.2 * clean, "{dirty} against {clean}");
}

/// RMSE of `raw` in the JSON of `identify` with stated frames.
fn raw_rmse(at: &Path, data: &str, stated: &[&str]) -> f64 {
    let json = format!("{data}.json");
    let all = [&["identify", data, "--robot", "abb-irb-120", "--json", &json], stated].concat();
    let (code, _, err) = truegrind(at, &all);
    assert_eq!(code, 0, "{err}");
    let json: serde_json::Value = serde_json::from_str(&fs::read_to_string(at.join(&json)).unwrap()).unwrap();
    json["stages"]["raw"]["all"]["rmse"].as_f64().unwrap()
}

#[test]
fn stated_frames_make_the_raw_error_a_number() {
    let dir = folder();
    let at = dir.path();
    fs::write(at.join("cable.csv"), CABLE).unwrap();
    // The recipe of the shipped file says where outlet, hook and zero are; the nominal arm is the catalogue's.
    let stated =
        ["--outlet", "742.6,183.4,38.9", "--cable-zero", "17.35", "--touched-point", "11.8,-6.4,41.7"];
    let found = raw_rmse(at, "cable.csv", &stated);
    let nominal = truegrind::robots::load("abb-irb-120").unwrap().model;
    let still = truegrind::arm::condition::Condition::default();
    let number = |cell: &str| cell.parse::<f64>().unwrap();
    let header: Vec<&str> = CABLE.lines().next().unwrap().split(',').collect();
    let place = |name: &str| header.iter().position(|h| *h == name).unwrap();
    let squares: Vec<f64> = CABLE
        .lines()
        .skip(1)
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            let q = truegrind::arm::model::Joints::from_fn(|i, _| {
                number(cells[place(&format!("q{}", i + 1))]).to_radians()
            });
            let hook = nominal.forward(&q, &still) * nalgebra::Point3::new(11.8, -6.4, 41.7);
            let length = (hook - nalgebra::Point3::new(742.6, 183.4, 38.9)).norm() + 17.35;
            (length - number(cells[place("L")])).powi(2)
        })
        .collect();
    let expected = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    assert!((found - expected).abs() < 1e-3 * expected, "{found} against {expected} mm");
    assert!(found > 1.0, "an arm out of the box is millimetres off: {found}");
    // The tracker of the second shipped file.
    fs::write(at.join("tracker.csv"), include_str!("../data/irb120-tracker.csv")).unwrap();
    let recipe: toml::Table = include_str!("../data/irb120-tracker.toml").parse().unwrap();
    let sensor = &recipe["sensor"];
    let list = |value: &toml::Value| -> Vec<f64> {
        value.as_array().unwrap().iter().map(|v| v.as_float().unwrap()).collect()
    };
    let text = |values: &[f64]| values.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
    let mut frame = list(&sensor["frame"]["position_mm"]);
    frame.extend(list(&sensor["frame"]["wxyz"]));
    let point = text(&list(&sensor["reflector_mm"]));
    let tracked = raw_rmse(at, "tracker.csv", &["--sensor-frame", &text(&frame), "--touched-point", &point]);
    assert!((0.3..10.0).contains(&tracked), "{tracked} mm");
}

#[test]
fn stated_frames_that_make_no_sense_are_refused() {
    let dir = folder();
    let at = dir.path();
    fs::write(at.join("data.csv"), CABLE).unwrap();
    for (stated, word) in [
        (vec!["--sensor-frame", "1,2,3"], "cable lengths"),
        (vec!["--outlet", "1,2,3"], "--cable-zero"),
        (vec!["--outlet", "1,2", "--cable-zero", "3"], "2 numbers"),
        (vec!["--outlet", "1,2,x", "--cable-zero", "3"], "`x` is not a number"),
        (vec!["--outlet", "1,2,NaN", "--cable-zero", "3"], "not a number"),
        (vec!["--outlet", "1,2,3", "--outlet", "1,2,3", "--cable-zero", "3"], "given 2 times"),
        (vec!["--touched-point", "1,2"], "2 numbers"),
        (vec!["--touched-point", "1,2,3", "--touched-sigma", "0"], "expected a length above 0"),
        (vec!["--touched-point", "1,2,3", "--touched-sigma", "1,0"], "expected an angle above 0"),
        (vec!["--touched-point", "1,2,3", "--touched-sigma", "1,2"], "no orientation of the target"),
        (vec!["--outlet", "1,2,3", "--cable-zero", "3", "--touched-point", "0,0,0,1,1,0,0"], "length 1.414"),
    ] {
        let all = [&["identify", "data.csv", "--robot", "abb-irb-120"], stated.as_slice()].concat();
        let (code, _, err) = truegrind(at, &all);
        assert!(code == 2 && err.contains(word), "{stated:?}: `{word}` is not in {err}");
    }
}

#[test]
fn plan_writes_a_program_and_the_log_to_fill_in() {
    let dir = folder();
    let at = dir.path();
    let (code, out, err) = truegrind(
        at,
        &[
            "plan",
            "--robot",
            "abb-irb-120",
            "--sensor",
            "cable",
            "--outlet",
            "750,200,40",
            "--poses",
            "12",
            "--candidates",
            "120",
            "--range",
            "150,1100",
            "-o",
            "poses.mod",
            "--csv",
            "rows.csv",
            "--json",
            "plan.json",
            "--html",
            "plan.html",
        ],
    );
    assert!(code == 0 || code == 1, "{err}");
    assert!(out.contains("Detectable effects") && out.contains("backlash"), "{out}");
    let program = fs::read_to_string(at.join("poses.mod")).unwrap();
    let rows = fs::read_to_string(at.join("rows.csv")).unwrap();
    // As many as rows, and one in a comment: the header line of the table makes up for it.
    assert_eq!(program.matches("WaitTime").count(), rows.lines().count());
    let header = rows.lines().next().unwrap();
    for column in ["q1", "q6", "approach1", "approach6", "t", "expected_L"] {
        assert!(header.split(',').any(|c| c == column), "{column} is not in {header}");
    }
    let json: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(at.join("plan.json")).unwrap()).unwrap();
    assert_eq!(json["schema"], "truegrind.plan/1");
    assert_eq!(json["rows"].as_array().unwrap().len(), rows.lines().count() - 1);
    // What was written can be shown to the other verbs: no motion is left unread.
    let (_, out, err) = truegrind(
        at,
        &["compensate", "poses.mod", "--robot", "abb-irb-120", "--model", "nominal", "--dry-run"],
    );
    assert!(out.contains("nothing to correct"), "{out} {err}");
    for (arguments, word) in [
        (vec!["--sensor", "cable"], "--outlet X,Y,Z is missing"),
        (vec!["--sensor", "cable", "--outlet", "750,200,40", "--box", "0,0,0,1,1"], "--box"),
        (vec!["--sensor", "cable", "--outlet", "750,200,40", "--range", "9,1"], "--range"),
        (vec!["--sensor", "position", "--outlet", "750,200,40"], "--sensor-frame"),
        (vec!["--sensor", "position", "--poses", "2"], "at least 4"),
        (vec!["--sensor", "position", "--for", "plan.json"], "truegrind.diagnosis/1"),
        (
            vec!["--sensor", "cable", "--outlet", "750,200,40", "--range", "5000,5001", "--candidates", "50"],
            "too far from the sensor",
        ),
    ] {
        let all = [&["plan", "--robot", "abb-irb-120"], arguments.as_slice()].concat();
        let (code, _, err) = truegrind(at, &all);
        assert!(code == 2 && err.contains(word), "{arguments:?}: `{word}` is not in {err}");
    }
}

#[test]
fn the_demo_goes_the_whole_way_and_the_causes_it_finds_straighten_the_path() {
    let dir = folder();
    let at = dir.path();
    let (code, out, err) = truegrind(at, &["demo", "-o", "made"]);
    assert_eq!(code, 0, "{err}");
    for file in ["blade.mod", "blade-compensated.mod", "model.toml", "measurements.csv", "cell.toml"] {
        assert!(at.join("made").join(file).exists(), "{file}");
    }
    for page in ["deviation.html", "identification.html", "diagnosis.html"] {
        let text = fs::read_to_string(at.join("made").join(page)).unwrap();
        assert!(text.contains("<svg") && out.contains(page), "{page}");
    }
    // The shape of the path: what is left of it after rigid registration.
    let shape = |row: &str| -> f64 {
        let table = out.split_once("Absolute deviation, and shape").unwrap().1;
        let line = table.lines().find(|line| line.starts_with(row)).unwrap_or_else(|| panic!("{row}: {out}"));
        line.split_whitespace().last().unwrap().parse().unwrap()
    };
    let (before, geometry, causes) = (shape("before"), shape("lm, "), shape("diagnosed, "));
    assert!(before > 0.3 && geometry < 0.3 * before, "{before} to {geometry}");
    assert!(causes < 0.6 * geometry, "{geometry} to {causes}");
    // By the files that it wrote everything is rewritten, and nothing is in doubt.
    let args = ["compensate", "made/blade.mod", "--model", "made/model.toml", "--cell", "made/cell.toml"];
    let (code, out, err) = truegrind(at, &[&args[..], &["-o", "again.mod"]].concat());
    assert_eq!(code, 0, "{out}{err}");
    assert!(out.contains("448 corrected (100 %); 0 refused"), "{out}");
    assert!(out.contains("[ok]") && !out.contains("[warning]"), "{out}");
}

#[test]
fn diagnose_names_what_was_hidden_and_compensate_uses_it() {
    let dir = folder();
    let at = dir.path();
    fs::write(at.join("data.csv"), include_str!("../data/irb120-tracker.csv")).unwrap();
    // The same arm, measured again. (The shipped cable measured another one, which `--also` tells.)
    let recipe = include_str!("../data/irb120-tracker.toml").replace("\nseed = 121\n", "\nseed = 122\n");
    fs::write(at.join("recipe.toml"), recipe).unwrap();
    let (code, _, err) = truegrind(at, &["simulate", "recipe.toml", "-o", "again.csv"]);
    assert_eq!(code, 0, "{err}");
    fs::write(at.join("blade.toml"), include_str!("../../surfaces/blade.toml")).unwrap();
    let (code, out, err) = truegrind(
        at,
        &[
            "diagnose",
            "data.csv",
            "--robot",
            "abb-irb-120",
            "-o",
            "model.toml",
            "--json",
            "why.json",
            "--html",
            "why.html",
            "--md",
            "why.md",
            "--csv",
            "why.csv",
            "--also",
            "again.csv",
        ],
    );
    assert_eq!(code, 0, "{out}{err}");
    let text = fs::read_to_string(at.join("why.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(json["schema"], "truegrind.diagnosis/1");
    let found: Vec<(String, u64)> = json["findings"]
        .as_array()
        .unwrap()
        .iter()
        .map(|f| (f["effect"].as_str().unwrap().to_owned(), f["joints"][0].as_u64().unwrap_or(0)))
        .collect();
    // What the recipe beside the data hid: tests/data/irb120-tracker.toml.
    for hidden in
        [("gear-eccentricity", 1), ("joint-compliance", 2), ("joint-compliance", 3), ("backlash", 4)]
    {
        assert!(found.contains(&(hidden.0.to_owned(), hidden.1)), "{hidden:?} is not in {found:?}");
    }
    assert_eq!(found.len(), 4, "{found:?}");
    let error = |stage: &str| json["fits"][stage]["cv_rmse_mm"].as_f64().unwrap();
    assert!(error("extended") < 0.4 * error("geometric") && error("geometric") < 0.4 * error("nominal"));
    assert_eq!(json["transfers"][0]["file"], "again.csv");
    for file in ["why.html", "why.md", "why.csv"] {
        let page = fs::read_to_string(at.join(file)).unwrap();
        assert!(page.contains("gear-eccentricity") || page.contains("Gear eccentricity"), "{file}");
    }
    let model = fs::read_to_string(at.join("model.toml")).unwrap();
    assert!(model.contains("effect = \"joint-compliance\""), "the model carries the findings");
    let (code, _, err) = truegrind(at, &["path", "blade.toml", "--robot", "abb-irb-120", "-o", "blade.mod"]);
    assert_eq!(code, 0, "{err}");
    let (code, out, err) = truegrind(
        at,
        &["compensate", "blade.mod", "--model", "model.toml", "-o", "real.mod", "--max-correction", "20"],
    );
    assert!(code < 2 && at.join("real.mod").exists(), "{out}{err}");
    let (code, _, err) = truegrind(at, &["diagnose", "data.csv", "--robot", "abb-irb-120", "-o", "data.csv"]);
    assert_eq!(code, 2);
    assert!(err.contains("input"), "{err}");
}
