//! Programs of either language as a user has them: NC from path to deviation, folders, bad files, diffs, marks.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use assert_cmd::Command;
use nalgebra::{DMatrix, DVector, Vector3};
use tempfile::TempDir;
use truegrind::arm::estimated::Estimated;

mod outputs;

const CABLE: &str = include_str!("../data/irb120-cable.csv");

fn truegrind(folder: &Path, arguments: &[&str]) -> (i32, String, String) {
    let output =
        Command::cargo_bin("truegrind").unwrap().current_dir(folder).args(arguments).output().unwrap();
    let text = |b: &[u8]| String::from_utf8_lossy(b).into_owned();
    (output.status.code().unwrap_or(-1), text(&output.stdout), text(&output.stderr))
}

/// A folder with a model of the simulated actual arm, which stands in `arm.toml`.
fn workshop() -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    fs::write(at.join("data.csv"), CABLE).unwrap();
    fs::write(at.join("recipe.toml"), include_str!("../data/irb120-cable.toml")).unwrap();
    fs::write(at.join("blade.toml"), include_str!("../../surfaces/blade.toml")).unwrap();
    let (code, _, err) =
        truegrind(at, &["identify", "data.csv", "--robot", "abb-irb-120", "-o", "model.toml"]);
    assert_eq!(code, 0, "{err}");
    let (code, _, err) = truegrind(at, &["simulate", "recipe.toml", "-o", "again.csv", "--arm", "arm.toml"]);
    assert_eq!(code, 0, "{err}");
    dir
}

/// What the RAPID program's tool data say of its load, for programs that say nothing: the arm yields under it.
const LOAD: [&str; 4] = ["--payload", "1.2", "--payload-centre", "0,0,55"];

/// Where every point shall be, and its deviations before and after, on the actual arm.
fn achieved(at: &Path, program: &str, intended: &str) -> Vec<[Vector3<f64>; 3]> {
    let arguments = [
        "deviation",
        program,
        "--model",
        "nominal",
        "--robot",
        "abb-irb-120",
        "--intended",
        intended,
        "--actual",
        "arm.toml",
        "--json",
    ];
    let load = if program.ends_with(".mod") { &[][..] } else { &LOAD };
    let (code, text, err) = truegrind(at, &[&arguments, load].concat());
    assert_eq!(code, 0, "{err}");
    let report = json(&text);
    let points = report["programs"][0]["models"][0]["points"].as_array().unwrap().clone();
    let vector = |value: &serde_json::Value| {
        Vector3::from(["dx_mm", "dy_mm", "dz_mm"].map(|axis| value[axis].as_f64().unwrap()))
    };
    let place = |value: &serde_json::Value| Vector3::from_fn(|k, _| value[k].as_f64().unwrap());
    points
        .iter()
        .map(|point| [place(&point["intended_mm"]), vector(&point["before"]), vector(&point["after"])])
        .collect()
}

/// Sum of squares of displacements of points, apart from the best small motion of all of them (mm²).
fn squares_of_shape(points: &[Vector3<f64>], off: &[Vector3<f64>]) -> f64 {
    let middle = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let mut motions = DMatrix::zeros(3 * points.len(), 6);
    for (k, point) in points.iter().enumerate() {
        motions.view_mut((3 * k, 0), (3, 3)).fill_with_identity();
        motions.view_mut((3 * k, 3), (3, 3)).copy_from(&-(point - middle).cross_matrix());
    }
    let off = DVector::from_iterator(3 * off.len(), off.iter().flat_map(|v| [v.x, v.y, v.z]));
    let found = motions.clone().svd(true, true).solve(&off, 1e-9).unwrap();
    (off - motions * found).norm_squared()
}

fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).unwrap()
}

