//! Arms that somebody else described. The poses were computed from the same files by yourdfpy 0.0.60, which shares no code with
//! this project; the files are our own, of arms that do not exist.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use truegrind_arm::condition::Condition;
use truegrind_arm::model::{Joints, Model};
use truegrind_arm::robots::foreign::{ImportOptions, ImportedRobot, Kind, import};
use truegrind_arm::robots::{RobotError, load, parse, to_toml};

const TURNED: &str = include_str!("../data/tool-turned.urdf");
const GRIPPER: &str = include_str!("../data/gripper.urdf");
const TWO: &str = include_str!("../data/two-arms.urdf");
const SEVEN: &str = include_str!("../data/seven.urdf");
const PARALLEL: &str = include_str!("../data/parallel.urdf");

const JOINTS: [[f64; 6]; 3] =
    [[0.0; 6], [0.3, -0.4, 0.5, -0.6, 0.7, -0.8], [-2.1, 0.9, -1.2, 1.7, -1.1, 2.9]];

/// Position of the flange (mm) and its z axis.
type Pose = ([f64; 3], [f64; 3]);

const WORKSHOP: [Pose; 3] = [
    ([394.0, 0.0, 640.0], [1.0, 0.0, 0.0]),
    (
        [268.8411568850024, 55.747689665817326, 544.5985312512237],
        [0.78381732465919, -0.13829557654562305, -0.6053963454399306],
    ),
    (
        [-323.9941062736792, -427.9376604180919, 625.7084215152697],
        [-0.9987860705590389, 0.042819952867254346, 0.02434824210657471],
    ),
];

fn only_tip(base: &str, tip: &str) -> ImportOptions {
    ImportOptions { base: Some(base.to_owned()), tip: Some(tip.to_owned()), ground_joint_3: false }
}

fn meets(arm: &Model, base: Vector3<f64>, poses: &[Pose; 3]) {
    for (joints, (place, z)) in JOINTS.iter().zip(poses) {
        let flange = arm.forward(&Joints::from(*joints), &Condition::default());
        let off = (flange.translation.vector + base - Vector3::from(*place)).norm();
        assert!(off < 1e-9, "{off:e} mm");
        let off = (flange.rotation * Vector3::z() - Vector3::from(*z)).norm();
        assert!(off < 1e-12, "{off:e}");
    }
}

fn read(text: &str, file: &str, choice: &ImportOptions) -> ImportedRobot {
    import(text, file, choice).unwrap_or_else(|error| panic!("{error}"))
}

fn refused(text: &str, file: &str, choice: &ImportOptions, words: &[&str]) {
    let said = import(text, file, choice).map(|found| found.robot.sheet.name).unwrap_err().to_string();
    for word in words {
        assert!(said.contains(word), "{word}: {said}");
    }
    assert!(said.starts_with(file), "{said}");
}

/// A tool frame that is turned against the last link, fixed joints, a world above the base, and a gripper behind the flange.
#[test]
fn a_turned_tool_and_whatever_is_fixed_belong_to_the_links() {
    for (text, file) in [(TURNED, "turned.urdf"), (GRIPPER, "gripper.urdf")] {
        let found = read(text, file, &ImportOptions::default());
        assert_eq!(found.kind, Kind::Urdf);
        meets(&found.robot.model, Vector3::zeros(), &WORKSHOP);
        let told = found.summary.join("\n");
        assert!(told.contains("from link world to link tool0"), "{told}");
        assert!(told.contains("all joints at 0° put the flange at (394.000, 0.000, 640.000) mm"), "{told}");
        assert!(told.contains("J1 +z, J2 +y, J3 +y, J4 +x, J5 +y, J6 +x"), "{told}");
        assert!(told.contains("its z points along +x") && told.contains("a closed form is known"), "{told}");
        assert!(told.contains("no range is stated of joint_4"), "{told}");
        let limits = &found.robot.model.limits;
        assert!((limits.max_rad[2] - 1.2).abs() < 1e-12 && (limits.min_rad[2] + 1.9).abs() < 1e-12);
        assert!((limits.max_rad[3].to_degrees() - 360.0).abs() < 1e-9);
    }
    // What was read goes to a robot file and back.
    let found = read(TURNED, "arms/turned.urdf", &ImportOptions::default()).robot;
    let again = parse(&to_toml(&found).unwrap(), "turned.toml").unwrap();
    assert_eq!((again.model, again.sheet.name.as_str()), (found.model, "turned-urdf"));
}

