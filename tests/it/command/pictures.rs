//! Recordings of verbs that have no path: that they are written, whole, with the arm.

use std::fs;
use std::path::Path;

use super::{CABLE, folder, truegrind};

const URDF: &str = include_str!("../../../crates/arm/tests/data/gripper.urdf");

/// What an `.rrd` file begins with.
fn is_recording(path: &Path) -> bool {
    fs::read(path).is_ok_and(|bytes| bytes.starts_with(b"RRF"))
}

/// The class: a verb that offers a recording as all do, and has none.
#[test]
fn every_verb_that_has_an_arm_records_it() {
    let dir = folder();
    let at = dir.path();
    fs::write(at.join("data.csv"), CABLE).unwrap();
    let robot = ["--robot", "abb-irb-120"];
    fs::write(
        at.join("mine.toml"),
        "name = \"mine\"\ntitle = \"Mine\"\npaper = \"ours\"\n[methods]\nreference = \"B\"\n[methods.protocol]\nrows = \
         60\nheld_out = 0.2\ncases = 2\n[[methods.method]]\nid = \"A\"\nname = \"EKF\"\nsolver = \"ekf\"\ntreatment = \
         \"sound\"\n[[methods.method]]\nid = \"B\"\nname = \"LM\"\nsolver = \"lm\"\ntreatment = \"sound\"\n",
    )
    .unwrap();
    for (stem, verb) in [
        ("id", [&["identify", "data.csv", "-o", "model.toml"][..], &robot].concat()),
        (
            "plan",
            [
                &[
                    "plan",
                    "--sensor",
                    "cable",
                    "--outlet",
                    "750,200,40",
                    "--poses",
                    "8",
                    "--candidates",
                    "100",
                ][..],
                &["--keep-out", "-900,-900,0,-600,900,900"],
                &robot,
            ]
            .concat(),
        ),
        ("track", vec!["track", "data.csv", "--model", "model.toml", "-o", "tracks"]),
        ("compare", [&["compare", "data.csv", "--experiment", "mine.toml"][..], &robot].concat()),
    ] {
        let picture = format!("{stem}.rrd");
        let (code, _, err) = truegrind(at, &[&verb[..], &["--rrd", &picture]].concat());
        assert!(code < 2, "{stem}: {err}");
        assert!(is_recording(&at.join(&picture)), "{stem}: {err}");
    }
}

/// Meshes that a robot file names are drawn where they are found and are STL; what is not drawn is said, and is no error.
#[test]
fn meshes_of_a_robot_file_are_drawn_or_missed_by_name() {
    let dir = folder();
    let at = dir.path();
    let visual = |link: &str, file: &str| {
        let shown = format!("<visual><geometry><mesh filename=\"{file}\"/></geometry></visual>");
        (format!("<link name=\"{link}\"/>"), format!("<link name=\"{link}\">{shown}</link>"))
    };
    let mut text = URDF.to_owned();
    for (empty, full) in
        [visual("link_2", "package://arm/meshes/link_2.stl"), visual("link_3", "meshes/link_3.dae")]
    {
        assert!(text.contains(&empty));
        text = text.replace(&empty, &full);
    }
    fs::create_dir_all(at.join("arm/urdf")).unwrap();
    fs::create_dir_all(at.join("arm/meshes")).unwrap();
    fs::write(at.join("arm/urdf/arm.urdf"), text).unwrap();
    let stl = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 0.1 0 0\nvertex 0 0.1 0\nendloop\nendfacet\n\
               endsolid s\n";
    let plan = |rrd: &str| {
        let verb = ["plan", "--robot", "arm/urdf/arm.urdf", "--sensor", "cable", "--outlet", "600,200,40"];
        let few = ["--poses", "6", "--candidates", "100", "--rrd", rrd];
        truegrind(at, &[&verb[..], &few].concat())
    };
    let (code, _, err) = plan("bare.rrd");
    assert!(code < 2 && err.contains("2 of its meshes are not drawn"), "{err}");
    fs::write(at.join("arm/meshes/link_2.stl"), stl).unwrap();
    let (code, _, err) = plan("shown.rrd");
    assert!(code < 2 && err.contains("1 of its meshes are not drawn (meshes/link_3.dae)"), "{err}");
    assert_ne!(fs::read(at.join("bare.rrd")).unwrap(), fs::read(at.join("shown.rrd")).unwrap());
    // A mesh that is none is named, and no picture is written without it.
    fs::write(at.join("arm/meshes/link_2.stl"), "no mesh").unwrap();
    let (code, _, err) = plan("never.rrd");
    assert!(code == 2 && err.contains("link_2.stl") && err.contains("STL"), "{err}");
    assert!(!at.join("never.rrd").exists());
}
