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
    for header in ["", "J1,J2,J3,J4,J5,J6,X,Y,Z,TCPx,TCPy,TCPz\n"] {
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
    // With our names x, y and z are the controller's own, and a sensor is missing.
    let ours = format!("q1,q2,q3,q4,q5,q6,x,y,z,a,b,c\n{}", robodk(6, |_| 0.0));
    assert!(complaint(&ours).contains("measured_x"), "{}", complaint(&ours));
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
    let seven = complaint(&delmia(true, 7));
    assert!(seven.contains('7') && seven.contains("joint"), "{seven}");
}
