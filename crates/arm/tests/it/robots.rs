//! Tests of `robots`: the catalogue against what was published, and what bad files get.

use nalgebra::{Matrix6, Vector3, Vector6};
use truegrind_arm::link::LinkModel;
use truegrind_arm::robots::sheet::{Angles, Dialect, LinkSheet, Orientation, RobotFile};
use truegrind_arm::robots::validation::deviation;
use truegrind_arm::robots::{Robot, RobotError, catalogue, load, parse};
use truegrind_math::toml_text;

const ABB: &str = include_str!("../../src/robots/abb.toml");

fn all() -> Vec<Robot> {
    catalogue().iter().map(|name| load(name).expect("catalogue loads")).collect()
}

/// The first arm of the ABB file alone: what a user's own file looks like.
fn own() -> String {
    let second = ABB.match_indices("[[robot]]").nth(1).expect("two robots").0;
    ABB[..second].to_owned()
}

#[test]
fn the_catalogue_has_the_arms_asked_for_and_each_loads() {
    let names = catalogue();
    for name in ["abb-irb-120", "hsr-jr680", "staubli-tx60", "universal-robots-ur10", "universal-robots-ur5"]
    {
        assert!(names.iter().any(|n| n == name), "{name} missing");
    }
    assert!(names.len() >= 11, "{names:?}");
    assert!(names.is_sorted_by(|a, b| a < b), "sorted, no name twice: {names:?}");
    for robot in all() {
        let expected = if robot.sheet.name == "hsr-jr680" { 1 } else { 0 };
        assert_eq!(robot.warnings.len(), expected, "{}: {:?}", robot.sheet.name, robot.warnings);
        assert_eq!(load(&robot.sheet.name.to_uppercase()).unwrap().sheet, robot.sheet);
    }
}

/// A start does not look for it.
#[test]
fn no_array_of_the_catalogue_is_longer_than_its_field() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/src/robots");
    let files = std::fs::read_dir(folder).unwrap().map(|file| file.unwrap().path());
    let texts = files.filter(|path| path.extension().is_some_and(|end| end == "toml"));
    let read = texts.map(|path| {
        let text = std::fs::read_to_string(&path).unwrap();
        toml_text::read::<RobotFile>(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    });
    assert_eq!(read.map(|file| file.robot.len()).sum::<usize>(), catalogue().len());
}

#[test]
fn every_number_has_a_source() {
    for Robot { sheet, .. } in all() {
        let name = &sheet.name;
        let sourced = |text: &str| text.trim().len() > 10;
        assert!(sourced(&sheet.sources.links), "{name}: links");
        assert_eq!(sheet.joints.min_deg.is_some(), sourced(&sheet.sources.limits), "{name}: limits");
        assert_eq!(sheet.masses.is_some(), sourced(&sheet.sources.masses), "{name}: masses");
        let performance = sheet.payload_kg.or(sheet.reach_mm).or(sheet.repeatability_mm);
        assert_eq!(performance.is_some(), sourced(&sheet.sources.payload), "{name}: payload");
        assert!(!sheet.published.is_empty(), "{name}: no published pose");
        for pose in &sheet.published {
            assert!(sourced(&pose.source), "{name}: {}", pose.what);
        }
    }
}

#[test]
fn published_poses_are_met() {
    for Robot { sheet, model, .. } in all() {
        for pose in &sheet.published {
            let (distance, turn) = deviation(pose, &model);
            assert!(distance <= pose.tolerance_mm, "{}: {}: {distance} mm", sheet.name, pose.what);
            assert!(turn.unwrap_or(0.0) < 1e-6, "{}: {}: {turn:?} rad", sheet.name, pose.what);
            if let (Some(min), Some(max)) = (sheet.joints.min_deg, sheet.joints.max_deg) {
                let inside = (0..6).all(|i| (min[i]..=max[i]).contains(&pose.joints_deg[i]));
                assert!(inside, "{}: {} lies outside the range of the joints", sheet.name, pose.what);
            }
        }
    }
}

