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
    for (file, words) in [("text.txt", "no motion"), ("data.csv", "these are measurements")] {
        let (code, _, err) = truegrind(at, &["compensate", file, "--model", "m.toml", "-o", "q.mod"]);
        assert!(code == 2 && err.contains(file) && err.contains(words), "{err}");
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

/// The rows of the shipped tracker with every cell passed through `change`, and a further column.
fn tracked(change: impl Fn(usize, &str, f64) -> f64, further: (&str, impl Fn(usize) -> String)) -> String {
    let mut lines = include_str!("../../data/irb120-tracker.csv").lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let mut out = format!("{},{}\n", header.join(","), further.0);
    for (row, line) in lines.enumerate() {
        let cells = line.split(',').zip(&header);
        let cells = cells.map(|(cell, name)| change(row, name, cell.parse().unwrap()).to_string());
        out += &format!("{},{}\n", cells.collect::<Vec<_>>().join(","), further.1(row));
    }
    out
}

/// A frame that is off by more than its stated σ was taken up as a scale error of the sensor, or by the arm.
#[test]
fn a_stated_frame_that_the_readings_contradict_is_refused() {
    let dir = folder();
    let at = dir.path();
    fs::write(at.join("data.csv"), include_str!("../../data/irb120-tracker.csv")).unwrap();
    let recipe: toml::Table = include_str!("../../data/irb120-tracker.toml").parse().unwrap();
    let list = |value: &toml::Value| -> Vec<f64> {
        value.as_array().unwrap().iter().map(|v| v.as_float().unwrap()).collect()
    };
    let frame = &recipe["sensor"]["frame"];
    let text = |values: &[f64]| values.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
    let point = text(&list(&recipe["sensor"]["reflector_mm"]));
    for verb in ["identify", "diagnose"] {
        for off_mm in [0.0, 1.2] {
            let mut stated = [list(&frame["position_mm"]), list(&frame["wxyz"])].concat();
            stated[0] += off_mm;
            let frame = text(&stated);
            let stated = ["--sensor-frame", &frame, "--touched-point", &point, "--frame-sigma", "0.05"];
            let data = [verb, "data.csv", "--robot", "abb-irb-120", "--sensor-scale-sigma", "0.001"];
            let (code, out, err) = truegrind(at, &[&data[..], &stated].concat());
            if off_mm == 0.0 {
                assert!(code < 2, "{verb}: {out}{err}");
            } else {
                assert_eq!(code, 2, "{verb}: {out}");
                assert!(err.contains("contradict it by") && err.contains("--frame-sigma"), "{verb}: {err}");
            }
        }
    }
}

/// A target at the flange itself, stated closely, was taken as not stated, and as not seen since its prior is narrow.
#[test]
fn a_target_that_was_touched_at_the_flange_stays_there() {
    let dir = folder();
    let at = dir.path();
    let recipe = include_str!("../../data/irb120-tracker.toml");
    let mut parsed: toml::Table = recipe.parse().unwrap();
    let frame = parsed["sensor"]["frame"].clone();
    parsed["sensor"]["reflector_mm"] = vec![0.0; 3].into();
    fs::write(at.join("recipe.toml"), parsed.to_string()).unwrap();
    let (code, _, err) = truegrind(at, &["simulate", "recipe.toml", "-o", "data.csv"]);
    assert_eq!(code, 0, "{err}");
    let text = |key: &str| {
        let values = frame[key].as_array().unwrap().iter().map(|v| v.as_float().unwrap().to_string());
        values.collect::<Vec<_>>().join(",")
    };
    let frame = format!("{},{}", text("position_mm"), text("wxyz"));
    let stated = ["--sensor-frame", &frame, "--frame-sigma", "0.05", "--touched-point", "0,0,0"];
    let data =
        ["identify", "data.csv", "--robot", "abb-irb-120", "--touched-sigma", "0.02", "--json", "i.json"];
    let (code, out, err) = truegrind(at, &[&data[..], &stated].concat());
    assert!(code < 2, "{out}{err}");
    assert!(!out.contains("do not show where the target sits"), "{out}");
    let json: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(at.join("i.json")).unwrap()).unwrap();
    for axis in ["target.x", "target.y", "target.z"] {
        let frames = json["frames"].as_array().unwrap();
        let target = frames.iter().find(|p| p["name"] == axis).unwrap()["value"].as_f64().unwrap();
        assert!(target.abs() < 0.1, "{axis} {target}");
    }
}

