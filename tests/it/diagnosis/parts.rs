//! The parts: tails, intervals, scores, rows that contradict themselves.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use truegrind::diagnosis::design::{Design, Slopes};
use truegrind::diagnosis::intervals::scan;
use truegrind::diagnosis::rows::{mismatches, prepare};
use truegrind::diagnosis::score::score_columns;
use truegrind::kinematics::condition::Condition;
use truegrind::math::tail::{chi_square_tail, log_chi_square_tail, normal_two_sided};
use truegrind::measurement::dataset::Sensor;
use truegrind::robots;

use super::simulator::{Setup, run};

#[test]
fn tails_are_those_of_the_tables() {
    // Abramowitz and Stegun, tables 26.1 and 26.8.
    for (value, freedom, p) in [
        (3.841_459, 1, 0.05),
        (6.634_897, 1, 0.01),
        (5.991_465, 2, 0.05),
        (7.814_728, 3, 0.05),
        (18.307_04, 10, 0.05),
        (29.588_3, 10, 0.001),
        (0.015_790_8, 1, 0.9),
    ] {
        let found = chi_square_tail(value, freedom);
        assert!((found / p - 1.0).abs() < 2e-5, "χ²({freedom}) {value}: {found} against {p}");
    }
    assert!((normal_two_sided(1.959_964) - 0.05).abs() < 1e-7);
    // Continuous where the two evaluations of erfc meet.
    let (a, b) = (log_chi_square_tail(12.499_999, 1), log_chi_square_tail(12.500_001, 1));
    assert!((a - b).abs() < 2e-6, "{a} {b}");
    assert!(log_chi_square_tail(1e6, 3).is_finite());
    assert_eq!(log_chi_square_tail(-1.0, 3), 0.0);
}

/// A design of white residuals over one nuisance column of ones.
fn plain(n: usize, residual: impl Fn(usize) -> f64) -> Design {
    let residual = DVector::from_fn(n, |i, _| residual(i));
    let q = 1.0 / (n as f64).sqrt();
    let mean = residual.mean();
    let residual = residual.add_scalar(-mean);
    let slopes = Slopes {
        by_joint: vec![DVector::zeros(n); 6],
        by_growth: DVector::zeros(n),
        by_tool: DMatrix::zeros(n, 3),
        by_frame: DMatrix::zeros(n, 3),
        by_zero: DVector::from_element(n, 1.0),
        by_scale: DVector::zeros(n),
        by_sag: DVector::zeros(n),
        mm: vec![1.0; n],
    };
    let basis = DMatrix::from_element(1, n, q);
    Design { observations: n, per: 1, basis, residual, slopes: Arc::new(slopes) }
}

#[test]
fn a_step_is_found_to_the_row_and_white_noise_has_none() {
    let wave = |i: usize| ((i * i * 37 + 11 * i) % 101) as f64 / 50.0 - 1.0;
    let design = plain(700, |i| wave(i) + if (213..=480).contains(&i) { 3.0 } else { 0.0 });
    let columns = DMatrix::from_element(700, 1, 1.0);
    let best = scan(&design, &columns, &[5.0], 2);
    assert_eq!((best[0].from, best[0].to), (213, 480));
    assert!(best[0].evidence > 500.0);
    let quiet = plain(700, wave);
    assert!(scan(&quiet, &columns, &[5.0], 1)[0].evidence < 20.0);
}

#[test]
fn a_score_is_the_fall_of_the_squares_of_the_joint_fit() {
    let n = 60;
    let slope = |i: usize| i as f64 / 30.0 - 1.0;
    let design = plain(n, |i| 2.0 * slope(i) + ((i * 7) % 5) as f64 * 0.1);
    let columns = DMatrix::from_fn(n, 1, |i, _| slope(i));
    let found = score_columns(&design, &columns, &[1e6], 1.0);
    // The same by a least-squares fit of constant and slope.
    let full = DMatrix::from_fn(n, 2, |i, k| if k == 0 { 1.0 } else { slope(i) });
    let fitted = full.clone().svd(true, true).solve(&design.residual, 1e-12).unwrap();
    let left = (&design.residual - &full * &fitted).norm_squared();
    let fall = design.residual.norm_squared() - left;
    assert!((found.gain - fall).abs() < 1e-6 * fall, "{} against {fall}", found.gain);
    assert!((found.estimate[0] + fitted[1]).abs() < 1e-6, "residual is model minus reading");
    let tight = score_columns(&design, &columns, &[1e-6], 1.0);
    assert!(tight.gain < 1e-6 * found.gain, "a size prior holds what it is sure of");
    let many = score_columns(&design, &columns, &[1e6], 100.0);
    assert!((found.merit - many.merit - 2.0 * 100.0_f64.ln()).abs() < 1e-9);
}

#[test]
fn rows_whose_columns_contradict_each_other_are_named() {
    let nominal = robots::load("abb-irb-120").unwrap().model;
    let setup = Setup { sensor: Sensor::Cable, rows: 60, sigma_mm: 0.05, dirty: false, seed: 3 };
    let mut data = run(&nominal, &[], &setup).dataset;
    let step = 0.1_f64.to_radians();
    for row in &mut data.rows {
        row.readout_mm = Some(nominal.forward(&row.joints, &Condition::default()).translation.vector);
        row.joints = row.joints.map(|q| (q / step).round() * step);
    }
    data.angle_step_rad = Some(step);
    for wrong in [7, 31] {
        if let Some(at) = &mut data.rows[wrong].readout_mm {
            at.y += 30.0;
        }
    }
    let rows: Vec<usize> = mismatches(&data, &nominal).rows.iter().map(|r| r.0).collect();
    assert_eq!(rows, [7, 31]);
    let prepared = prepare(&data, &nominal);
    assert!(prepared.sharpening.is_ok(), "the other rows are sharpened without them");
    assert_eq!(
        prepared.observed.dataset.rows[7].joints, data.rows[7].joints,
        "a contradicting row stays as logged"
    );
    assert_ne!(prepared.observed.dataset.rows[8].joints, data.rows[8].joints);
}
