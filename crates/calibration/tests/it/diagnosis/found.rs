//! A small part of the scenario suite; `cargo bench --bench diagnosis` runs the whole of it and prints the rates.

use truegrind_arm::effect::Effect;
use truegrind_arm::model::Model;
use truegrind_arm::robots;
use truegrind_calibration::diagnosis::cause_kind::CauseKind;
use truegrind_calibration::diagnosis::diagnose::{Diagnosed, Options, diagnose};
use truegrind_calibration::diagnosis::finding::{Confidence, Diagnosis, SCHEMA};
use truegrind_calibration::measurement::dataset::Sensor;

use super::scenarios::{Outcome, frames, hide, log, outcome, stream};
use super::simulator::{self, Hidden, Log, Setup, run};

fn arm() -> Model {
    robots::load("abb-irb-120").unwrap().model
}

fn setup(sensor: Sensor, rows: usize, seed: u64) -> Setup {
    let sigma_mm = if sensor == Sensor::Cable { 0.04 } else { 0.03 };
    Setup { sensor, rows, sigma_mm, dirty: true, seed, log: Log::default() }
}

/// The hidden effects are visible, found by name and joint or rows, and nothing else is.
fn expect(out: &Outcome) {
    for ((hidden, lambda), found) in out.hidden.iter().zip(&out.found) {
        assert!(*lambda > 40.0, "{hidden:?} is too small for a test: λ {lambda}");
        assert!(found, "{hidden:?} with λ {lambda} was not found: {:?}", out.all);
    }
    assert!(out.wrong.is_empty(), "{:?} hidden, and found {:?}", out.hidden, out.all);
    let fits = &out.diagnosed.diagnosis.fits;
    assert!(out.over_truth < 1.2, "held out {} times the true structure's error", out.over_truth);
    assert!(fits.extended.cv_blocks_rmse_mm < fits.geometric.cv_blocks_rmse_mm);
    assert!(fits.extended.cv_rmse_mm < fits.geometric.cv_rmse_mm);
}

#[test]
fn an_eccentric_gear_is_found_with_a_tracker() {
    let hidden = [Hidden::Gear { joint: 2, order: 1.0, peak_rad: 0.0015, phase: 0.7 }];
    let out = outcome(&arm(), &hidden, &setup(Sensor::Position, 200, 1));
    expect(&out);
    assert_eq!(out.within, (2, 2), "amplitudes within 3σ");
}

#[test]
fn a_reducer_line_is_found_with_a_cable() {
    let hidden = [Hidden::Gear { joint: 0, order: 50.0, peak_rad: 0.001, phase: 2.0 }];
    expect(&outcome(&arm(), &hidden, &setup(Sensor::Cable, 300, 2)));
}

#[test]
fn play_is_found_by_its_sides() {
    let hidden = [Hidden::Backlash { joint: 1, play_rad: 0.001 }];
    expect(&outcome(&arm(), &hidden, &setup(Sensor::Position, 200, 3)));
}

#[test]
fn a_joint_that_yields_is_found_though_its_masses_are_others() {
    let hidden = [Hidden::Compliance { joint: 1, peak_rad: 0.0025 }];
    expect(&outcome(&arm(), &hidden, &setup(Sensor::Position, 300, 4)));
}

#[test]
fn a_zero_that_jumped_is_told_with_its_rows() {
    let hidden = [Hidden::Zero { from: 120, to: 219, mm: 0.8 }];
    let out = outcome(&arm(), &hidden, &setup(Sensor::Cable, 300, 5));
    expect(&out);
    let finding = &out.diagnosed.diagnosis.findings[0];
    assert_eq!(finding.rows, Some([120, 219]));
    assert_eq!(finding.confidence, Confidence::Identified);
    // In words, with the statistician's figure in brackets.
    let words = "the readings are over 1000 times more probable with it than without (2 ln Bayes factor ";
    assert!(finding.evidence.contains(words), "{}", finding.evidence);
    assert!(!finding.alternatives.is_empty(), "what else was tried is shown");
    let offset = &finding.parameters[0];
    assert!((offset.value - 0.8).abs() < 3.0 * offset.sigma.unwrap());
}