/// A published reach is met by a pose that no joint makes longer within its range: it really is the stretched one.
#[test]
fn published_reaches_are_the_longest() {
    let mut seen = 0;
    for Robot { sheet, model, .. } in all() {
        for pose in sheet.published.iter().filter(|pose| pose.radius_mm.is_some()) {
            let radius = |joints_deg: [f64; 6]| {
                let mut moved = pose.clone();
                moved.joints_deg = joints_deg;
                moved.radius_mm = Some(0.0);
                deviation(&moved, &model).0
            };
            let stretched = radius(pose.joints_deg);
            for joint in 0..6 {
                for step in [-2.0, 2.0] {
                    let mut joints = pose.joints_deg;
                    joints[joint] += step;
                    let outside = sheet.joints.max_deg.is_some_and(|max| joints[joint] > max[joint])
                        || sheet.joints.min_deg.is_some_and(|min| joints[joint] < min[joint]);
                    if outside {
                        continue;
                    }
                    let longer = radius(joints) - stretched;
                    assert!(longer < 1e-2, "{}: joint {}: {longer} mm longer", sheet.name, joint + 1);
                }
            }
            seen += 1;
        }
    }
    assert!(seen >= 12, "{seen} reaches");
}

/// Axes 2 and 3 of every elbow arm are parallel, and axes 3 and 4 of the UR arms; no other neighbours are.
#[test]
fn parallel_axes_are_hayati_and_no_others() {
    for Robot { sheet, model, .. } in all() {
        let ur = sheet.dialect == Some(Dialect::Urscript);
        for (i, link) in model.links.iter().enumerate().take(5) {
            let parallel = link.alpha_rad.sin().abs() < 1e-9;
            assert_eq!(parallel, i == 1 || (ur && i == 2), "{} link {}", sheet.name, i + 1);
            assert_eq!(parallel, link.model == LinkModel::Hayati, "{} link {}", sheet.name, i + 1);
        }
    }
}

/// Elbow arms: axes 4, 5 and 6 meet in one point, whatever the joints; axes 4 and 6 are at right angles to axis 5.
#[test]
fn elbow_arms_have_a_spherical_wrist() {
    let q = Vector6::new(0.4, -0.3, 0.5, 1.1, -0.7, 0.2);
    for Robot { sheet, model, .. } in all() {
        let frames = model.at_condition(&Default::default()).frames(&q);
        let wrist = Vector3::from(frames.origin[5]);
        let off = |axis: usize| {
            (wrist - Vector3::from(frames.origin[axis])).cross(&Vector3::from(frames.z[axis])).norm()
        };
        let spherical = (3..6).all(|axis| off(axis) < 1e-9);
        assert_eq!(spherical, sheet.dialect != Some(Dialect::Urscript), "{}", sheet.name);
        for axis in [3, 5] {
            assert!(
                Vector3::from(frames.z[axis]).dot(&Vector3::from(frames.z[4])).abs() < 1e-12,
                "{}",
                sheet.name
            );
        }
    }
}

#[test]
fn limits_hold_the_zero_pose_and_are_sane() {
    for Robot { sheet, model, .. } in all() {
        for i in 0..6 {
            let (min, max) = (model.limits.min_rad[i], model.limits.max_rad[i]);
            assert!(min <= 0.0 && 0.0 <= max, "{} joint {}", sheet.name, i + 1);
            assert!(max - min > 1.9 && max - min < 16.0, "{} joint {}", sheet.name, i + 1);
        }
        assert_eq!(model.limits.violated(&Vector6::zeros()), None);
    }
}

#[test]
fn fanuc_j2_leaves_the_forearm_level_and_abb_does_not() {
    let tilt = |name: &str| {
        let model = load(name).unwrap().model;
        let z = |q2: f64| {
            Vector3::from(
                model.at_condition(&Default::default()).frames(&Vector6::new(0.0, q2, 0.0, 0.0, 0.0, 0.0)).z
                    [3],
            )
        };
        z(0.0).angle(&z(0.3))
    };
    for name in ["fanuc-lr-mate-200id", "fanuc-m-20ia", "fanuc-m-710ic-50"] {
        assert!(tilt(name) < 1e-9, "{name}");
    }
    assert!((tilt("abb-irb-120") - 0.3).abs() < 1e-9);
}

/// The flange of every maker's arm at positive joint 1 and joint 6: the signs that makers choose differently.
#[test]
fn signs_of_the_makers() {
    for Robot { sheet, model, .. } in all() {
        let expected = if sheet.dialect == Some(Dialect::Krl) { -1.0 } else { 1.0 };
        let turned = model.forward(&Vector6::new(0.1, 0.0, 0.0, 0.0, 0.0, 0.0), &Default::default());
        let still = model.forward(&Vector6::zeros(), &Default::default());
        let turn = (turned.rotation * still.rotation.inverse()).scaled_axis();
        assert!(
            (turn - Vector3::new(0.0, 0.0, 0.1 * expected)).norm() < 1e-9,
            "{}: joint 1 {turn}",
            sheet.name
        );

        let outward = match sheet.dialect {
            Some(Dialect::Krl | Dialect::Fanuc | Dialect::Inform) => -1.0,
            _ => 1.0,
        };
        let turned = model.forward(&Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.1), &Default::default());
        let turn = (still.rotation.inverse() * turned.rotation).scaled_axis();
        assert!(
            (turn - Vector3::new(0.0, 0.0, 0.1 * outward)).norm() < 1e-9,
            "{}: joint 6 {turn}",
            sheet.name
        );
    }
}

