//! Robots of one's own, in and out again.

use std::fs;

use super::{CABLE, folder, truegrind};

const URDF: &str = include_str!("../../../crates/arm/tests/data/tool-turned.urdf");
const TWO: &str = include_str!("../../../crates/arm/tests/data/two-arms.urdf");

#[test]
fn what_is_understood_of_a_file_is_told_and_goes_to_a_robot_file() {
    let dir = folder();
    let at = dir.path();
    fs::write(at.join("arm.urdf"), URDF).unwrap();
    fs::write(at.join("cell.urdf"), TWO).unwrap();
    let (code, out, err) =
        truegrind(at, &["robots", "--check", "arm.urdf", "-o", "arm.toml", "--html", "page.html"]);
    assert_eq!(code, 0, "{err}");
    for words in
        ["zero pose: all joints at 0°", "(394.000, 0.000, 640.000) mm", "J4 +x", "Compare zero pose and axes"]
    {
        assert!(out.contains(words), "{words}: {out}");
    }
    let page = fs::read_to_string(at.join("page.html")).unwrap();
    assert!(page.contains("<svg") && page.contains("Compare with the manual."));
    // The file and the robot file that was written of it are one robot to every verb.
    let (_, ours, _) = truegrind(at, &["robots", "arm.toml"]);
    let (_, theirs, _) = truegrind(at, &["robots", "arm.urdf"]);
    assert_eq!(ours, theirs);

    let (code, _, err) = truegrind(at, &["robots", "--check", "cell.urdf"]);
    assert!(code == 2 && err.contains("2 arms of six joints"), "{err}");
    let (code, _, err) = truegrind(
        at,
        &[
            "robots",
            "--check",
            "cell.urdf",
            "--base",
            "left_base_link",
            "--tip",
            "left_tool0",
            "-o",
            "left.toml",
        ],
    );
    assert_eq!(code, 0, "{err}");
    // Every verb that needs a robot takes the links too, and the arm between them is that of the robot file.
    let between = |robot: &'static str, links: &[&'static str]| {
        let plan = [
            "plan",
            "--sensor",
            "position",
            "--poses",
            "8",
            "--candidates",
            "60",
            "--json",
            "--robot",
            robot,
        ];
        truegrind(at, &[&plan[..], links].concat())
    };
    let links = ["--base", "left_base_link", "--tip", "left_tool0"];
    let (code, one, err) = between("cell.urdf", &links);
    assert_eq!(code, 0, "{err}");
    let (_, other, _) = between("left.toml", &[]);
    assert_eq!(one.replace("cell-urdf", "left"), other.replace("cell-urdf", "left"));
    assert!(one.contains("truegrind.plan/1"), "{one}");
    let (code, _, err) = between("cell.urdf", &[]);
    assert!(code == 2 && err.contains("--base LINK --tip LINK"), "{err}");
    let (code, _, err) = between("cell.urdf", &["--tip", "left_hand"]);
    assert!(code == 2 && err.contains("left_hand"), "{err}");
    let (code, _, err) = between("abb-irb-120", &links);
    assert!(code == 2 && err.contains("name links of a URDF: omit them"), "{err}");
    let (code, _, err) = between("arm.toml", &links);
    assert!(code == 2 && err.contains("links of a URDF"), "{err}");
    let (code, _, err) = truegrind(
        at,
        &[
            "measurement",
            "template",
            "--robot",
            "cell.urdf",
            "--base",
            "left_base_link",
            "--tip",
            "left_tool0",
            "-o",
            "empty.csv",
        ],
    );
    assert!(code == 0 && err.contains("for each pose of cell-urdf"), "{err}");
    let (code, _, err) = truegrind(at, &["robots", "--check", "arm.urdf", "-o", "arm.csv"]);
    assert!(code == 2 && err.contains("expected the extension .toml"), "{err}");
    let (code, _, err) = truegrind(at, &["identify", "none.csv", "--robot", "arm.step"]);
    assert!(code == 2 && err.contains("arm.step"), "{err}");
}