/// Meshes move with the frames of their links, whatever frames we lay through the arm; what hangs on a finger is none of the arm's.
#[test]
fn meshes_are_named_with_the_frames_that_they_move_with() {
    let visual = |file: &str| {
        format!(
            "<visual><origin xyz=\"0.01 0.02 0.03\"/><geometry><mesh filename=\"{file}\" scale=\"0.001 0.001 0.001\"/>\
             </geometry></visual>"
        )
    };
    let mut text = GRIPPER.to_owned();
    for link in ["base_link", "link_3", "flange", "finger_a"] {
        let empty = format!("<link name=\"{link}\"/>");
        assert!(text.contains(&empty), "{link}");
        text =
            text.replace(&empty, &format!("<link name=\"{link}\">{}</link>", visual(&format!("{link}.stl"))));
    }
    let found = read(&text, "gripper.urdf", &ImportOptions::default());
    let named: Vec<(usize, &str)> = found.visuals.iter().map(|v| (v.frame, v.file.as_str())).collect();
    assert_eq!(named, [(0, "base_link.stl"), (3, "link_3.stl"), (6, "flange.stl")]);
    assert_eq!(found.visuals[0].unit_mm, [1.0; 3], "metres times the scale");
    let arm = found.robot.model.at_condition(&Condition::default());
    let place = |visual: usize, joints: &Joints| {
        let chain = arm.frames(joints);
        let i = found.visuals[visual].frame;
        let at = found.visuals[visual].pose.translation.vector;
        let (y, z) = (Vector3::from(chain.y[i - 1]), Vector3::from(chain.z[i]));
        Vector3::from(chain.origin[i]) + y.cross(&z) * at.x + y * at.y + z * at.z
    };
    // Joint 3 lies at (20, 0, 570) and turns about y.
    let off = place(1, &Joints::zeros()) - Vector3::new(30.0, 20.0, 600.0);
    assert!(off.norm() < 1e-9, "{off}");
    let mut turned = Joints::zeros();
    turned[2] = std::f64::consts::FRAC_PI_2;
    let off = place(1, &turned) - Vector3::new(50.0, 20.0, 560.0);
    assert!(off.norm() < 1e-9, "{off}");
    assert!(read(GRIPPER, "gripper.urdf", &ImportOptions::default()).visuals.is_empty());
    // Many arms are shown by meshes of another kind, and stop at simpler ones that are STL.
    let other = text.replace("link_3.stl\"", "link_3.dae\"");
    let collision = visual("simple/link_3.STL").replace("visual>", "collision>");
    let both = other.replace("<link name=\"link_3\">", &format!("<link name=\"link_3\">{collision}"));
    assert_eq!(read(&both, "gripper.urdf", &ImportOptions::default()).visuals[1].file, "simple/link_3.STL");
    assert_eq!(
        read(&other, "gripper.urdf", &ImportOptions::default()).visuals[1].file,
        "link_3.dae",
        "to be told of"
    );
}

/// Masses stand where the links are, what is fixed to a link with it.
#[test]
fn masses_are_taken_with_their_places() {
    let arm = read(TURNED, "turned.urdf", &ImportOptions::default()).robot.model;
    let bodies = arm.bodies.unwrap();
    let frames = arm.at_condition(&Condition::default()).frames(&Joints::zeros());
    let place = |i: usize| {
        let centre = Vector3::from(bodies[i].centre_mm);
        let [x, z] = [frames.lateral[i], frames.z[i + 1]].map(Vector3::from);
        let y = Vector3::from(frames.y[i]);
        // At zero the x axis after the joint's turn is that of the frame at the link's end, but for links that turn it.
        let x = if (x.cross(&z) + y).norm() < 1e-9 { x } else { y.cross(&z) };
        Vector3::from(frames.origin[i + 1]) + x * centre.x + y * centre.y + z * centre.z
    };
    for (i, (mass, at)) in [
        (4.0, [10.0, 0.0, 390.0]),
        (5.0, [20.0, 20.0, 450.0]),
        (3.0, [50.0, 0.0, 580.0]),
        (2.0, [250.0, 0.0, 640.0]),
        (1.0, [322.0, 0.0, 640.0]),
        (0.4, [392.0, 0.0, 640.0]),
    ]
    .into_iter()
    .enumerate()
    {
        assert!((bodies[i].mass_kg - mass).abs() < 1e-12);
        assert!((place(i) - Vector3::from(at)).norm() < 1e-9, "link {}: {}", i + 1, place(i));
    }
}

#[test]
fn of_two_arms_in_one_file_one_has_to_be_named() {
    refused(
        TWO,
        "cell.urdf",
        &ImportOptions::default(),
        &["2 arms of six joints", "left_joint_6, right_joint_6", "--base"],
    );
    for side in ["left", "right"] {
        let choice = only_tip(&format!("{side}_base_link"), &format!("{side}_tool0"));
        meets(&read(TWO, "cell.urdf", &choice).robot.model, Vector3::zeros(), &WORKSHOP);
    }
    // Mounted on its side: gravity is not along the axis of joint 1.
    let right = read(TWO, "cell.urdf", &only_tip("table", "right_tool0")).robot;
    assert!((right.model.gravity.norm() - 1.0).abs() < 1e-12 && right.model.gravity.z.abs() < 1e-9);
    // So it is with its own base: what it is mounted on is above that in the tree.
    let own = read(TWO, "cell.urdf", &only_tip("right_base_link", "right_tool0"));
    assert!((own.robot.model.gravity.norm() - 1.0).abs() < 1e-12 && own.robot.model.gravity.z.abs() < 1e-9);
    let told = own.summary.join("\n");
    assert!(told.contains("mounting: the arm is on a wall (gravity points along "), "{told}");
    assert!(told.contains("gravity points along −z of link table, the root of the tree"), "{told}");
    let left = read(TWO, "cell.urdf", &only_tip("left_base_link", "left_tool0")).summary.join("\n");
    assert!(
        left.contains(
            "mounting: the arm stands (gravity points along −z of the base); its mounting face is at the origin"
        ),
        "{left}"
    );
    refused(
        TWO,
        "cell.urdf",
        &only_tip("left_base_link", "right_tool0"),
        &["link right_tool0, to which no joints lead"],
    );
    refused(TWO, "cell.urdf", &only_tip("left_base_link", "tool1"), &["tip", "`tool1`", "left_tool0"]);
}

