//! An arm on a wall or a ceiling whose robot file was not told is noticed, and what its weight does is no fault of a joint.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::Vector3;
use truegrind_arm::model::Model;
use truegrind_arm::robots;
use truegrind_calibration::diagnosis::diagnose::{Diagnosed, Options, diagnose};
use truegrind_calibration::diagnosis::finding::Confidence;
use truegrind_calibration::measurement::dataset::Sensor;

use super::scenarios::frames;
use super::simulator::{Hidden, Log, Setup, run};

const PEDESTAL: Hidden = Hidden::Tilt { rad_per_nm: 1e-5 };

fn arm(gravity: [f64; 3]) -> Model {
    Model { gravity: Vector3::from(gravity), ..robots::load("abb-irb-120").unwrap().model }
}

/// An arm that leans by so much, diagnosed as one with a stated direction of gravity.
fn diagnosed(hidden: &[Hidden], lean_rad: f64, stated: [f64; 3], seed: u64) -> Diagnosed {
    let log = Log { lean_rad, ..Log::default() };
    let setup = Setup { sensor: Sensor::Position, rows: 300, sigma_mm: 0.03, dirty: false, seed, log };
    let dataset = run(&arm([0.0, 0.0, -1.0]), hidden, &setup).dataset;
    let arm = arm(stated);
    let frames = frames(&dataset, &arm);
    diagnose(&dataset, "abb-irb-120", &arm, &frames, &Options::default(), &|_| ()).unwrap()
}

fn note(found: &Diagnosed) -> Option<&String> {
    found.diagnosis.notes.iter().find(|note| note.starts_with("gravity seems to act"))
}

fn identified(found: &Diagnosed) -> Vec<&str> {
    let sure = found.diagnosis.findings.iter().filter(|f| f.confidence == Confidence::Identified);
    sure.map(|f| f.effect.as_str()).collect()
}

/// A pedestal on a wall: without the mount it was an axis that wobbles, a joint that yields or two gears, with certainty.
#[test]
fn a_wall_that_no_file_states_is_told_and_names_no_joint() {
    for seed in [101, 102] {
        let found = diagnosed(&[PEDESTAL], FRAC_PI_2, [0.0, 0.0, -1.0], seed);
        let note = note(&found).expect("a note on the mounting");
        assert!(note.contains("along −x") && note.contains("gravity = [-1.000, 0.000, 0.000]"), "{note}");
        assert!(identified(&found).is_empty(), "{:?}", identified(&found));
        let stated = diagnosed(&[PEDESTAL], FRAC_PI_2, [-1.0, 0.0, 0.0], seed);
        assert_eq!((self::note(&stated), identified(&stated)), (None, vec!["base-tilt"]));
    }
}

#[test]
fn a_ceiling_that_no_file_states_is_told() {
    let yields = Hidden::Compliance { joint: 2, peak_rad: 0.0015 };
    for hidden in [PEDESTAL, yields] {
        let found = diagnosed(std::slice::from_ref(&hidden), PI, [0.0, 0.0, -1.0], 103);
        let note = note(&found).expect("a note on the mounting");
        assert!(note.contains("along +z"), "{note}");
        assert_eq!(self::note(&diagnosed(&[hidden], PI, [0.0, 0.0, 1.0], 103)), None);
    }
}

/// Nor is an arm on a floor said to hang, whatever is wrong with it.
#[test]
fn what_is_wrong_with_an_upright_arm_is_no_other_gravity() {
    let faults = [
        PEDESTAL,
        Hidden::Wobble { joint: 0, peak_rad: 4e-4, phase: 0.5 },
        Hidden::Gear { joint: 1, order: 1.0, peak_rad: 0.001, phase: 0.7 },
        Hidden::Compliance { joint: 1, peak_rad: 0.0015 },
        Hidden::Backlash { joint: 2, play_rad: 0.001 },
    ];
    for (k, fault) in faults.into_iter().enumerate() {
        let found = diagnosed(&[fault], 0.0, [0.0, 0.0, -1.0], 110 + k as u64);
        assert_eq!(note(&found), None);
        assert_eq!(identified(&found).len(), 1, "{:?}", found.diagnosis.findings);
    }
}
