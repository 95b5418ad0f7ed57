//! The parts: tails, intervals, scores, rows that contradict themselves.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use truegrind_arm::condition::Condition;
use truegrind_arm::effect::Effect;
use truegrind_arm::effect::error_map::ErrorMap;
use truegrind_arm::parameter::Parameter;
use truegrind_arm::robots;
use truegrind_calibration::diagnosis::catalogue::Candidate;
use truegrind_calibration::diagnosis::cause::Cause;
use truegrind_calibration::diagnosis::design::{Design, Linear, Slopes};
use truegrind_calibration::diagnosis::diagnose::Options;
use truegrind_calibration::diagnosis::extension::{Extended, FreeParameters, Subject, fit};
use truegrind_calibration::diagnosis::held_out::FoldErrors;
use truegrind_calibration::diagnosis::intervals::scan;
use truegrind_calibration::diagnosis::levels::piecewise_levels;
use truegrind_calibration::diagnosis::newton::descend;
use truegrind_calibration::diagnosis::preparation::{mismatches, prepare};
use truegrind_calibration::diagnosis::score::score_columns;
use truegrind_calibration::diagnosis::validation::Validation;
use truegrind_calibration::measurement::dataset::Sensor;
use truegrind_calibration::measurement::sensor::disturbance::{Disturbance, Kind, Profile};
use truegrind_calibration::measurement::split;
use truegrind_estimation::least_squares::lm;
use truegrind_estimation::problem::{Problem, prior_cost};
use truegrind_math::tail::{chi_square_tail, log_chi_square_tail, normal_two_sided};

use super::scenarios;
use super::simulator::{Hidden, Log, Setup, run};

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
        by_link_growth: std::array::from_fn(|_| DVector::zeros(n)),
        by_target: DMatrix::zeros(n, 3),
        by_frame: DMatrix::zeros(n, 3),
        by_zero: DVector::from_element(n, 1.0),
        by_scale: DVector::zeros(n),
        by_sag: DVector::zeros(n),
        mm: vec![1.0; n],
        poses: (0..n).collect(),
    };
    let basis = DMatrix::from_element(1, n, q);
    Design {
        observations: n,
        per: 1,
        basis: Arc::new(basis),
        reduction: None,
        residual,
        slopes: Arc::new(slopes),
    }
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
    let setup =
        Setup { sensor: Sensor::Cable, rows: 60, sigma_mm: 0.05, dirty: false, seed: 3, log: Log::default() };
    let mut data = run(&nominal, &[], &setup).dataset;
    let step = 0.1_f64.to_radians();
    for row in &mut data.rows {
        row.extra_mut().readout_mm =
            Some(nominal.forward(&row.joints, &Condition::default()).translation.vector);
        row.joints = row.joints.map(|q| (q / step).round() * step);
    }
    data.angle_step_rad = Some(step);
    for wrong in [7, 31] {
        if let Some(at) = &mut data.rows[wrong].extra_mut().readout_mm {
            at.y += 30.0;
        }
    }
    let rows: Vec<usize> = mismatches(&data, &nominal).rows.iter().map(|r| r.0).collect();
    assert_eq!(rows, [7, 31]);
    let prepared = prepare(&data, &nominal, true);
    assert!(prepared.readout_fusion.is_ok(), "the other rows are sharpened without them");
    assert_eq!(
        prepared.observed.dataset.rows[7].joints, data.rows[7].joints,
        "a contradicting row stays as logged"
    );
    assert_ne!(prepared.observed.dataset.rows[8].joints, data.rows[8].joints);
}

