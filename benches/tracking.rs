//! What a pose costs a track of a diagnosed model of 50 effects, and what an alarm costs.
//!
//! `cargo bench --no-default-features --bench tracking`: milliseconds per pose while nothing happens, while every pose is set
//! aside (a burst), and over a track in which a joint jumps.

// A benchmark says what it measured.
#![allow(clippy::print_stdout, clippy::unwrap_used, missing_docs)]

use std::time::Instant;

use nalgebra::DMatrix;
use truegrind::arm::effect::Effect;
use truegrind::arm::effect::harmonic::Harmonic;
use truegrind::arm::estimated::Estimated;
use truegrind::arm::parameter::Parameter;
use truegrind::calibration::identification::identify::{Options as Settings, identify};
use truegrind::calibration::identification::register::starting_frames;
use truegrind::calibration::measurement::dataset::{Dataset, Reading};
use truegrind::calibration::measurement::{import, split};
use truegrind::calibration::tracking::{Options, Tracker};

/// Effects of the model, each with two parameters.
const EFFECTS: usize = 50;
/// Poses of a track: the shipped ones over and over.
const ROUNDS: usize = 3;

fn model(dataset: &Dataset) -> Estimated {
    let robot = truegrind::robots::load("abb-irb-120").unwrap().model;
    let settings = Settings::default();
    let frames = starting_frames(dataset, &robot, &settings.tolerance, false).unwrap();
    let division = |d: &Dataset| split::random(d, 0.2, 0);
    let mut arm = identify(dataset, "abb-irb-120", &robot, &frames, &division, &settings).unwrap().estimated;
    let before = arm.order.len();
    for k in 0..EFFECTS {
        let (joint, order) = (k % 6, 1.0 + (k / 6) as f64);
        let index = arm.model.effects.len();
        let harmonic = Harmonic { joint, order, sine_rad: 0.0, cosine_rad: 0.0 };
        arm.model.effects.push(Effect::GearTransmission(harmonic));
        arm.order.extend((0..2).map(|parameter| Parameter::Effect { index, parameter }));
    }
    let p = arm.order.len();
    let small = 1e-4_f64;
    arm.covariance = DMatrix::from_fn(p, p, |i, j| match (i < before && j < before, i == j) {
        (true, _) => arm.covariance[(i, j)],
        (false, true) => small * small,
        (false, false) => 0.0,
    });
    arm
}

fn main() {
    let bytes = include_bytes!("../tests/data/irb120-tracker.csv");
    let dataset = import::read("rows.csv", bytes, &import::Options::default()).unwrap();
    let arm = model(&dataset);
    let mut calm = dataset.clone();
    for _ in 1..ROUNDS {
        calm.rows.extend(dataset.rows.iter().cloned());
    }
    let half = calm.rows.len() / 2;
    let mut burst = calm.clone();
    for (k, row) in burst.rows.iter_mut().enumerate().skip(half) {
        let Reading::Position(p) = &mut row.reading else { continue };
        p[k % 3] += if k % 2 == 0 { 40.0 } else { -70.0 };
    }
    let mut jump = calm.clone();
    jump.rows.iter_mut().skip(half).for_each(|row| row.joints[2] += 1e-3);
    println!("{} parameters of the arm, {} poses", arm.order.len(), calm.rows.len());
    for (name, rows) in [("calm", &calm), ("burst", &burst), ("jump", &jump)] {
        let mut tracker = Tracker::begin(&arm, "hash", rows, &Options::default()).unwrap();
        let begun = Instant::now();
        let alarms = tracker.process_file(rows).unwrap();
        let ms = begun.elapsed().as_secs_f64() * 1e3;
        println!(
            "{name}: {:.3} ms per pose, {} alarms, {} of {} set aside",
            ms / rows.rows.len() as f64,
            alarms.len(),
            tracker.state().outliers,
            rows.rows.len()
        );
    }
}