/// An arm on a plate beside the base of its file: positions count from a base on axis 1, and whoever fits it is told.
#[test]
fn an_arm_beside_the_base_of_its_file_is_noted() {
    let dir = folder();
    let at = dir.path();
    fs::write(at.join("arm.urdf"), URDF).unwrap();
    fs::write(at.join("beside.urdf"), URDF.replace("xyz=\"0 0 0.29\"", "xyz=\"0.03 -0.02 0.29\"")).unwrap();
    let recipe = "robot = \"arm.urdf\"\nseed = 1\n[poses]\nkind = \"random\"\ncount = 60\n[sensor]\nkind = \"position\"\n\
                  frame = { position_mm = [1500.0, 0.0, 500.0], wxyz = [1, 0, 0, 0] }\nreflector_mm = [0, 0, 0]\n\
                  [noise]\nsigma_mm = 0.02\n";
    fs::write(at.join("recipe.toml"), recipe).unwrap();
    let (code, _, err) = truegrind(at, &["simulate", "recipe.toml", "-o", "rows.csv"]);
    assert_eq!(code, 0, "{err}");
    let told = |robot: &str| {
        let (_, out, err) = truegrind(at, &["identify", "rows.csv", "--robot", robot]);
        let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
        words(&format!("{out} {err}"))
    };
    let beside = told("beside.urdf");
    assert!(beside.contains("lies at (30.000, -20.000, 0.000) mm in the file's"), "{beside}");
    assert!(beside.contains("Sensor frames and the positions of programs count from that base"), "{beside}");
    let plain = told("arm.urdf");
    assert!(plain.contains("held-out") && !plain.contains("axis 1 is not"), "{plain}");
}

/// The class: a verb that takes a robot file, and not the links between which a URDF's arm is.
#[test]
#[cfg(feature = "visual")]
fn every_verb_that_takes_a_robot_takes_the_links_of_a_urdf() {
    let dir = folder();
    let at = dir.path();
    fs::write(at.join("cell.urdf"), TWO).unwrap();
    let links = ["--robot", "cell.urdf", "--base", "left_base_link", "--tip", "left_tool0"];
    let (code, _, err) = truegrind(
        at,
        &["robots", "--check", "cell.urdf", links[2], links[3], links[4], links[5], "-o", "left.toml"],
    );
    assert_eq!(code, 0, "{err}");
    let recipe = include_str!("../../data/irb120-cable.toml");
    let recipe = recipe.replace("robot = \"abb-irb-120\"", "robot = \"left.toml\"");
    fs::write(at.join("recipe.toml"), recipe).unwrap();
    let (code, _, err) = truegrind(at, &["simulate", "recipe.toml", "-o", "rows.csv"]);
    assert_eq!(code, 0, "{err}");
    fs::write(
        at.join("mine.toml"),
        "name = \"mine\"\ntitle = \"Mine\"\npaper = \"ours\"\n[methods]\nreference = \"A\"\n[methods.protocol]\nrows = \
         60\nheld_out = 0.2\ncases = 2\n[[methods.method]]\nid = \"A\"\nname = \"LM\"\nsolver = \"lm\"\ntreatment = \
         \"sound\"\n",
    )
    .unwrap();
    for verb in [
        &[
            "plan",
            "--sensor",
            "position",
            "--poses",
            "8",
            "--candidates",
            "60",
            "-o",
            "poses.mod",
            "--rrd",
            "1.rrd",
        ][..],
        &["identify", "rows.csv", "-o", "model.toml", "--allow-doubtful", "--rrd", "2.rrd"],
        &["diagnose", "rows.csv", "--most", "1", "--rrd", "3.rrd"],
        &["compare", "rows.csv", "--experiment", "mine.toml", "--rrd", "4.rrd"],
        &["view", "rows.csv", "--rrd", "5.rrd"],
        &["view", "rows.csv", "--model", "model.toml", "--rrd", "6.rrd"],
        &["track", "rows.csv", "--model", "model.toml", "-o", "tracks", "--rrd", "7.rrd"],
        &["export", "model.toml", "--to", "urdf", "--data", "rows.csv", "-o", "made.urdf"],
        &["cell", "poses.mod", "-o", "cell.toml"],
        &["compensate", "poses.mod", "--model", "model.toml", "--allow-doubtful", "--dry-run"],
        &["deviation", "poses.mod", "--model", "model.toml", "--rrd", "8.rrd"],
    ] {
        let (code, _, err) = truegrind(at, &[verb, &links[..2]].concat());
        assert!(code == 2 && err.contains("--base LINK --tip LINK"), "{verb:?}: {err}");
        let (code, _, err) = truegrind(at, &[verb, &links[..]].concat());
        assert!(code < 2, "{verb:?}: {err}");
    }
}

