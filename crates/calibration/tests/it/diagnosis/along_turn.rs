//! Where along the turn a gear's error is largest.

use std::f64::consts::FRAC_PI_4;

use truegrind_arm::effect::Effect;
use truegrind_arm::effect::error_map::ErrorMap;
use truegrind_arm::effect::harmonic::Harmonic;
use truegrind_arm::robots;
use truegrind_calibration::diagnosis::along_turn::along_turn;
use truegrind_calibration::diagnosis::cause::Cause;
use truegrind_calibration::diagnosis::diagnose::Options;
use truegrind_calibration::diagnosis::extension::Subject;
use truegrind_calibration::diagnosis::preparation::prepare;
use truegrind_calibration::measurement::dataset::Sensor;

use super::scenarios::frames;
use super::simulator::{Log, Setup, run};

fn line(joint: usize, order: f64, sine_rad: f64) -> Cause {
    Cause::Arm(Effect::GearTransmission(Harmonic { joint, order, sine_rad, cosine_rad: 0.0 }))
}

/// sin 9u (1 + cos u) is sin 9u + ½ sin 8u + ½ sin 10u: twice a harmonic's size at 0°, nothing at 180°.
#[test]
fn neighbouring_orders_are_one_error_that_changes_along_the_turn() {
    let nominal = robots::load("abb-irb-120").unwrap().model;
    let setup = Setup {
        sensor: Sensor::Position,
        rows: 600,
        sigma_mm: 0.05,
        dirty: false,
        seed: 12,
        log: Log::default(),
    };
    let mut data = run(&nominal, &[], &setup).dataset;
    // Joint 4 through most of a turn; what was read there does not matter here.
    for (i, row) in data.rows.iter_mut().enumerate() {
        row.joints[3] = 2.8 * (i as f64 / 299.5 - 1.0);
    }
    let (options, prepared) = (Options::default(), prepare(&data, &nominal, true));
    let frames = frames(&data, &nominal);
    let subject = Subject {
        observed: &prepared.observed,
        nominal: &nominal,
        frames: &frames,
        evaluated_at: &frames,
        tolerance: &options.tolerance,
    };
    assert_eq!(nominal.mapped(&data.rows[0].joints)[3], data.rows[0].joints[3]);
    let [one, below, above] = [line(3, 9.0, 1e-3), line(3, 8.0, 5e-4), line(3, 10.0, 5e-4)];
    let [largest, smallest] = along_turn(&subject, 3, &[&one, &below, &above]).unwrap();
    assert!(largest.at_rad.abs() < 0.4 && (largest.error_rad - 2e-3).abs() < 1e-4, "{largest:?}");
    // The outermost stretch, of 45°, has half the range of the function itself there.
    let angles = (0..=1000).map(|k| smallest.at_rad + FRAC_PI_4 * (f64::from(k) / 1000.0 - 0.5));
    let (low, high) = angles
        .map(|u| 1e-3 * (9.0 * u).sin() * (1.0 + u.cos()))
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), e| (low.min(e), high.max(e)));
    assert!(
        smallest.at_rad.abs() > 2.3 && (smallest.error_rad / (0.5 * (high - low)) - 1.0).abs() < 0.02,
        "{smallest:?}, expected {}",
        0.5 * (high - low)
    );
    // One harmonic is the same everywhere, and so are two whose orders are far apart; a map has a range of its own in every stretch.
    assert_eq!(along_turn(&subject, 3, &[&one]), None);
    assert_eq!(along_turn(&subject, 3, &[&line(3, 3.0, 1e-3), &line(3, 80.0, 8e-4)]), None);
    let map = ErrorMap { joint: 3, knots_rad: vec![1e-3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0] };
    assert_eq!(along_turn(&subject, 3, &[&one, &Cause::Arm(Effect::GearMap(map))]), None);
}
