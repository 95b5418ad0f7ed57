//! Tables of other programs: recognised by their content, named in the notes, refused if unusable.

use truegrind_calibration::measurement::dataset::{Dataset, Reading, Sensor};
use truegrind_calibration::measurement::import::{self, ImportError, Options};

fn read(text: &str) -> Result<Dataset, ImportError> {
    import::read("rows.txt", text.as_bytes(), &Options::default())
}

fn complaint(text: &str) -> String {
    read(text).map(|_| ()).unwrap_err().to_string()
}

fn robodk(rows: usize, tcp: impl Fn(usize) -> f64) -> String {
    let row = |k: usize| {
        let j = k as f64;
        let point =
            if k == 2 { "0,0,0.0000".to_owned() } else { format!("{},{},{}", 800.0 + j, 10.0 - j, 900.5) };
        format!("{},{},{},{},{},{},{point},{},5,120\n", 10.0 + j, -20.0, 30.5, 4.0 * j, 50.0, -60.0, tcp(k))
    };
    (0..rows).map(row).collect()
}

#[test]
fn a_calibration_table_of_robodk_leaves_out_what_was_not_measured() {
    // RoboDK's own macros ignore the first line, whatever it is.
    let headers = [
        "J1,J2,J3,J4,J5,J6,X,Y,Z,TCPx,TCPy,TCPz",
        "q1,q2,q3,q4,q5,q6,X,Y,Z,TX,TY,TZ",
        "Joints,,,,,,XYZ,,,TCP",
    ];
    for header in std::iter::once(String::new()).chain(headers.map(|names| names.to_owned() + "\n")) {
        let data = read(&format!("{header}{}", robodk(6, |_| 0.0))).unwrap();
        assert_eq!((data.sensor, data.rows.len()), (Sensor::Position, 5), "{header}");
        let Reading::Position(point) = data.rows[2].reading else { panic!("a position") };
        assert_eq!((point.x, point.y, point.z), (803.0, 7.0, 900.5));
        assert!((data.rows[2].joints[3].to_degrees() - 12.0).abs() < 1e-12);
        // The line of the file, counted as an editor does.
        assert_eq!(data.rows[2].line, 4 + u32::from(!header.is_empty()));
        assert!(
            data.notes[0].contains("RoboDK") && data.notes[0].contains("(0, 5, 120)"),
            "{:?}",
            data.notes
        );
        assert!(data.notes[1].starts_with("1 rows whose point is near zero"), "{:?}", data.notes);
    }
    for (fault, words) in [
        ("", "row 4: found 12 cells"),
        ("off", "row 4: found 12 cells"),
        ("NaN", "row 4, column q1: found `NaN`"),
    ] {
        let said = complaint(&robodk(6, |_| 0.0).replace("\n13,", &format!("\n{fault},")));
        assert!(said.starts_with(&format!("rows.txt, {words}")), "{fault}: {said}");
    }
    let short = complaint(&robodk(6, |_| 0.0).replace("13,-20,", "13,"));
    assert!(
        short.starts_with("rows.txt, row 4: found 11 cells") && short.contains("expected 12 numbers"),
        "{short}"
    );
    let two = complaint(&robodk(8, |k| if k == 5 { 40.0 } else { 0.0 }));
    assert!(two.contains("more than one TCP") && two.contains("--also"), "{two}");
}

#[test]
fn other_numbers_and_our_own_names_are_none_of_theirs() {
    // Twelve columns whose last change from row to row, few rows, and nothing measured.
    assert!(complaint(&robodk(8, |k| k as f64)).contains("column"), "no guess");
    assert!(complaint(&robodk(3, |_| 0.0)).contains("column"));
    let nothing = "1,2,3,4,5,6,0,0,0,0,0,0\n".repeat(6);
    assert!(complaint(&nothing).contains("column"));
    // With our names x, y and z are the controller's own, and a sensor is missing; so it is with a name of ours in place of a TCP, and
    // joints in another order are not where RoboDK has them.
    for header in ["q1,q2,q3,q4,q5,q6,x,y,z,a,b,c", "J1,J2,J3,J4,J5,J6,x,y,z,a,b,c"] {
        let said = complaint(&format!("{header}\n{}", robodk(6, |_| 0.0)));
        assert!(
            said.contains("the controller's own read-out") && said.contains("rename them to measured_x"),
            "{said}"
        );
    }
    for header in ["q1,q2,q3,q4,q5,q6,X,Y,Z,temperature,payload,c", "q6,q5,q4,q3,q2,q1,X,Y,Z,a,b,c"] {
        let said = complaint(&format!("{header}\n{}", robodk(6, |_| 0.0)));
        assert!(said.contains("found no sensor's column"), "{said}");
    }
}

