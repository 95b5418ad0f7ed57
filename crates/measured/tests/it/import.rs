//! Real measurement files are read as they are.

use truegrind_calibration::measurement::dataset::{Reading, Sensor};
use truegrind_measured::data_set;

#[test]
#[cfg_attr(not(measured_data), ignore = "TRUEGRIND_DATA names no folder of measured data")]
fn robot_cali() {
    let first = data_set("RobotCali.xlsx", None);
    assert_eq!((first.rows.len(), first.sensor), (120, Sensor::Cable));
    assert_eq!(first.sheet.as_deref(), Some("Sheet1"));
    assert_eq!(first.angle_step_rad, Some(0.1f64.to_radians()));
    assert_eq!(first.readout_step_mm, Some(0.1));
    assert_eq!(first.reading_step_mm, Some(0.01));
    assert_eq!(first.rows[0].reading, Reading::Cable(509.19));
    assert_eq!(first.rows[0].readout_mm().unwrap().y, -451.9);
    assert!(first.notes.iter().any(|n| n.contains("Sheet2") && n.contains("10 rows")), "{:?}", first.notes);
    let second = data_set("RobotCali.xlsx", Some("Sheet2"));
    assert_eq!(second.rows.len(), 10);
    assert_eq!(second.sha256, first.sha256);
}

#[test]
#[cfg_attr(not(measured_data), ignore = "TRUEGRIND_DATA names no folder of measured data")]
fn hsr() {
    let data = data_set("HSR-RobotCali.xlsx", None);
    assert_eq!((data.rows.len(), data.sensor), (2017, Sensor::Cable));
    assert_eq!(data.angle_step_rad, Some(0.001f64.to_radians()));
    assert!(data.notes.iter().any(|n| n == "1 blank row skipped"), "{:?}", data.notes);
    assert!(data.notes.iter().any(|n| n == "2 columns without a header skipped"), "{:?}", data.notes);
}

#[test]
#[cfg_attr(not(measured_data), ignore = "TRUEGRIND_DATA names no folder of measured data")]
fn universal_robots() {
    let ur10 = data_set("ur10-landgraf/series-a.csv", None);
    assert_eq!((ur10.rows.len(), ur10.sensor), (11_911, Sensor::Pose));
    assert_eq!(ur10.rows[0].condition.temperature_c, Some(23.68));
    assert_eq!(ur10.rows[0].condition.time_h, Some(0.0));
    assert_eq!(ur10.angle_step_rad, None);
    let later = data_set("ur10-landgraf/series-d.csv", None);
    assert_eq!((later.rows.len(), later.sensor), (632, Sensor::Pose));
    let ur5 = data_set("ur5-jacobi/grid.csv", None);
    assert_eq!((ur5.rows.len(), ur5.sensor), (1000, Sensor::Position));
}
