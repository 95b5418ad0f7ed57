//! The acceptance of a model as a user asks for it, and the empty table to begin with.

use std::fs;
use std::path::Path;

use super::{folder, truegrind, words_of};

const RECIPE: &str = include_str!("../../data/irb120-tracker.toml");
const ROWS: &str = include_str!("../../data/irb120-tracker.csv");

/// `poses.csv`, and `later.csv` of the same arm on another day.
fn measured_twice(at: &Path) {
    fs::write(at.join("poses.csv"), ROWS).unwrap();
    fs::write(at.join("later.toml"), RECIPE.replace("seed = 121", "seed = 122")).unwrap();
    let (code, _, err) = truegrind(at, &["simulate", "later.toml", "-o", "later.csv"]);
    assert_eq!(code, 0, "{err}");
}

#[test]
fn a_model_is_accepted_by_poses_of_its_own() {
    let dir = folder();
    let at = dir.path();
    measured_twice(at);
    let (code, _, err) = truegrind(
        at,
        &["diagnose", "poses.csv", "--robot", "abb-irb-120", "-o", "model.toml", "--allow-doubtful"],
    );
    assert!(code < 2, "{err}");
    let accept = |data: &str, more: &[&str]| {
        truegrind(at, &[&["accept", data, "--model", "model.toml", "--tolerance"], more].concat())
    };
    let page = [
        "1",
        "--sensor-uncertainty",
        "0.02",
        "--serial",
        "arm=120-503211",
        "--html",
        "page.html",
        "--json",
        "page.json",
    ];
    let (code, out, err) = accept("later.csv", &page);
    assert!(code == 0 && out.contains("[ok] Accepted: largest error 0."), "{out}{err}");
    let unwrapped = |out: &str| out.split_whitespace().collect::<Vec<_>>().join(" ");
    let words = unwrapped(&out);
    for told in [
        "apart from the placement of base and flange",
        "the placement of the base and the flange was not tested",
    ] {
        assert!(words.contains(told), "{out}");
    }
    let (_, out, _) = accept("later.csv", &["100", "--sensor-uncertainty", "0.02"]);
    assert!(unwrapped(&out).contains("the nominal arm passes as well"), "{out}");
    let (_, out, _) = accept("later.csv", &["0.0004", "--sensor-uncertainty", "0.0002"]);
    assert!(out.contains("tolerance 0.00040 mm"), "{out}");
    let html = fs::read_to_string(at.join("page.html")).unwrap();
    assert!(html.contains("120-503211") && html.contains("<svg"));
    assert!(html.contains("30 cycles at 5 poses are required, at most 1 were measured at one pose"));
    let json: serde_json::Value = serde_json::from_slice(&fs::read(at.join("page.json")).unwrap()).unwrap();
    assert_eq!(json["schema"], "truegrind.acceptance/1");
    assert!(json["iso_9283"].is_null());
    assert_eq!((&json["decision"], &json["poses"]), (&"accepted".into(), &200.into()));
    assert!(json["model"]["rmse"].as_f64().unwrap() < 0.5 * json["nominal"]["rmse"].as_f64().unwrap());
    for file in ["measurements", "model_file", "fitted_to"] {
        assert_eq!(json[file]["sha256"].as_str().unwrap().len(), 64, "{file}");
    }

    let (code, out, _) = accept("later.csv", &["0.001", "--sensor-uncertainty", "0.01"]);
    assert!(code == 1 && out.contains("[failed] Not accepted"), "{out}");
    // Without the target the flange's centre was taken for it, and a good model failed.
    let (code, _, err) =
        accept("later.csv", &["1", "--sensor-frame", "2310.5,-640.2,512.7,0.12,0.02,-0.03,0.99"]);
    assert!(code == 2 && err.contains("--touched-point is missing: --sensor-frame tests where"), "{err}");
    let (code, _, err) = accept("poses.csv", &["1"]);
    assert!(code == 2 && err.contains("the model was fitted to these rows"), "{err}");
    let few: String = fs::read_to_string(at.join("later.csv"))
        .unwrap()
        .lines()
        .take(61)
        .map(|l| format!("{l}\n"))
        .collect();
    fs::write(at.join("few.csv"), few).unwrap();
    let (code, out, _) = accept("few.csv", &["1"]);
    assert!(code == 1 && out.contains("[not evaluated] 60 poses are too few"), "{out}");
    for (more, expected) in [
        (vec!["0"], "expected a length above 0"),
        (vec!["1", "--sensor-uncertainty", "-1"], "the uncertainty of the sensor"),
        (
            vec!["1", "--tolerance-angle", "0"],
            "the tolerance of the orientation 0: expected an angle above 0°",
        ),
        (vec!["1", "--sensor-uncertainty-angle", "200"], "the uncertainty of the sensor's orientation 200"),
        (vec!["1", "--serial", "arm"], "expected WHAT=TEXT"),
    ] {
        let (code, _, err) = accept("later.csv", &more);
        assert!(code == 2 && err.contains(expected), "{more:?}: {err}");
    }
}