/// Seven joints are never six, not where a link hangs on the sixth either.
#[test]
fn seven_joints_are_refused_by_name() {
    refused(
        SEVEN,
        "seven.urdf",
        &ImportOptions::default(),
        &["7 joints that move in a row", "seven_joint1, ", "seven_joint7"],
    );
    refused(SEVEN, "seven.urdf", &only_tip("base_link", "link_7"), &["7 joints", "seven_joint7"]);
    refused(SEVEN, "seven.urdf", &only_tip("base_link", "link_5"), &["5 joints", "seven_joint5"]);
    // Six of them are an arm where that is said.
    let six = read(SEVEN, "seven.urdf", &only_tip("link_1", "link_7"));
    assert!(six.summary.join("\n").contains("positions are those of a base on axis 1"), "{:?}", six.summary);
}

/// Parallel axes written as 1.5708, a base beside axis 1, joints that turn the other way round: nothing is rounded.
#[test]
fn what_is_nearly_a_right_angle_stays_as_it_is() {
    let found = read(PARALLEL, "parallel.urdf", &ImportOptions::default());
    meets(&found.robot.model, Vector3::new(100.0, -50.0, 0.0), &PARALLEL_POSES);
    assert_eq!(found.robot.model.joint_map[(0, 0)], -1.0);
    let told = found.summary.join("\n");
    assert!(
        told.contains("joint 1 turns clockwise seen from above")
            && told.contains("(100.000, -50.000, 0.000)"),
        "{told}"
    );
    assert!(found.robot.model.links.iter().all(|link| link.a_mm.abs() < 1000.0 && link.d_mm.abs() < 1000.0));
}

const PARALLEL_POSES: [Pose; 3] = [
    (
        [-1059.9999999999998, -340.5995599457103, 280.19850463901065],
        [2.653599540514399e-06, -0.9999999999357632, -1.1019615309802681e-05],
    ),
    (
        [-1155.0421520948548, 62.72027505558224, 511.4860353319097],
        [-0.7661319337804156, -0.5636103822454117, 0.3088449401674922],
    ),
    (
        [683.6312552746383, -598.3905906226377, 172.5691387000366],
        [0.3150743515754391, 0.359756863181002, 0.8782386648135471],
    ),
];

/// What tools leave behind in a URDF: marks of their own without a declaration, macros that are only defined, comments.
#[test]
fn what_tools_leave_behind_is_passed_over() {
    let left = TURNED.replacen(
        "<link",
        "<drake:collision_filter_group name=\"a\"/><!-- <xacro:arm/> ${a} --><xacro:property name=\"a\" value=\"${b}\"/><link",
        1,
    );
    meets(&read(&left, "left.urdf", &ImportOptions::default()).robot.model, Vector3::zeros(), &WORKSHOP);
    // An axis that stands off the upright by less than the cosine of it tells.
    let leaning = TURNED.replacen("<axis xyz=\"0 0 1\"/>", "<axis xyz=\"3e-9 0 1\"/>", 1);
    let found = read(&leaning, "leaning.urdf", &ImportOptions::default()).robot.model;
    let flange = found.forward(&Joints::zeros(), &Condition::default()).translation.vector;
    // Seen from a base that leans so, the flange 640 mm higher stands 640 mm · 3e-9 further back.
    assert!((flange.x - (394.0 - 640.0 * 3e-9 + 290.0 * 3e-9)).abs() < 1e-9, "{:e}", flange.x - 394.0);
}

#[test]
fn what_is_no_urdf_of_an_arm_is_refused_in_words() {
    let none = ImportOptions::default();
    let replaced = |from: &str, to: &str| TURNED.replacen(from, to, 1);
    for (text, words) in [
        (
            replaced("<link", "<xacro:include filename=\"a\"/><link"),
            &["xacro macros", "xacro arm.urdf.xacro > arm.urdf"][..],
        ),
        (replaced("0 0 0.29", "0 0 ${height}"), &["xacro macros"]),
        (replaced("<robot", "<sdf").replace("</robot", "</sdf"), &["root element", "<sdf>"]),
        (replaced("</joint>", ""), &["line ", "XML"]),
        (replaced("0 0 0.29", "0 0 wide"), &["<origin xyz>", "`0 0 wide`", "three finite numbers"]),
        (replaced("0 0 0.29", "0 0 NaN"), &["<origin xyz>", "`0 0 NaN`"]),
        (
            replaced("<axis xyz=\"0 0 1\"/>", "<axis xyz=\"0 0 0\"/>"),
            &["joint joint_1, <axis>", "a direction"],
        ),
        (
            replaced("\"joint_5\" type=\"revolute\"", "\"joint_5\" type=\"prismatic\""),
            &["joint joint_5", "slides"],
        ),
        (
            replaced("\"joint_5\" type=\"revolute\"", "\"joint_5\" type=\"floating\""),
            &["joint joint_5", "`floating`"],
        ),
        (
            replaced("\"joint_5\" type=\"revolute\"", "\"joint_5\" type=\"fixed\""),
            &["5 joints that move in a row"],
        ),
        (
            replaced("velocity=\"5.5\" effort=\"100\"/>", "velocity=\"5.5\"/><mimic joint=\"joint_3\"/>"),
            &["joint joint_5", "follows joint_3 (mimic)"],
        ),
        (
            replaced("<child link=\"link_2\"/>", "<child link=\"link_1\"/>"),
            &["joint_2", "that of joint joint_1 already"],
        ),
        (replaced("<parent link=\"world\"/>", "<parent link=\"tool0\"/>"), &["no link without a parent"]),
        (
            replaced("0 0 0.29", "0 0 290"),
            &["joint joint_1, <origin xyz>: found `0 0 290`", "metres, within ±10"],
        ),
        (String::new(), &["XML"]),
        ("<!DOCTYPE a [<!ENTITY b \"c\">]><robot name=\"&b;\"/>".to_owned(), &["XML"]),
    ] {
        refused(&text, "arm.urdf", &none, words);
    }
    refused(TURNED, "arm.urdf.xacro", &none, &["xacro macros"]);
    refused(TURNED, "arm.step", &none, &["the extension", "found .step", ".urdf"]);
    refused(GRIPPER, "arm.urdf", &only_tip("world", "finger_a"), &["finger_joint", "slides"]);
    refused("a", "arm.csv", &only_tip("world", "tool0"), &["base and tip", "links of a URDF"]);
}