/// The variable against which the first finding's picture shows the residuals.
fn shown_over(found: &Diagnosed) -> &str {
    found.pictures[0].as_ref().map_or("", |picture| &picture.x.0)
}

#[test]
fn a_second_draw_wire_of_another_scale_is_told_with_its_rows_and_widens_the_arm() {
    let second = [Hidden::Scale { rows: Some([120, 299]), factor: 0.0015 }];
    let out = outcome(&arm(), &second, &setup(Sensor::Cable, 300, 5));
    expect(&out);
    let finding = &out.diagnosed.diagnosis.findings[0];
    assert_eq!((finding.effect, finding.rows), (CauseKind::SensorScale, Some([120, 299])));
    assert_eq!(finding.confidence, Confidence::Identified);
    assert_eq!(shown_over(&out.diagnosed), "data row", "the band of its rows is drawn there");
    let error = &finding.parameters[0];
    assert!((error.value - 0.0015).abs() < 3.0 * error.sigma.unwrap(), "{error:?}");
    // Which of the two wires is right, no row tells: the arm is as uncertain in size as they differ.
    let expected = |hidden: &[Hidden]| {
        let run = run(&arm(), hidden, &setup(Sensor::Cable, 300, 5));
        let mut options = Options::default();
        options.arm_tolerance.scale = Some(2e-4);
        let frames = frames(&run.dataset, &arm());
        let found = diagnose(&run.dataset, "arm", &arm(), &frames, &options, &|_| {}).unwrap();
        found.benefit.unwrap().estimated_mm
    };
    let [of_two, of_one] = [expected(&second), expected(&[])];
    assert!(of_two > of_one + 0.1, "{of_two} {of_one}");
}

#[test]
fn a_cable_that_reads_longer_paid_out_is_told_from_readings_that_had_not_settled() {
    let out = outcome(&arm(), &[Hidden::Reversal { mm: 0.3 }], &setup(Sensor::Cable, 300, 9));
    expect(&out);
    let finding = &out.diagnosed.diagnosis.findings[0];
    assert_eq!(finding.confidence, Confidence::Identified, "{finding:?}");
    assert_eq!(shown_over(&out.diagnosed), "change of the reading from the row before");
    let difference = &finding.parameters[0];
    assert!((difference.value - 0.3).abs() < 4.0 * difference.sigma.unwrap(), "{difference:?}");
}

#[test]
fn a_lens_that_distorts_is_told_from_axes_of_other_scales() {
    let out = outcome(&arm(), &[Hidden::Lens { share: 0.02 }], &setup(Sensor::Position, 300, 10));
    expect(&out);
    let finding = &out.diagnosed.diagnosis.findings[0];
    assert_eq!(finding.confidence, Confidence::Identified, "{finding:?}");
    assert_eq!(shown_over(&out.diagnosed), "angle from the axis of the camera");
    assert!((finding.parameters[0].value - 0.02).abs() < 0.002, "{:?}", finding.parameters);
}

#[test]
fn a_moved_tripod_and_a_slipped_reflector_are_told_apart() {
    let moved = [Hidden::Frame { from: 100, to: 199, mm: [0.8, -0.5, 0.3] }];
    expect(&outcome(&arm(), &moved, &setup(Sensor::Position, 200, 6)));
    let slipped = [Hidden::Tool { from: 60, to: 149, mm: [0.8, -0.5, 0.3] }];
    expect(&outcome(&arm(), &slipped, &setup(Sensor::Position, 200, 7)));
}