#[test]
fn a_path_as_nc_is_compensated_and_goes_where_it_shall() {
    let dir = workshop();
    let at = dir.path();
    for arguments in [
        &["path", "blade.toml", "--robot", "abb-irb-120", "-o", "blade.mod"][..],
        &["compensate", "blade.mod", "--model", "model.toml", "-o", "out.mod"],
    ] {
        let (code, _, err) = truegrind(at, arguments);
        assert!(code == 0 || code == 1, "{err}");
    }
    let rapid = achieved(at, "out.mod", "blade.mod");
    let column = |which: usize| rapid.iter().map(|point| point[which]).collect::<Vec<_>>();
    // The rows do not see where the path stands as a whole.
    let shape = |which: usize| squares_of_shape(&column(0), &column(which));
    assert!(shape(2) < 0.1 * shape(1), "the rewritten program is better: {} {}", shape(1), shape(2));
    for (name, word) in [("blade.nc", "G43.4 H1"), ("blade.mpf", "TRAORI")] {
        let out = format!("out-{name}");
        let (code, _, err) = truegrind(at, &["path", "blade.toml", "--robot", "abb-irb-120", "-o", name]);
        assert_eq!(code, 0, "{err}");
        let original = fs::read_to_string(at.join(name)).unwrap();
        assert!(original.contains(word) && original.contains("\nN"), "{original}");
        let arguments = ["compensate", name, "--model", "model.toml", "-o", &out, "--json"];
        let (code, text, err) = truegrind(at, &[&arguments, &LOAD[..]].concat());
        assert!(code == 0 || code == 1, "{err}");
        let contract = json(&text);
        let motions = contract["programs"][0]["motions"].as_array().unwrap();
        assert!(motions.len() > 300, "{}", motions.len());
        let changed = motions.iter().filter(|m| m["status"] == "changed" || m["status"] == "flagged").count();
        assert!(changed * 10 > motions.len() * 9, "{changed} of {}", motions.len());
        let rewritten = fs::read_to_string(at.join(&out)).unwrap();
        assert!(rewritten.contains("truegrind 0") && rewritten.contains(" model "), "a mark is written");
        // A word that was left out and must now change stands in its block.
        let words = |text: &str| {
            text.lines().filter(|line| line.starts_with('N')).flat_map(str::split_whitespace).count()
        };
        assert!(words(&rewritten) > words(&original) + 300, "{} {}", words(&rewritten), words(&original));
        // On the actual arm, which the correction knew nothing of, it goes where the RAPID program goes.
        let found = achieved(at, &out, name);
        assert_eq!(found.len(), rapid.len());
        for ([_, before, after], [_, rapid_before, rapid_after]) in found.iter().zip(&rapid) {
            assert!((before - rapid_before).norm() < 2e-3, "{name}: {before} {rapid_before}");
            assert!((after - rapid_after).norm() < 2e-3, "{name}: {after} {rapid_after}");
        }
        let (code, text, _) = truegrind(at, &["compensate", &out, "--model", "model.toml", "-o", "twice.nc"]);
        assert_eq!((code, text.contains("already compensated")), (1, true), "{text}");
        assert!(!at.join("twice.nc").exists());
    }
}

fn module(name: &str, count: usize, shift: f64) -> String {
    let mut text = format!("MODULE {name}\n  PROC main()\n    ! Points.\n");
    for k in 0..count {
        let _ = writeln!(
            text,
            "    MoveL [[{:.1},{:.1},450],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z1,tool0;",
            350.0 + shift,
            k as f64 * 2.0 - 20.0
        );
    }
    text + "  ENDPROC\nENDMODULE\n"
}

/// Motions by line: status and reason.
fn motions(contract: &serde_json::Value, program: usize) -> Vec<(u64, String, String)> {
    let motions = contract["programs"][program]["motions"].as_array().unwrap();
    let text = |value: &serde_json::Value| value.as_str().unwrap_or("-").to_owned();
    motions.iter().map(|m| (m["line"].as_u64().unwrap(), text(&m["status"]), text(&m["reason"]))).collect()
}

