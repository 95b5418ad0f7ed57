//! Files that belong together: cell, surface, program, model, and the name of what is written.
//!
//! The class: a run that goes through although what it was given speaks of different things (another robot, another place of
//! the work object, another language), and whose result looks like a correction.

use std::fs;
use std::path::Path;

use tempfile::TempDir;

use super::{folder, truegrind};

const POSES: &str = include_str!("../../data/irb120-tracker.csv");
const BLADE: &str = include_str!("../../../surfaces/blade.toml");

/// A folder with a model, and the program of the shipped surface.
fn shop() -> TempDir {
    let dir = folder();
    let at = dir.path();
    fs::write(at.join("poses.csv"), POSES).unwrap();
    fs::write(at.join("blade.toml"), BLADE).unwrap();
    let (code, _, err) =
        truegrind(at, &["identify", "poses.csv", "--robot", "abb-irb-120", "-o", "model.toml"]);
    assert!(code < 2, "{err}");
    for name in ["blade.mod", "blade.nc", "blade.mpf"] {
        let (code, _, err) = truegrind(at, &["path", "blade.toml", "--robot", "abb-irb-120", "-o", name]);
        assert_eq!(code, 0, "{err}");
    }
    dir
}

/// Runs `compensate` to be refused: exit code 2, nothing written, all of `words` in the message.
fn refused(at: &Path, arguments: &[&str], words: &[&str]) {
    let (code, out, err) = truegrind(at, &[&["compensate"], arguments].concat());
    assert_eq!(code, 2, "{arguments:?}: {out}{err}");
    for word in words {
        assert!(err.contains(word), "{arguments:?}: `{word}` is not in: {err}");
    }
}

#[test]
fn a_corrected_file_no_longer_says_that_it_is_to_be_corrected() {
    let dir = shop();
    let at = dir.path();
    for name in ["blade.mod", "blade.nc", "blade.mpf"] {
        let before = fs::read_to_string(at.join(name)).unwrap();
        assert_eq!(before.matches("run truegrind compensate before grinding").count(), 1, "{name}");
        let out = format!("out-{name}");
        let (code, _, err) = truegrind(at, &["compensate", name, "--model", "model.toml", "-o", &out]);
        assert!(code < 2, "{name}: {err}");
        let after = fs::read_to_string(at.join(&out)).unwrap();
        assert!(
            !after.contains("before grinding") && after.contains("truegrind 0."),
            "{name}: {}",
            &after[..600]
        );
        // The line went whole: one line less, and the mark instead.
        assert_eq!(
            after.lines().filter(|line| line.trim().is_empty()).count(),
            before.lines().filter(|line| line.trim().is_empty()).count(),
            "{name}"
        );
        assert!(after.contains("Path over surface blade for abb-irb-120"), "{name}");
    }
}

#[test]
fn a_model_of_another_robot_is_refused_as_such() {
    let dir = shop();
    let at = dir.path();
    // The program says for which robot it was made.
    for name in ["blade.mod", "blade.nc"] {
        let other = fs::read_to_string(at.join(name)).unwrap().replace("abb-irb-120", "hsr-jr605");
        let file = format!("other-{name}");
        fs::write(at.join(&file), other).unwrap();
        refused(
            at,
            &[&file, "--model", "model.toml", "-o", &format!("out-{name}")],
            &["hsr-jr605", "abb-irb-120", &file],
        );
        let (code, _, err) = truegrind(at, &["deviation", &file, "--model", "model.toml"]);
        assert!(code == 2 && err.contains("hsr-jr605"), "{err}");
    }
    // The cell file does.
    fs::write(at.join("cell.toml"), "robot = \"hsr-jr605\"\n").unwrap();
    refused(
        at,
        &["blade.mod", "--model", "model.toml", "--cell", "cell.toml", "-o", "out.mod"],
        &["cell file", "hsr-jr605", "abb-irb-120"],
    );
    fs::write(at.join("cell.toml"), "robot = \"ABB-IRB-120\"\n").unwrap();
    let (code, _, err) = truegrind(
        at,
        &["compensate", "blade.mod", "--model", "model.toml", "--cell", "cell.toml", "-o", "out.mod"],
    );
    assert!(code < 2, "{err}");
    // Nobody says it, but the arm reaches nothing of it.
    let far = "MODULE Far\nPROC main()\nCONFIG".replace(
        "CONFIG",
        &(0..8)
            .map(|k| {
                format!(
                    "MoveL [[2400,{},900],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z1,tool0;\n",
                    10 * k
                )
            })
            .collect::<String>(),
    ) + "ENDPROC\nENDMODULE\n";
    fs::write(at.join("far.mod"), far).unwrap();
    refused(
        at,
        &["far.mod", "--model", "model.toml", "-o", "out-far.mod"],
        &["8 motions", "abb-irb-120", "another robot"],
    );
    assert!(!at.join("out-far.mod").exists());
}

