//! The picture of a measurement file.

use nalgebra::{Point3, Vector3};
use re_sdk_types::archetypes::{LineStrips3D, Points3D, Scalars};
use re_sdk_types::components::Scalar;
use re_sdk_types::components::{Color, LineStrip3D};
use truegrind_arm::condition::Condition;
use truegrind_arm::model::{Joints, Model};
use truegrind_calibration::diagnosis::diagnose;
use truegrind_calibration::identification::calibration::Frames;
use truegrind_calibration::measurement::dataset::{Dataset, Reading, Row, Sensor};
use truegrind_calibration::measurement::import;
use truegrind_math::se3::Pose;
use truegrind_pictures::measured::{AXIS, Residuals};
use truegrind_pictures::{MeasuredScene, VisualError, diagnosis_recording, measured_recording};

use super::read::Read;
use truegrind_calibration::identification::start::candidate_frames;

const OUTLET: [f64; 3] = [900.0, -200.0, 30.0];
const HOOK: [f64; 3] = [10.0, 0.0, 40.0];

fn arm() -> Model {
    truegrind_arm::robots::load("abb-irb-120").unwrap().model
}

fn frames() -> Frames {
    Frames {
        flange_from_target: Pose::translation(HOOK[0], HOOK[1], HOOK[2]),
        outlets_mm: vec![Vector3::from(OUTLET)],
        ..Frames::at_origin(1)
    }
}

fn dataset(count: usize) -> Dataset {
    let arm = arm();
    let rows = (0..count).map(|i| {
        let joints = Joints::from_fn(|j, _| 0.6 * ((i * (j + 3)) as f64 * 0.37 + j as f64).sin());
        let hook = arm.forward(&joints, &Condition::default()) * Point3::from(HOOK);
        Row::new(i, joints, Reading::Cable((hook - Point3::from(OUTLET)).norm()))
    });
    Dataset {
        file: "poses_1.csv".to_owned(),
        sha256: String::new(),
        sensor: Sensor::Cable,
        rows: rows.collect(),
        notes: vec!["1 column without a header skipped".to_owned()],
        joined_by_time: false,
        station_names: Vec::new(),
        angle_step_rad: None,
        readout_step_mm: None,
        reading_step_mm: None,
        other_columns: Vec::new(),
        sheet: None,
    }
}

#[test]
fn rows_sensor_and_residuals_are_drawn() {
    let (arm, dataset, frames) = (arm(), dataset(30), frames());
    let residuals = |stage: &str, size: f64| Residuals {
        stage: stage.to_owned(),
        rows: (0..30).map(|i| (i, size * (i as f64 - 10.0))).collect(),
    };
    let residuals = [residuals("before", 0.5), residuals("after", 0.05)];
    let scene = MeasuredScene {
        dataset: &dataset,
        arm: &arm,
        arm_is: "abb-irb-120",
        nominal: None,
        meshes: &[],
        planned: false,
        keep_out_mm: &[],
        answer: &[],
        frames: Some(&frames),
        residuals: &residuals,
        held_out: &[(3, 0.2), (8, -0.1)],
        set_aside: &[29],
        identification: None,
        diagnosis: None,
    };
    let read = Read::of(&measured_recording(&scene).unwrap().rrd().unwrap());
    assert_eq!(read.axes().keys().collect::<Vec<_>>(), [AXIS]);
    // The cable runs from the outlet to the hook, as long as the reading.
    let cables = read.values::<LineStrip3D>("/sensor/cable", &LineStrips3D::descriptor_strips());
    assert_eq!(cables.len(), 30);
    for ((time, strip), row) in cables.iter().zip(&dataset.rows) {
        assert_eq!(*time, Some(row.number as i64));
        let [from, to] = [0, 1].map(|k| Vector3::from(strip[0].0[k].0.map(f64::from)));
        assert!((from - Vector3::from(OUTLET)).norm() < 1e-3);
        assert_eq!(
            row.reading,
            Reading::Cable(match row.reading {
                Reading::Cable(length) if ((to - from).norm() - length).abs() < 1e-3 => length,
                _ => f64::NAN,
            })
        );
    }
    let after = read.values::<Scalar>("/residual/2", &Scalars::descriptor_scalars());
    assert_eq!(after.len(), 30);
    assert!((after[29].1[0].0.0 - 0.95).abs() < 1e-12);
    assert_eq!(read.values::<Scalar>("/residual/held_out", &Scalars::descriptor_scalars()).len(), 2);
    assert_eq!(
        read.fixed::<re_sdk_types::components::Text>("/set_aside", &Points3D::descriptor_labels())[0]
            .to_string(),
        "row 29 set aside"
    );
    // Colours follow the size of the last stage: row 10 has none, row 29 the most.
    let colours = read.fixed::<Color>("/touched", &Points3D::descriptor_colors());
    assert_eq!(colours.len(), 30);
    assert_eq!(colours[9], colours[11]);
    assert_ne!(colours[10], colours[29]);
    let views = read.views();
    assert!(views.iter().any(|(_, n)| n == "Residual, model − reading [mm], over rows"), "{views:?}");
    let text = read.summary();
    for needle in ["poses\\_1.csv", "30 rows, sensor: cable", "1 column without a header skipped", "| 6 |"] {
        assert!(text.contains(needle), "{needle} not in\n{text}");
    }
}