#[test]
fn the_nominal_arm_lists_every_motion_and_changes_no_byte() {
    let dir = workshop();
    let at = dir.path();
    fs::create_dir_all(at.join("in")).unwrap();
    let text = "MODULE A\r\n  VAR robtarget here;\r\n  PROC main()\r\n    MoveL [[350,0,450],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z1,tool0;\r\n    \
                here:=CRobT();\r\n    MoveL here,v100,z1,tool0;\r\n    MoveL [[350,0,450],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z1,tMine;\r\n    \
                MoveAbsJ [[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z1,tool0;\r\n  ENDPROC\r\nENDMODULE";
    fs::write(at.join("in/a.mod"), text).unwrap();
    fs::write(at.join("in/b.pgf"), "<Program><Module>nowhere.mod</Module></Program>").unwrap();
    fs::write(at.join("in/c.mod"), module("C", 2, 0.0)).unwrap();
    let nominal = ["--model", "nominal", "--robot", "abb-irb-120"];
    let one =
        ["compensate", "in/a.mod", "-o", "a.mod", "--json", "a.json", "--html", "a.html", "--diff", "a.diff"];
    let (code, out, err) = truegrind(at, &[&one, &nominal[..]].concat());
    assert_eq!(code, 0, "{out}\n{err}");
    assert_eq!(fs::read_to_string(at.join("a.mod")).unwrap(), text);
    assert_eq!(fs::read_to_string(at.join("a.diff")).unwrap(), "");
    let found = motions(&json(&fs::read_to_string(at.join("a.json")).unwrap()), 0);
    let lines: Vec<u64> = found.iter().map(|(line, ..)| *line).collect();
    assert_eq!(lines, [4, 6, 7, 8]);
    assert!(found.iter().all(|(_, status, _)| status == "left"), "{found:?}");
    let says = [
        "its numbers are already right to the last written decimal",
        "known only at run time",
        "the tool frame is unknown",
        "joint target",
    ];
    // The reasons are those that an estimated arm gives, but for what it corrects.
    let (_, _, err) = truegrind(
        at,
        &["compensate", "in/a.mod", "--model", "model.toml", "--dry-run", "--json", "real.json"],
    );
    let real = motions(&json(&fs::read_to_string(at.join("real.json")).expect(&err)), 0);
    for (((_, _, reason), (_, status, why)), says) in found.iter().zip(&real).zip(says) {
        assert!(reason.contains(says), "{reason}: {says}");
        assert!(status != "left" || reason == why, "{reason}: {why}");
    }
    // A bad one among many does not keep the others from being written.
    let many = ["compensate", "in", "-o", "out", "--csv", "rows.csv"];
    let (code, out, err) = truegrind(at, &[&many, &nominal[..]].concat());
    assert_eq!(code, 1, "{out}\n{err}");
    assert!(out.contains("nowhere.mod") && out.contains("1 failed"), "{out}");
    for file in ["a.mod", "c.mod"] {
        let [a, b] = ["in", "out"].map(|folder| fs::read(at.join(folder).join(file)).unwrap());
        assert_eq!(a, b, "{file}");
    }
    assert_eq!(fs::read_to_string(at.join("rows.csv")).unwrap().lines().count(), 4);
}

#[test]
fn a_module_without_the_mark_of_its_task_is_not_called_compensated() {
    let dir = workshop();
    let at = dir.path();
    let target = "[[360,10,450],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]";
    fs::write(at.join("points.sys"), format!("MODULE points\n  PERS robtarget p1:={target};\nENDMODULE\n"))
        .unwrap();
    let main = |name: &str, more: &str| {
        let text = format!(
            "MODULE {name}\n  PROC main()\n    ! Points.\n    MoveL p1,v100,fine,tool0;\n{more}  ENDPROC\nENDMODULE\n"
        );
        fs::write(at.join(format!("{name}.mod")), text).unwrap();
    };
    main("one", "");
    main("two", &format!("    MoveL {},v100,fine,tool0;\n", target.replace("360", "370")));
    let run = |files: &[&str], out: &str| {
        truegrind(at, &[&["compensate"], files, &["--model", "model.toml", "-o", out]].concat())
    };
    let (code, _, err) = run(&["one.mod", "points.sys"], "first");
    assert_eq!(code, 0, "{err}");
    // The same task again: points.sys carries the mark, and one.mod has nothing of its own to correct.
    let (code, text, err) = run(&["first/one.mod", "first/points.sys"], "again");
    assert_eq!((code, text.contains("already compensated")), (1, true), "{text}{err}");
    // Another module with the corrected points.
    let (code, text, err) = run(&["two.mod", "first/points.sys"], "second");
    assert_eq!(code, 2, "{text}");
    assert!(err.contains("points.sys is already compensated with this model, two.mod is not"), "{err}");
    assert!(!at.join("second").exists());
}

