//! Repeated poses that show more than the noise of a reading: what the arm is said to be off by stays right.

use nalgebra::{Point3, Vector3};
use rand::{RngExt as _, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::unseen_target::{arm, start, tracker};
use truegrind_arm::condition::Condition;
use truegrind_arm::estimated::beyond_noise::ErringArm;
use truegrind_arm::estimated::{Reason, ReasonKind};
use truegrind_arm::model::Joints;
use truegrind_calibration::identification::identify::{Identification, Options, identify};
use truegrind_calibration::measurement::dataset::{Dataset, Reading, Row, Sensor};
use truegrind_calibration::measurement::split;
use truegrind_math::se3::Pose;

/// What happens to the readings.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Event {
    Nothing,
    /// The sensor moves by this at row 92 (mm).
    Shift(f64),
    /// It drifts by this over all rows (mm).
    Drift(f64),
    /// It takes steps of this along each axis from row to row (mm).
    Walk(f64),
    /// The reading of row 125 is off by this (mm).
    Bump(f64),
    /// Joint 2 comes to rest on either side of a play of this (rad).
    Play(f64),
}

/// Errors of the joints (rad, 1σ), each another one at each pose.
const RAD: [f64; 6] = [1e-4; 6];
/// Noise of a coordinate (mm).
const NOISE_MM: f64 = 0.02;
const TARGET_MM: f64 = 150.0;
/// Poses, of which twelve of the first half are read once more at the end.
const POSES: usize = 120;

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

fn measured(event: Event, seed: u64) -> Dataset {
    let (actual, still) = (arm(), Condition::default());
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut poses: Vec<(Joints, Joints)> = (0..POSES)
        .map(|_| {
            let q = Joints::from_fn(|_, _| rng.random_range(-1.0..1.0));
            let error = Joints::from_fn(|j, _| RAD[j] * normal(&mut rng));
            (q, q + error)
        })
        .collect();
    let again: Vec<(Joints, Joints)> = (0..12).map(|k| poses[(17 * k + 5) % (POSES / 2)]).collect();
    poses.extend(again);
    let direction = Vector3::from_fn(|_, _| normal(&mut rng)).normalize();
    let count = poses.len() as f64;
    let mut walked = Vector3::zeros();
    let rows = poses.iter().enumerate().map(|(i, (logged, real))| {
        let mut real = *real;
        if let Event::Play(rad) = event {
            real[1] += if rng.random_bool(0.5) { 0.5 * rad } else { -0.5 * rad };
        }
        let mut seen =
            (tracker().inverse() * (actual.forward(&real, &still) * Point3::new(0.0, 0.0, TARGET_MM))).coords;
        walked += Vector3::from_fn(|_, _| normal(&mut rng));
        seen += match event {
            Event::Shift(mm) if i >= 92 => direction * mm,
            Event::Drift(mm) => direction * (mm * i as f64 / count),
            Event::Walk(mm) => walked * mm,
            Event::Bump(mm) if i == 125 => direction * mm,
            _ => Vector3::zeros(),
        };
        seen += Vector3::from_fn(|_, _| NOISE_MM * normal(&mut rng));
        Row::new(i, *logged, Reading::Position(seen))
    });
    Dataset::new("repeats.csv", Sensor::Position, rows.collect::<Vec<_>>())
}

fn found(event: Event, seed: u64) -> Identification {
    let dataset = measured(event, seed);
    let halves = |rows: &Dataset| split::random(rows, 0.2, 0);
    identify(&dataset, "arm", &arm(), &start(&dataset), &halves, &Options::default()).unwrap()
}

/// The error beyond noise that is stated over the true one.
fn stated_over_true(event: Event, found: &Identification) -> f64 {
    let estimated = &found.estimated;
    let samples_deg = &estimated.region.samples_deg;
    let erring = ErringArm { model: &estimated.model, condition: &estimated.condition, samples_deg };
    let mut rad = RAD;
    if let Event::Play(play) = event {
        rad[1] = rad[1].hypot(0.5 * play);
    }
    let target = Pose::translation(0.0, 0.0, TARGET_MM);
    estimated.beyond_noise_mm.unwrap() / erring.displacement_mm(&target, &rad)
}

fn warning(found: &Identification) -> Option<&Reason> {
    found.estimated.verdict.reasons.iter().find(|reason| reason.kind == ReasonKind::MoreThanNoise)
}

/// The scatter of repeated poses was taken off as noise, whatever made it: the rest was a third of the arm's error, or nothing.
#[test]
fn what_moved_between_repetitions_is_not_taken_off_as_noise() {
    let cases = [
        (Event::Shift(0.35), "moved or drifted"),
        (Event::Drift(0.5), "drifted"),
        (Event::Walk(0.02), "the sensor, its target or the arm"),
        (Event::Bump(0.45), "check the reading of row 125"),
        (Event::Play(8e-4), "play"),
    ];
    for (event, words) in cases {
        let mut told = 0;
        for seed in 0..6 {
            let found = found(event, seed);
            let ratio = stated_over_true(event, &found);
            assert!((1.0 / 1.5..1.7).contains(&ratio), "{event:?}, seed {seed}: stated over true {ratio}");
            told += usize::from(warning(&found).is_some_and(|said| said.text.contains(words)));
        }
        assert!(told >= 3, "{event:?}: told in {told} of 6");
    }
}

#[test]
fn repetitions_that_scatter_as_noise_stay_the_noise_floor() {
    for seed in 0..10 {
        let found = found(Event::Nothing, seed);
        assert_eq!(warning(&found), None, "seed {seed}");
        let floor_mm = found.estimated.noise_floor_mm.unwrap();
        assert!((floor_mm / (3_f64.sqrt() * NOISE_MM) - 1.0).abs() < 0.35, "seed {seed}: {floor_mm}");
        let ratio = stated_over_true(Event::Nothing, &found);
        assert!((1.0 / 1.3..1.3).contains(&ratio), "seed {seed}: stated over true {ratio}");
    }
}