/// What a surface file says from metrology is true: a program that tells the controller something else is wrong, or the file is.
#[test]
fn a_surface_from_metrology_and_the_frames_of_the_program_agree() {
    let dir = shop();
    let at = dir.path();
    for (from, to, words) in [
        (
            "position_mm = [420, 0, 250]",
            "position_mm = [421, 0, 250]",
            ["work_object \"wobjBlade\"", "1.00 mm", "421.000", "420.000"],
        ),
        (
            "rpy_deg = [0, 0, 0]",
            "rpy_deg = [0, 0, 1]",
            ["work_object \"wobjBlade\"", "1.000°", "metrology", "taught"],
        ),
        (
            "position_mm = [0, 0, 120]",
            "position_mm = [0, 0, 119]",
            ["tool \"tSpindle\"", "1.00 mm", "119.000", "120.000"],
        ),
    ] {
        let moved = BLADE.replace(from, to);
        assert_ne!(moved, BLADE);
        fs::write(at.join("moved.toml"), &moved).unwrap();
        for program in ["blade.mod", "blade.nc"] {
            let (_, ending) = program.split_once('.').unwrap();
            let out = format!("out.{ending}");
            refused(at, &[program, "--model", "model.toml", "--surface", "moved.toml", "-o", &out], &words);
            assert!(!at.join(out).exists());
        }
        // A place that was taught is the controller's.
        fs::write(at.join("moved.toml"), moved.replace("\"metrology\"", "\"taught\"")).unwrap();
        let (code, _, err) = truegrind(
            at,
            &["compensate", "blade.mod", "--model", "model.toml", "--surface", "moved.toml", "--dry-run"],
        );
        assert!(code < 2, "{err}");
    }
}

#[test]
fn an_output_is_called_what_it_is() {
    let dir = shop();
    let at = dir.path();
    for name in ["out.src", "out.script", "out.txt", "out.pgf"] {
        refused(at, &["blade.mod", "--model", "model.toml", "-o", name], &[name, ".mod", ".nc"]);
        let (code, _, err) = truegrind(at, &["path", "blade.toml", "--robot", "abb-irb-120", "-o", name]);
        assert!(code == 2 && err.contains(".mod") && err.contains(".mpf"), "{err}");
        let (code, _, err) =
            truegrind(at, &["plan", "--robot", "abb-irb-120", "--sensor", "position", "-o", name]);
        assert!(code == 2 && err.contains(".mod"), "{err}");
        assert!(!at.join(name).exists());
    }
    // Another language, another control.
    refused(
        at,
        &["blade.mod", "--model", "model.toml", "-o", "out.nc"],
        &["not translated", "RAPID", ".mod"],
    );
    refused(at, &["blade.nc", "--model", "model.toml", "-o", "out.mod"], &["not translated", "NC", ".nc"]);
    // Text of one control in a file that another one reads.
    for name in ["out.mpf", "out.h", "out.ngc"] {
        refused(
            at,
            &["blade.nc", "--model", "model.toml", "-o", name],
            &["this extension stands for", "Fanuc"],
        );
        assert!(!at.join(name).exists());
    }
    let (code, _, err) = truegrind(at, &["path", "blade.toml", "--robot", "abb-irb-120", "-o", "out.gcode"]);
    assert!(code == 2 && err.contains(".mpf"), "{err}");
    // As its source, whatever that is called; and where nothing is said.
    fs::copy(at.join("blade.mod"), at.join("blade.txt")).unwrap();
    for (from, to) in [("blade.txt", "out.txt"), ("blade.mod", "out"), ("blade.mod", "out.MODX")] {
        let (code, _, err) = truegrind(at, &["compensate", from, "--model", "model.toml", "-o", to]);
        assert!(code < 2 && at.join(to).exists(), "{from} to {to}: {err}");
    }
}