const STANDARD: &str = "\u{feff}convention;theta_deg;d_mm;a_mm;alpha_deg;min_deg;max_deg\n\
    standard;0;300;20;-90;-170;170\nstandard;-90;0;270,5;0;-100;100\nstandard;0;0;70;-90;-110;70\n\
    standard;0;302;0;90;-160;160\nstandard;0;0;0;-90;-120;120\nstandard;180;72;0;90;-400;400\n";

/// The product of transforms, written out.
fn product(rows: &[[f64; 4]; 6], modified: bool, joints: &[f64; 6]) -> Isometry3<f64> {
    let z = |angle: f64, d: f64| {
        Isometry3::from_parts(
            Translation3::new(0.0, 0.0, d),
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle),
        )
    };
    let x = |angle: f64, a: f64| {
        Isometry3::from_parts(
            Translation3::new(a, 0.0, 0.0),
            UnitQuaternion::from_axis_angle(&Vector3::x_axis(), angle),
        )
    };
    rows.iter().zip(joints).fold(Isometry3::identity(), |pose, ([theta, d, a, alpha], q)| match modified {
        true => pose * x(*alpha, *a) * z(theta + q, *d),
        false => pose * z(theta + q, *d) * x(*alpha, *a),
    })
}

/// The same numbers under the two conventions are two arms, and neither is guessed.
#[test]
fn a_table_says_itself_which_convention_it_is_of() {
    let rows = [
        [0.0_f64, 300.0, 20.0, -90.0],
        [-90.0, 0.0, 270.5, 0.0],
        [0.0, 0.0, 70.0, -90.0],
        [0.0, 302.0, 0.0, 90.0],
        [0.0, 0.0, 0.0, -90.0],
        [180.0, 72.0, 0.0, 90.0],
    ]
    .map(|[theta, d, a, alpha]| [theta.to_radians(), d, a, alpha.to_radians()]);
    let both = [(STANDARD.to_owned(), false), (STANDARD.replace("standard", "Modified"), true)];
    let arms = both.map(|(text, modified)| {
        let arm = read(&text, "table.csv", &ImportOptions::default()).robot;
        // The base of ours is on axis 1, which Craig's first twist turns away from the table's.
        let base = product(&rows, modified, &JOINTS[0])
            * arm.model.forward(&Joints::zeros(), &Condition::default()).inverse();
        for joints in &JOINTS {
            let ours = base * arm.model.forward(&Joints::from(*joints), &Condition::default());
            let theirs = product(&rows, modified, joints);
            assert!((ours.translation.vector - theirs.translation.vector).norm() < 1e-9);
            assert!(ours.rotation.angle_to(&theirs.rotation) < 1e-12);
        }
        arm
    });
    assert_ne!(arms[0].model.links, arms[1].model.links);
    assert!((arms[0].model.limits.max_rad[1].to_degrees() - 100.0).abs() < 1e-9);
    let none = ImportOptions::default();
    for (text, words) in [
        (
            STANDARD.replace("convention;", "name;"),
            &["column convention", "standard or modified", "Craig"][..],
        ),
        (STANDARD.replacen("standard;0", "craig;0", 1), &["`standard`, and `craig` above"]),
        (STANDARD.replace("standard", "craig"), &["`craig`"]),
        (STANDARD.replace("270,5", "long"), &["line 3, column a_mm", "`long`"]),
        (STANDARD.replace(";270,5;", ";;"), &["line 3, column a_mm", "an empty cell"]),
        (STANDARD.replace("d_mm", "d"), &["column d_mm", "the columns convention, theta_deg, d, a_mm"]),
        (STANDARD.lines().take(6).collect::<Vec<_>>().join("\n"), &["5 rows", "six"]),
        (format!("{STANDARD}standard;0;0;0;0;-1;1\n"), &["7 rows", "six"]),
        (STANDARD.replace(";72;", ";72;9;9;"), &["line 7", "cells under a header"]),
        (STANDARD.replace("alpha_deg", "alpha_rad"), &["column alpha_rad", "look like degrees"]),
        (
            STANDARD.replace("-90", "-1.5708").replace("180", "3.14159"),
            &["column theta_deg", "look like radians"],
        ),
        (String::new(), &["nothing"]),
    ] {
        refused(&text, "table.csv", &none, words);
    }
}