/// What is exported is judged by itself: a model with effects is not its links.
#[test]
fn what_is_exported_says_its_own_error() {
    let dir = folder();
    let at = dir.path();
    fs::write(at.join("poses.csv"), CABLE).unwrap();
    for (verb, model) in [("identify", "links.toml"), ("diagnose", "whole.toml")] {
        let (code, _, err) =
            truegrind(at, &[verb, "poses.csv", "--robot", "abb-irb-120", "-o", model, "--allow-doubtful"]);
        assert!(code < 2, "{err}");
    }
    let export = |model: &str, more: &[&str]| truegrind(at, &[&["export", model, "--to"], more].concat());
    let (code, out, err) = export("links.toml", &["urdf", "-o", "-"]);
    assert!(code == 0 && out.contains("<!-- held-out error of these links: 0."), "{out}{err}");
    let (code, out, err) = export("whole.toml", &["dh-csv", "-o", "-"]);
    assert!(code == 1 && out.contains("# held-out error of these links alone: not evaluated"), "{out}{err}");
    assert!(out.contains("# effects beyond rigid links are left out: joint-compliance"), "{out}");
    let (code, out, err) = export("whole.toml", &["mdh-csv", "-o", "-", "--data", "poses.csv"]);
    assert!(
        code == 1 && out.contains("to which the model was fitted, so this is not a held-out error"),
        "{out}{err}"
    );
    // Each format by rows that the fit has not seen, read back as its user reads it: the links of this arm are the model.
    let recipe = include_str!("../../data/irb120-cable.toml");
    let seed = recipe.lines().find(|line| line.starts_with("seed =")).unwrap();
    fs::write(at.join("later.toml"), recipe.replacen(seed, "seed = 4711", 1)).unwrap();
    let (code, _, err) = truegrind(at, &["simulate", "later.toml", "-o", "later.csv"]);
    assert_eq!(code, 0, "{err}");
    let number = |text: &str, after: &str| -> f64 {
        text.split(after).nth(1).and_then(|rest| rest.split(' ').next()).unwrap().parse().unwrap()
    };
    let (code, _, err) = export("links.toml", &["ur-yaml", "-o", "arm.yaml"]);
    assert!(code == 2 && err.contains("made by ABB") && err.contains("dh-csv"), "{err}");
    assert!(!at.join("arm.yaml").exists());
    for form in ["urdf", "dh-csv", "mdh-csv"] {
        let (code, out, err) = export("links.toml", &[form, "-o", "-", "--data", "later.csv"]);
        assert!(code == 0 && out.contains("to which the model was not fitted"), "{form}: {out}{err}");
        let (links, whole) = (number(&out, "sensor frame fitted: "), number(&out, "whole model "));
        assert!((links - whole).abs() < 2e-4 && links > 0.01, "{form}: {links} {whole}");
        let (_, out, _) = export("whole.toml", &[form, "-o", "-", "--data", "later.csv"]);
        let (links, whole) = (number(&out, "sensor frame fitted: "), number(&out, "whole model "));
        assert!(links > whole, "{form}: {links} {whole}");
    }
    // And back in again.
    let (code, _, err) = export("links.toml", &["urdf", "-o", "links.urdf"]);
    assert_eq!(code, 0, "{err}");
    let (code, out, err) = truegrind(at, &["robots", "--check", "links.urdf"]);
    assert!(code == 0 && out.contains("zero pose"), "{out}{err}");
    let (code, _, err) = export("nominal", &["urdf", "-o", "-"]);
    assert!(code == 2 && err.contains("expected a model file"), "{err}");
}

