//! What bad input gets: where, what was found, what is expected, and what to do.

use std::fs;

use super::{CABLE, changed, files, folder, truegrind};

/// Runs `identify` on a text and expects exit code 2, no model, and all of `words` in the message.
fn refused(text: &str, words: &[&str]) {
    let dir = folder();
    fs::write(dir.path().join("data.csv"), text).unwrap();
    let (code, out, err) =
        truegrind(dir.path(), &["identify", "data.csv", "--robot", "abb-irb-120", "-o", "model.toml"]);
    assert_eq!(code, 2, "expected a refusal, got:\n{out}\n{err}");
    for word in words {
        assert!(err.to_lowercase().contains(&word.to_lowercase()), "`{word}` is not in: {err}");
    }
    assert_eq!(files(dir.path()).len(), 1, "nothing is written beside the input");
}

#[test]
fn wrong_units_are_noticed_and_named() {
    let number = |c: &str| c.parse::<f64>().unwrap();
    let angles = ["q1", "q2", "q3", "q4", "q5", "q6"];
    refused(&changed(&angles, |_, c| format!("{:.6}", number(c).to_radians())), &["radian", "degree"]);
    refused(&changed(&["L"], |_, c| format!("{:.6}", number(c) / 1000.0)), &["metres", "millimetres"]);
}

#[test]
fn broken_cells_get_file_row_column_and_remedy() {
    refused(
        &changed(&["q3"], |row, c| if row == 6 { "NaN".into() } else { c.into() }),
        &["data.csv", "8", "q3"],
    );
    refused(
        &changed(&["L"], |row, c| if row == 3 { "far".into() } else { c.into() }),
        &["data.csv", "5", "far", "L"],
    );
    refused(&CABLE.replacen("q5", "qq5", 1), &["q5", "qq5"]);
    refused(&CABLE.replacen("L,", "length,", 1), &["L"]);
    refused("", &["data.csv"]);
    let seven = CABLE.replacen("q6,", "q6,q7,", 1).replace('\n', ",0\n");
    refused(&seven, &["q7"]);
}

#[test]
fn numbers_that_no_measurement_has_are_named_by_cell() {
    let at = |row: usize, text: &'static str| {
        move |k: usize, c: &str| if k == row { text.to_owned() } else { c.to_owned() }
    };
    refused(&changed(&["L"], at(4, "1e300")), &["data.csv", "row 6", "column L", "1e300", "kilometre"]);
    refused(&changed(&["q2"], at(9, "1e9")), &["data.csv", "row 11", "column q2", "3600"]);
    // Two columns that changed places, and a file whose header is missing.
    let swapped = CABLE.replacen("q2,q3", "q3,q2", 1);
    refused(&swapped, &["data.csv", "no two columns are swapped"]);
    let headless: String = CABLE.lines().skip(1).map(|line| format!("{line}\n")).collect();
    refused(&headless, &["put a header line"]);
}

#[test]
fn rows_of_one_pose_are_no_measurement_of_an_arm() {
    let mut lines = CABLE.lines();
    let (header, row) = (lines.next().unwrap(), lines.next().unwrap());
    let same = format!("{header}\n{}", format!("{row}\n").repeat(200));
    refused(&same, &["1 different pose,", "copies of a row count once"]);
    let ten: String = CABLE.lines().skip(1).take(10).map(|line| format!("{line}\n")).collect();
    refused(&format!("{header}\n{}", ten.repeat(30)), &["10 rows at 10 different poses", "at least"]);
}