/// A fit of two hidden effects, on `rows` rows.
fn fitted(rows: usize, then: impl FnOnce(&Subject<'_>, &Extended)) {
    let nominal = robots::load("abb-irb-120").unwrap().model;
    let setup =
        Setup { sensor: Sensor::Position, rows, sigma_mm: 0.05, dirty: true, seed: 11, log: Log::default() };
    let hidden = [
        Hidden::Gear { joint: 1, order: 1.0, peak_rad: 1.5e-3, phase: 0.4 },
        Hidden::Tool { from: 20, to: 50, mm: [0.8, -0.3, 0.2] },
    ];
    let data = run(&nominal, &hidden, &setup).dataset;
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
    let causes: Vec<Cause> = hidden.iter().filter_map(scenarios::cause).collect();
    then(&subject, &fit(&subject, &causes, FreeParameters::All, None));
}

#[test]
fn a_refit_by_one_step_is_a_refit() {
    fitted(150, |subject, fitted| {
        let validation = Validation::of(subject, &[], 0, 10);
        let steps = validation.by_steps(fitted).unwrap();
        for (step, refit) in steps.iter().zip(&validation.by_refits(fitted)) {
            let off = step.rmse / refit.rmse - 1.0;
            assert!(off.abs() < 1e-3, "{} against {}", step.rmse, refit.rmse);
        }
        let regions =
            [validation.over_regions_by_steps(fitted).unwrap(), validation.over_regions_by_refits(fitted)];
        let off = regions[0].rmse / regions[1].rmse - 1.0;
        assert!(off.abs() < 3e-3 && regions[1].rmse > steps[0].rmse, "{regions:?} beside {steps:?}");
        let dataset = &subject.observed.dataset;
        let linear = Linear::of(subject, fitted);
        let held = FoldErrors::of(&linear, &split::folds(dataset, 5, 0));
        let whole = held.without(&[]).rmse_mm(None, &[]);
        assert!((whole / steps[0].rmse - 1.0).abs() < 2e-3, "{whole} against {}", steps[0].rmse);
        // What is taken out and added again as a candidate is where it was.
        let design = linear.whole().design;
        for (index, cause) in fitted.causes.iter().enumerate() {
            let candidate = Candidate::of(cause, subject);
            let (columns, sizes) = (candidate.columns(&design), cause.sizes());
            let without = held.without(&fitted.parameter_indices(index));
            let (alone, back) = (without.rmse_mm(None, &[]), without.rmse_mm(Some((&columns, &sizes)), &[]));
            assert!(alone > 1.5 * whole, "{cause:?} makes a difference: {alone} against {whole}");
            // Regressors are taken at the nominal arm.
            assert!((back / whole - 1.0).abs() < 1e-3, "{cause:?}: {back} against {whole}");
        }
    });
}

/// What no row reaches is no work: a map of a joint that moved through a part of its turn has as many free knots as the rows
/// reach, and its fit is that of all of them, since the others stay where their priors hold them.
#[test]
fn knots_that_no_row_reaches_are_not_searched_for_and_change_nothing() {
    fitted(90, |subject, fitted| {
        let map = ErrorMap { joint: 1, knots_rad: vec![0.0; 72] };
        let angles =
            || subject.observed.dataset.rows.iter().map(|row| (subject.nominal.joint_map * row.joints)[1]);
        let mut seen: Vec<usize> = angles().flat_map(|u| map.reached(u)).collect();
        seen.sort_unstable();
        seen.dedup();
        let causes = [Cause::Arm(Effect::GearMap(map))];
        let found = fit(subject, &causes, FreeParameters::All, Some(fitted));
        assert!(seen.len() < 72, "all {} knots are reached", seen.len());
        let free = found.parameter_indices(0).into_iter().map(|k| match found.parameters[k] {
            Parameter::Effect { parameter, .. } => parameter,
            other => panic!("{other:?}"),
        });
        assert_eq!(free.collect::<Vec<_>>(), seen);
        let Cause::Arm(Effect::GearMap(map)) = &found.causes[0] else { panic!("{:?}", found.causes) };
        assert_eq!(map.knots_rad.len(), 72);
        assert!((0..72).all(|k| seen.contains(&k) || map.knots_rad[k] == 0.0));
    });
}

#[test]
fn gauss_newton_from_nearby_ends_where_levenberg_marquardt_does() {
    fitted(120, |_, fitted| {
        let problem = &fitted.problem;
        // Away from the optimum as another sample of the noise would be.
        let covariance = fitted.estimate.covariance.clone().unwrap();
        let signs = DVector::from_fn(fitted.x.len(), |k, _| if k.is_multiple_of(2) { 1.0 } else { -1.0 });
        let away = covariance.clone().cholesky().unwrap().l() * signs;
        let mut x: Vec<f64> = fitted.x.iter().zip(away.iter()).map(|(x, a)| x + a).collect();
        let cost = |x: &[f64]| problem.row_cost(x) + prior_cost(&fitted.priors, x);
        assert!(cost(&x) > fitted.estimate.cost + 5.0, "{} and {}", cost(&x), fitted.estimate.cost);
        assert!(descend(problem, &mut x));
        let solved = lm::solve(problem, &x, &lm::Options::default());
        assert!(cost(&x) - solved.cost < 1e-6 * problem.rows() as f64, "{} and {}", cost(&x), solved.cost);
        for (k, (a, b)) in x.iter().zip(&solved.x).enumerate() {
            assert!(
                (a - b).abs() < 0.02 * covariance[(k, k)].sqrt(),
                "{:?}: {a} and {b}",
                fitted.parameters[k]
            );
        }
    });
}

#[test]
fn columns_of_many_candidates_are_projected_as_those_of_one() {
    fitted(90, |subject, fitted| {
        let design = Design::of(subject, fitted);
        let dense = |k: usize| DMatrix::from_fn(270, k, |i, a| ((i * (3 + a) + k) % 11) as f64 - 5.0);
        // Each column reaches one row in nine: an error map's knots.
        let sparse = DMatrix::from_fn(270, 9, |i, a| if i % 9 == a { 1.0 + i as f64 / 90.0 } else { 0.0 });
        let all = [dense(2), sparse, dense(1)];
        for (columns, together) in all.iter().zip(design.project_all(&all)) {
            let shared = &*design.basis * columns;
            let information = columns.tr_mul(columns) - shared.tr_mul(&shared);
            let alone = design.project(columns);
            for projected in [&together, &alone] {
                assert!((&projected.information - &information).amax() < 1e-9 * information.amax());
                assert!((&projected.gradient - columns.tr_mul(&design.residual)).amax() < 1e-9);
            }
        }
    });
}

#[test]
fn a_model_without_some_parameters_follows_from_the_whole_one() {
    fitted(90, part_of_the_whole);
}

fn part_of_the_whole(subject: &Subject<'_>, fitted: &Extended) {
    let linear = Linear::of(subject, fitted);
    let whole = linear.whole();
    let columns = DMatrix::from_fn(270, 3, |i, k| ((i * (5 + k) + 3 * k) % 17) as f64 - 8.0);
    let on_whole = whole.design.project(&columns);
    for dropped in [fitted.parameter_indices(0), fitted.parameter_indices(1), vec![2, 5, 9]] {
        // The long way: the smaller model's own basis.
        let own = linear.design(&dropped);
        let part = whole.without(&dropped);
        let off = (&own.residual - &part.residual).amax();
        assert!(off < 1e-6 * own.residual.amax(), "residuals differ by {off}");
        let (a, b) = (own.project(&columns), part.project(&columns));
        let reduced = part.gradient_and_information(&on_whole);
        for (gradient, information) in [&(b.gradient.clone(), b.information.clone()), &reduced] {
            assert!((&a.information - information).amax() < 1e-9 * a.information.amax());
            assert!((&a.gradient - gradient).amax() < 1e-6 * a.gradient.amax());
        }
        assert!((own.pure(&columns, &a) - part.pure(&columns, &b)).amax() < 1e-8 * columns.amax());
        let (near, far) = (scan(&own, &columns, &[1.0; 3], 2), scan(&part, &columns, &[1.0; 3], 2));
        for (a, b) in near.iter().zip(&far) {
            assert_eq!((a.from, a.to), (b.from, b.to));
            assert!((a.evidence - b.evidence).abs() < 1e-6 * (1.0 + a.evidence.abs()));
        }
    }
}

#[test]
fn a_step_beside_random_effects_solves_the_equations_of_all_rows() {
    fitted(90, |subject, fitted| {
        let columns = DMatrix::from_fn(270, 4, |i, k| ((i * (5 + k) + 3 * k) % 17) as f64 / 8.0 - 1.0);
        let noise = 1.3;
        let (x, covariance) = Linear::of(subject, fitted).step_beside(&columns, noise);
        // The long way: readings and priors as rows of one system.
        let (residual, transposed) = fitted.problem.linearise(&fitted.x);
        let (p, n) = transposed.shape();
        let mut rows = DMatrix::zeros(n, p + 4);
        rows.columns_mut(0, p).tr_copy_from(&transposed);
        rows.columns_mut(p, 4).copy_from(&columns);
        rows /= noise;
        let mut normal = rows.tr_mul(&rows);
        let mut gradient = rows.tr_mul(&(residual / noise));
        for (k, prior) in fitted.priors.iter().enumerate() {
            normal[(k, k)] += prior.sigma.powi(-2);
            gradient[k] += prior.sigma.powi(-2) * fitted.x[k];
        }
        (p..p + 4).for_each(|k| normal[(k, k)] += 1.0);
        let all = normal.cholesky().unwrap();
        let (step, inverse) = (all.solve(&gradient), all.inverse());
        for k in 0..p {
            let sigma = inverse[(k, k)].sqrt();
            assert!((x[k] - fitted.x[k] + step[k]).abs() < 1e-6 * sigma, "{:?}", fitted.parameters[k]);
            assert!((covariance[(k, k)].sqrt() / sigma - 1.0).abs() < 1e-6, "{:?}", fitted.parameters[k]);
        }
    });
}

#[test]
fn overlapping_shifts_are_told_as_levels() {
    let zero = |from, to, mm| {
        let mut d = Disturbance::new(Kind::Zero, Profile::Rows { from, to });
        d.values[0] = mm;
        Cause::Measurement(d)
    };
    let frame = Cause::Measurement(Disturbance::new(
        Kind::Frame { turning: false },
        Profile::Rows { from: 5, to: 9 },
    ));
    let levels =
        piecewise_levels(&[zero(72, 535, -2.2), frame.clone(), zero(300, 387, 2.25), zero(386, 537, -0.8)]);
    let levels = levels.expect("they overlap");
    let rows: Vec<_> = levels.iter().map(Cause::rows).collect();
    assert_eq!(rows, [Some([72, 299]), Some([388, 535]), Some([5, 9])], "ends two rows apart are one event");
    let Cause::Measurement(second) = &levels[1] else { panic!("a measurement's") };
    assert!((second.values[0] + 3.0).abs() < 1e-12);
    assert_eq!(levels[2], frame, "other kinds stay as they are");
    // A second step on top of the first: from the one state to the other.
    let steps = piecewise_levels(&[zero(100, 299, 1.0), zero(200, 299, 2.0)]).expect("they overlap");
    assert_eq!(steps, [zero(100, 199, 1.0), zero(200, 299, 3.0)]);
    assert_eq!(piecewise_levels(&[zero(10, 20, 1.0), zero(21, 30, 2.0), frame]), None, "nothing overlaps");
}