/// A calibrated arm whose table moves nearly parallel axes by hundreds of metres there and back.
#[test]
fn links_hundreds_of_metres_away_come_home() {
    let conf = "robot = universal-robots-ur10\n[mounting]\ndelta_theta = [0.00001, 0.9, -1.3, 0.4, 0.00002, 0]\n\
        delta_d = [0.0001, 431.2, -700.9, 269.7, -0.00003, 0.00004]\ndelta_a = [0.0002, 0.3, 0.2, 0.00005, 0.00001, 0]\n\
        delta_alpha = [-0.0003, 0.0009, -0.0012, 0.0006, 0.0001, 0]\njoint_checksum = [1, 2, 3, 4, 5, 6]\n";
    let found = read(conf, "calibration.conf", &ImportOptions::default());
    let arm = &found.robot.model;
    assert!(
        arm.links.iter().all(|link| link.a_mm.abs() < 2000.0 && link.d_mm.abs() < 2000.0),
        "{:?}",
        arm.links
    );
    let nominal = load("universal-robots-ur10").unwrap().model;
    let deltas = [
        [0.00001, 0.1, 0.2, -0.0003],
        [0.9, 431_200.0, 300.0, 0.0009],
        [-1.3, -700_900.0, 200.0, -0.0012],
        [0.4, 269_700.0, 0.05, 0.0006],
        [0.00002, -0.03, 0.01, 0.0001],
        [0.0, 0.04, 0.0, 0.0],
    ];
    let rows: [[f64; 4]; 6] = std::array::from_fn(|i| {
        let link = nominal.links[i];
        let plain = [link.theta_rad, link.d_mm, link.a_mm, link.alpha_rad];
        std::array::from_fn(|k| plain[k] + deltas[i][k])
    });
    for joints in &JOINTS {
        let ours = arm.forward(&Joints::from(*joints), &Condition::default());
        let theirs = product(&rows, false, joints);
        // A number of 700 m holds no more.
        assert!((ours.translation.vector - theirs.translation.vector).norm() < 1e-7);
    }
    assert!(
        found.summary.iter().any(|line| line.contains("up to 700.900 m there and back")),
        "{:?}",
        found.summary
    );
    let none = ImportOptions::default();
    refused(
        &conf.replace("robot = ", "arm = "),
        "calibration.conf",
        &none,
        &["robot", "universal-robots-ur10"],
    );
    refused(
        &conf.replace("0.9, -1.3", "0.9"),
        "calibration.conf",
        &none,
        &["line 3, delta_theta", "six finite numbers"],
    );
    refused(&conf.replace("delta_a =", "a ="), "calibration.conf", &none, &["delta_a"]);
    let unknown = import(&conf.replace("ur10", "ur99"), "calibration.conf", &none);
    assert!(matches!(unknown, Err(RobotError::Unknown { .. })));
}

/// The driver's file: places of the joints in each other. Nominal UR10e, as its maker publishes it.
// Digits as the driver's file prints them.
#[allow(clippy::approx_constant)]
#[test]
fn the_drivers_file_is_read() {
    let places = [
        ("shoulder", [0.0, 0.0, 0.1807, 0.0, 0.0, 0.0]),
        ("upper_arm", [0.0, 0.0, 0.0, 1.570796327, 0.0, 0.0]),
        ("forearm", [-0.6127, 0.0, 0.0, 0.0, 0.0, 0.0]),
        ("wrist_1", [-0.57155, 0.0, 0.17415, 0.0, 0.0, 0.0]),
        ("wrist_2", [0.0, -0.11985, 0.0, 1.570796327, 0.0, 0.0]),
        ("wrist_3", [0.0, 0.11655, 0.0, 1.570796326589793, 3.141592653589793, 3.141592653589793]),
    ];
    let mut text = "kinematics:\n".to_owned();
    for (name, [x, y, z, roll, pitch, yaw]) in places {
        text += &format!(
            "  {name}:\n    x: {x}\n    y: {y}\n    z: {z}\n    roll: {roll}\n    pitch: {pitch}\n    yaw: {yaw}\n"
        );
    }
    text += "  hash: calib_209549117540498681\n";
    let found = read(&text, "ur10e.yaml", &ImportOptions::default());
    let flange = found.robot.model.forward(&Joints::zeros(), &Condition::default());
    // Of the maker's table: x = a2 + a3, y = −(d4 + d6), z = d1 − d5.
    let expected = Vector3::new(-1184.25, -290.7, 60.85);
    assert!((flange.translation.vector - expected).norm() < 1e-5, "{}", flange.translation.vector);
    let none = ImportOptions::default();
    refused(&text.replace("x: -0.6127", "x: far"), "ur10e.yaml", &none, &["line ", "forearm.x", "`x: far`"]);
    refused(
        &text.replace("forearm:", "fore_arm:"),
        "ur10e.yaml",
        &none,
        &["kinematics.forearm.x", "nothing"],
    );
}