/// A file alone: no sensor, no residuals, no legend.
#[test]
fn a_file_alone_is_a_picture_too() {
    let (arm, dataset) = (arm(), dataset(12));
    let scene = MeasuredScene {
        dataset: &dataset,
        arm: &arm,
        arm_is: "abb-irb-120",
        nominal: None,
        meshes: &[],
        planned: false,
        keep_out_mm: &[],
        answer: &[],
        frames: None,
        residuals: &[],
        held_out: &[],
        set_aside: &[],
        identification: None,
        diagnosis: None,
    };
    let read = Read::of(&measured_recording(&scene).unwrap().rrd().unwrap());
    let entities = read.entities();
    assert!(entities.contains("/touched") && entities.contains("/joints/1"));
    assert!(!entities.iter().any(|e| e.starts_with("/legend") || e.starts_with("/residual")), "{entities:?}");
    // Without frames the points are the flange's.
    let points =
        read.fixed::<re_sdk_types::components::Position3D>("/touched", &Points3D::descriptor_positions());
    let flange = arm.forward(&dataset.rows[5].joints, &Condition::default()).translation.vector;
    assert!((Vector3::new(points[5].x(), points[5].y(), points[5].z()).cast::<f64>() - flange).norm() < 1e-3);
}

#[test]
fn no_rows_no_picture() {
    let (arm, dataset) = (arm(), dataset(0));
    let scene = MeasuredScene {
        dataset: &dataset,
        arm: &arm,
        arm_is: "abb-irb-120",
        nominal: None,
        meshes: &[],
        planned: false,
        keep_out_mm: &[],
        answer: &[],
        frames: None,
        residuals: &[],
        held_out: &[],
        set_aside: &[],
        identification: None,
        diagnosis: None,
    };
    assert!(matches!(measured_recording(&scene), Err(VisualError::Empty(why)) if why.contains("no rows")));
}

#[test]
fn a_diagnosis_says_in_its_picture_what_it_found() {
    let bytes = include_bytes!("../../../../tests/data/irb120-cable.csv");
    let dataset = import::read("irb120-cable.csv", bytes, &import::Options::default()).unwrap();
    let options = diagnose::Options::default();
    let start = candidate_frames(&dataset, &arm()).unwrap().remove(0);
    let found = diagnose::diagnose(&dataset, "abb-irb-120", &arm(), &start, &options, &|_| {}).unwrap();
    assert!(!found.diagnosis.findings.is_empty());
    let text = Read::of(&diagnosis_recording(&dataset, &found, &[]).unwrap().rrd().unwrap()).summary();
    for finding in &found.diagnosis.findings {
        assert!(text.contains(&finding.cause), "{}: {text}", finding.cause);
    }
    assert!(text.contains("| with causes |") && text.contains("Noise floor"), "{text}");
}
