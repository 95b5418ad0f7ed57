//! `truegrind compare` and `truegrind track` as a user runs them.

use std::fs;
use std::path::Path;

use assert_cmd::Command;

const TRACKER: &str = include_str!("../../data/irb120-tracker.csv");

fn truegrind(folder: &Path, arguments: &[&str]) -> (i32, String, String) {
    let output =
        Command::cargo_bin("truegrind").unwrap().current_dir(folder).args(arguments).output().unwrap();
    let text = |b: &[u8]| String::from_utf8_lossy(b).into_owned();
    (output.status.code().unwrap_or(-1), text(&output.stdout), text(&output.stderr))
}

fn names(folder: &Path) -> Vec<String> {
    let mut out: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    out.sort();
    out
}

/// A folder with measurements and the model that was made of them.
fn identified() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("first.csv"), TRACKER).unwrap();
    let arguments = ["identify", "first.csv", "--robot", "abb-irb-120", "-o", "model.toml"];
    let (code, _, err) = truegrind(dir.path(), &arguments);
    assert!(code == 0, "{err}");
    dir
}

#[test]
fn compare_lists_what_there_is_and_refuses_what_is_not() {
    let dir = tempfile::tempdir().unwrap();
    let (code, out, _) = truegrind(dir.path(), &["compare", "--list"]);
    assert!(code == 0 && out.contains("ltlm-table-6") && out.contains("rls-degradation"), "{out}");
    let (code, _, err) = truegrind(dir.path(), &["compare", "--experiment", "table-6"]);
    assert!(code == 2 && err.contains("unknown experiment") && err.contains("ukf-vslm-d2"), "{err}");
    fs::write(dir.path().join("data.csv"), TRACKER).unwrap();
    let (code, _, err) = truegrind(dir.path(), &["compare", "data.csv", "--experiment", "ltlm-table-6"]);
    assert!(code == 2 && err.contains("--robot"), "{err}");
    let with_robot = [
        "compare",
        "data.csv",
        "--robot",
        "abb-irb-120",
        "--experiment",
        "ltlm-table-6",
        "--json",
        "out.json",
    ];
    let (code, _, err) = truegrind(dir.path(), &with_robot);
    assert!(code == 2 && err.contains("200 rows") && err.contains("--rows 200"), "{err}");
    assert_eq!(names(dir.path()), ["data.csv"], "nothing is written");
}

#[test]
fn compare_runs_an_experiment_of_ones_own_and_writes_the_same_bytes_again() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    fs::write(at.join("data.csv"), TRACKER).unwrap();
    fs::write(
        at.join("mine.toml"),
        "name = \"mine\"\ntitle = \"Mine\"\npaper = \"ours\"\n[methods]\nreference = \"B\"\n[methods.protocol]\nrows = 100\n\
         held_out = 0.2\ncases = 2\n[[methods.method]]\nid = \"A\"\nname = \"EKF\"\nsolver = \"ekf\"\ntreatment = \
         \"sound\"\n[[methods.method]]\nid = \"B\"\nname = \"LM\"\nsolver = \"lm\"\ntreatment = \"sound\"\n",
    )
    .unwrap();
    let run = |json: &str, threads: &str| {
        let arguments = [
            "compare",
            "data.csv",
            "--robot",
            "abb-irb-120",
            "--experiment",
            "mine.toml",
            "--json",
            json,
            "--csv",
            "out.csv",
            "--md",
            "out.md",
            "--html",
            "out.html",
            "--threads",
            threads,
        ];
        truegrind(at, &arguments)
    };
    let (code, out, err) = run("one.json", "1");
    assert!(code == 0, "{err}");
    assert!(
        out.contains("Held-out errors, 2 cases of 100 rows") && !out.contains("not the same in every run")
    );
    assert!(!err.contains("not the same in every run"), "no clock unless it is asked for: {err}");
    let text = |name: &str| fs::read_to_string(at.join(name)).unwrap();
    let pages = [text("out.md"), text("out.html"), text("out.csv")];
    let (_, again, _) = run("two.json", "2");
    assert_eq!(out, again);
    assert_eq!(pages, [text("out.md"), text("out.html"), text("out.csv")]);
    let timed = [
        "compare",
        "data.csv",
        "--robot",
        "abb-irb-120",
        "--experiment",
        "mine.toml",
        "--timings",
        "--md",
        "timed.md",
    ];
    let (_, _, err) = truegrind(at, &timed);
    assert!(
        err.contains("not the same in every run") && text("timed.md").contains("not the same in every run"),
        "{err}"
    );
    assert_eq!(text("one.json"), text("two.json"));
    assert!(text("one.json").contains("truegrind.comparison/1"));
    // Registered frames, two methods and the named causes, in two cases.
    assert_eq!(text("out.csv").lines().count(), 1 + 2 * 4);
    assert!(text("out.html").contains("<svg") && text("out.md").contains("Mine"));
}

