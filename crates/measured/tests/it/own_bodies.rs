//! Poses that real arms took.

use nalgebra::Vector3;
use truegrind_calibration::identification::calibration::Frames;
use truegrind_calibration::measurement::convention::AngleConvention;
use truegrind_calibration::measurement::dataset::Sensor;
use truegrind_measured::data_set;
use truegrind_planning::poses::MeasurementSetup;
use truegrind_planning::poses::keep_out::{KeepOut, is_clear};

/// None of them is a collision of the arm with itself: such a check would take good poses away.
#[test]
#[cfg_attr(not(measured_data), ignore = "TRUEGRIND_DATA names no folder of measured data")]
fn no_measured_pose_is_a_collision_of_the_arm_with_itself() {
    for (file, sheet, robot) in [
        ("RobotCali.xlsx", Some("Sheet1"), "abb-irb-120"),
        ("RobotCali.xlsx", Some("Sheet2"), "abb-irb-120"),
        ("HSR-RobotCali.xlsx", None, "hsr-jr680"),
        ("ur5-jacobi/grid.csv", None, "universal-robots-ur5"),
        ("ur10-landgraf/series-a.csv", None, "universal-robots-ur10"),
        ("ur10-landgraf/series-d.csv", None, "universal-robots-ur10"),
    ] {
        let nominal = truegrind_arm::robots::load(robot).unwrap().model;
        let mut frames = Frames::at_origin(1);
        frames.flange_from_target.translation.vector = Vector3::new(0.0, 0.0, 40.0);
        let setup = MeasurementSetup { nominal: &nominal, sensor: Sensor::Position, frames: &frames };
        let reach: f64 = nominal.links[1..].iter().map(|l| l.a_mm.abs() + l.d_mm.abs()).sum();
        let space = KeepOut { radius_mm: reach / 12.0, ..KeepOut::default() };
        // The logged angles of this file contain the offsets of the links already.
        let dh = file.starts_with("HSR");
        let convention = if dh { AngleConvention::Dh } else { AngleConvention::Logged };
        let rows = convention.apply(data_set(file, sheet), &nominal).unwrap().rows;
        let lost = rows.iter().filter(|row| !is_clear(&setup, &space, &row.joints)).count();
        assert_eq!(lost, 0, "{file}: {lost} of {} rows", rows.len());
    }
}
