//! A diagnosis of poses in one orientation of the flange, where the place of the target is not seen.

use nalgebra::Vector3;

use truegrind_arm::estimated::ReasonKind;
use truegrind_calibration::diagnosis::cause_kind::CauseKind;
use truegrind_calibration::diagnosis::diagnose::{Diagnosed, Options, diagnose};
use truegrind_calibration::diagnosis::finding::Confidence;
use truegrind_calibration::measurement::dataset::{Dataset, Reading, Row, Sensor};

use super::simulator::{Log, Setup, run};
use crate::identification::unseen_target::{arm, measured, raster, start, tracker};

fn diagnosed(dataset: &Dataset) -> Diagnosed {
    diagnose(dataset, "arm", &arm(), &start(dataset), &Options::default(), &|_| {}).unwrap()
}

/// Of play of a joint no other name is identified: none of the sensor, of the log or of the set-up.
#[test]
fn a_raster_with_play_has_no_name_but_play() {
    for seed in [11, 12, 13, 14] {
        let found = diagnosed(&raster(seed));
        let wrong: Vec<&str> = found
            .diagnosis
            .findings
            .iter()
            .filter(|f| f.confidence == Confidence::Identified)
            .filter(|f| {
                !matches!(
                    f.effect,
                    CauseKind::Backlash | CauseKind::JointCompliance | CauseKind::GearEccentricity
                )
            })
            .map(|f| f.cause.as_str())
            .collect();
        assert!(wrong.is_empty(), "seed {seed}: {wrong:?}");
        assert!(found.estimated.verdict.has(ReasonKind::TargetNotShown), "seed {seed}");
    }
}

/// The cube of ISO 9283: five poses, thirty times. Few poses carry no name of the log, with four decimals or with one.
#[test]
fn few_poses_do_not_name_the_rounding_of_the_log() {
    let cube =
        [[0.0; 3], [-90.0, -90.0, 70.0], [-90.0, 90.0, 70.0], [90.0, 90.0, -70.0], [90.0, -90.0, -70.0]];
    let places: Vec<[f64; 3]> = (0..150).map(|i| cube[i % 5]).collect();
    let again: Vec<usize> = (0..150).map(|i| i % 5).collect();
    let rounded = |step_deg: f64, seed: u64| {
        let log = Log { angle_step_rad: Some(step_deg.to_radians()), ..Log::default() };
        let setup = Setup { sensor: Sensor::Position, rows: 5, sigma_mm: 0.01, dirty: false, seed, log };
        let mut dataset = run(&arm(), &[], &setup).dataset;
        dataset.rows.iter_mut().for_each(|row| row.extra = None);
        dataset.subset(&again)
    };
    let cubes = (21..25).map(|seed| measured(&places, seed));
    for dataset in cubes.chain((5..8).map(|seed| rounded(0.5, seed))) {
        let found = diagnosed(&dataset);
        assert!(found.diagnosis.poses_needed.is_some());
        let named = found.diagnosis.findings.iter().find(|f| f.effect == CauseKind::AngleRounding);
        assert!(named.is_none(), "{}", named.map_or("", |f| f.cause.as_str()));
    }
}

/// A drift of the sensor is told as far as the target moved against it: at the sensor, metres away, a turn and a shift cancel that nobody saw
/// apart.
#[test]
fn a_drift_is_told_where_the_readings_are() {
    // The stand turns about the middle of the readings, and shifts.
    let (mm, turn, time_constant_h) = (Vector3::new(0.04, -0.03, 0.02), Vector3::new(2e-4, -1e-4, 4e-4), 0.3);
    // Places out of their order, so that they tell nothing of the time.
    let places: Vec<[f64; 3]> = (0..120_usize)
        .map(|i| 37 * i % 120)
        .map(|k| {
            [20.0 * (k % 12) as f64 - 110.0, 30.0 * (k / 12 % 5) as f64 - 60.0, 60.0 * (k / 60) as f64 - 30.0]
        })
        .collect();
    for seed in [31, 32, 33] {
        let mut dataset = measured(&places, seed);
        let share = |row: &Row| 1.0 - (-row.condition.time_h.unwrap() / time_constant_h).exp();
        let last = share(dataset.rows.last().unwrap());
        let middle = dataset.rows.iter().map(|row| row.reading.place_mm()).sum::<Vector3<f64>>() / 120.0;
        for row in dataset.rows.iter_mut() {
            let share = share(row);
            if let Reading::Position(at) = &mut row.reading {
                let moved = mm + turn.cross(&(tracker().rotation * (*at - middle)));
                *at -= tracker().rotation.inverse() * moved * share;
            }
        }
        let found = diagnosed(&dataset);
        let causes = || found.diagnosis.findings.iter().map(|f| f.cause.as_str());
        let told = causes().find_map(|cause| cause.split_once("moved relative to the base by "));
        let (_, size) = told.unwrap_or_else(|| panic!("seed {seed}: {:?}", causes().collect::<Vec<_>>()));
        let size: f64 = size.split_once(" mm").unwrap().0.parse().unwrap();
        let truth = last * mm.norm();
        assert!((size / truth - 1.0).abs() < 0.3, "seed {seed}: {truth:.3} mm is told as {size:.3} mm");
    }
}