/// One fit has one frame: that the column says otherwise was ignored.
#[test]
fn sessions_with_frames_of_their_own_make_a_model_doubtful() {
    let dir = folder();
    let at = dir.path();
    let session = |row: usize| if row < 120 { "monday" } else { "tuesday" }.to_owned();
    for (name, moved_mm, code) in [("still.csv", 0.0, 0), ("moved.csv", 2.0, 1)] {
        let shift = |row, name: &str, cell| {
            if row >= 120 && name == "measured_y" { cell + moved_mm } else { cell }
        };
        fs::write(at.join(name), tracked(shift, ("session", session))).unwrap();
        let (found, out, err) = truegrind(at, &["identify", name, "--robot", "abb-irb-120"]);
        assert_eq!(found, code, "{out}{err}");
        let told = out.split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(told.contains("readings of sessions monday and tuesday differ by"), code == 1, "{out}");
    }
}

#[test]
fn a_payload_above_the_rated_one_is_noted() {
    let dir = folder();
    let at = dir.path();
    let pounds = |row: usize| ["0", "6.6"][row % 2].to_owned();
    fs::write(at.join("data.csv"), tracked(|_, _, cell| cell, ("payload", pounds))).unwrap();
    let (_, _, err) = truegrind(at, &["identify", "data.csv", "--robot", "abb-irb-120"]);
    assert!(err.contains("up to 6.6 kg") && err.contains("rated for 3 kg"), "{err}");
}

/// What no arm explains is explained by the file, where one mistake does.
#[test]
fn a_mistake_that_explains_tracker_readings_is_named() {
    let text = include_str!("../../data/irb120-tracker.csv");
    let table: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
    let written = |table: &[Vec<String>]| table.iter().map(|row| row.join(",") + "\n").collect::<String>();
    let owned: Vec<Vec<String>> =
        table.iter().map(|row| row.iter().map(|cell| (*cell).to_owned()).collect()).collect();
    // Columns that changed places.
    let mut swapped = owned.clone();
    swapped[0].swap(6, 7);
    refused(&written(&swapped), &["mirror image", "measured_x"]);
    let mut swapped = owned.clone();
    swapped[0].swap(1, 2);
    refused(&written(&swapped), &["joints 2 and 3"]);
    // A joint that counts the other way, or from another zero; two that do.
    let changed = |joints: &[usize], change: &dyn Fn(f64) -> f64| {
        let mut table = owned.clone();
        for row in &mut table[1..] {
            for joint in joints {
                row[joint - 1] = change(row[joint - 1].parse().unwrap()).to_string();
            }
        }
        written(&table)
    };
    refused(&changed(&[4], &|deg| -deg), &["if q4 gets the other sign", "truegrind robots"]);
    refused(&changed(&[2], &|deg| deg + 90.0), &["if -90° are added to q2"]);
    refused(&changed(&[1, 2], &|deg| -deg), &["if q1 and q2 get the other sign"]);
    // Some rows in another unit.
    let from = |row: usize, cells: std::ops::Range<usize>, factor: f64| {
        let mut table = owned.clone();
        for cell in table[row..].iter_mut().flat_map(|row| &mut row[cells.clone()]) {
            *cell = (factor * cell.parse::<f64>().unwrap()).to_string();
        }
        written(&table)
    };
    refused(&from(150, 6..9, 1e-3), &["those of rows 151, 152", "are metres and the others millimetres"]);
    refused(&from(150, 0..6, 1f64.to_radians()), &["of rows 151, 152", "radians and the others degrees"]);
    // A reading of row 82 is missing, and all later ones moved up.
    let mut short = owned.clone();
    for row in 81..short.len() - 1 {
        let later = short[row + 1][6..9].to_vec();
        short[row][6..9].clone_from_slice(&later);
    }
    short.pop();
    refused(&written(&short), &["from row 82 on", "a reading is missing"]);
    refused(
        &written(&set_up_elsewhere("session")),
        &["week 1 and week 2", "column station", "a file of its own"],
    );
}