#[test]
fn what_an_option_cannot_mean_is_refused_before_the_work() {
    let dir = folder();
    let at = dir.path();
    fs::write(at.join("data.csv"), CABLE).unwrap();
    fs::write(at.join("text.txt"), "no program\n").unwrap();
    let identify = ["identify", "data.csv", "--robot", "abb-irb-120", "-o", "m.toml"];
    assert_eq!(truegrind(at, &identify).0, 0);
    let before = files(at);
    let compensate = ["compensate", "p.mod", "--model", "m.toml", "-o", "q.mod"];
    let plan = ["plan", "--robot", "abb-irb-120", "--sensor", "position", "-o", "q.mod"];
    for (verb, more, words) in [
        (&identify[..], &["--limit-rmse", "nan"][..], &["--limit-rmse", "above 0"][..]),
        (&identify, &["--limit-max", "-1"], &["--limit-max -1", "above 0"]),
        (&identify, &["--held-out", "-0.2"], &["--held-out -0.2", "share"]),
        (&identify, &["--threads", "0"], &["--threads 0"]),
        (&identify, &["--threads", "100000"], &["--threads 100000"]),
        (&compensate, &["--tolerance", "-1"], &["--tolerance -1", "above 0"]),
        (&compensate, &["--max-correction", "inf"], &["--max-correction", "above 0"]),
        (&plan, &["--poses", "100000000"], &["--poses 100000000", "at most"]),
    ] {
        fs::write(at.join("p.mod"), "MODULE m\nENDMODULE\n").unwrap();
        let arguments: Vec<&str> = verb.iter().chain(more).copied().collect();
        let (code, out, err) = truegrind(at, &arguments);
        assert_eq!(code, 2, "{arguments:?}: {out}{err}");
        for word in words {
            assert!(err.contains(word), "{arguments:?}: `{word}` is not in: {err}");
        }
    }
    for payload in ["nan", "-3", "1e9"] {
        let arguments = ["compensate", "p.mod", "--model", "m.toml", "-o", "q.mod", "--payload", payload];
        let (code, _, err) = truegrind(at, &arguments);
        assert!(code == 2 && err.contains("--payload") && err.contains("kg"), "{err}");
    }
    // A file that is no program, and one that is an arm's model.
    for file in ["text.txt", "data.csv"] {
        let (code, _, err) = truegrind(at, &["compensate", file, "--model", "m.toml", "-o", "q.mod"]);
        assert!(code == 2 && err.contains(file) && err.contains("no motion"), "{err}");
    }
    let (code, _, err) = truegrind(at, &["compensate", "p.mod", "--model", "data.csv", "-o", "q.mod"]);
    assert!(code == 2 && err.contains("identify -o") && !err.contains("\n;"), "{err}");
    let mut left = files(at);
    left.retain(|path| !path.ends_with("p.mod"));
    assert_eq!(left, before, "nothing was written");
}

#[test]
fn too_few_rows_say_how_many_are_needed() {
    let five: String = CABLE.lines().take(6).map(|l| format!("{l}\n")).collect();
    refused(&five, &["5 rows", "at least"]);
}

#[test]
fn wrong_names_list_what_exists() {
    let dir = folder();
    let at = dir.path();
    fs::write(at.join("data.csv"), CABLE).unwrap();
    let (code, _, err) = truegrind(at, &["identify", "data.csv", "--robot", "abb-irb-12"]);
    assert_eq!(code, 2);
    assert!(err.contains("abb-irb-12") && err.contains("abb-irb-120"), "{err}");
    let (code, _, err) =
        truegrind(at, &["identify", "data.csv", "--robot", "abb-irb-120", "--method", "newton"]);
    assert_eq!(code, 2);
    assert!(err.contains("newton") && err.contains("ltlm"), "{err}");
    let (code, _, err) = truegrind(at, &["identify", "nothing.csv", "--robot", "abb-irb-120"]);
    assert_eq!(code, 2);
    assert!(err.contains("nothing.csv"), "{err}");
    let (code, _, _) = truegrind(at, &["grind"]);
    assert_eq!(code, 2);
    let (code, out, _) = truegrind(at, &["--help"]);
    assert_eq!(code, 0);
    for verb in ["demo", "robots", "simulate", "identify", "path", "compensate", "deviation"] {
        assert!(out.contains(verb), "{verb} is not in the help");
    }
}

#[test]
fn a_surface_that_does_not_parse_names_file_and_place() {
    let dir = folder();
    let at = dir.path();
    let broken = include_str!("../../../surfaces/blade.toml").replacen("sin(y/40)", "sin(y/40", 1);
    fs::write(at.join("blade.toml"), broken).unwrap();
    let (code, _, err) = truegrind(at, &["path", "blade.toml", "--robot", "abb-irb-120", "-o", "b.mod"]);
    assert_eq!(code, 2);
    assert!(err.contains("blade.toml"), "{err}");
    assert!(!at.join("b.mod").exists());
    let far = include_str!("../../../surfaces/blade.toml").replacen("[420, 0, 250]", "[1420, 0, 250]", 1);
    fs::write(at.join("blade.toml"), far).unwrap();
    let (code, _, err) = truegrind(at, &["path", "blade.toml", "--robot", "abb-irb-120", "-o", "b.mod"]);
    assert_eq!(code, 2);
    assert!(err.contains("point 1") && err.contains("reach"), "{err}");
}

#[test]
fn a_robot_that_is_not_the_models_is_an_error_naming_both() {
    let dir = folder();
    let at = dir.path();
    fs::write(at.join("data.csv"), CABLE).unwrap();
    let (code, _, err) = truegrind(at, &["identify", "data.csv", "--robot", "abb-irb-120", "-o", "m.toml"]);
    assert_eq!(code, 0, "{err}");
    fs::write(at.join("p.mod"), "MODULE m\nENDMODULE\n").unwrap();
    let (code, _, err) = truegrind(
        at,
        &["compensate", "p.mod", "--model", "m.toml", "--robot", "kuka-kr6-r900-sixx", "-o", "q.mod"],
    );
    assert_eq!(code, 2);
    assert!(err.contains("abb-irb-120") && err.contains("kuka-kr6-r900-sixx"), "{err}");
}