#[test]
fn the_papers_tables_are_in_the_catalogue() {
    let table = |name: &str| {
        let links = load(name).unwrap().sheet.link;
        links.iter().map(|l| [l.a_mm, l.d_mm, l.alpha_deg, l.theta_deg]).collect::<Vec<_>>()
    };
    // ltlm-2024 Table 1; theta 6 is turned by 180° to make frame 6 tool0.
    let irb120 = [
        [0.0, 290.0, -90.0, 0.0],
        [270.0, 0.0, 0.0, -90.0],
        [70.0, 0.0, -90.0, 0.0],
        [0.0, 302.0, 90.0, 0.0],
        [0.0, 0.0, -90.0, 0.0],
        [0.0, 72.0, 0.0, 180.0],
    ];
    assert_eq!(table("abb-irb-120"), irb120);
    // ukf-vslm-2023 Table I.
    let jr680 = [
        [250.0, 653.5, -90.0, 0.0],
        [900.0, 0.0, 0.0, -90.0],
        [-205.0, 0.0, 90.0, 180.0],
        [0.0, 1030.2, -90.0, 0.0],
        [0.0, 0.0, 90.0, 90.0],
        [0.0, 200.6, 0.0, 0.0],
    ];
    assert_eq!(table("hsr-jr680"), jr680);
    assert_eq!(load("hsr-jr680").unwrap().sheet.joints.angles, Angles::Dh);
    assert_eq!(load("abb-irb-120").unwrap().sheet.joints.angles, Angles::Logged);
}

#[test]
fn masses_fall_towards_the_flange() {
    let with_masses: Vec<Robot> = all().into_iter().filter(|robot| robot.model.bodies.is_some()).collect();
    assert!(with_masses.len() >= 4);
    for Robot { sheet, model, .. } in with_masses {
        let bodies = model.bodies.unwrap();
        let mass = |links: std::ops::Range<usize>| bodies[links].iter().map(|body| body.mass_kg).sum::<f64>();
        assert!(mass(0..3) > 2.0 * mass(3..6), "{}", sheet.name);
        assert!(bodies.iter().all(|body| body.mass_kg > 0.0 && body.mass_kg < 20.0), "{}", sheet.name);
        // No centre lies further from the end of its link than the link is long, give or take a housing.
        for (link, body) in model.links.iter().zip(&bodies) {
            let room = link.a_mm.abs() + link.d_mm.abs() + 180.0;
            assert!(Vector3::from(body.centre_mm).norm() < room, "{}: {body:?}", sheet.name);
        }
    }
}

/// The centres of mass, moved from the URDF frames into the DH frames, lie where the URDF has them at joints zero
/// (irb120_3_58_macro.xacro: joint origin plus inertial origin).
#[test]
fn centres_of_mass_are_in_the_dh_frames() {
    let model = load("abb-irb-120").unwrap().model;
    let bodies = model.bodies.unwrap();
    let frames = model.at_condition(&Default::default()).frames(&Vector6::zeros());
    let expected = [
        [0.0977, -0.12, 238.41],
        [0.78, -2.12, 290.0 + 101.24],
        [22.81, 1.06, 560.0 + 57.91],
        [224.7, 0.15, 630.41],
        [302.0 - 1.09, 0.0368, 630.0622],
        [374.0 - 7.06, -0.17, 629.99868],
    ];
    for i in 0..6 {
        let z = Vector3::from(frames.z[i + 1]);
        let x = match i {
            5 => Vector3::from(frames.x),
            _ => Vector3::from(frames.lateral[i]),
        };
        let centre = Vector3::from(bodies[i].centre_mm);
        let at = Vector3::from(frames.origin[i + 1]) + x * centre.x + z.cross(&x) * centre.y + z * centre.z;
        assert!((at - Vector3::from(expected[i])).norm() < 1e-3, "link {}: {at}", i + 1);
    }
}

