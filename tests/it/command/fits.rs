//! What `identify` and `diagnose` accept alike: limits of the held-out error, columns as they were logged.

use std::fs;

use serde_json::Value;

use super::{CABLE, folder, truegrind};

const TRACKER: &str = include_str!("../../data/irb120-tracker.csv");
const ROUNDED: &str = include_str!("../../data/irb120-rounded.csv");

/// A stated limit decides, and the verdict names it, whichever way the arm was found; one that is no length is refused.
#[test]
fn limits_of_the_held_out_error_hold_for_both_ways_to_find_an_arm() {
    let dir = folder();
    let at = dir.path();
    fs::write(at.join("data.csv"), CABLE).unwrap();
    for verb in ["identify", "diagnose"] {
        let run = |more: &[&str]| {
            let begin = [verb, "data.csv", "--robot", "abb-irb-120", "-o", "m.toml", "--json", "o.json"];
            truegrind(at, &[&begin[..], more].concat())
        };
        let (code, _, err) = run(&["--limit-rmse", "0.0001"]);
        assert!(code == 2 && err.contains("exceeds the stated 0.0001 mm"), "{verb}: {err}");
        assert!(!at.join("m.toml").exists(), "{verb}");
        let (code, _, err) = run(&["--limit-rmse", "1", "--limit-max", "5"]);
        assert!(code < 2, "{verb}: {err}");
        let json: Value = serde_json::from_str(&fs::read_to_string(at.join("o.json")).unwrap()).unwrap();
        assert_eq!(json["verdict"]["status"], "pass", "{verb}");
        fs::remove_file(at.join("m.toml")).unwrap();
        let (code, _, err) = run(&["--limit-max", "-1"]);
        assert!(code == 2 && err.contains("--limit-max -1") && err.contains("above 0"), "{verb}: {err}");
    }
}

/// Rounded angles are sharpened by the read-out, but where the columns shall be taken as they are.
#[test]
fn columns_are_taken_as_they_are_where_that_is_asked_for() {
    let dir = folder();
    let at = dir.path();
    fs::write(at.join("data.csv"), ROUNDED).unwrap();
    for verb in ["identify", "diagnose"] {
        for (more, sharpened) in [(&[][..], "sharpened = true"), (&["--raw-columns"], "sharpened = false")] {
            let begin = [verb, "data.csv", "--robot", "abb-irb-120", "-o", "m.toml", "--allow-doubtful"];
            let (code, _, err) = truegrind(at, &[&begin[..], more].concat());
            assert!(code < 2, "{verb}: {err}");
            let model = fs::read_to_string(at.join("m.toml")).unwrap();
            assert!(model.contains(sharpened), "{verb} {more:?}");
        }
    }
}

/// The same rows, the points in a file of the tracker's software in another order: the same model, but for what says where it came from.
#[test]
fn points_of_the_tracker_are_joined_with_a_log_of_joints_by_name() {
    let dir = folder();
    let at = dir.path();
    let rows: Vec<Vec<&str>> = TRACKER.lines().skip(1).map(|line| line.split(',').collect()).collect();
    let mut log = "name,q1,q2,q3,q4,q5,q6\nextra,0,0,0,0,90,0\n".to_owned();
    let mut points = vec!["// Units: Millimeters".to_owned()];
    let mut alone = "q1,q2,q3,q4,q5,q6,measured_x,measured_y,measured_z\n".to_owned();
    for (k, row) in rows.iter().enumerate() {
        log += &format!("A::Arm::p{k},{}\n", row[..6].join(","));
        points.insert(1, format!("A Arm p{k} {} 0.012 11/23/2026 10:15:30", row[6..9].join(" ")));
        alone += &format!("{}\n", row[..9].join(","));
    }
    fs::write(at.join("log.csv"), &log).unwrap();
    fs::write(at.join("points.txt"), points.join("\n")).unwrap();
    fs::write(at.join("alone.csv"), &alone).unwrap();
    let run = |data: &str, more: &[&str]| {
        let begin = ["identify", data, "--robot", "abb-irb-120", "--json", "o.json"];
        let (code, out, err) = truegrind(at, &[&begin[..], more].concat());
        assert!(code < 2, "{err}");
        let json: Value = serde_json::from_str(&fs::read_to_string(at.join("o.json")).unwrap()).unwrap();
        (json["parameters"].clone(), out)
    };
    let (joined, _) = run("log.csv", &["--points", "points.txt"]);
    assert!(joined.as_array().is_some_and(|all| all.len() > 20));
    assert_eq!(joined, run("alone.csv", &[]).0);
    let refused = |points: &str, expected: &[&str]| {
        fs::write(at.join("points.txt"), points).unwrap();
        let begin = ["identify", "log.csv", "--robot", "abb-irb-120", "--points", "points.txt"];
        let (code, _, err) = truegrind(at, &begin);
        assert!(code == 2 && expected.iter().all(|part| err.contains(part)), "{err}");
    };
    refused("p1, 1.5, 2.5, 3.5\np1, 1.5, 2.5, 3.5\n", &["points.txt, row 2", "`p1` occurs twice"]);
    refused("r1 1.5 2.5 3.5\n", &["none of its names", "`r1`", "`extra`"]);
    refused("// Units: Inches\np1 1.5 2.5 3.5\n", &["row 1", "millimetres"]);
    refused("1 2 3 4\n5 6\n", &["row 1", "x, y, z"]);
    let protected =
        ["identify", "log.csv", "--robot", "abb-irb-120", "--points", "points.txt", "-o", "points.txt"];
    let (code, _, err) = truegrind(at, &protected);
    assert!(code == 2 && err.contains("points.txt"), "{err}");
    assert_eq!(fs::read_to_string(at.join("points.txt")).unwrap(), "1 2 3 4\n5 6\n");
}

