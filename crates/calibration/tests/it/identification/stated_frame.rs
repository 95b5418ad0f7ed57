//! A stated frame of the sensor is judged by what the fit leaves with it and without it: in a small box an arm that is off by millimetres
//! looks like another frame, and the frame of the data sheet's arm tells neither a right frame nor a wrong one.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use rand::{RngExt as _, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use truegrind_arm::condition::Condition;
use truegrind_arm::inverse::Inverse;
use truegrind_arm::model::{Joints, Model};
use truegrind_arm::robots;
use truegrind_calibration::identification::calibration::Frames;
use truegrind_calibration::identification::start::candidate_frames;
use truegrind_calibration::identification::stated_frame::{
    contradicted_target, contradiction, contradiction_beside_geometry, judged_by_fit,
    target_contradiction_by_fit,
};
use truegrind_calibration::identification::tolerance::Tolerance;
use truegrind_calibration::measurement::dataset::{Dataset, Reading, Row, Sensor};
use truegrind_math::se3::Pose;

const TARGET_MM: [f64; 3] = [40.0, 15.0, 60.0];

fn tracker() -> Pose {
    let turn = UnitQuaternion::from_euler_angles(0.01, -0.02, 2.4);
    Pose::from_parts(Vector3::new(1900.0, -500.0, 300.0).into(), turn)
}

/// An arm whose joint zeros and links are off as on an arm that was never calibrated.
fn uncalibrated(nominal: &Model, rng: &mut ChaCha8Rng) -> Model {
    let mut normal = |sigma: f64| {
        let v: f64 = StandardNormal.sample(rng);
        v * sigma
    };
    let mut actual = nominal.clone();
    for link in &mut actual.links {
        link.a_mm += normal(0.7);
        link.d_mm += normal(0.7);
        link.alpha_rad += normal(2e-3);
        link.theta_rad += normal(4e-3);
    }
    actual
}

/// What the tracker sees of the target of an arm.
fn seen(actual: &Model, joints: &Joints, rng: &mut ChaCha8Rng) -> Reading {
    let at = tracker().inverse() * (actual.forward(joints, &Condition::default()) * Point3::from(TARGET_MM));
    let noise = Vector3::from_fn(|_, _| {
        let v: f64 = StandardNormal.sample(rng);
        0.02 * v
    });
    Reading::Position(at.coords + noise)
}

/// Readings in a box of 60 mm.
fn small_box(seed: u64) -> Dataset {
    let (nominal, still) = (robots::load("abb-irb-120").unwrap().model, Condition::default());
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let actual = uncalibrated(&nominal, &mut rng);
    let inverse = Inverse::new(&nominal, &still, &nominal);
    let middle = Joints::from_column_slice(&[0.0, 20.0, 0.0, 0.0, 60.0, 0.0].map(f64::to_radians));
    let centre = nominal.forward(&middle, &still);
    let mut rows = Vec::new();
    while rows.len() < 60 {
        let mut within = |half: f64| rng.random_range(-half..half);
        let place = Vector3::new(within(60.0), within(60.0), within(60.0));
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(within(0.3), within(0.3), within(0.3)));
        let at = Pose::from_parts((centre.translation.vector + place).into(), turn * centre.rotation);
        let Ok(found) = inverse.solve_near(&at, &middle) else { continue };
        rows.push(Row::new(rows.len(), found.joints, seen(&actual, &found.joints, &mut rng)));
    }
    Dataset::new("box.csv", Sensor::Position, rows)
}

#[test]
fn a_frame_is_judged_by_what_the_fit_leaves_with_it() {
    let nominal = robots::load("abb-irb-120").unwrap().model;
    let mut refused_by_nominal = 0;
    for seed in 0..4 {
        let dataset = small_box(seed);
        let found = candidate_frames(&dataset, &nominal).unwrap().remove(0);
        let tolerance = Tolerance { target_mm: 0.05, ..Tolerance::default() };
        let of_arm = Tolerance { learn_widths: true, ..Tolerance::default() };
        let touched = Pose::translation(TARGET_MM[0], TARGET_MM[1], TARGET_MM[2]);
        let judged = |off: Vector3<f64>| {
            let mut frame = tracker();
            frame.translation.vector += off;
            let stated =
                Frames { base_from_sensor: frame, flange_from_target: touched, ..Frames::at_origin(1) };
            let by_fit =
                judged_by_fit([&tolerance, &of_arm], (&stated, &found), [0.02, 2e-5], (&dataset, &nominal));
            (by_fit.0.unwrap(), contradiction(&dataset, &nominal, &stated, &found, 0.02).is_some())
        };
        let (right, by_nominal) = judged(Vector3::zeros());
        assert_eq!(right, None, "seed {seed}");
        refused_by_nominal += usize::from(by_nominal);
        let (wrong, _) = judged(Vector3::new(3.0, 0.0, 0.0));
        assert!(wrong.is_some_and(|said| said.contains("without it")), "seed {seed}");
    }
    assert!(refused_by_nominal > 0, "the arm must be off by more than frames of the data sheet's arm may be");
}