/// As RoboDK writes measured poses: angles about x, the new y and the new z, in radians.
fn robodk_poses(unit: f64, turn: [f64; 3], tcp: &str) -> String {
    let row = |k: usize| {
        let j = k as f64;
        let at = if k == 1 {
            "0,0,0,0,0,0".to_owned()
        } else {
            let [a, b, c] = turn.map(|angle| angle * unit);
            format!("{},{},900.5,{a},{b},{c}", 800.0 + j, 10.0 - j)
        };
        format!("{},-20,30.5,{},50,-60,{at},{tcp}\n", 10.0 + j, 4.0 * j)
    };
    format!("Joints,,,,,,Measured,,,,,,TCP\n{}", (0..6).map(row).collect::<String>())
}

#[test]
fn a_calibration_table_of_robodk_holds_poses_too() {
    let tcp = "-135.2,-53.1,71.3,-3.13,0.001,-1.15";
    let turn = [0.5, -0.3, 2.0];
    let data = read(&robodk_poses(1.0, turn, tcp)).unwrap();
    assert_eq!((data.sensor, data.rows.len()), (Sensor::Pose, 5));
    let Reading::Pose(pose) = &data.rows[1].reading else { panic!("a pose") };
    assert_eq!(pose.translation.vector.as_slice(), [802.0, 8.0, 900.5]);
    // `TxyzRxyz_2_Pose` of RoboDK, written out: rotx(a)·roty(b)·rotz(c).
    let [(sx, cx), (sy, cy), (sz, cz)] = turn.map(f64::sin_cos);
    let expected = nalgebra::Matrix3::new(
        cy * cz,
        -cy * sz,
        sy,
        cx * sz + cz * sx * sy,
        cx * cz - sx * sy * sz,
        -cy * sx,
        sx * sz - cx * cz * sy,
        cz * sx + cx * sy * sz,
        cx * cy,
    );
    assert!((pose.rotation.to_rotation_matrix().matrix() - expected).amax() < 1e-12);
    assert!(
        data.notes[0].contains("measured pose") && data.notes[1].starts_with("1 rows"),
        "{:?}",
        data.notes
    );
    // Where no orientation was measured, points.
    assert_eq!(read(&robodk_poses(1.0, [0.0; 3], tcp)).unwrap().sensor, Sensor::Position);
    let degrees = complaint(&robodk_poses(57.29577951308232, turn, tcp));
    assert!(
        degrees.starts_with("rows.txt, row 2:") && degrees.contains("in radians, within ±π"),
        "{degrees}"
    );
}

fn delmia(turned: bool, joints: usize) -> String {
    let row = |k: usize| {
        let angles = if turned { "90\t0\t30" } else { "0\t0\t0" };
        let joints: Vec<String> = (0..joints).map(|j| format!("{}.25", 10 * (j + 1) + k)).collect();
        format!("Tag.{k}\t{}.5\t-200\t950\t{angles}\t{}\n", 700 + k, joints.join("\t"))
    };
    (0..5).map(row).collect()
}