/// Points joined by time with clocks that differ by the time between two rows: it is the clocks, rather than a reading too many.
#[test]
fn clocks_that_differ_are_named_where_points_were_joined_by_time() {
    let dir = folder();
    let at = dir.path();
    let text = include_str!("../../data/irb120-tracker.csv");
    let time = |second: usize| format!("{:02}:{:02}:{:02}", 8 + second / 3600, second / 60 % 60, second % 60);
    let (mut log, mut points) = ("time,q1,q2,q3,q4,q5,q6\n".to_owned(), "// Units: Millimeters\n".to_owned());
    for (k, line) in text.lines().skip(1).enumerate() {
        let cells: Vec<&str> = line.split(',').collect();
        log += &format!("{},{}\n", time(20 * k), cells[..6].join(","));
        points += &format!("Main p{k} {} 0.01 {}\n", cells[6..9].join(" "), time(20 * k + 20));
    }
    fs::write(at.join("log.csv"), log).unwrap();
    fs::write(at.join("points.txt"), points).unwrap();
    let joined =
        ["identify", "log.csv", "--points", "points.txt", "--points-within", "2", "--robot", "abb-irb-120"];
    let (code, out, err) = truegrind(at, &joined);
    assert!(code == 2 && err.contains("--points-ahead"), "{out}{err}");
    let (code, out, err) = truegrind(at, &[&joined[..], &["--points-ahead", "20"]].concat());
    assert_eq!(code, 0, "{out}{err}");
}

/// A tracker that was set up elsewhere for the second half, which the column of this name tells.
fn set_up_elsewhere(column: &str) -> Vec<Vec<String>> {
    let text = include_str!("../../data/irb120-tracker.csv");
    let mut rows: Vec<Vec<String>> =
        text.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect();
    rows[0].push(column.to_owned());
    for (number, row) in rows.iter_mut().enumerate().skip(1) {
        let second = number > 100;
        if second {
            let x: f64 = row[6].parse().unwrap();
            let y: f64 = row[7].parse().unwrap();
            (row[6], row[7]) = (format!("{:.4}", 500.0 - y), format!("{:.4}", x + 200.0));
        }
        row.push(if second { "week 2" } else { "week 1" }.to_owned());
    }
    rows
}

/// What a column `station` tells is fitted: the arm of both places is that of one.
#[test]
fn stations_of_a_tracker_are_fitted_together() {
    let dir = folder();
    let at = dir.path();
    let rows = set_up_elsewhere("station");
    let text: String = rows.iter().map(|row| row.join(",") + "\n").collect();
    fs::write(at.join("two.csv"), text).unwrap();
    fs::write(at.join("one.csv"), include_str!("../../data/irb120-tracker.csv")).unwrap();
    let identified = |file: &str| {
        let arguments = ["identify", file, "--robot", "abb-irb-120", "--json", "found.json"];
        let (code, out, err) = truegrind(at, &arguments);
        assert_eq!(code, 0, "{out}{err}");
        let json: serde_json::Value =
            serde_json::from_str(&fs::read_to_string(at.join("found.json")).unwrap()).unwrap();
        fs::remove_file(at.join("found.json")).unwrap();
        (err, json)
    };
    let (_, one) = identified("one.csv");
    let (notes, two) = identified("two.csv");
    assert!(notes.contains("2 stations with 100 and 100 rows"), "{notes}");
    let rmse = |of: &serde_json::Value| of["stages"]["geometry"]["held_out"]["rmse"].as_f64().unwrap();
    assert!(rmse(&two) < 1.1 * rmse(&one), "{} {}", rmse(&two), rmse(&one));
    let names: Vec<&str> =
        two["frames"].as_array().unwrap().iter().filter_map(|p| p["name"].as_str()).collect();
    assert!(names.contains(&"station2.x"), "{names:?}");
}

#[test]
fn decimal_commas_of_a_cell_file_are_refused_by_line() {
    let dir = folder();
    let cell = "[[tool]]\nname = \"tDisc\"\norigin = \"metrology\"\nposition_mm = [12,5, 0, 120]\n";
    fs::write(dir.path().join("cell.toml"), cell).unwrap();
    fs::write(dir.path().join("part.mod"), "MODULE part\nENDMODULE\n").unwrap();
    let data = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/irb120-tracker.csv");
    let made = truegrind(dir.path(), &["identify", data, "--robot", "abb-irb-120", "-o", "model.toml"]);
    assert!(made.0 < 2, "{}", made.2);
    let (code, _, err) = truegrind(
        dir.path(),
        &["compensate", "part.mod", "--model", "model.toml", "--cell", "cell.toml", "-o", "out.mod"],
    );
    assert_eq!(code, 2, "{err}");
    for word in ["cell.toml", "line 4", "position_mm", "found 4 numbers, expected 3", "decimal point"] {
        assert!(err.contains(word), "`{word}` is not in: {err}");
    }
}
