//! What `identify` and `diagnose` accept alike: limits of the held-out error, columns as they were logged.

use std::fs;

use serde_json::Value;

use super::{CABLE, folder, truegrind};

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
