//! What a model leaves beyond the noise, as far as it is known.

use nalgebra::{Point3, Vector3};
use rand::{RngExt as _, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::unseen_target::{arm, start, tracker};
use truegrind_arm::condition::Condition;
use truegrind_arm::estimated::StageErrors;
use truegrind_arm::estimated::beyond_noise::ErringArm;
use truegrind_arm::model::Joints;
use truegrind_calibration::identification::beyond_noise::BeyondNoise;
use truegrind_calibration::identification::identify::{Options, identify};
use truegrind_calibration::measurement::dataset::{Dataset, Reading, Row, Sensor};
use truegrind_calibration::measurement::noise_floor::NoiseFloor;
use truegrind_calibration::measurement::split;
use truegrind_math::se3::Pose;
use truegrind_math::statistics::ErrorSummary;

/// Errors of this size (mm).
fn of_size(mm: f64) -> StageErrors {
    let errors = ErrorSummary::of([mm, -mm, mm, -mm]);
    StageErrors { fitted: errors, held_out: errors }
}

/// The bound of an arm without its play was that of all causes: below the held-out error that stood beside it.
#[test]
fn an_arm_that_lacks_a_cause_is_off_by_it() {
    let of = |own_mm, of_arm| {
        let all = BeyondNoise::AtMost(0.03);
        all.of_submodel(&of_size(0.03), &of_size(own_mm), Sensor::Position, of_arm)
    };
    let BeyondNoise::Between { least_mm, most_mm } = of(0.05, true) else { panic!() };
    assert!((least_mm - 0.04).abs() < 1e-12 && (most_mm - 0.05).abs() < 1e-12, "{least_mm}, {most_mm}");
    // What the sensor did is not the arm's, but may be.
    let BeyondNoise::AtMost(most_mm) = of(0.05, false) else { panic!() };
    assert!((most_mm - 0.05).abs() < 1e-12);
    assert_eq!(of(0.03, true), BeyondNoise::AtMost(0.03));
}

#[test]
fn rounding_of_the_log_is_no_error_of_the_arm() {
    let BeyondNoise::AtMost(mm) = BeyondNoise::AtMost(0.5).less_rounding(Some(0.4), Sensor::Position) else {
        panic!()
    };
    assert!((mm - 0.3).abs() < 1e-12, "{mm}");
    let all = BeyondNoise::AtMost(0.3).less_rounding(Some(0.4), Sensor::Position);
    assert_eq!(all, BeyondNoise::AtMost(0.0));
    assert_eq!(BeyondNoise::AtMost(0.3).less_rounding(None, Sensor::Cable), BeyondNoise::AtMost(0.3));
}

#[test]
fn a_scatter_that_is_seen_does_not_hide_what_else_may_be_left() {
    let left = BeyondNoise::AtMost(0.5).at_least_scatter(0.1);
    assert_eq!(left, BeyondNoise::Between { least_mm: 0.1, most_mm: 0.5 });
    assert_eq!(left.known_mm(), Some(0.1));
    assert_eq!(BeyondNoise::AtMost(0.5).at_least_scatter(0.0), BeyondNoise::AtMost(0.5));
    assert_eq!(BeyondNoise::Known(0.05).at_least_scatter(0.1), BeyondNoise::Known(0.1));
}

/// Lengths of `count` errors, of which `freedom` coordinates are independent, each of this standard deviation (mm).
fn drawn(rng: &mut ChaCha8Rng, count: usize, freedom: usize, sigma_mm: f64) -> ErrorSummary {
    let square: f64 = (0..freedom)
        .map(|_| {
            let v: f64 = StandardNormal.sample(rng);
            v * v
        })
        .sum();
    let rms = sigma_mm * (square / count as f64).sqrt();
    ErrorSummary::of(std::iter::repeat_n(rms, count))
}

/// Round a part of sixty poses the excess over twelve repeated ones is hardly ever significant, and larger than all else that is stated.
#[test]
fn an_excess_over_the_noise_is_expected_though_it_is_not_significant() {
    const NOISE_MM: f64 = 0.02;
    const LACKING_MM: f64 = 0.02;
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let stated = |lacking: f64, rng: &mut ChaCha8Rng| {
        let sigma_mm = NOISE_MM.hypot(lacking);
        // Held-out rows have the uncertainty of the parameters beside their own error.
        let held_out_mm = sigma_mm * (1.0 + 12.0 / 47.0_f64).sqrt();
        let errors = StageErrors {
            fitted: drawn(rng, 47, 3 * 47 - 36, sigma_mm),
            held_out: drawn(rng, 12, 36, held_out_mm),
        };
        let floor = NoiseFloor { sigma_mm: drawn(rng, 12, 36, NOISE_MM).rmse, poses: 12, freedom: 12 };
        let beyond = BeyondNoise::of(&errors, 36, Sensor::Position, Some(&floor));
        beyond.known_mm().unwrap() / (3_f64.sqrt() * LACKING_MM)
    };
    let ratios: Vec<f64> = (0..200).map(|_| stated(LACKING_MM, &mut rng)).collect();
    let mean_square = ratios.iter().map(|ratio| ratio * ratio).sum::<f64>() / 200.0;
    let low = ratios.iter().filter(|ratio| **ratio < 1.0 / 1.3).count();
    assert!((mean_square - 1.0).abs() < 0.1, "{mean_square}");
    assert!(low < 30, "{low} of 200");
    // Without an excess what chance leaves of one is below the noise itself.
    let ratios: Vec<f64> = (0..200).map(|_| stated(0.0, &mut rng)).collect();
    let mean_square = ratios.iter().map(|ratio| ratio * ratio).sum::<f64>() / 200.0;
    assert!(mean_square < 0.15, "{mean_square}");
}

/// 120 poses of an arm each of whose joints errs by `rad` in a way of its own at each pose, a fifth of them measured twice. The target
/// is on the axis of joint 6, `target_mm` in front of the flange.
fn erring(rad: &[f64; 6], target_mm: f64, seed: u64) -> Dataset {
    let (actual, still) = (arm(), Condition::default());
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let poses: Vec<(Joints, Joints)> = (0..120)
        .map(|_| {
            let q = Joints::from_fn(|_, _| rng.random_range(-1.0..1.0));
            let error = Joints::from_fn(|j, _| {
                let v: f64 = StandardNormal.sample(&mut rng);
                rad[j] * v
            });
            (q, q + error)
        })
        .collect();
    let rows = poses.iter().chain(poses.iter().step_by(5)).enumerate().map(|(i, (logged, real))| {
        let seen = tracker().inverse() * (actual.forward(real, &still) * Point3::new(0.0, 0.0, target_mm));
        let noise = Vector3::from_fn(|_, _| {
            let v: f64 = StandardNormal.sample(&mut rng);
            0.01 * v
        });
        Row::new(i, *logged, Reading::Position(seen.coords + noise))
    });
    Dataset::new("joints.csv", Sensor::Position, rows.collect::<Vec<_>>())
}

/// On the axis of joint 6 the target does not see that joint err, and the others less than a tool does.
#[test]
fn what_the_target_saw_is_stated_for_a_longer_tool() {
    // Smaller gears err by more.
    const RAD: [f64; 6] = [1e-4, 1e-4, 1e-4, 2e-4, 3e-4, 3e-4];
    let halves = |rows: &Dataset| split::random(rows, 0.2, 0);
    for (seed, target_mm, is_told) in [(1, 20.0, true), (2, 20.0, true), (3, 400.0, false)] {
        let dataset = erring(&RAD, target_mm, seed);
        let found =
            identify(&dataset, "arm", &arm(), &start(&dataset), &halves, &Options::default()).unwrap();
        let estimated = &found.estimated;
        let samples_deg = &estimated.region.samples_deg;
        let erring = ErringArm { model: &estimated.model, condition: &estimated.condition, samples_deg };
        // A long tool beside the axis.
        let tool = Pose::translation(300.0, 0.0, 100.0);
        let stated = erring.displacement_mm(&tool, &estimated.beyond_noise_rad.unwrap());
        let ratio = erring.displacement_mm(&tool, &RAD) / stated;
        assert!((1.0 / 1.3..1.3).contains(&ratio), "seed {seed}: true over stated {ratio}");
        let told =
            estimated.verdict.reasons.iter().any(|reason| reason.text.contains("tool tip 300 mm in front"));
        assert_eq!(told, is_told, "seed {seed}: {:?}", estimated.verdict.reasons);
    }
}