#[test]
fn joint_maps_have_an_inverse_and_orientation_follows_the_dialect() {
    for Robot { sheet, model, .. } in all() {
        let inverse = model.joint_map.try_inverse().unwrap();
        assert!((model.joint_map * inverse - Matrix6::identity()).norm() < 1e-12);
        assert_eq!(sheet.orientation().is_none(), sheet.dialect == Some(Dialect::Hsr), "{}", sheet.name);
        assert!(!sheet.compensates);
    }
    assert_eq!(load("kuka-kr10-r1420").unwrap().sheet.orientation(), Some(Orientation::Abc));
}

#[test]
fn a_users_own_file_gives_the_same_robot() {
    let robot = parse(&own(), "my-arm.toml").unwrap();
    assert_eq!(robot, load("abb-irb-120").unwrap());
    let text = toml::to_string(&truegrind_arm::robots::sheet::RobotFile { robot: vec![robot.sheet.clone()] })
        .unwrap();
    assert_eq!(parse(&text, "again.toml").unwrap(), robot);
}

#[test]
fn the_least_that_a_file_may_hold() {
    let link = "[[robot.link]]\nmodel = \"dh\"\na_mm = 10.0\nd_mm = 100\nalpha_deg = 90.0\ntheta_deg = 0.0\n";
    let text = format!("[[robot]]\nname = \"mine\"\n{}", link.repeat(6));
    let robot = parse(&text, "mine.toml").unwrap();
    assert_eq!(robot.model.joint_map, Matrix6::identity());
    assert_eq!(robot.model.gravity, -Vector3::z());
    assert!(robot.model.bodies.is_none() && robot.sheet.joints.min_deg.is_none());
    assert!(robot.warnings.iter().any(|w| w.contains("no source")), "{:?}", robot.warnings);
    assert!(robot.warnings.iter().any(|w| w.contains("no range")), "{:?}", robot.warnings);
}

#[test]
fn plain_dh_on_parallel_axes_is_a_warning() {
    let text = own().replacen("model = \"hayati\"", "model = \"dh\"", 1);
    let robot = parse(&text, "my-arm.toml").unwrap();
    assert!(
        robot.warnings.iter().any(|w| w.contains("link 2") && w.contains("hayati")),
        "{:?}",
        robot.warnings
    );
}

#[test]
fn a_flange_turned_in_the_file_turns_the_flange() {
    let flange = "[robot.flange]\nposition_mm = [0.0, 0.0, 10.0]\nquaternion_wxyz = [0.0, 0.0, 0.0, 1.0]\n\n[robot.sources]";
    let text =
        own().replacen("theta_deg = 180.0", "theta_deg = 0.0", 1).replacen("[robot.sources]", flange, 1);
    let text = text.replacen("position_mm = [374.0", "position_mm = [384.0", 1);
    let robot = parse(&text, "my-arm.toml").unwrap();
    assert_eq!(robot.model.flange.translation.vector, Vector3::new(0.0, 0.0, 10.0));
}