#[test]
fn tags_of_delmia_are_points_or_poses() {
    for header in ["", "Name\tX\tY\tZ\tRoll\tPitch\tYaw\tJ1\tJ2\tJ3\tJ4\tJ5\tJ6\n"] {
        let data = read(&format!("{header}{}", delmia(false, 6))).unwrap();
        assert_eq!((data.sensor, data.rows.len()), (Sensor::Position, 5));
        assert!((data.rows[1].joints[5].to_degrees() - 61.25).abs() < 1e-12);
        assert!(data.notes[0].contains("DELMIA"), "{:?}", data.notes);
        let data = read(&format!("{header}{}", delmia(true, 6))).unwrap();
        let Reading::Pose(pose) = &data.rows[1].reading else { panic!("a pose") };
        assert_eq!(pose.translation.vector.as_slice(), [701.5, -200.0, 950.0]);
        // Roll about x first: its z points along −y then, which the yaw of 30° turns on.
        let z = pose.rotation * nalgebra::Vector3::z();
        let yaw = 30_f64.to_radians();
        assert!((z - nalgebra::Vector3::new(yaw.sin(), -yaw.cos(), 0.0)).norm() < 1e-9, "{z}");
    }
    let faulty = complaint(&delmia(false, 6).replace("\t32.25", "\t"));
    assert!(faulty.starts_with("rows.txt, row 3: found 13 cells") && faulty.contains("Auto ID"), "{faulty}");
    let short = complaint(&delmia(false, 6).replace("\t63.25", ""));
    assert!(short.starts_with("rows.txt, row 4: found 12 cells"), "{short}");
    let seven = complaint(&delmia(true, 7));
    assert!(seven.contains('7') && seven.contains("joint"), "{seven}");
}

const LOG: &str =
    "name,q1,q2,q3,q4,q5,q6\np1,10,20,30,40,50,60\np2,11,21,31,41,51,61\np3,15,21,31,41,51,61\n";
const POINTS: &str =
    "// Units: Millimeters\nMain p2 812.5 -40.25 903.125\nMain p1 800.5 -41.0 900.25\nMain p7 1.0 2.0 3.0\n";

fn joined(log: &str, points: &str) -> Result<Dataset, ImportError> {
    import::read_joined(
        ("joints.csv", log.as_bytes()),
        ("points.txt", points.as_bytes()),
        &Options::default(),
    )
}

#[test]
fn points_of_a_tracker_are_joined_by_name_and_what_has_no_partner_is_told() {
    let data = joined(LOG, POINTS).unwrap();
    let Reading::Position(point) = data.rows[1].reading else { panic!("a position") };
    assert_eq!((data.rows.len(), point.x, point.y, point.z), (2, 812.5, -40.25, 903.125));
    let told = data.notes.join("; ");
    assert!(told.contains("2 rows joined by name with 3 measured points") && told.contains("`p3`"), "{told}");
    // With group and collection, between commas, and in quotes.
    let full = POINTS.replace("Main ", "A::Main::").replace(' ', ", ").replace("//, Units:, ", "// Units: ");
    assert_eq!(joined(LOG, &full).unwrap().rows[0].reading, data.rows[0].reading);
}

#[test]
fn points_that_cannot_be_joined_are_refused_by_line() {
    let said = |log: &str, points: &str| joined(log, points).map(|_| ()).unwrap_err().to_string();
    let cases = [
        (said(LOG, ""), "points.txt: no line has a name and x, y, z"),
        (said(LOG, "// nothing\n"), "points.txt: no line has a name"),
        (
            said(LOG, &POINTS.replace("-40.25", "nan")),
            "points.txt, row 2: found `Main p2 812.5 nan 903.125`; expected 2 names",
        ),
        (said(LOG, &POINTS.replace("-40.25", "-1e999")), "points.txt, row 2: found"),
        (said(LOG, &POINTS.replace(" 903.125", "")), "points.txt, row 2: found `Main p2 812.5 -40.25`"),
        (
            said(LOG, &POINTS.replace("Millimeters", "Inches")),
            "points.txt, row 1: found `inch` in a comment on units; expected",
        ),
        (said(LOG, &POINTS.replace("p7", "p1")), "points.txt, row 4: point `p1` occurs twice"),
        (
            said(&LOG.replace("name", "operator"), POINTS),
            "joints.csv: has no column that names the measured points",
        ),
        (said(&LOG.replace('p', "x"), POINTS), "joints.csv: none of its names is that of a measured point"),
        (said("", POINTS), "joints.csv: found no rows"),
        (said(&LOG.replace("11,21", "11,"), POINTS), "joints.csv, row 3, column q2: found an empty cell"),
        (said(&LOG.replace(",q6", ""), POINTS), "column q6 is missing"),
    ];
    for (said, words) in cases {
        assert!(said.contains(words), "{said}\n without: {words}");
        assert!(!said.contains("CSV or XLSX"), "a remedy that is none: {said}");
    }
}
