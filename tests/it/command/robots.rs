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