/// Each fault, as an edit of a good file, and what the message must name: key, what was found or expected, remedy.
#[test]
fn bad_files_are_refused_by_key_with_a_remedy() {
    let cases: [(&str, &str, &str, &[&str]); 19] = [
        ("metres", "a_mm = 270.0", "a_mm = 0.27", &["published", "miss it by", "check lengths"]),
        (
            "misspelt key",
            "payload_kg",
            "payload",
            &["my-arm.toml:10:1", "unknown field `payload`", "payload_kg"],
        ),
        ("missing key", "alpha_deg = -90.0\n", "", &["my-arm.toml:", "missing field `alpha_deg`"]),
        ("text for number", "d_mm = 290.0", "d_mm = \"290\"", &["my-arm.toml:18:8", "invalid type: string"]),
        (
            "five limits",
            "min_deg = [-165.0, ",
            "min_deg = [",
            &["min_deg", "invalid length 5", "array of length 6"],
        ),
        ("unknown model", "\"hayati\"", "\"craig\"", &["craig", "`dh`", "`hayati`"]),
        ("modified dh", "standard-dh", "modified-dh", &["modified-dh", "standard-dh"]),
        ("not a number", "d_mm = 290.0", "d_mm = nan", &["link 1 d_mm", "NaN", "finite"]),
        (
            "min over max",
            "max_deg = [165.0",
            "max_deg = [-170.0",
            &["joint 1", "-165 and -170", "min below max"],
        ),
        (
            "d on hayati",
            "a_mm = 270.0\nd_mm = 0.0",
            "a_mm = 270.0\nd_mm = 5.0",
            &["link 2 d_mm", "hayati", "next link"],
        ),
        (
            "beta on dh",
            "theta_deg = 0.0\n\n[[robot.link]]\nmodel = \"h",
            "theta_deg = 0.0\nbeta_deg = 1.0\n\n[[robot.link]]\nmodel = \"h",
            &["link 1 beta_deg", "hayati"],
        ),
        (
            "hayati on square axes",
            "\"dh\"\na_mm = 70.0",
            "\"hayati\"\na_mm = 70.0",
            &["link 3 model", "parallel", "dh"],
        ),
        (
            "no gravity",
            "gravity = [0.0, 0.0, -1.0]",
            "gravity = [0, 0, 0]",
            &["mounting.gravity", "direction", "hangs"],
        ),
        (
            "no payload",
            "payload_kg = 3.0",
            "payload_kg = 0.0",
            &["payload_kg", "more than 0", "leave the key out"],
        ),
        (
            "quaternion",
            "[0.7071067812, 0.0, 0.7071067812, 0.0]",
            "[0.7, 0.0, 0.0, 0.0]",
            &["quaternion_wxyz", "length 1", "w, x, y, z"],
        ),
        (
            "wrong sign",
            "theta_deg = -90.0",
            "theta_deg = 90.0",
            &["flange with all joints at zero", "joints.map"],
        ),
        ("wrong turn", "theta_deg = 180.0", "theta_deg = 0.0", &["orientation 180", "theta_deg of link 6"]),
        (
            "two positions",
            "radius_mm = 580.0",
            "radius_mm = 580.0\nposition_mm = [580.0, 0.0, 290.0]",
            &["both", "exactly one"],
        ),
        (
            "one range",
            "max_deg = [165.0, 110.0, 70.0, 160.0, 120.0, 400.0]\n",
            "",
            &["joints.max_deg", "nothing", "both or none"],
        ),
    ];
    for (what, from, to, needles) in cases {
        let text = own();
        assert!(text.contains(from), "{what}: fixture");
        let message = parse(&text.replacen(from, to, 1), "my-arm.toml").unwrap_err().to_string();
        for needle in needles {
            assert!(message.contains(needle), "{what}: \"{needle}\" not in: {message}");
        }
        assert!(message.starts_with("my-arm.toml"), "{what}: {message}");
        assert!(!message.contains('\n'), "{what}: {message}");
    }
}

fn with_links(edit: impl Fn(&mut LinkSheet)) -> String {
    let mut sheet = load("abb-irb-120").expect("catalogue loads").sheet;
    sheet.link.iter_mut().for_each(edit);
    toml::to_string(&truegrind_arm::robots::sheet::RobotFile { robot: vec![sheet] })
        .expect("a sheet serializes")
}

#[test]
fn other_units_are_named() {
    let message = |text: &str| parse(text, "my-arm.toml").unwrap_err().to_string();
    let radians = message(&with_links(|link| {
        link.alpha_deg = link.alpha_deg.to_radians();
        link.theta_deg = link.theta_deg.to_radians();
    }));
    assert!(radians.contains("alpha_deg") && radians.contains("looks like radians"), "{radians}");
    let metres = message(&with_links(|link| {
        link.a_mm /= 1000.0;
        link.d_mm /= 1000.0;
    }));
    assert!(metres.contains("looks like metres") && metres.contains("multiply by 1000"), "{metres}");

    let mut sheet = load("abb-irb-120").unwrap().sheet;
    sheet.joints.min_deg = sheet.joints.min_deg.map(|v| v.map(f64::to_radians));
    let limits = Robot::new(sheet, "my-arm.toml").unwrap_err().to_string();
    assert!(limits.contains("joints.min_deg") && limits.contains("looks like radians"), "{limits}");

    let mut sheet = load("abb-irb-120").unwrap().sheet;
    sheet.masses.as_mut().unwrap().centre_mm.iter_mut().flatten().for_each(|v| *v /= 1000.0);
    let masses = Robot::new(sheet, "my-arm.toml").unwrap_err().to_string();
    assert!(masses.contains("masses.centre_mm") && masses.contains("metres"), "{masses}");
}