#[test]
fn what_cannot_be_read_is_not_called_done() {
    let dir = workshop();
    let at = dir.path();
    let run = |name: &str| truegrind(at, &["compensate", name, "--model", "model.toml", "--dry-run"]);
    let broken = "    MoveL [[360,10,450],[0,0,1,0],v100,fine,tool0;\n";
    fs::write(at.join("none.mod"), format!("MODULE N\n  PROC main()\n{broken}  ENDPROC\nENDMODULE\n"))
        .unwrap();
    let (code, _, err) = run("none.mod");
    assert_eq!(code, 1, "{err}");
    assert!(err.contains("no motion found; 1 region could not be read"), "{err}");
    let some = module("A", 5, 0.0).replace("    ! Points.\n", &format!("    ! Points.\n{broken}"));
    fs::write(at.join("some.mod"), some).unwrap();
    let (code, text, err) = run("some.mod");
    assert_eq!(code, 1, "{err}");
    assert!(text.contains("[warning] Corrected, but parts of the program could not be read"), "{text}");
    assert!(text.contains("1 region could not be read and is unchanged;"), "{text}");
}

#[test]
fn lines_whose_path_nobody_checked_are_named() {
    let dir = workshop();
    let at = dir.path();
    let text = module("A", 5, 0.0).replace("v100,z1,tool0;\n", "v100,fine,tool0;\n    IF di1=1 Stop;\n");
    let text = text.replacen("    IF di1=1 Stop;\n", "    IF di1=1 MoveL CRobT(),v100,fine,tool0;\n", 2);
    fs::write(at.join("a.mod"), text).unwrap();
    let (code, text, err) = truegrind(at, &["compensate", "a.mod", "--model", "model.toml", "--dry-run"]);
    // Two lines to where the robot stands are left beside cuts; nothing tells where those behind them start.
    assert_eq!(code, 1, "{err}");
    let words: String = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("check the refused and flagged motions"), "{text}");
    assert!(words.contains("of which 2 are flagged"), "{text}");
    assert!(words.contains("3 lines or arcs start at a place that is unknown or not corrected"), "{text}");
    assert!(words.contains("the path to it is not checked (lines 4, 6, 8)"), "{text}");
}

#[test]
fn a_motion_that_is_right_already_is_left_for_that_reason() {
    let dir = workshop();
    let at = dir.path();
    // An arm that is not off at all.
    fs::write(at.join("a.mod"), module("A", 3, 0.0).replace("! Points.", "ConfL\\Off;")).unwrap();
    let model = fs::read_to_string(at.join("model.toml")).unwrap();
    let mut exact = Estimated::from_toml(&model).unwrap();
    exact.model = exact.nominal.clone();
    // The list says what was identified, which this arm is not.
    exact.parameters.clear();
    // Measured everywhere.
    (exact.region.min_deg, exact.region.max_deg) = ([-400.0; 6], [400.0; 6]);
    (exact.region.spacing_deg, exact.region.sigma_mm) = (1e4, 1e3);
    fs::write(at.join("exact.toml"), exact.to_toml().unwrap()).unwrap();
    let (code, text, err) =
        truegrind(at, &["compensate", "a.mod", "--model", "exact.toml", "--dry-run", "--json"]);
    assert!(code == 0 || code == 1, "{err}");
    let motions = json(&text)["programs"][0]["motions"].as_array().unwrap().clone();
    assert_eq!(motions.len(), 3);
    for motion in &motions {
        assert_eq!(motion["status"], "left", "{motion}");
        assert_eq!(motion["reason"], "its numbers are already right to the last written decimal", "{motion}");
    }
}

