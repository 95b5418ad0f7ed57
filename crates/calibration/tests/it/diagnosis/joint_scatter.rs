//! A joint that stands elsewhere from reading to reading is told, and what programs may be off by contains it.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use truegrind_arm::effect::Effect;
use truegrind_arm::parameter::Parameter;
use truegrind_arm::robots;
use truegrind_calibration::diagnosis::cause_kind::CauseKind;
use truegrind_calibration::diagnosis::diagnose::{Diagnosed, Options, diagnose};
use truegrind_calibration::diagnosis::finding::Finding;
use truegrind_calibration::measurement::dataset::{Dataset, Sensor};

use super::scenarios::frames;
use super::simulator::{Log, Setup, run};

/// The diagnosis of positions of an IRB 120 whose log is changed.
fn diagnosed(rows: usize, seed: u64, change: impl FnOnce(&mut Dataset)) -> Diagnosed {
    let nominal = robots::load("abb-irb-120").unwrap().model;
    let setup =
        Setup { sensor: Sensor::Position, rows, sigma_mm: 0.02, dirty: false, seed, log: Log::default() };
    let mut data = run(&nominal, &[], &setup).dataset;
    change(&mut data);
    diagnose(&data, "arm", &nominal, &frames(&data, &nominal), &Options::default(), &|_| {}).unwrap()
}

/// That of 300 positions whose joint 3 stands elsewhere than logged, by an angle of the row (rad).
fn with_joint_3_off(seed: u64, mut off: impl FnMut(&mut ChaCha8Rng) -> f64) -> Diagnosed {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    diagnosed(300, seed, |data| data.rows.iter_mut().for_each(|row| row.joints[2] -= off(&mut rng)))
}

fn unexplained(found: &Diagnosed) -> Option<&Finding> {
    found.diagnosis.findings.iter().find(|finding| finding.effect == CauseKind::Unexplained)
}

/// σ of the written arm about a joint (rad), of what no cause explains; 0 without such an error.
fn sigma_rad(found: &Diagnosed, joint: usize) -> f64 {
    let estimated = &found.estimated;
    let stands_for_it = |index: usize| match &estimated.model.effects[index] {
        Effect::GearEccentricity(harmonic) => harmonic.joint == joint && harmonic.amplitude_rad() == 0.0,
        _ => false,
    };
    let variances = estimated.order.iter().enumerate().filter_map(|(place, parameter)| match parameter {
        Parameter::Effect { index, .. } if stands_for_it(*index) => {
            Some(estimated.covariance[(place, place)])
        }
        _ => None,
    });
    variances.fold(0.0, f64::max).sqrt()
}

#[test]
fn play_whose_side_no_row_tells_is_an_error_about_its_joint() {
    for seed in 0..3 {
        let found = with_joint_3_off(seed, |rng| if rng.random_bool(0.5) { 4e-4 } else { -4e-4 });
        let finding = unexplained(&found).unwrap();
        assert_eq!(finding.joints.as_deref(), Some(&[3][..]), "{}", finding.cause);
        assert!(finding.cause.contains("joint 3 did not return to the same angle"), "{}", finding.cause);
        assert!(finding.remedy.contains("column approach3"), "{}", finding.remedy);
        let sigma = sigma_rad(&found, 2);
        assert!((sigma / 4e-4 - 1.0).abs() < 0.1, "{sigma}");
    }
}

/// A robust fit follows eleven rows of twelve and all but ignores the twelfth: once this was "no cause beyond geometry".
#[test]
fn one_row_of_twelve_on_the_other_flank_is_no_set_of_outliers() {
    let mut row = 0;
    let found = with_joint_3_off(5, |rng| {
        row += 1;
        if (row * 7 + rng.random_range(0..3)) % 12 == 0 { 3e-3 } else { 0.0 }
    });
    let finding = unexplained(&found).unwrap();
    assert_eq!(finding.joints.as_deref(), Some(&[3][..]), "{}", finding.cause);
    // 3 mrad in one row of twelve: 0.83 mrad RMS about the mean.
    let sigma = sigma_rad(&found, 2);
    assert!((0.7e-3..1.1e-3).contains(&sigma), "{sigma}");
}

#[test]
fn a_joint_that_stands_where_it_is_logged_has_no_scatter() {
    for seed in 0..4 {
        let found = with_joint_3_off(seed, |_| 0.0);
        assert!(unexplained(&found).is_none(), "{:?}", unexplained(&found));
        assert_eq!(sigma_rad(&found, 2), 0.0);
    }
}

/// Angles in steps of 0.1° scatter by 0.029° about every joint, most visibly about the one with the longest lever.
#[test]
fn rounding_of_the_log_is_no_scatter_of_a_joint() {
    let step = 0.1_f64.to_radians();
    let found = diagnosed(400, 5, |data| {
        data.rows.iter_mut().for_each(|row| row.joints.apply(|q| *q = (*q / step).round() * step));
        data.angle_step_rad = Some(step);
    });
    assert!(unexplained(&found).is_none(), "{:?}", unexplained(&found).map(|finding| &finding.cause));
    assert!(found.benefit.unwrap().estimated_without_scale_mm < 0.15, "{:?}", found.benefit);
}

/// Zeros of joints that change in the course of a measurement are the arm's, not the set-up's.
#[test]
fn zeros_that_change_are_named_with_their_joints() {
    let found = diagnosed(300, 7, |data| {
        for joints in data.rows.iter_mut().map(|row| &mut row.joints).skip(130) {
            (joints[1], joints[2], joints[4]) = (joints[1] - 2e-3, joints[2] + 2e-3, joints[4] + 4e-3);
        }
    });
    let first = &found.diagnosis.findings[0];
    assert_eq!(first.effect, CauseKind::SetupChange);
    assert!(first.cause.starts_with("the zeros of joints 2, 3 and 5 changed"), "{}", first.cause);
    assert_eq!(first.joints.as_deref(), Some(&[2, 3, 5][..]));
}