/// FANUC controllers measure joint 3 relative to the ground: turning joint 2 alone leaves the forearm's direction as it is.
#[test]
fn joint_3_may_be_counted_against_the_ground() {
    let ground = ImportOptions { ground_joint_3: true, ..ImportOptions::default() };
    let turn = |arm: &Model, j2: f64| {
        arm.forward(&Joints::new(0.2, j2, 0.3, 0.1, 0.4, 0.5), &Condition::default()).rotation
    };
    let against = [
        TURNED.to_owned(),
        TURNED.replace(
            "<axis xyz=\"0 1 0\"/>\n    <limit lower=\"-1.9\" upper=\"1.2\"",
            "<axis xyz=\"0 -1 0\"/>\n    <limit lower=\"-1.9\" upper=\"1.2\"",
        ),
    ];
    assert_ne!(against[0], against[1]);
    for text in &against {
        let arm = read(text, "fanuc.urdf", &ground).robot.model;
        assert!(turn(&arm, 0.0).angle_to(&turn(&arm, 0.7)) < 1e-12);
        // The file's range is that of the link against the one before it.
        let [sum] = arm.limits.sums[..] else { panic!("{:?}", arm.limits.sums) };
        let alone = read(text, "fanuc.urdf", &ImportOptions::default()).robot.model.limits;
        for q in JOINTS.map(Joints::from) {
            assert!((sum.of(&q) - (arm.joint_map.row(2) * q)[0]).abs() < 1e-12);
        }
        let ranges = [[sum.min_rad, sum.max_rad], [alone.min_rad[2], alone.max_rad[2]]];
        assert!((0..2).all(|end| (ranges[0][end] - ranges[1][end]).abs() < 1e-12), "{ranges:?}");
        let plain = read(text, "fanuc.urdf", &ImportOptions::default());
        assert!((turn(&plain.robot.model, 0.0).angle_to(&turn(&plain.robot.model, 0.7)) - 0.7).abs() < 1e-9);
        assert!(plain.summary.iter().any(|line| line.contains("--ground-joint-3")), "{:?}", plain.summary);
    }
    // As the catalogue has a FANUC, by a table with the columns q2 and q3.
    let table = "convention,theta_deg,d_mm,a_mm,alpha_deg,q1,q2,q3,q4,q5,q6\n\
        standard,0,0,50,-90,1,,,,,\nstandard,-90,0,330,0,,1,,,,\nstandard,0,0,35,-90,,-1,-1,,,\n\
        standard,0,335,0,90,,,,-1,,\nstandard,0,0,0,-90,,,,,-1,\nstandard,0,80,0,0,,,,,,-1\n";
    let own = read(table, "lr-mate.csv", &ImportOptions::default()).robot.model;
    let known = load("fanuc-lr-mate-200id").unwrap().model;
    for joints in JOINTS.map(Joints::from) {
        let (ours, theirs) = [&own, &known].map(|arm| arm.forward(&joints, &Condition::default())).into();
        assert!((ours.translation.vector - theirs.translation.vector).norm() < 1e-9);
        assert!(ours.rotation.angle_to(&theirs.rotation) < 1e-12);
    }
    refused(
        SEVEN,
        "seven.urdf",
        &ImportOptions { ground_joint_3: true, ..only_tip("base_link", "link_6") },
        &["relative to the ground"],
    );
}

/// What is written in the formats of others and read back is the arm, calibrated twists of parallel axes and all, once the angles of
/// the controller are turned into the file's as it is said. The class: an arm that turns some other way round, or by a sum of
/// angles, than the file's reader takes it for.
#[test]
fn what_is_exported_comes_back() {
    use truegrind_arm::robots::export::{Format, flange_in_last_frame, joint_matrix, lost_in_export, write};
    for name in [
        "universal-robots-ur10",
        "abb-irb-120",
        "fanuc-lr-mate-200id",
        "staubli-tx60",
        "kuka-kr6-r900-sixx",
        "yaskawa-gp12",
    ] {
        let mut arm = load(name).unwrap().model;
        // As an identification leaves it: nothing is a round number, parallel axes are not quite.
        for (i, link) in arm.links.iter_mut().enumerate() {
            let k = i as f64;
            (link.a_mm, link.theta_rad) = (link.a_mm + 0.3 * (k + 1.0), link.theta_rad + 0.002 * (k - 2.5));
            link.alpha_rad += 0.0011 * (k - 1.7);
            if link.model == truegrind_arm::link::LinkModel::Hayati {
                link.beta_rad = 0.0007 * (k + 0.5);
            } else {
                link.d_mm -= 0.4 * k;
            }
        }
        for (format, file) in [
            (Format::Urdf, "out.urdf"),
            (Format::Standard, "out.csv"),
            (Format::Modified, "out.csv"),
            (Format::UrYaml, "out.yaml"),
        ] {
            let written = write(&arm, name, format, &["a note -- with dashes".to_owned()]);
            let again = read(&written, file, &ImportOptions::default()).robot.model;
            let (flange, angles) = (flange_in_last_frame(&arm, format), joint_matrix(&arm, format));
            let told = lost_in_export(&arm, format).join("\n");
            assert_eq!(
                told.contains("whoever moves the arm"),
                angles != nalgebra::Matrix6::identity(),
                "{told}"
            );
            for joints in JOINTS.map(Joints::from) {
                let ours = arm.forward(&joints, &Condition::default());
                let theirs = again.forward(&(angles * joints), &Condition::default()) * flange;
                let off = (ours.translation.vector - theirs.translation.vector).norm();
                assert!(
                    off < 1e-7 && ours.rotation.angle_to(&theirs.rotation) < 1e-9,
                    "{name} {format:?}: {off:e} mm"
                );
            }
            match (name, format) {
                ("fanuc-lr-mate-200id", Format::Urdf) => {
                    assert!(told.contains("compute them: joint 3 = J2 + J3; their ranges"), "{told}");
                    // J2 + J3 has a range of its own.
                    let [ours, theirs] = [&arm, &again].map(|arm| (arm.limits.min_rad, arm.limits.max_rad));
                    assert!((theirs.0[2].to_degrees() + 70.0).abs() < 1e-9);
                    assert!((theirs.1[2].to_degrees() - 205.0).abs() < 1e-9);
                    assert!((theirs.0[3] - ours.0[3]).abs() < 1e-12);
                    // Without it either joint may be anywhere in its range.
                    let mut alone = arm.clone();
                    alone.limits.sums.clear();
                    let written = write(&alone, name, format, &[]);
                    let theirs = read(&written, file, &ImportOptions::default()).robot.model.limits;
                    assert!((theirs.min_rad[2] - (ours.0[1] + ours.0[2])).abs() < 1e-12);
                    assert!((theirs.max_rad[2] - (ours.1[1] + ours.1[2])).abs() < 1e-12);
                }
                ("fanuc-lr-mate-200id", Format::UrYaml) => {
                    assert!(told.contains("joint 3 = −J2 − J3, joint 4 = −J4"), "{told}");
                }
                _ => {}
            }
        }
    }
}