#[test]
fn track_takes_in_a_growing_file_writes_dated_models_and_goes_on_where_it_was_stopped() {
    let dir = identified();
    let at = dir.path();
    let lines: Vec<&str> = TRACKER.lines().collect();
    let day = |rows: usize, tail: &str| {
        fs::write(at.join("day.csv"), lines[..=rows].join("\n") + "\n" + tail).unwrap();
    };
    let track = |arguments: &[&str]| {
        let mut all = vec!["track", "day.csv", "--model", "model.toml", "-o", "out"];
        all.extend(arguments);
        truegrind(at, &all)
    };
    // A last line that is still being written is not read.
    day(60, "12.3,4.");
    let (code, out, err) = track(&["--date", "2026-05-04T12:30:00Z", "--json", "one.json"]);
    assert!(code == 0 && out.contains("60 new poses"), "{out}{err}");
    assert_eq!(names(&at.join("out")), ["model-20260504T123000Z-000060.toml", "model.track.toml"]);
    day(110, "");
    let (code, out, err) = track(&["--date", "2026-05-05"]);
    assert!(code == 0 && out.contains("50 new poses"), "{out}{err}");
    assert_eq!(names(&at.join("out")).len(), 3);
    // Nothing new: nothing written.
    let (code, _, err) = track(&["--date", "2026-05-06"]);
    assert!(code == 0 && err.contains("no new measurements"), "{err}");
    assert_eq!(names(&at.join("out")).len(), 3);
    // The same in one go, to the bit.
    let (_, _, err) =
        truegrind(at, &["track", "day.csv", "--model", "model.toml", "-o", "whole", "--date", "2026-05-05"]);
    let of = |folder: &str| fs::read_to_string(at.join(folder).join("model.track.toml"));
    assert_eq!(of("out").unwrap(), of("whole").unwrap(), "{err}");
    // A written model is a model like any other.
    let model = "out/model-20260505-000110.toml";
    let (code, _, err) = truegrind(at, &["track", "day.csv", "--model", model, "-o", "next"]);
    assert!(code == 0, "{err}");
    // Where nothing can be written, nothing is said to be.
    fs::write(at.join("taken"), "a file").unwrap();
    let (code, out, err) = truegrind(at, &["track", "day.csv", "--model", "model.toml", "-o", "taken"]);
    assert!(code == 2 && err.contains("taken") && !out.contains("written"), "{out}{err}");
    // Another model with this track, a bad date, a parameter that there is none of.
    let (code, _, err) =
        truegrind(at, &["track", "day.csv", "--model", model, "--state", "out/model.track.toml"]);
    assert!(code == 2 && err.contains("another model"), "{err}");
    assert!(track(&["--date", "today"]).2.contains("expected a date"));
    assert!(track(&["--drift", "link9.theta=1"]).2.contains("link2.theta"));
}

#[test]
fn identify_takes_every_sound_method_and_lists_them() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    fs::write(at.join("data.csv"), TRACKER).unwrap();
    let identify = |method: &str| {
        truegrind(at, &["identify", "data.csv", "--robot", "abb-irb-120", "--method", method, "-o", "m.toml"])
    };
    let (code, _, err) = identify("annealing");
    assert!(code == 2 && err.contains("unknown method") && err.contains("qibas"), "{err}");
    for method in ["vslm", "sslm", "least-squares", "ukf-vslm", "ekf", "rls", "rbf"] {
        let (code, out, err) = identify(method);
        assert!(code == 0, "{method}: {out}{err}");
        assert!(fs::read_to_string(at.join("m.toml")).unwrap().contains(&format!("method = \"{method}\"")));
    }
    // The network is in the file as an effect without a physical name, and the file is read again.
    assert!(fs::read_to_string(at.join("m.toml")).unwrap().contains("smooth-correction"));
    let (code, _, err) = truegrind(at, &["track", "data.csv", "--model", "m.toml", "-o", "out"]);
    assert!(code == 0, "{err}");
}