/// The skeleton of a cell names every tool and frame of the programs, loads, and is refused until it is filled in.
#[test]
fn the_skeleton_of_a_cell_loads_and_is_refused_until_it_is_filled_in() {
    let dir = shop();
    let at = dir.path();
    let arguments = ["cell", "blade.mod", "blade.nc", "-o", "cell.toml", "--robot", "abb-irb-120"];
    let (code, _, err) = truegrind(at, &arguments);
    assert!(code == 0 && err.contains("cell.toml"), "{err}");
    let text = fs::read_to_string(at.join("cell.toml")).unwrap();
    for name in ["\"T1\"", "\"G54\"", "\"tSpindle\"", "\"wobjBlade\"", "robot = \"abb-irb-120\""] {
        assert!(text.contains(name), "{name}: {text}");
    }
    assert!(text.lines().all(|line| line.chars().count() <= 120), "{text}");
    let read = truegrind::compensation::cell::Cell::from_toml(&text).unwrap();
    assert_eq!((read.tool.len(), read.wobj.len()), (2, 2), "{text}");
    assert_eq!(read.open.len(), text.lines().filter(|line| line.contains("= \"?\"")).count(), "{text}");
    refused(
        at,
        &["blade.mod", "--model", "model.toml", "--cell", "cell.toml", "-o", "out.mod"],
        &["cell.toml", "T1", "origin = \"?\"", "metrology"],
    );
    // Filled in one after the other: each entry is named in its turn, in the end there is none.
    let mut open = text;
    while let Some((before, after)) = open.split_once("origin = \"?\"") {
        open = format!("{before}origin = \"metrology\"{after}");
        fs::write(at.join("cell.toml"), &open).unwrap();
        let (code, _, err) = truegrind(
            at,
            &["compensate", "blade.mod", "--model", "model.toml", "--cell", "cell.toml", "--dry-run"],
        );
        assert_eq!(code == 2, open.contains("= \"?\""), "{err}");
    }
    let (code, _, err) = truegrind(at, &["cell", "blade.mod", "-o", "cell.txt"]);
    assert!(code == 2 && err.contains(".toml"), "{err}");
    fs::write(at.join("empty.nc"), "%\nO1\nG90\nM30\n%\n").unwrap();
    let (code, _, err) = truegrind(at, &["cell", "empty.nc", "-o", "none.toml"]);
    assert!(code == 2 && err.contains("no motion"), "{err}");
}

/// A plan keeps links and target above the mounting plane and out of what is stated, at every stop and on every way between
/// them; the ways are walked here through the written program, with an arm that this test puts together from the data sheet.
#[test]
fn a_plan_keeps_above_the_floor_and_out_of_boxes() {
    use truegrind::arm::condition::Condition;
    use truegrind::arm::model::Joints;

    let dir = folder();
    let at = dir.path();
    let base = [
        "plan",
        "--robot",
        "abb-irb-120",
        "--sensor",
        "position",
        "--poses",
        "30",
        "--touched-point",
        "30,0,60",
        "--candidates",
        "400",
    ];
    let corners = [[250.0, -700.0, 0.0], [700.0, -100.0, 500.0]];
    let stated =
        ["--keep-out", "700,-100,0,250,-700,500", "--link-radius", "40", "--sensor-frame", "1800,900,700"];
    let (code, out, err) = truegrind(at, &[&base[..], &stated, &["-o", "poses.mod"]].concat());
    assert_eq!(code, 0, "{err}");
    let in_one_line = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(in_one_line(&out).contains("above z = 0 mm, out of the box") && out.contains("40 mm"), "{out}");
    assert!(out.lines().all(|line| line.chars().count() <= 100), "{out}");
    let text = fs::read_to_string(at.join("poses.mod")).unwrap();
    assert!(text.contains("above z = 0 mm, out of the box"), "{text}");
    let stops: Vec<Joints> = text
        .lines()
        .filter_map(|line| line.trim().strip_prefix("MoveAbsJ [[")?.split_once(']'))
        .map(|(angles, _)| {
            let angles: Vec<f64> =
                angles.split(',').map(|angle| angle.parse::<f64>().unwrap().to_radians()).collect();
            Joints::from_column_slice(&angles)
        })
        .collect();
    assert!(stops.len() > 60, "{}", stops.len());
    let arm = truegrind::robots::load("abb-irb-120").unwrap().model;
    let still = Condition::default();
    let posed = arm.at_condition(&still);
    let clear = |joints: &Joints| {
        let frames = posed.frames(joints);
        let flange = frames.last() * arm.flange;
        let touched = flange * nalgebra::Point3::new(30.0, 0.0, 60.0);
        let mut points: Vec<nalgebra::Vector3<f64>> =
            frames.origin.iter().map(|origin| nalgebra::Vector3::from(*origin)).collect();
        points.extend([flange.translation.vector, touched.coords]);
        (1..points.len() - 1).all(|k| {
            (0..=40).all(|step| {
                let point = points[k].lerp(&points[k + 1], f64::from(step) / 40.0);
                let away = nalgebra::Vector3::from_fn(|axis, _| {
                    (corners[0][axis] - point[axis]).max(point[axis] - corners[1][axis]).max(0.0)
                });
                // Half the radius is what the wrist has; the way is sampled elsewhere than in the plan.
                point.z > 15.0 && away.norm() > 15.0
            })
        })
    };
    for way in stops.windows(2) {
        for step in 0..=60 {
            let joints = way[0].lerp(&way[1], f64::from(step) / 60.0);
            assert!(clear(&joints), "{:?} to {:?} at {step}", way[0], way[1]);
        }
    }
    // Without the box poses do go there: the check is what keeps them out.
    let (_, _, err) = truegrind(at, &[&base[..], &["-o", "free.mod"]].concat());
    assert!(at.join("free.mod").exists(), "{err}");
    for (wrong, words) in [
        (&["--keep-out", "1,2,3"][..], ["--keep-out", "two corners"]),
        (&["--keep-out", "0,0,0,0,1,1"], ["--keep-out", "two corners"]),
        (&["--link-radius", "-3"], ["--link-radius", "0 up to the reach"]),
        (&["--floor", "nan"], ["--floor", "mm"]),
        (&["--keep-out=-900,-900,-900,900,900,900"], ["box to keep out of", "smaller"]),
    ] {
        let (code, _, err) = truegrind(at, &[&base[..], wrong, &["-o", "none.mod"]].concat());
        assert!(code == 2 && words.iter().all(|word| err.contains(word)), "{wrong:?}: {err}");
        assert!(!at.join("none.mod").exists());
    }
}