/// Rows that geometry rejects as outliers are not among those of its fit, whose weights are asked for.
#[test]
fn a_frame_is_judged_beside_outliers() {
    let nominal = robots::load("abb-irb-120").unwrap().model;
    let mut dataset = small_box(0);
    for row in [7, 31] {
        let Reading::Position(at) = &mut dataset.rows[row].reading else { panic!("a position") };
        at.x += 20.0;
    }
    let found = candidate_frames(&dataset, &nominal).unwrap().remove(0);
    let touched = Pose::translation(TARGET_MM[0], TARGET_MM[1], TARGET_MM[2]);
    let stated = Frames { base_from_sensor: tracker(), flange_from_target: touched, ..Frames::at_origin(1) };
    for scale in [None, Some(1e-4)] {
        let tolerance = Tolerance { target_mm: 0.05, scale, ..Tolerance::default() };
        let of_arm = Tolerance { learn_widths: true, scale, ..Tolerance::default() };
        let (judged, geometry) =
            judged_by_fit([&tolerance, &of_arm], (&stated, &found), [0.02, 2e-5], (&dataset, &nominal));
        assert_eq!(judged, Some(None));
        let geometry = geometry.unwrap();
        assert_eq!(geometry.rows.rows.len(), dataset.rows.len() - 2);
        let beside = contradiction_beside_geometry(&dataset, geometry, &stated, [0.02, 2e-5], scale);
        assert_eq!(beside, None);
        assert_eq!(target_contradiction_by_fit(&of_arm, &touched, 0.5, &found, (&dataset, &nominal)), None);
    }
}

/// Readings along a spiral about a blade, where the flange turns as it moves.
fn spiral(seed: u64) -> Dataset {
    let (nominal, still) = (robots::load("abb-irb-120").unwrap().model, Condition::default());
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let actual = uncalibrated(&nominal, &mut rng);
    let inverse = Inverse::new(&nominal, &still, &nominal);
    let middle = Joints::from_column_slice(&[0.0, 20.0, 0.0, 0.0, 60.0, 0.0].map(f64::to_radians));
    let centre = nominal.forward(&middle, &still);
    let mut rows = Vec::new();
    for k in 0..150 {
        let share = f64::from(k) / 149.0;
        let (along_mm, swing) = (240.0 * share - 120.0, 0.5 * (std::f64::consts::TAU * 10.0 * share).sin());
        let place = Vector3::new(120.0 * swing.sin(), along_mm, 120.0 * (swing.cos() - 1.0));
        let turn = UnitQuaternion::from_euler_angles(-0.1 * (along_mm / 60.0).sin(), swing, 0.0);
        let at = Pose::from_parts((centre.translation.vector + place).into(), turn * centre.rotation);
        let Ok(found) = inverse.solve_near(&at, &middle) else { continue };
        rows.push(Row::new(rows.len(), found.joints, seen(&actual, &found.joints, &mut rng)));
    }
    Dataset::new("spiral.csv", Sensor::Position, rows)
}

/// A point that was touched exactly is right on a smooth path too, where the data sheet's arm puts it elsewhere; one that is centimetres off is not.
#[test]
fn a_touched_point_is_judged_by_what_the_fit_leaves_of_it() {
    let nominal = robots::load("abb-irb-120").unwrap().model;
    let of_arm = Tolerance { learn_widths: true, ..Tolerance::default() };
    let mut refused_by_nominal = 0;
    for seed in 0..4 {
        let dataset = spiral(seed);
        let found = candidate_frames(&dataset, &nominal).unwrap().remove(0);
        for off_mm in [0.0, 30.0] {
            let touched = Pose::translation(TARGET_MM[0], TARGET_MM[1] + off_mm, TARGET_MM[2]);
            let by_nominal = contradicted_target(&dataset, &nominal, &touched, 0.5, &found);
            let by_fit = target_contradiction_by_fit(&of_arm, &touched, 0.5, &found, (&dataset, &nominal));
            assert_eq!(by_fit.is_some(), off_mm > 0.0, "seed {seed}, {off_mm} mm off: {by_fit:?}");
            refused_by_nominal += usize::from(off_mm == 0.0 && by_nominal.is_some());
        }
    }
    assert!(
        refused_by_nominal > 0,
        "the arm must be off by more than a point beside the data sheet's arm may be"
    );
}