/// A tolerance of the orientation counts where the sensor measures it, and decides nothing where it does not.
#[test]
fn the_orientation_is_told_and_judged_where_that_is_asked_for() {
    let dir = folder();
    let at = dir.path();
    let recipe = RECIPE
        .replace("kind = \"position\"", "kind = \"pose\"")
        .replace(
            "reflector_mm = [38.2, 12.6, 61.3]",
            "target = { position_mm = [38.2, 12.6, 61.3], wxyz = [0.9, 0.1, 0.4, 0.1] }",
        )
        .replace("sigma_mm = 0.015", "sigma_mm = 0.015\nsigma_deg = 0.003");
    assert_ne!(recipe, RECIPE);
    for (name, seed) in [("poses", "121"), ("later", "122")] {
        fs::write(at.join(format!("{name}.toml")), recipe.replace("seed = 121", &format!("seed = {seed}")))
            .unwrap();
        let (code, _, err) =
            truegrind(at, &["simulate", &format!("{name}.toml"), "-o", &format!("{name}.csv")]);
        assert_eq!(code, 0, "{err}");
    }
    let identify =
        ["identify", "poses.csv", "--robot", "abb-irb-120", "-o", "model.toml", "--allow-doubtful"];
    let (code, _, err) = truegrind(at, &identify);
    assert!(code < 2, "{err}");
    let accept = |data: &str, more: &[&str]| {
        truegrind(
            at,
            &[
                &[
                    "accept",
                    data,
                    "--model",
                    "model.toml",
                    "--tolerance",
                    "5",
                    "--sensor-uncertainty",
                    "0.02",
                ],
                more,
            ]
            .concat(),
        )
    };
    let (code, out, err) =
        accept("later.csv", &["--html", "page.html", "--json", "page.json", "--csv", "rows.csv"]);
    assert_eq!(code, 0, "{out}{err}");
    // A terminal breaks lines.
    let on_one_line = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let page = || words_of(&fs::read_to_string(at.join("page.html")).unwrap());
    for words in
        ["Errors of the orientation by row", "not evaluated: no tolerance was stated (--tolerance-angle)"]
    {
        assert!(page().contains(words), "{words}");
    }
    assert!(fs::read_to_string(at.join("rows.csv")).unwrap().lines().next().unwrap().contains("error_deg"));
    let json =
        || -> serde_json::Value { serde_json::from_slice(&fs::read(at.join("page.json")).unwrap()).unwrap() };
    let found = json();
    assert_eq!(found["orientation"]["decision"], "not evaluated");
    let largest = found["orientation"]["model"]["max_deg"].as_f64().unwrap();
    assert!(largest > 0.0 && largest < 0.2, "{largest}");
    let (code, out, _) =
        accept("later.csv", &["--tolerance-angle", "2", "--sensor-uncertainty-angle", "0.01"]);
    let said = on_one_line(&out);
    assert!(
        code == 0 && said.contains("; largest orientation error") && said.contains(", tolerance 2.0000°"),
        "{out}"
    );
    let half = format!("{}", 0.5 * largest);
    let tight = ["--tolerance-angle", &half, "--sensor-uncertainty-angle", "0.0001", "--json", "page.json"];
    let (code, out, _) = accept("later.csv", &tight);
    assert!(
        code == 1 && on_one_line(&out).contains("[failed] Not accepted: largest orientation error"),
        "{out}"
    );
    assert_eq!(json()["decision"], "not accepted");
    // Positions alone.
    let places: String = fs::read_to_string(at.join("later.csv"))
        .unwrap()
        .lines()
        .map(|line| line.split(',').take(9).collect::<Vec<_>>().join(",") + "\n")
        .collect();
    fs::write(at.join("places.csv"), places).unwrap();
    let (code, out, err) = accept("places.csv", &["--html", "page.html"]);
    assert!(
        code == 0 && page().contains("not evaluated: the sensor does not measure the orientation"),
        "{out}{err}"
    );
    let (code, out, _) = accept("places.csv", &["--tolerance-angle", "1"]);
    let headline =
        "[not evaluated] A tolerance of the orientation was stated, but the sensor does not measure it";
    assert!(code == 1 && on_one_line(&out).contains(headline), "{out}");
}