/// By time: the same model as by name. Options that make no sense are refused by name.
#[test]
fn points_of_the_tracker_are_joined_with_a_log_of_joints_by_time() {
    let dir = folder();
    let at = dir.path();
    let rows: Vec<Vec<&str>> = TRACKER.lines().skip(1).map(|line| line.split(',').collect()).collect();
    let clock = |k: usize, late_s: f64| format!("{:02}:{:02}:{:05.2}", 10 + k / 60, k % 60, 20.0 + late_s);
    let mut log = "name,time,q1,q2,q3,q4,q5,q6\nextra,23:00:00,0,0,0,0,90,0\n".to_owned();
    let mut points = "// Units: Millimeters\n".to_owned();
    for (k, row) in rows.iter().enumerate() {
        log += &format!("p{k},{},{}\n", clock(k, 0.0), row[..6].join(","));
        points += &format!(
            "A Arm p{k} {} 0.012 11/23/2026 {}\n",
            row[6..9].join(" "),
            clock(k, 4.0 + 0.01 * (k % 7) as f64)
        );
    }
    fs::write(at.join("log.csv"), &log).unwrap();
    fs::write(at.join("points.txt"), &points).unwrap();
    let run = |more: &[&str]| {
        let begin =
            ["identify", "log.csv", "--robot", "abb-irb-120", "--points", "points.txt", "--json", "o.json"];
        truegrind(at, &[&begin[..], more].concat())
    };
    let parameters = || {
        let json: Value = serde_json::from_str(&fs::read_to_string(at.join("o.json")).unwrap()).unwrap();
        json["parameters"].clone()
    };
    let (code, _, err) = run(&[]);
    assert!(code < 2, "{err}");
    let by_name = parameters();
    let (code, _, err) = run(&["--points-within", "0.5", "--points-ahead", "4"]);
    assert!(code < 2 && err.contains("rows joined by time with"), "{err}");
    assert!(err.contains("1 rows without a point at their time are left out: 2"), "{err}");
    assert_eq!(parameters(), by_name);
    for (more, expected) in [
        (&["--points-within", "0"][..], "--points-within 0: expected a time above 0 s"),
        (&["--points-within", "nan"], "--points-within NaN"),
        (&["--points-ahead", "4"], "--points-within"),
        (&["--points-within", "0.5"], "--points-ahead"),
        (&["--points-within", "70", "--points-ahead", "4"], "is ambiguous"),
    ] {
        let (code, _, err) = run(more);
        assert!(code == 2 && err.contains(expected), "{more:?}: {err}");
    }
    let (code, _, err) =
        truegrind(at, &["identify", "log.csv", "--robot", "abb-irb-120", "--points-within", "1"]);
    assert!(code == 2 && err.contains("--points"), "{err}");
}