#[test]
fn a_pair_is_found_and_wild_rows_are_listed() {
    let hidden = [
        Hidden::Gear { joint: 1, order: 2.0, peak_rad: 0.0018, phase: 1.0 },
        Hidden::Frame { from: 150, to: 249, mm: [1.5, 0.4, -0.8] },
    ];
    let mut with_outliers = hidden.to_vec();
    with_outliers.push(Hidden::Outliers { list: vec![17, 180], mm: 25.0 });
    let out = outcome(&arm(), &with_outliers, &setup(Sensor::Position, 250, 8));
    assert_eq!(out.found, [true, true, true], "{:?}", out.all);
    assert!(out.wrong.is_empty(), "{:?}", out.all);
    let wild = out.diagnosed.diagnosis.findings.iter().find(|f| f.effect == "outliers").unwrap();
    assert_eq!(wild.row_list, Some(vec![17, 180]));
    assert_eq!(out.diagnosed.diagnosis.measure_again, [17, 180]);
    assert_eq!(out.diagnosed.diagnosis.dataset.set_aside, 2);
}

#[test]
fn nothing_is_found_where_nothing_is_hidden() {
    for seed in 0..4 {
        for sensor in [Sensor::Cable, Sensor::Position] {
            let out = outcome(&arm(), &[], &setup(sensor, 200, 100 + seed));
            assert!(out.all.is_empty(), "{sensor:?} {seed}: {:?}", out.all);
            let d = &out.diagnosed.diagnosis;
            assert!((d.fits.extended.cv_rmse_mm - d.fits.geometric.cv_rmse_mm).abs() < 1e-12);
        }
    }
}

#[test]
fn what_nothing_explains_is_said_and_a_smooth_correction_follows_it_when_asked() {
    let run = run(&arm(), &[Hidden::Warp { mm: 0.5 }], &setup(Sensor::Position, 600, 12));
    let plain = Options::default();
    let asked = Options { smooth: true, ..plain.clone() };
    let diagnosed = |options: &Options| {
        diagnose(&run.dataset, "arm", &arm(), &frames(&run.dataset, &arm()), options, &|_| {}).unwrap()
    };
    let (without, with) = (diagnosed(&plain), diagnosed(&asked));
    for found in [&without, &with] {
        let effects: Vec<&str> = found.diagnosis.findings.iter().map(|f| f.effect.as_str()).collect();
        assert!(effects.contains(&"unexplained"), "{effects:?}");
        assert!(!effects.contains(&"smooth-correction"), "a correction is no cause");
        assert!(found.diagnosis.remaining.is_some());
    }
    let (a, b) = (&without.diagnosis.fits.extended, &with.diagnosis.fits.extended);
    // Causes that are in doubt describe a part of it in both, so the correction is measured against geometry alone.
    let geometry = &without.diagnosis.fits.geometric;
    assert!(
        b.cv_rmse_mm < 0.7 * geometry.cv_rmse_mm,
        "held out {} against {}",
        b.cv_rmse_mm,
        geometry.cv_rmse_mm
    );
    assert!(b.cv_rmse_mm < 0.95 * a.cv_rmse_mm, "held out {} against {}", b.cv_rmse_mm, a.cv_rmse_mm);
    assert!(b.cv_blocks_rmse_mm < a.cv_blocks_rmse_mm);
    let smooth =
        |d: &Diagnosed| d.estimated.model.effects.iter().any(|e| matches!(e, Effect::SmoothCorrection(_)));
    assert!(smooth(&with) && !smooth(&without), "it goes into the model, and only when asked for");
    // Where nothing is left it is not fitted, asked for or not.
    let clean = simulator::run(&arm(), &[], &setup(Sensor::Position, 200, 13)).dataset;
    let found = diagnose(&clean, "arm", &arm(), &frames(&clean, &arm()), &asked, &|_| {}).unwrap();
    assert!(!smooth(&found));
}