/// Ten cycles of a path beside the poses of the acceptance: path accuracy and repeatability are evaluated, else what is missing is said.
#[test]
fn a_measured_path_is_evaluated() {
    let dir = folder();
    let at = dir.path();
    measured_twice(at);
    let identify =
        ["identify", "poses.csv", "--robot", "abb-irb-120", "-o", "model.toml", "--allow-doubtful"];
    let (code, _, err) = truegrind(at, &identify);
    assert!(code < 2, "{err}");
    let later = fs::read_to_string(at.join("later.csv")).unwrap();
    let (header, poses) = later.split_once('\n').unwrap();
    let columns: Vec<&str> = header.split(',').collect();
    let x = columns.iter().position(|name| *name == "measured_x").unwrap();
    // A "path" over ten of the poses: what a tracker saw there, in each cycle 0.02 mm to one side or the other.
    let table = |cycles: usize, points: usize| {
        let mut text = format!("{header},path,cycle,sample\n");
        poses.lines().skip(points).for_each(|line| text += &format!("{line},,,\n"));
        for cycle in 0..cycles {
            for (sample, line) in poses.lines().take(points).enumerate() {
                let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
                let seen: f64 = cells[x].parse().unwrap();
                cells[x] = format!("{:.4}", seen + 0.02 * [-1.0, 1.0][cycle % 2]);
                text += &format!("{},edge,{},{sample}\n", cells.join(","), cycle + 1);
            }
        }
        fs::write(at.join("cycles.csv"), text).unwrap();
    };
    let accept = || {
        let arguments = [
            "accept",
            "cycles.csv",
            "--model",
            "model.toml",
            "--tolerance",
            "1",
            "--sensor-uncertainty",
            "0.02",
            "--json",
            "page.json",
        ];
        let (code, out, err) = truegrind(at, &arguments);
        let json = fs::read(at.join("page.json")).unwrap_or_default();
        let found: serde_json::Value = serde_json::from_slice(&json).unwrap_or_default();
        (code, out.split_whitespace().collect::<Vec<_>>().join(" "), err, found)
    };
    table(10, 10);
    let (code, out, err, found) = accept();
    assert!(code == 0 && out.contains("190 poses in 190 rows"), "{out}{err}");
    assert!(out.contains("path edge: 10 cycles, 10 sampling points"), "{out}");
    let of = &found["iso_9283_paths"][0];
    assert_eq!((&of["path"], &of["cycles"], &of["points"]), (&"edge".into(), &10.into(), &10.into()));
    let [accuracy, repeatability] = ["at_mm", "rt_mm"].map(|name| of[name].as_f64().unwrap());
    assert!((0.001..1.0).contains(&accuracy), "{accuracy}");
    // Each cycle lies 0.02 mm beside the mean; this way turns sharply at its points, whose planes are met obliquely.
    assert!((0.005..0.2).contains(&repeatability), "{repeatability}");
    table(4, 10);
    let (code, out, _, found) = accept();
    assert!(code == 0 && out.contains("not evaluated: 10 cycles are required (path edge: 4 cycles"), "{out}");
    assert!(out.contains("largest deviation of the path") && found["iso_9283_paths"][0]["at_mm"].is_null());
    // What is wrong is told by its place.
    for (from, to, expected) in [
        (",edge,1,3\n", ",edge,0,3\n", "column cycle: found `0`; expected the number of a cycle, from 1"),
        (",edge,1,3\n", ",edge,1,3.5\n", "column sample: found `3.5`"),
        (",edge,1,3\n", ",,1,3\n", "column path: found an empty cell; expected the name of a path"),
        (",edge,1,3\n", ",edge,1,2\n", "both are sampling point 2 of cycle 1 of path edge"),
    ] {
        table(4, 10);
        let text = fs::read_to_string(at.join("cycles.csv")).unwrap();
        fs::write(at.join("cycles.csv"), text.replacen(from, to, 1)).unwrap();
        let (code, out, err, _) = accept();
        assert!(code == 2 && err.contains(expected), "{out}{err}");
    }
    // Two of the three columns are no path, and that is said.
    table(4, 10);
    let text = fs::read_to_string(at.join("cycles.csv")).unwrap();
    fs::write(at.join("cycles.csv"), text.replacen(",cycle,", ",run,", 1)).unwrap();
    let (_, _, err, _) = accept();
    assert!(err.contains("cycle is missing, and the rows are read as poses"), "{err}");
}