#[test]
fn a_track_that_is_killed_again_and_again_ends_in_the_same_bits() {
    use std::io::Write;
    use std::process::{Command as Process, Stdio};
    use std::time::Duration;
    let dir = identified();
    let at = dir.path();
    let lines: Vec<&str> = TRACKER.lines().collect();
    // Rows come in while the follower is killed at whatever it is doing, from before it began to after it wrote.
    fs::write(at.join("day.csv"), format!("{}\n", lines[0])).unwrap();
    let arguments = ["track", "day.csv", "--model", "model.toml", "-o", "out", "--date", "2026-05-05"];
    let mut written = 1;
    for kill in 0..14_u64 {
        let mut follower = Process::new(env!("CARGO_BIN_EXE_truegrind"))
            .current_dir(at)
            .args(arguments)
            .args(["--follow", "0.01"])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut day = fs::OpenOptions::new().append(true).open(at.join("day.csv")).unwrap();
        let more = (written + 12).min(151);
        for line in &lines[written..more] {
            // In two pieces, so that half lines are met as well.
            let (a, b) = line.split_at(line.len() / 2);
            day.write_all(a.as_bytes()).unwrap();
            std::thread::sleep(Duration::from_millis(1 + kill % 3));
            writeln!(day, "{b}").unwrap();
        }
        written = more;
        std::thread::sleep(Duration::from_millis(17 * kill % 90));
        follower.kill().unwrap();
        follower.wait().unwrap();
        // Whatever is there is whole.
        if let Ok(state) = fs::read_to_string(at.join("out/model.track.toml")) {
            assert!(truegrind::calibration::tracking::State::from_toml(&state).is_ok());
        }
    }
    assert_eq!(written, 151);
    let (code, _, err) = truegrind(at, &arguments);
    assert!(code == 0, "{err}");
    let mut whole = arguments;
    whole[5] = "whole";
    let (code, _, err) = truegrind(at, &whole);
    assert!(code == 0, "{err}");
    let of = |folder: &str, name: &str| fs::read_to_string(at.join(folder).join(name)).unwrap();
    assert_eq!(of("out", "model.track.toml"), of("whole", "model.track.toml"));
    assert_eq!(of("out", "model-20260505-000150.toml"), of("whole", "model-20260505-000150.toml"));
    // Every model that was written is a model.
    for name in names(&at.join("out")).iter().filter(|n| !n.starts_with('.') && n.starts_with("model-")) {
        assert!(truegrind::arm::estimated::Estimated::from_toml(&of("out", name)).is_ok(), "{name}");
    }
}

#[test]
fn track_refuses_wrong_units_and_leaves_nothing_behind() {
    let dir = identified();
    let at = dir.path();
    let mut lines = TRACKER.lines();
    let mut metres = format!("{}\n", lines.next().unwrap());
    for line in lines {
        let cells: Vec<String> = line
            .split(',')
            .enumerate()
            .map(|(k, cell)| match k {
                6..9 => (cell.parse::<f64>().unwrap() / 1000.0).to_string(),
                _ => cell.to_owned(),
            })
            .collect();
        metres += &(cells.join(",") + "\n");
    }
    fs::write(at.join("metres.csv"), metres).unwrap();
    let track = |arguments: &[&str]| {
        let mut all = vec!["track", "metres.csv", "--model", "model.toml", "-o", "out"];
        all.extend(arguments);
        truegrind(at, &all)
    };
    let (code, _, err) = track(&[]);
    assert!(code == 2 && err.contains("these look like metres"), "{err}");
    // Whoever insists is told that the readings are not of this arm.
    let (code, _, err) = track(&["--allow-odd-units"]);
    assert!(code == 2 && err.contains("these are not measurements of this arm"), "{err}");
    assert_eq!(names(at), ["first.csv", "metres.csv", "model.toml"], "nothing is written, no folder made");
}

#[test]
fn track_takes_a_folder_of_small_files_and_none_twice() {
    let dir = identified();
    let at = dir.path();
    let lines: Vec<&str> = TRACKER.lines().collect();
    fs::create_dir(at.join("days")).unwrap();
    let day = |k: usize| {
        let rows = lines[1 + 15 * k..16 + 15 * k].join("\n");
        fs::write(at.join(format!("days/day-{k}.csv")), format!("{}\n{rows}\n", lines[0])).unwrap();
    };
    let track = |arguments: &[&str]| {
        let mut all = vec!["track", "days", "--model", "model.toml", "-o", "out"];
        all.extend(arguments);
        truegrind(at, &all)
    };
    assert!(track(&[]).2.contains("no .csv or .xlsx"));
    day(0);
    let (code, _, err) = track(&[]);
    assert!(code == 2 && err.contains("15 poses so far, 30 are needed"), "{err}");
    (1..4).for_each(day);
    // A table among the measurements is no measurement.
    let (code, out, err) = track(&["--date", "2026-05-04", "--csv", "days/parameters.csv"]);
    assert!(code == 0 && out.contains("60 new poses"), "{out}{err}");
    (4..6).for_each(day);
    let (code, out, err) = track(&["--date", "2026-05-05", "--csv", "days/parameters.csv", "--sigma", "0.1"]);
    assert!(code == 0 && out.contains("30 new poses"), "{out}{err}");
    assert!(err.contains("keeps the settings with which it was started"), "{err}");
    assert!(track(&["--csv", "days/parameters.csv"]).2.contains("no new measurements"));
}