#[test]
fn what_a_shop_floor_log_hides_is_found() {
    // Fitted with the wrong direction of gravity, without approach columns, with a thermometer and with rounded angles.
    for (kind, sensor, rows, seed) in [
        ("backlash/order", Sensor::Position, 300, 21),
        ("thermal-drift/temperature", Sensor::Position, 250, 22),
        ("thermal-drift/base", Sensor::Cable, 300, 23),
        ("cable-sag", Sensor::Cable, 600, 27),
        ("gear-eccentricity/rounded", Sensor::Position, 250, 25),
        ("sensor-zero-shift/twice", Sensor::Cable, 350, 26),
    ] {
        let hidden = hide(kind, rows, &mut stream(kind, seed));
        let setup = Setup { log: log(kind), ..setup(sensor, rows, seed) };
        let out = outcome(&arm(), &hidden, &setup);
        assert!(out.hidden.iter().all(|(_, l)| *l > 40.0), "{kind}: too small for a test, {:?}", out.hidden);
        assert!(out.found.iter().all(|f| *f) && out.wrong.is_empty(), "{:?}: {:?}", out.hidden, out.all);
    }
}

#[test]
fn a_model_without_the_effect_fails_where_the_extended_one_passes() {
    let hidden = [Hidden::Gear { joint: 0, order: 1.0, peak_rad: 0.002, phase: 0.2 }];
    let out = outcome(&arm(), &hidden, &setup(Sensor::Position, 200, 9));
    let fits = &out.diagnosed.diagnosis.fits;
    assert!(out.over_truth < 1.2);
    let left_out = out.over_truth * fits.geometric.cv_rmse_mm / fits.extended.cv_rmse_mm;
    assert!(left_out > 1.2, "geometry alone has {left_out} times the true structure's error");
}

#[test]
fn the_result_is_the_same_for_any_number_of_threads_and_keeps_the_contract() {
    let hidden = [Hidden::Zero { from: 80, to: 199, mm: 1.2 }];
    let text = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let out = pool.install(|| outcome(&arm(), &hidden, &setup(Sensor::Cable, 200, 10)));
        serde_json::to_string(&out.diagnosed.diagnosis).unwrap()
    };
    let one = text(1);
    assert_eq!(one, text(3));
    let back: Diagnosis = serde_json::from_str(&one).unwrap();
    assert_eq!(back.schema, SCHEMA);
    let value: serde_json::Value = serde_json::from_str(&one).unwrap();
    for key in ["dataset", "noise_floor_mm", "fits", "findings", "not_testable", "remaining", "noise_model"] {
        assert!(value.get(key).is_some(), "{key}");
    }
    for key in
        ["effect", "cause", "confidence", "rows", "joints", "parameters", "evidence", "p_value", "gain"]
    {
        assert!(value["findings"][0].get(key).is_some(), "{key}");
    }
    assert_eq!(value["findings"][0]["confidence"], "identified");
}

#[test]
fn too_few_rows_say_how_many_are_needed() {
    let out = outcome(&arm(), &[], &setup(Sensor::Cable, 30, 11));
    let d = &out.diagnosed.diagnosis;
    assert!(d.findings.is_empty());
    assert!(d.notes[0].contains("too few") && d.notes[0].contains("at least"), "{:?}", d.notes);
    let needed = d.poses_needed.unwrap();
    assert!(needed > 30);
}

#[test]
fn rows_that_a_fit_follows_without_error_are_still_held_out() {
    // 18 readings for 33 parameters.
    let out = outcome(&arm(), &[], &setup(Sensor::Position, 6, 12));
    let fits = &out.diagnosed.diagnosis.fits;
    assert!(fits.geometric.rmse_mm < 0.01, "{}", fits.geometric.rmse_mm);
    for held_out in [fits.geometric.cv_rmse_mm, fits.geometric.cv_blocks_rmse_mm] {
        assert!(held_out > 0.03, "{held_out} is less than the sensor's noise");
    }
}