#[test]
fn a_program_with_fewer_motions_was_not_rewritten_from_the_intended_one() {
    let dir = shop();
    let at = dir.path();
    let whole = fs::read_to_string(at.join("blade.mod")).unwrap();
    let mut shorter: Vec<&str> = whole.lines().collect();
    let last = shorter.iter().rposition(|line| line.trim_start().starts_with("MoveL")).unwrap();
    shorter.remove(last);
    fs::write(at.join("shorter.mod"), shorter.join("\n")).unwrap();
    let arguments = ["deviation", "shorter.mod", "--intended", "blade.mod", "--model", "model.toml"];
    let (code, out, err) = truegrind(at, &arguments);
    assert_eq!(code, 2, "{out}");
    assert!(err.contains("447 motions") && err.contains("--intended has 448"), "{err}");
}

/// A file in the place of another kind is called what it is, and not what a parser of the expected kind makes of its first line.
#[test]
fn a_file_in_the_wrong_place_is_told_what_it_is() {
    let dir = shop();
    let at = dir.path();
    fs::write(at.join("cell.toml"), "[[tool]]\nname = \"t\"\norigin = \"metrology\"\n").unwrap();
    fs::write(at.join("empty.toml"), "\n").unwrap();
    fs::write(at.join("broken.toml"), "robot = \"abb-irb-120\"\n[poses]\nkind = \"any\"\n[sensor]\n")
        .unwrap();
    let ur5 = ["path", "blade.toml", "--robot", "universal-robots-ur5", "-o", "ur.mod"];
    let (code, _, err) =
        truegrind(at, &["compensate", "blade.mod", "--model", "model.toml", "-o", "real.mod"]);
    assert!(code < 2, "{err}");
    for (arguments, words) in [
        (
            &["deviation", "blade.mod", "--intended", "real.mod", "--model", "model.toml"][..],
            ["itself corrected (with model ", "the two programs are swapped"],
        ),
        (
            &["path", "blade.mod", "--robot", "abb-irb-120", "-o", "x.mod"],
            ["this is a RAPID program", "expected a surface file"],
        ),
        (&["simulate", "blade.mpf", "-o", "x.csv"], ["this is an NC program", "expected a recipe"]),
        (
            &["compensate", "blade.mod", "--model", "cell.toml", "-o", "x.mod"],
            ["this is a cell file, which --cell reads", "expected a model file"],
        ),
        (
            &["identify", "poses.csv", "--robot", "abb-irb-120", "-o", "x.xlsx"],
            ["a model file is TOML", "not .xlsx"],
        ),
        (
            &["identify", "blade.mod", "--robot", "abb-irb-120"],
            ["this is a RAPID program", "expected measurements"],
        ),
        (
            &["compensate", "blade.mod", "--model", "blade.nc", "-o", "x.mod"],
            ["this is an NC program", "expected a model file"],
        ),
        (&["simulate", "model.toml", "-o", "x.csv"], ["this is a model file", "docs/simulate.md"]),
        (
            &["simulate", "broken.toml", "-o", "x.csv"],
            ["broken.toml: not a recipe: line", "docs/simulate.md"],
        ),
        (
            &["identify", "model.toml", "--robot", "abb-irb-120"],
            ["this is a model file, which --model reads", "expected measurements"],
        ),
        (
            &["diagnose", "poses.csv", "--robot", "abb-irb-120", "--also", "cell.toml"],
            ["this is a cell file, which --cell reads", "expected measurements"],
        ),
        (
            &["accept", "blade.toml", "--model", "model.toml", "--tolerance", "1"],
            ["this is a surface file, which path and --surface read", "expected measurements"],
        ),
        (
            &["accept", "poses.csv", "--model", "poses.csv", "--tolerance", "1"],
            [
                "these are measurements, which identify, diagnose, track and accept read",
                "expected a model file",
            ],
        ),
        (
            &["compensate", "blade.mod", "--model", "blade.toml", "-o", "x.mod"],
            ["this is a surface file", "expected a model file"],
        ),
        (
            &["compensate", "blade.mod", "--model", "model.toml", "-o", "x.mod", "--cell", "blade.mod"],
            ["this is a RAPID program", "expected a cell file"],
        ),
        (
            &["compensate", "blade.mod", "--model", "model.toml", "-o", "x.mod", "--cell", "empty.toml"],
            ["this file is empty", "expected a cell file"],
        ),
        (
            &["compensate", "poses.csv", "--model", "model.toml", "-o", "x.mod"],
            ["these are measurements", "expected a program: RAPID"],
        ),
        (
            &["deviation", "model.toml", "--model", "model.toml"],
            ["this is a model file", "expected a program: RAPID"],
        ),
        (&["cell", "poses.csv", "-o", "x.toml"], ["these are measurements", "expected a program: RAPID"]),
        (
            &["deviation", "blade.mod", "--model", "model.toml", "--actual", "model.toml"],
            ["this is a model file", "expected an arm file of `simulate --arm`"],
        ),
        (
            &["identify", "poses.csv", "--robot", "model.toml"],
            ["this is a model file", "expected a robot file"],
        ),
        (&["robots", "--check", "poses.csv"], ["these are measurements", "expected a robot file"]),
        (
            &["plan", "--robot", "abb-irb-120", "--sensor", "tracker", "--for", "poses.csv"],
            ["these are measurements", "expected a diagnosis"],
        ),
        (
            &["compare", "poses.csv", "--robot", "abb-irb-120", "--experiment", "cell.toml"],
            ["this is a cell file", "expected an experiment"],
        ),
        (&["gather", "poses.csv"], ["poses.csv: is a file", "expected the folder of a run"]),
        (
            &["identify", "poses.csv", "--robot", "abb-irb-120", "--json", "x.csv"],
            ["x.csv: JSON is written here", "expected the extension .json, not .csv"],
        ),
        (
            &["identify", "poses.csv", "--robot", "abb-irb-120", "--html", "x.toml"],
            ["an HTML page is written here", "not .toml"],
        ),
        (&["robots", "--json", "x.html"], ["JSON is written here", "not .html"]),
        (
            &["compensate", "blade.mod", "--model", "model.toml", "-o", "x.mod", "--tolerance", "50"],
            ["--tolerance 50: expected a length above 0 in mm", "up to 10 (50 µm are 0.05)"],
        ),
        (
            &["compensate", "blade.mod", "--model", "model.toml", "-o", "x.mod", "--max-correction", "1000"],
            ["--max-correction 1000: expected a length above 0 in mm", "up to 100"],
        ),
        (
            &["deviation", "blade.mod", "--model", "model.toml", "--tolerance", "inf"],
            ["--tolerance inf: expected a length above 0 in mm", "up to 10"],
        ),
        (
            &["accept", "poses.csv", "--model", "model.toml", "--tolerance", "300"],
            ["the tolerance 300: expected a length above 0 in mm", "up to 100"],
        ),
        (
            &["plan", "--robot", "abb-irb-120", "--sensor", "tracker", "--touched-point", "0,0,60000"],
            ["--touched-point 0,0,60000: 60000 mm from the flange", "the arm itself reaches"],
        ),
        (
            &["track", "poses.csv", "--model", "model.toml", "--follow", "1e6"],
            ["--follow 1000000: expected seconds above 0", "up to 86400"],
        ),
        (
            &["track", "poses.csv", "--model", "model.toml", "--first-poses", "0"],
            ["--first-poses 0", "expected at least 4"],
        ),
        (
            &["plan", "--robot", "abb-irb-120", "--sensor", "tracker", "--settle", "1e300"],
            ["--settle", "expected seconds, up to 86400"],
        ),
        (
            &["plan", "--robot", "abb-irb-120", "--sensor", "tracker", "--candidates", "0"],
            ["--candidates 0: expected 1 to 100000", "2000 are usual"],
        ),
        (
            &["diagnose", "poses.csv", "--robot", "abb-irb-120", "--most", "0"],
            ["--most 0: expected 1 to 200 causes", "`truegrind identify`"],
        ),
        (&["simulate", "model.toml", "-o", "x.xlsx"], ["CSV is written here", "x.xlsx"]),
        (
            &["identify", "poses.csv", "--robot", "abb-irb-120", "--csv", "x.xlsx"],
            ["CSV is written here", "x.xlsx"],
        ),
        (
            &["deviation", "real.mod", "--intended", "blade.nc", "--model", "model.toml"],
            ["this is RAPID, but the program of --intended is NC code", "from which it was rewritten"],
        ),
        (
            &["path", "blade.toml", "--robot", "abb-irb-120", "-o", "x.h"],
            ["written as RAPID (.mod), Fanuc style (.nc) or 840D (.mpf)", "not as .h"],
        ),
        (
            &["plan", "--robot", "abb-irb-120", "--sensor", "tracker", "--sigma", "30"],
            ["expected mm, up to 10", "30 µm are 0.03"],
        ),
        (
            &["identify", "poses.csv", "--robot", "abb-irb-120", "--touched-point", "40", "0", "60"],
            ["unexpected argument '0'", "with commas between them: 40,0,60"],
        ),
        (
            &["identify", "poses.csv", "--robot", "abb-irb-120", "--seed", "-1"],
            ["invalid value '-1' for '--seed", "invalid digit"],
        ),
    ] {
        let (code, out, err) = truegrind(at, arguments);
        assert_eq!(code, 2, "{arguments:?}: {out}{err}");
        assert!(words.iter().all(|word| err.contains(word)), "{arguments:?}: {err}");
    }
    // RAPID for an arm that does not read it is written, with a note.
    let plan = [
        "plan",
        "--robot",
        "universal-robots-ur5",
        "--sensor",
        "tracker",
        "--poses",
        "20",
        "-o",
        "ur-poses.mod",
    ];
    for verb in [&ur5[..], &plan] {
        let (code, _, err) = truegrind(at, verb);
        assert!(code == 0 && err.contains("reads URScript"), "{verb:?}: {err}");
    }
    let (_, _, err) = truegrind(at, &["path", "blade.toml", "--robot", "abb-irb-120", "-o", "abb.mod"]);
    assert!(!err.contains("translated"), "{err}");
}

/// What Excel leaves beside an open workbook is no arm of a fleet, and a workbook that is not read is named.
#[test]
fn other_files_of_a_folder_of_arms_are_passed_over_with_a_word() {
    let dir = folder();
    let at = dir.path();
    fs::create_dir(at.join("fleet")).unwrap();
    fs::write(at.join("fleet/arm.csv"), POSES).unwrap();
    fs::write(at.join("fleet/~$arm.xlsx"), "owner").unwrap();
    fs::write(at.join("fleet/old.xls"), "old").unwrap();
    let (code, out, err) = truegrind(at, &["diagnose", "fleet", "--robot", "abb-irb-120"]);
    assert!(code < 2 && out.contains("Diagnosis of 1 arm") && !out.contains("[failed]"), "{out}{err}");
    assert!(err.contains("arm.xlsx is open in Excel") && err.contains("save it as XLSX"), "{err}");
}