/// What is tidied away (axes that meet by less than a picometre, an upright first axis) stays far below the nanometre within which an
/// arm agrees with its file, all joints together. The class: each place is rounded by as much as the whole may be off. The arm has its
/// angles as files write them, π with eleven digits, so that axes which are meant to meet do so by half a nanometre.
#[test]
fn what_is_tidied_away_does_not_add_up() {
    use std::f64::consts::{FRAC_PI_2, PI};
    // As files write them, and not as they are.
    let [pi, half] = [PI, FRAC_PI_2].map(|angle| (1e11 * angle).round() / 1e11);
    let steps: [([f64; 3], [f64; 3]); 7] = [
        ([0.0, 0.0, 0.16], [0.0, pi, 0.0]),
        ([0.0, 0.0, -0.12], [-half, 0.0, pi]),
        ([0.0, -0.4, 0.0], [0.0, pi, 0.0]),
        ([0.0, 0.21, -0.01], [-half, 0.0, pi]),
        ([0.0, 0.0, -0.1], [half, 0.0, pi]),
        ([0.0, 0.1, 0.0], [-half, 0.0, pi]),
        ([0.0, 0.0, -0.16], [pi, half, 0.0]),
    ];
    let place = |(xyz, rpy): &([f64; 3], [f64; 3])| {
        let turn = UnitQuaternion::from_euler_angles(rpy[0], rpy[1], rpy[2]);
        Isometry3::from_parts((Vector3::from(*xyz) * 1000.0).into(), turn)
    };
    let mut text = String::from("<robot name=\"arm\"><link name=\"l0\"/>");
    for (i, (xyz, rpy)) in steps.iter().enumerate() {
        let kind = if i < 6 { "revolute" } else { "fixed" };
        let word = |v: &[f64; 3]| v.map(|v| v.to_string()).join(" ");
        text += &format!(
            "<link name=\"l{n}\"/><joint name=\"j{n}\" type=\"{kind}\"><parent link=\"l{i}\"/><child link=\"l{n}\"/>\
             <origin xyz=\"{}\" rpy=\"{}\"/><axis xyz=\"0 0 1\"/></joint>",
            word(xyz),
            word(rpy),
            n = i + 1
        );
    }
    let found = read(&(text + "</robot>"), "rounded.urdf", &only_tip("l0", "l7"));
    let told = found.summary.join("\n");
    assert!(!told.contains("is not the z axis of the file's base"), "{told}");
    let pose = |joints: &[f64; 6]| {
        let turn = |angle| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
        let turns = joints.iter().copied().chain([0.0]);
        steps
            .iter()
            .zip(turns)
            .fold(Isometry3::identity(), |pose, (step, angle)| pose * place(step) * turn(angle))
    };
    for joints in
        JOINTS.into_iter().chain([[1.9, 1.1, -0.8, 2.4, -1.7, 0.6], [-0.4, -2.2, 2.6, -1.5, 1.2, -2.8]])
    {
        let ours = found.robot.model.forward(&Joints::from(joints), &Condition::default());
        let off = (ours.translation.vector - pose(&joints).translation.vector).norm();
        // The base of ours leans by what the first axis does, 2e-13.
        assert!(off < 3e-10, "{off:e} mm");
    }
}