/// What the class is: a green end of a run in which nothing, or nothing that helps, was done.
#[test]
fn nothing_rewritten_is_never_ok_and_names_what_is_missing() {
    let dir = workshop();
    let at = dir.path();
    fs::create_dir(at.join("nc")).unwrap();
    let head = "%\nO1\nG90 G21 G17 G54\nT7 M6\nG43.4 H7\n";
    let body = "G1 X0. Y0. Z20. A180. B0. C0. F600.\nG1 X5. Y0. Z20. A180. B0. C0.\nM30\n%\n";
    for name in ["a.nc", "b.nc"] {
        fs::write(at.join("nc").join(name), format!("{head}{body}")).unwrap();
    }
    fs::copy(at.join("nc/a.nc"), at.join("one.nc")).unwrap();
    let nc = ["--model", "model.toml", "--robot", "abb-irb-120"];
    let (code, text, _) = truegrind(at, &[&["compensate", "one.nc", "-o", "out.nc"], &nc[..]].concat());
    assert_eq!(code, 1, "{text}");
    assert!(text.contains("[not evaluated] Nothing was corrected") && !text.contains("[ok]"), "{text}");
    let words: String = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        words.contains("tool T7 is declared in none of the files, and 2 motions use it (first: line 6)"),
        "{text}"
    );
    assert!(
        words.contains("[[tool]] name = \"T7\", origin = \"metrology\", position_mm = [x, y, z]"),
        "{text}"
    );
    assert!(
        words.contains("work offset G54 is declared") && words.contains("[[wobj]] name = \"G54\""),
        "{text}"
    );
    let (code, text, _) = truegrind(at, &[&["compensate", "nc", "-o", "out"], &nc[..]].concat());
    assert_eq!(code, 1, "{text}");
    assert!(!text.contains("[ok]") && !text.contains("✓ unchanged"), "{text}");
    let words: String = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        words.contains("Nothing was corrected") && words.contains("declared in no file: T7, G54"),
        "{text}"
    );
    // With what was asked for they are rewritten.
    let cell = "[[tool]]\nname = \"T7\"\norigin = \"metrology\"\nposition_mm = [0, 0, 50]\n\
                [[wobj]]\nname = \"G54\"\norigin = \"metrology\"\nposition_mm = [400, 0, 250]\n";
    fs::write(at.join("cell.toml"), cell).unwrap();
    let source =
        fs::read_to_string(at.join("one.nc")).unwrap().replace("O1\n", "O1\n(truegrind angles wpr)\n");
    fs::write(at.join("one.nc"), source).unwrap();
    let with_cell = ["compensate", "one.nc", "-o", "out.nc", "--cell", "cell.toml"];
    let (_, text, _) = truegrind(at, &[&with_cell, &nc[..]].concat());
    assert!(text.contains("2 corrected"), "{text}");
}

#[test]
fn a_cut_corrected_in_part_says_so_in_its_mark() {
    let dir = workshop();
    let at = dir.path();
    let far = module("A", 5, 0.0).replace("[[350.0,-16.0,", "[[900.0,-16.0,");
    fs::write(at.join("a.mod"), &far).unwrap();
    assert_ne!(far, module("A", 5, 0.0));
    let run = |more: &[&str]| {
        let arguments = ["compensate", "a.mod", "--model", "model.toml", "-o", "out.mod"];
        let (code, text, err) = truegrind(at, &[&arguments, more].concat());
        assert_eq!(code, 1, "{text}{err}");
        (fs::read_to_string(at.join("out.mod")).unwrap(), text)
    };
    let (whole, text) = run(&[]);
    assert_eq!(whole, far);
    assert!(
        text.contains("Nothing could be corrected") && text.contains("as a whole or not at all"),
        "{text}"
    );
    let (partial, text) = run(&["--partial", "--tolerance", "5"]);
    assert!(text.contains("4 corrected"), "{text}");
    assert!(partial.contains("! truegrind ") && partial.contains(" partial\n"), "{partial}");
}