/// The way to state that an arm of the catalogue hangs: its data sheet as a file, with another gravity.
#[test]
fn an_arm_of_the_catalogue_is_written_as_a_file() {
    let dir = folder();
    let at = dir.path();
    let (code, _, err) = truegrind(at, &["robots", "abb-irb-120", "-o", "mine.toml"]);
    assert_eq!(code, 0, "{err}");
    let text = fs::read_to_string(at.join("mine.toml")).unwrap();
    assert!(text.contains("[robot.mounting]") && text.contains("gravity = [0.0, 0.0, -1.0]"), "{text}");
    let (_, sheet, _) = truegrind(at, &["robots", "abb-irb-120"]);
    let (code, mine, err) = truegrind(at, &["robots", "mine.toml"]);
    assert_eq!((code, mine), (0, sheet), "{err}");
    let (code, _, err) = truegrind(at, &["robots", "abb-irb-120", "--html", "arm.html"]);
    assert!(code == 2 && err.contains("--check FILE"), "{err}");
    let (code, _, err) = truegrind(at, &["robots", "-o", "mine.toml"]);
    assert!(code == 2 && err.contains("Give its name"), "{err}");
    let (code, _, err) = truegrind(at, &["robots", "mine.toml", "-o", "mine.toml"]);
    assert!(code == 2 && err.contains("mine.toml"), "{err}");
}

/// A robot file with a `[robot.flange]` of its own is the same arm under the same load, and a recipe finds its robot file beside itself.
#[test]
fn a_load_is_stated_in_the_flange_frame_of_every_robot_file() {
    let dir = folder();
    let at = dir.path();
    fs::create_dir(at.join("arms")).unwrap();
    let (code, _, err) = truegrind(at, &["robots", "abb-irb-120", "-o", "arms/plain.toml"]);
    assert_eq!(code, 0, "{err}");
    let plain = fs::read_to_string(at.join("arms/plain.toml")).unwrap();
    // The last link ends turned by 90° about x, and the flange turns back.
    let (before, last) = plain.split_at(plain.rfind("[[robot.link]]").unwrap());
    let turned = last
        .replacen("alpha_deg = 0.0", "alpha_deg = 90.0", 1)
        .replacen("[robot.joints]", "[robot.flange]\nposition_mm = [0.0, 0.0, 0.0]\nquaternion_wxyz = [0.7071067811865476, -0.7071067811865476, 0.0, 0.0]\n\n[robot.joints]", 1);
    assert!(turned.contains("alpha_deg = 90.0") && turned.contains("[robot.flange]"));
    fs::write(at.join("arms/turned.toml"), format!("{before}{turned}")).unwrap();
    let readings = |robot: &str, loads: &str| -> Vec<f64> {
        let recipe = format!(
            "robot = \"{robot}\"\nseed = 1\n[[arm.effect]]\neffect = \"joint-compliance\"\njoint = 1\ncompliance_rad_per_nm = 1e-4\n\
             [poses]\nkind = \"list\"\njoints_deg = [[10.0, 20.0, -30.0, 40.0, 50.0, 60.0], [0.0, 30.0, 10.0, 90.0, 80.0, 0.0]]\n\
             [circumstances]\n{loads}\n[sensor]\nkind = \"position\"\nframe = {{ position_mm = [0.0, 0.0, 0.0], wxyz = [1.0, 0.0, 0.0, \
             0.0] }}\nreflector_mm = [0.0, 0.0, 0.0]\n[noise]\nsigma_mm = 0.0\n"
        );
        fs::write(at.join("arms/recipe.toml"), recipe).unwrap();
        let (code, out, err) = truegrind(at, &["simulate", "arms/recipe.toml", "-o", "-"]);
        assert_eq!(code, 0, "{err}");
        let measured = |line: &str| -> Vec<f64> {
            line.split(',').skip(6).take(3).map(|c| c.parse().unwrap()).collect()
        };
        assert!(out.lines().next().unwrap().split(',').nth(6) == Some("measured_x"), "{out}");
        out.lines().skip(1).flat_map(measured).collect()
    };
    let load = "payload_kg = [3.0]\npayload_centre_mm = [0.0, 0.0, 100.0]";
    let (one, other) = (readings("plain.toml", load), readings("turned.toml", load));
    let without = readings("plain.toml", "payload_kg = [0.0]");
    let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    // The masses of the link itself were not turned with its frame: less than a micrometre.
    assert!(apart(&one, &other) < 2e-3, "{one:?} {other:?}");
    assert!(apart(&one, &without) > 0.1, "{one:?} {without:?}");
}