/// Whatever a file holds, it is read or refused: bytes changed, taken out and doubled at random.
#[test]
fn no_damage_brings_the_readers_down() {
    use rand::{RngExt, SeedableRng};
    let conf = "robot = universal-robots-ur10\ndelta_theta = [0, 0, 0, 0, 0, 0]\ndelta_d = [0, 0, 0, 0, 0, 0]\n\
        delta_a = [0, 0, 0, 0, 0, 0]\ndelta_alpha = [0, 0, 0, 0, 0, 0]\n";
    let yaml = truegrind_arm::robots::export::write(
        &load("universal-robots-ur10").unwrap().model,
        "ur",
        truegrind_arm::robots::export::Format::UrYaml,
        &[],
    );
    let none = ImportOptions::default();
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(11);
    let mut read_whole = 0;
    for (text, file) in [
        (TURNED, "a.urdf"),
        (TWO, "a.urdf"),
        (PARALLEL, "a.urdf"),
        (STANDARD, "a.csv"),
        (conf, "a.conf"),
        (&yaml, "a.yaml"),
    ] {
        for _ in 0..300 {
            let mut bytes = text.as_bytes().to_vec();
            for _ in 0..random.random_range(1..4) {
                let at = random.random_range(0..bytes.len());
                let to = (at + random.random_range(1..60)).min(bytes.len());
                match random.random_range(0..4) {
                    0 => drop(bytes.drain(at..to)),
                    1 => bytes[at] = b"0123456789-.eE<>\"/;,\n"[random.random_range(0..21)],
                    2 => {
                        let part = bytes[at..to].to_vec();
                        bytes.splice(at..at, part);
                    }
                    _ => bytes[at] = b'9',
                }
            }
            let damaged = String::from_utf8_lossy(&bytes);
            if let Ok(found) = import(&damaged, file, &none) {
                read_whole += 1;
                let flange = found.robot.model.forward(&Joints::repeat(0.3), &Condition::default());
                assert!(flange.translation.vector.iter().all(|v| v.is_finite()));
            }
        }
    }
    assert!(read_whole > 100, "{read_whole}");
}

/// Wrong units and slips of a URDF are told by line and name, with the numbers of the file.
#[test]
fn faults_of_a_urdf_are_told_by_line_and_joint() {
    let link = |name: &str| format!("<link name=\"{name}\"/>\n");
    let links = ["base", "l1", "l2", "l3", "l4", "l5", "tool0"].map(link).concat();
    let joint = |index: usize, parent: &str, child: &str, xyz: &str| {
        let axis = ["0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0"][index];
        format!(
            "<joint name=\"j{}\" type=\"revolute\"><parent link=\"{parent}\"/><child link=\"{child}\"/><origin xyz=\"{xyz}\"/>\
             <axis xyz=\"{axis}\"/><limit lower=\"-2.5\" upper=\"2.5\"/></joint>\n",
            index + 1
        )
    };
    let joints = [
        joint(0, "base", "l1", "0 0 0.29"),
        joint(1, "l1", "l2", "0 0 0"),
        joint(2, "l2", "l3", "0 0 0.27"),
        joint(3, "l3", "l4", "0 0 0.07"),
        joint(4, "l4", "l5", "0.302 0 0"),
        joint(5, "l5", "tool0", "0.072 0 0"),
    ]
    .concat();
    let sound = format!("<robot name=\"arm\">\n{links}{joints}</robot>\n");
    let none = ImportOptions::default();
    read(&sound, "a.urdf", &none);
    let fault = |from: &str, to: &str, words: &[&str]| {
        assert!(sound.contains(from));
        refused(&sound.replacen(from, to, 1), "a.urdf", &none, words);
    };
    fault(
        "0 0 0.27",
        "0 0 270",
        &["line 11, joint j3, <origin xyz>: found `0 0 270`", "metres", "millimetres"],
    );
    fault(
        "lower=\"-2.5\" upper=\"2.5\"",
        "lower=\"-165\" upper=\"165\"",
        &["line 9, joint j1, <limit>: found lower -165 and upper 165", "radians", "degrees"],
    );
    fault(
        "lower=\"-2.5\" upper=\"2.5\"",
        "lower=\"2\" upper=\"-2.5\"",
        &["line 9, joint j1, <limit>: found lower 2 and upper -2.5", "lower below upper"],
    );
    let heavy = "<link name=\"l2\"><inertial><mass value=\"-3.2\"/></inertial></link>";
    fault("<link name=\"l2\"/>", heavy, &["line 4, link l2, <mass>: found -3.2", "0 or more"]);
    fault(
        "<link name=\"l2\"/>",
        "<link name=\"l2\"/><link name=\"l1\"/>",
        &["line 4, link l1", "second link"],
    );
}

/// A table whose metres are millimetres, and a kinematics file that is written in short.
#[test]
fn millimetres_under_metres_and_short_yaml_are_told() {
    let table = "convention,alpha_deg,a_m,theta_deg,d_m\nstandard,-90,0,0,290\nstandard,0,270,-90,0\n\
                 standard,-90,70,0,0\nstandard,90,0,0,302\nstandard,-90,0,0,0\nstandard,0,0,180,72\n";
    let words = ["column d_m: found [290.0, 0.0, 0.0, 302.0, 0.0, 72.0]", "these look like millimetres"];
    refused(table, "t.csv", &ImportOptions::default(), &words);
    let yaml = "kinematics:\n  shoulder: {x: 0, y: 0, z: 0.1, roll: 0, pitch: 0, yaw: 0}\n";
    let words = ["line 2, kinematics.shoulder", "each in a line of its own"];
    refused(yaml, "u.yaml", &ImportOptions::default(), &words);
}