#[test]
fn an_empty_table_says_what_belongs_where() {
    let dir = folder();
    let at = dir.path();
    for (sensor, column) in [("cable", ",L,"), ("position", ",measured_z,"), ("pose", ",measured_qz,")] {
        let name = format!("{sensor}.csv");
        let (code, _, err) = truegrind(
            at,
            &["measurement", "template", "--robot", "abb-irb-120", "--sensor", sensor, "-o", &name],
        );
        assert_eq!(code, 0, "{err}");
        let text = fs::read_to_string(at.join(&name)).unwrap();
        assert!(text.starts_with("q1,q2,q3,q4,q5,q6,") && text.contains(column), "{text}");
        assert_eq!(text.lines().count(), 1, "{text}");
        assert!(err.contains("J1 −165 to 165°") && err.contains("controller"), "{err}");
    }
    // Filled in, with the columns that are not needed left empty, it is read.
    let header = fs::read_to_string(at.join("cable.csv")).unwrap();
    let rows: String = super::CABLE
        .lines()
        .skip(1)
        .map(|line| {
            let cells: Vec<&str> = line.split(',').take(7).collect();
            let empty = header.split(',').count() - cells.len();
            format!("{}{}\n", cells.join(","), ",".repeat(empty))
        })
        .collect();
    fs::write(at.join("full.csv"), header + &rows).unwrap();
    let (code, out, err) = truegrind(at, &["identify", "full.csv", "--robot", "abb-irb-120"]);
    assert!(code < 2 && out.contains("sensor cable"), "{out}{err}");
    let (code, _, err) = truegrind(at, &["measurement", "template", "--robot", "abb-irb-12"]);
    assert!(code == 2 && err.contains("abb-irb-120"), "{err}");
    // A table that is filled in is not replaced by an empty one.
    let again = ["measurement", "template", "--robot", "abb-irb-120", "--sensor", "cable", "-o", "full.csv"];
    let filled = fs::read(at.join("full.csv")).unwrap();
    let (code, _, err) = truegrind(at, &again);
    assert!(code == 2 && err.contains("full.csv: the file exists"), "{err}");
    assert_eq!(fs::read(at.join("full.csv")).unwrap(), filled);
    let (code, _, err) =
        truegrind(at, &again.map(|word| if word == "full.csv" { "cable.csv" } else { word }));
    assert_eq!(code, 0, "{err}");
}