/// A URDF of an arm on a wall, and a model of an arm that is not in the catalogue.
#[test]
fn how_an_arm_is_mounted_is_told() {
    let dir = folder();
    let at = dir.path();
    fs::write(at.join("cell.urdf"), TWO).unwrap();
    let links = ["--base", "right_base_link", "--tip", "right_tool0", "-o", "right.toml"];
    let (code, out, err) = truegrind(at, &[&["robots", "--check", "cell.urdf"][..], &links].concat());
    let words = out.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        code == 0 && words.contains("mounting: the arm is on a wall (gravity points along "),
        "{out}{err}"
    );
    let written = fs::read_to_string(at.join("right.toml")).unwrap();
    let gravity = written.lines().find(|line| line.starts_with("gravity = ")).unwrap();
    assert!(!gravity.contains("[0.0, 0.0, -1.0]"), "{gravity}");
}

#[test]
fn what_else_a_robot_of_ones_own_needs_is_said() {
    let dir = folder();
    let at = dir.path();
    fs::write(at.join("data.csv"), CABLE).unwrap();
    let (code, _, err) = truegrind(at, &["robots", "abb-irb-120", "-o", "catalogue.toml"]);
    assert_eq!(code, 0, "{err}");
    let own =
        fs::read_to_string(at.join("catalogue.toml")).unwrap().replacen("\"abb-irb-120\"", "\"mine\"", 1);
    fs::write(at.join("mine.toml"), own).unwrap();
    let identify = ["identify", "data.csv", "--robot", "mine.toml", "-o", "m.toml", "--allow-doubtful"];
    let (code, _, err) = truegrind(at, &identify);
    assert!(code < 2, "{err}");
    let export = ["export", "m.toml", "--to", "dh-csv", "-o", "-", "--data", "data.csv"];
    let accept =
        ["accept", "data.csv", "--model", "m.toml", "--tolerance", "1", "--sensor-uncertainty", "0.02"];
    for run in [&export[..], &accept] {
        let (code, _, err) = truegrind(at, run);
        assert!(
            code == 2 && err.contains("mine, is not in the catalogue") && err.contains("--robot FILE"),
            "{err}"
        );
    }
    let (code, _, err) = truegrind(at, &[&export[..], &["--robot", "mine.toml"]].concat());
    assert!(code < 2, "{err}");
    let (code, _, err) = truegrind(at, &["identify", "-", "--robot", "abb-irb-120"]);
    assert!(code == 2 && err.contains("read from files, not from stdin"), "{err}");
}
