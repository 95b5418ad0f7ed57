//! Real measurement files, where the environment variable `TRUEGRIND_DATA` says where they are.

use std::path::PathBuf;

use truegrind::measurement::dataset::{Dataset, Reading, Sensor};
use truegrind::measurement::import::{self, Options};

/// A real file's data set; `None`, said aloud, where the files are absent.
pub(super) fn load(path: &str, sheet: Option<&str>) -> Option<Dataset> {
    let Some(folder) = std::env::var_os("TRUEGRIND_DATA") else {
        eprintln!("skipped: TRUEGRIND_DATA is not set, so {path} was not read");
        return None;
    };
    let full = PathBuf::from(folder).join(path);
    let bytes = std::fs::read(&full).unwrap_or_else(|e| panic!("{}: {e}", full.display()));
    let options = Options { sheet: sheet.map(str::to_owned), ..Options::default() };
    Some(import::read(path, &bytes, &options).unwrap())
}

#[test]
fn robot_cali() {
    let Some(first) = load("RobotCali.xlsx", None) else { return };
    assert_eq!((first.rows.len(), first.sensor), (120, Sensor::Cable));
    assert_eq!(first.sheet.as_deref(), Some("Sheet1"));
    assert_eq!(first.angle_step_rad, Some(0.1f64.to_radians()));
    assert_eq!(first.readout_step_mm, Some(0.1));
    assert_eq!(first.reading_step_mm, Some(0.01));
    assert_eq!(first.rows[0].reading, Reading::Cable(509.19));
    assert_eq!(first.rows[0].readout_mm.unwrap().y, -451.9);
    assert!(first.notes.iter().any(|n| n.contains("Sheet2") && n.contains("10 rows")), "{:?}", first.notes);
    let second = load("RobotCali.xlsx", Some("Sheet2")).unwrap();
    assert_eq!(second.rows.len(), 10);
    assert_eq!(second.sha256, first.sha256);
}

#[test]
fn hsr() {
    let Some(data) = load("HSR-RobotCali.xlsx", None) else { return };
    assert_eq!((data.rows.len(), data.sensor), (2017, Sensor::Cable));
    assert_eq!(data.angle_step_rad, Some(0.001f64.to_radians()));
    assert!(data.notes.iter().any(|n| n == "1 blank row(s) skipped"), "{:?}", data.notes);
    assert!(data.notes.iter().any(|n| n == "2 column(s) without a header skipped"), "{:?}", data.notes);
}

#[test]
fn universal_robots() {
    let Some(ur10) = load("ur10-landgraf/series-a.csv", None) else { return };
    assert_eq!((ur10.rows.len(), ur10.sensor), (11_911, Sensor::Pose));
    assert_eq!(ur10.rows[0].condition.temperature_c, Some(23.68));
    assert_eq!(ur10.rows[0].condition.time_h, Some(0.0));
    assert_eq!(ur10.angle_step_rad, None);
    let later = load("ur10-landgraf/series-d.csv", None).unwrap();
    assert_eq!((later.rows.len(), later.sensor), (632, Sensor::Pose));
    let ur5 = load("ur5-jacobi/grid.csv", None).unwrap();
    assert_eq!((ur5.rows.len(), ur5.sensor), (1000, Sensor::Position));
}