#[test]
fn counts_and_names_are_checked() {
    let mut sheet = load("abb-irb-120").unwrap().sheet;
    sheet.link.pop();
    let message = Robot::new(sheet, "my-arm.toml").unwrap_err().to_string();
    assert!(message.contains("5 links") && message.contains("six"), "{message}");

    let mut sheet = load("abb-irb-120").unwrap().sheet;
    sheet.joints.map = Some([[1.0; 6]; 6]);
    let message = Robot::new(sheet, "my-arm.toml").unwrap_err().to_string();
    assert!(message.contains("joints.map") && message.contains("inverse"), "{message}");

    assert_eq!(
        parse(ABB, "abb.toml").unwrap_err(),
        RobotError::Several { file: "abb.toml".into(), found: 7 }
    );
    assert_eq!(
        parse("robot = []", "x.toml").unwrap_err(),
        RobotError::Several { file: "x.toml".into(), found: 0 }
    );
    assert!(matches!(parse("not toml", "x.toml"), Err(RobotError::Syntax { line: 1, .. })));

    let message = load("abb-irb-121").unwrap_err().to_string();
    for needle in ["abb-irb-121", "abb-irb-120", "universal-robots-ur5", "TOML file"] {
        assert!(message.contains(needle), "{message}");
    }
}

/// The class: a number of a data sheet that no arm has goes into the nominal model.
#[test]
fn a_sheet_with_any_number_wrong_is_refused_or_makes_a_finite_arm() {
    let text = "[[robot]]\nname = \"mine\"\npayload_kg = 3.0\nreach_mm = 580.0\nrepeatability_mm = 0.01\n\
        [[robot.link]]\nmodel = \"dh\"\na_mm = 0\nd_mm = 290\nalpha_deg = -90\ntheta_deg = 0\n\
        [[robot.link]]\nmodel = \"dh\"\na_mm = 270\nd_mm = 0\nalpha_deg = 0\ntheta_deg = -90\n\
        [[robot.link]]\nmodel = \"dh\"\na_mm = 70\nd_mm = 0\nalpha_deg = -90\ntheta_deg = 0\n\
        [[robot.link]]\nmodel = \"dh\"\na_mm = 0\nd_mm = 302\nalpha_deg = 90\ntheta_deg = 0\n\
        [[robot.link]]\nmodel = \"dh\"\na_mm = 0\nd_mm = 0\nalpha_deg = -90\ntheta_deg = 0\n\
        [[robot.link]]\nmodel = \"dh\"\na_mm = 0\nd_mm = 72\nalpha_deg = 0\ntheta_deg = 180\n\
        [robot.joints]\nmap = [[1, 0, 0, 0, 0, 0], [0, 1, 0, 0, 0, 0], [0, 0.5, 1, 0, 0, 0], [0, 0, 0, 1, 0, 0], [0, 0, 0, 0, -1, 0], [0, 0, 0, 0, 0, 1]]\n\
        min_deg = [-165, -110, -110, -160, -120, -400]\nmax_deg = [165, 110, 70, 160, 120, 400]\nspeed_deg_s = [250, 250, 250, 320, 320, 420]\n\
        [robot.flange]\nposition_mm = [1, 2, 3]\nquaternion_wxyz = [0.6, 0.0, 0.8, 0.0]\n\
        [robot.mounting]\ngravity = [0, 0, -1]\nplate_mm = [0, 0, 5]\n\
        [robot.masses]\nmass_kg = [1, 2, 3, 4, 5, 6]\ncentre_mm = [[1, 2, 30], [1, 2, 3], [1, 2, 3], [1, 2, 3], [1, 2, 3], [1, 2, 3]]\n";
    truegrind_arm::robots::parse(text, "mine.toml").unwrap();
    for (said, text) in truegrind_testing::absurd::each(text) {
        let Ok(robot) = truegrind_arm::robots::parse(&text, "mine.toml") else { continue };
        assert!(!["nan", "inf", "1e308"].iter().any(|number| said.contains(number)), "{said}");
        let flange = robot.model.forward(&nalgebra::Vector6::repeat(0.3), &Default::default());
        assert!(flange.translation.vector.iter().all(|v| v.is_finite()), "{said}");
    }
    for (from, to, words) in [
        (
            "a_mm = 270",
            "a_mm = 1000000",
            "link 2 a_mm: found 1000000, expected a finite length in mm, within ±10,000",
        ),
        ("payload_kg = 3.0", "payload_kg = 1e9", "more than 0, up to 10,000 kg"),
        ("[0, 0.5, 1, 0, 0, 0]", "[0, 0.5, 1e-3, 0, 0, 0]", "joints.map: found a matrix of determinant"),
    ] {
        let error =
            truegrind_arm::robots::parse(&text.replace(from, to), "mine.toml").unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}