/// The class: something stated that nobody asks for, such as a misspelt name. Every entry of a cell file that no program of a
/// run uses is named, and none that one of them does.
#[test]
fn entries_of_a_cell_file_that_no_program_uses_are_named() {
    let dir = workshop();
    let at = dir.path();
    let tool = "PERS tooldata tOne:=[TRUE,[[0,0,50],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];\n  PROC main()";
    fs::create_dir_all(at.join("in")).unwrap();
    let one = module("A", 3, 0.0).replace("PROC main()", tool).replace("tool0", "tOne");
    fs::write(at.join("in/a.mod"), one).unwrap();
    fs::write(at.join("in/b.mod"), module("B", 3, 0.0)).unwrap();
    let cell = "[[tool]]\nname = \"TONE\"\norigin = \"metrology\"\n[[tool]]\nname = \"tOen\"\norigin = \"metrology\"\n\
                [[wobj]]\nname = \"wPart\"\norigin = \"metrology\"\n[[external]]\naxis = \"b\"\ncarries = \"other\"\n";
    fs::write(at.join("cell.toml"), cell).unwrap();
    for verb in [["compensate", "in", "--dry-run"], ["deviation", "in", "--threads=1"]] {
        let given = [&verb[..], &["--model", "model.toml", "--cell", "cell.toml"]].concat();
        let (_, _, err) = truegrind(at, &given);
        let notes: Vec<&str> = err.lines().filter(|line| line.contains("cell file:")).collect();
        assert_eq!(notes.len(), 3, "{err}");
        for (note, entry) in notes.iter().zip(["tool \"tOen\"", "wobj \"wPart\"", "axis 'b'"]) {
            assert!(note.contains(entry), "{note}");
        }
    }
    // NC programs know the tools of the cell file, and use those that they call.
    let program = "%\nO0001\n(truegrind angles wpr)\nG90 G21 G17\nT1 M6\nG54\nG43.4 H1\nG0 X0. Y0. Z20. A180. B0. C0.\nG1 X20. F600.\nM30\n%\n";
    let frame = |kind: &str, name: &str, at: &str| {
        format!("[[{kind}]]\nname = \"{name}\"\norigin = \"metrology\"\nposition_mm = {at}\n")
    };
    fs::write(at.join("face.nc"), program).unwrap();
    let cell =
        [("tool", "T1", "[0, 0, 120]"), ("tool", "T2", "[0, 0, 90]"), ("wobj", "G54", "[380, 0, 300]")];
    fs::write(at.join("nc.toml"), cell.map(|(kind, name, at)| frame(kind, name, at)).concat()).unwrap();
    let given = ["compensate", "face.nc", "--dry-run", "--model", "model.toml", "--cell", "nc.toml"];
    let (_, _, err) = truegrind(at, &given);
    let notes: Vec<&str> = err.lines().filter(|line| line.contains("cell file:")).collect();
    assert!(notes.len() == 1 && notes[0].contains("tool \"T2\" is not used by any program"), "{err}");
}

/// What is left beside corrected motions shows alone, in a folder, and in a report of deviations.
#[test]
fn what_is_left_shows_everywhere() {
    let dir = workshop();
    let at = dir.path();
    let place = |x: f64| format!("[[{x:.1},10,450],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]");
    // The routine takes its target at run time.
    let body = format!(
        "    ! Points.\n    MoveJ {},v100,fine,tool0;\n    along {},3;\n    MoveL {},v100,fine,tool0;\n    MoveL {},v100,fine,tool0;\n",
        place(340.0),
        place(342.0),
        place(350.0),
        place(370.0)
    );
    let text = format!(
        "MODULE L\n  PROC main()\n{body}  ENDPROC\n  PROC along(robtarget p,num d)\n    MoveL Offs(p,d,0,0),v100,fine,tool0;\n  \
         ENDPROC\nENDMODULE\n"
    );
    fs::create_dir(at.join("in")).unwrap();
    fs::write(at.join("in/left.mod"), &text).unwrap();
    let run = |program: &str, more: &[&str]| {
        let absolute =
            ["--model", "model.toml", "--placement", "absolute", "--max-risk", "1", "--tolerance", "0.005"];
        truegrind(at, &[&["compensate", program], &absolute[..], more].concat())
    };
    let (code, alone, err) = run("in/left.mod", &["-o", "left.mod"]);
    assert_eq!(code, 1, "{alone}{err}");
    // The terminal wraps sentences.
    let alone = alone.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        alone.contains("[warning]") && alone.contains("between corrected motions and uncorrected neighbours"),
        "{alone}"
    );
    assert!(alone.contains("1 line or arc on which the tool may cut is not corrected"), "{alone}");
    let (code, folder, err) = run("in", &["-o", "out"]);
    assert_eq!(code, 1, "{folder}{err}");
    assert!(folder.contains("[warning]") && !folder.contains("may run\n"), "{folder}");
    // Of a corrected program its targets are not the intended path.
    let (code, _, err) = truegrind(at, &["deviation", "left.mod", "--model", "model.toml"]);
    assert_eq!(code, 2);
    assert!(err.contains("--intended"), "{err}");
    let (code, report, err) =
        truegrind(at, &["deviation", "left.mod", "--model", "model.toml", "--intended", "in/left.mod"]);
    assert_eq!(code, 1, "{err}");
    assert!(report.contains("[warning]") && report.contains("2 motions have no known deviation"), "{report}");
    // As many motions, and one of them leads elsewhere.
    fs::write(at.join("other.mod"), text.replace(&place(370.0), &place(240.0))).unwrap();
    let other = ["deviation", "other.mod", "--model", "model.toml", "--intended", "in/left.mod"];
    let (code, _, err) = truegrind(at, &other);
    assert_eq!(code, 2);
    assert!(err.contains(" mm from the target of line 7"), "{err}");
    // What is as it was is not called corrected.
    let same = ["deviation", "in/left.mod", "--model", "model.toml", "--intended", "in/left.mod", "--json"];
    let (code, report, err) = truegrind(at, &same);
    assert_eq!(code, 1, "nothing is corrected: {err}");
    let points = json(&report)["programs"][0]["models"][0]["points"].as_array().unwrap().clone();
    assert!(!points.is_empty() && points.iter().all(|point| point["status"] == "left"), "{points:?}");
    // Corrected with this model: nothing would change.
    let (code, _, err) = truegrind(at, &["compensate", "left.mod", "--model", "model.toml", "--check"]);
    assert_eq!(code, 0, "{err}");
}

