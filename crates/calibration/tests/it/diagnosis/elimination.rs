//! Backward elimination beside the discrepancy, against the same models built one by one.

use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use truegrind_arm::robots;
use truegrind_calibration::diagnosis::catalogue::Candidate;
use truegrind_calibration::diagnosis::cause::Cause;
use truegrind_calibration::diagnosis::design::Linear;
use truegrind_calibration::diagnosis::diagnose::Options;
use truegrind_calibration::diagnosis::discrepancy::Functions;
use truegrind_calibration::diagnosis::elimination::{Criteria, Tested, eliminate};
use truegrind_calibration::diagnosis::extension::{FreeParameters, Subject, fit};
use truegrind_calibration::diagnosis::preparation::prepare;
use truegrind_calibration::diagnosis::score::{log_p_of, score_columns};
use truegrind_calibration::measurement::dataset::{Reading, Sensor};

use super::scenarios;
use super::simulator::{Hidden, Log, Setup, run};

/// A gear and a tool shift that are there, a frame shift that is not, beside them what `unknown` adds, and noise that is `correlated`
/// from row to row.
fn compared(unknown: &[Hidden], correlated: bool) {
    let nominal = robots::load("abb-irb-120").expect("it ships").model;
    let setup = Setup {
        sensor: Sensor::Position,
        rows: 240,
        sigma_mm: 0.05,
        dirty: false,
        seed: 12,
        log: Log::default(),
    };
    let gear = Hidden::Gear { joint: 1, order: 1.0, peak_rad: 1.5e-3, phase: 0.4 };
    let tool = Hidden::Tool { from: 20, to: 90, mm: [0.8, -0.3, 0.2] };
    let absent = Hidden::Frame { from: 130, to: 160, mm: [0.0; 3] };
    let hidden: Vec<Hidden> = [gear.clone(), tool.clone()].iter().chain(unknown).cloned().collect();
    let mut data = run(&nominal, &hidden, &setup).dataset;
    if correlated {
        let (mut random, mut noise) = (ChaCha8Rng::seed_from_u64(5), [0.0; 3]);
        for row in data.rows.iter_mut() {
            noise = noise.map(|noise| 0.7 * noise + random.random_range(-0.2..0.2));
            if let Reading::Position(position) = &mut row.reading {
                (0..3).for_each(|axis| position[axis] += noise[axis]);
            }
        }
    }
    let listed = [gear, tool, absent];
    let prepared = prepare(&data, &nominal, true);
    let frames = scenarios::frames(&data, &nominal);
    let options = Options::default();
    let subject = Subject {
        observed: &prepared.observed,
        nominal: &nominal,
        frames: &frames,
        evaluated_at: &frames,
        tolerance: &options.tolerance,
    };
    let causes: Vec<Cause> = listed.iter().filter_map(scenarios::cause).collect();
    let fitted = fit(&subject, &causes, FreeParameters::All, None);
    let linear = Linear::of(&subject, &fitted);
    let design = linear.whole().design;
    let functions = Functions::of(&subject, &linear);
    let candidates: Vec<Candidate> = causes.iter().map(|cause| Candidate::of(cause, &subject)).collect();
    let columns: Vec<DMatrix<f64>> = candidates.iter().map(|c| c.columns(&design)).collect();
    let tested: Vec<Tested<'_>> = columns
        .iter()
        .zip(&causes)
        .enumerate()
        .map(|(k, (columns, cause))| Tested {
            columns,
            sizes: cause.sizes(),
            tried: 3.0,
            parameters: fitted.parameter_indices(k),
            is_shift: cause.rows().is_some(),
        })
        .collect();
    let numbers: Vec<usize> = (0..data.rows.len()).collect();
    let criteria = Criteria { families: 20.0, alpha: 0.01 };
    let found = eliminate(&linear, &functions, &tested, &numbers, criteria);
    assert_eq!(found.removed, [causes.len() - 1], "the shift that is not there");
    let discrepancy = &found.discrepancy;
    assert_eq!(discrepancy.correlation > 0.0, correlated, "{}", discrepancy.correlation);
    assert_eq!(discrepancy.columns.ncols() > 0, !unknown.is_empty());

    // The long way: each model's own basis, with the functions as parameters.
    let (rho, noise) = (discrepancy.correlation, discrepancy.noise);
    let whitened = linear.with_random_effects(&discrepancy.columns).prewhitened(rho, &numbers, noise);
    for (k, tested) in tested.iter().enumerate() {
        let mut others: Vec<usize> = found.removed.clone();
        others.retain(|other| *other != k);
        others.push(k);
        let dropped: Vec<usize> = others.iter().flat_map(|&k| fitted.parameter_indices(k)).collect();
        let beside = whitened.design(&dropped);
        let whiten = |columns: &DMatrix<f64>| {
            let mut out = columns.clone();
            for (i, pair) in numbers.windows(2).enumerate() {
                assert_eq!(pair[1], pair[0] + 1);
                for s in 3 * (i + 1)..3 * (i + 2) {
                    for c in 0..columns.ncols() {
                        out[(s, c)] =
                            (columns[(s, c)] - rho * columns[(s - 3, c)]) / (1.0 - rho * rho).sqrt();
                    }
                }
            }
            out / noise
        };
        let own = whiten(tested.columns);
        let score = score_columns(&beside, &own, &tested.sizes, tested.tried);
        let log_p = log_p_of(&beside, || own.clone(), &tested.sizes, &score);
        let log_p = (log_p + (tested.tried * criteria.families).ln()).min(0.0);
        let short = found.significance[k];
        let near = |a: f64, b: f64| (a - b).abs() < 1e-6 * (1.0 + a.abs());
        assert!(near(score.merit, short.merit), "merit {} against {}", score.merit, short.merit);
        assert!(near(log_p, short.log_p), "ln p {log_p} against {}", short.log_p);
        assert_eq!(short.is_significant, !found.removed.contains(&k));
    }
}

#[test]
fn independent_readings_without_a_discrepancy() {
    compared(&[], false);
}

#[test]
fn an_unknown_error_of_the_pose() {
    compared(&[Hidden::Warp { mm: 0.5 }], false);
}

#[test]
fn serially_correlated_readings() {
    compared(&[Hidden::Warp { mm: 0.5 }], true);
}