/// A program beside the original that it was made from: what someone changed afterwards is listed by line, and no run of it is ok.
#[test]
fn a_program_that_was_edited_after_its_correction_is_not_ok() {
    let dir = workshop();
    let at = dir.path();
    let original = module("A", 5, 0.0);
    fs::write(at.join("a.mod"), &original).unwrap();
    let arguments =
        ["compensate", "a.mod", "--model", "model.toml", "-o", "b.mod", "--placement", "absolute"];
    let (code, text, err) = truegrind(at, &[&arguments[..], &["--max-risk", "1"]].concat());
    assert!(code < 2, "{text}{err}");
    let corrected = fs::read_to_string(at.join("b.mod")).unwrap();
    assert_ne!(corrected, original);
    let judge = |text: &str| {
        fs::write(at.join("c.mod"), text).unwrap();
        truegrind(at, &["deviation", "c.mod", "--intended", "a.mod", "--model", "model.toml"])
    };
    let (code, text, err) = judge(&corrected);
    assert!(code == 0 && text.contains("[ok]"), "{text}{err}");
    let line = corrected.lines().filter(|line| line.contains("MoveL")).nth(1).unwrap();
    let number = corrected.lines().position(|other| other == line).unwrap() + 1;
    let displaced = format!("    PDispSet [[0,0,5],[1,0,0,0]];\n{line}");
    let (code, text, err) = judge(&corrected.replacen(line, &displaced, 1));
    assert_eq!(code, 1, "{text}{err}");
    assert!(text.contains("[failed] The program differs") && text.contains("program displacement"), "{text}");
    assert!(text.contains(&format!("{}", number + 1)), "{text}");
    // Worse than before.
    let x = line.split("[[").nth(1).unwrap().split(',').next().unwrap();
    let far: f64 = x.parse::<f64>().unwrap() + 9.0;
    let (code, text, err) = judge(&corrected.replacen(line, &line.replacen(x, &far.to_string(), 1), 1));
    assert!(code == 1 && text.contains("[failed]") && text.contains("makes the path worse"), "{text}{err}");
}

/// What is missing is named; that the text does not tell where a motion leads is another reason.
#[test]
fn a_program_without_a_known_deviation_is_told_why() {
    let dir = workshop();
    let at = dir.path();
    fs::write(at.join("a.mod"), module("A", 5, 0.0).replace("tool0", "tNowhere")).unwrap();
    let (code, _, err) = truegrind(at, &["deviation", "a.mod", "--model", "model.toml"]);
    assert_eq!(code, 2, "{err}");
    assert!(err.contains("the deviation of none of its") && err.contains("tool"), "{err}");
    assert!(!err.contains("program text determines"), "{err}");
}

#[test]
fn configurations_of_another_robot_are_not_called_out_of_reach() {
    let dir = workshop();
    let at = dir.path();
    let text = module("A", 12, 0.0).replace("[0,0,0,0]", "[2,0,0,0]");
    fs::write(at.join("a.mod"), text).unwrap();
    let (code, _, err) = truegrind(at, &["compensate", "a.mod", "--model", "model.toml", "-o", "b.mod"]);
    assert_eq!(code, 2, "{err}");
    assert!(
        err.contains("12 of the motions are in reach of abb-irb-120 only in other configurations"),
        "{err}"
    );
    assert!(err.contains("line 4: target is not reachable in configuration [2,0,0,0]"), "{err}");
}
