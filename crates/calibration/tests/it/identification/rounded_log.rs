//! Angles in whole steps: rounded by the log, or commanded so. Of the first the rounding is no error of the arm; of the second all that is left
//! is.

use nalgebra::{Point3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::promise::placed_rms_mm;
use super::unseen_target::{TARGET_MM, arm, start, tracker};
use truegrind_arm::condition::Condition;
use truegrind_arm::model::{Joints, Model};
use truegrind_calibration::identification::benefit::Benefit;
use truegrind_calibration::identification::identify::{Options, identify};
use truegrind_calibration::measurement::dataset::{Dataset, Reading, Row, Sensor};
use truegrind_calibration::measurement::split;
use truegrind_math::se3::Pose;

const NOISE_MM: f64 = 0.015;

/// How the angles came to be multiples of the step.
#[derive(Clone, Copy, PartialEq)]
enum Angles {
    Rounded,
    Commanded,
}

/// What an identification expects of the estimated arm, and its error without the twist of the gears (mm).
struct Outcome {
    benefit: Benefit,
    links_mm: f64,
}

/// 110 random poses and ten of them again, by an arm whose links are off and whose gears twist the joints by up to `gears_rad`.
fn outcome(angles: Angles, step_deg: f64, gears_rad: [f64; 6], seed: u64) -> Outcome {
    let (nominal, still, step) = (arm(), Condition::default(), step_deg.to_radians());
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = |sigma: f64| {
        let v: f64 = StandardNormal.sample(&mut rng);
        v * sigma
    };
    let mut actual: Model = nominal.clone();
    for link in &mut actual.links {
        link.a_mm += normal(0.3);
        link.d_mm += normal(0.3);
        link.alpha_rad += normal(6e-4);
        link.theta_rad += normal(1.2e-3);
    }
    let whole = |q: Joints| q.map(|v| (v / step).round() * step);
    let mut pose = || Joints::from_fn(|j, _| normal([0.7, 0.35, 0.35, 0.9, 0.7, 1.2][j]));
    let mut poses: Vec<Joints> = (0..110).map(|_| pose()).collect();
    let fresh: Vec<Joints> = (0..150).map(|_| pose()).collect();
    if angles == Angles::Commanded {
        poses.iter_mut().for_each(|q| *q = whole(*q));
    }
    let repeated: Vec<Joints> = poses.iter().step_by(11).copied().collect();
    poses.extend(repeated);
    let rows = poses.iter().enumerate().map(|(i, q)| {
        let twisted = Joints::from_fn(|j, _| q[j] + gears_rad[j] * (7.0 * q[j] + j as f64).sin());
        let seen = tracker().inverse() * (actual.forward(&twisted, &still) * Point3::from(TARGET_MM));
        let noise = Vector3::from_fn(|_, _| normal(NOISE_MM));
        Row::new(i, whole(*q), Reading::Position(seen.coords + noise))
    });
    let mut dataset = Dataset::new("steps.csv", Sensor::Position, rows.collect::<Vec<_>>());
    dataset.angle_step_rad = Some(step);
    let halves = |rows: &Dataset| split::random(rows, 0.2, 0);
    let found = identify(&dataset, "arm", &nominal, &start(&dataset), &halves, &Options::default()).unwrap();
    let is_told = found.estimated.verdict.reasons.iter().any(|reason| reason.text.contains("log rounds"));
    assert_eq!(is_told, angles == Angles::Rounded, "{:?}", found.estimated.verdict.reasons);
    let target = Pose::translation(TARGET_MM[0], TARGET_MM[1], TARGET_MM[2]);
    let links_mm = placed_rms_mm(&actual, &found.estimated.model, &fresh, &target);
    Outcome { benefit: found.benefit.unwrap(), links_mm }
}

#[test]
fn the_rounding_of_a_log_is_not_expected_of_the_arm() {
    for step_deg in [0.1, 0.01] {
        let cases = (0..7).map(|seed| {
            let Outcome { benefit, links_mm } = outcome(Angles::Rounded, step_deg, [0.0; 6], seed);
            // The scale of a tracker is not in question here.
            benefit.estimated_without_scale_mm / links_mm
        });
        let mut ratios: Vec<f64> = cases.collect();
        ratios.sort_by(f64::total_cmp);
        assert!(ratios[3] > 0.75 && ratios[3] < 1.35 && ratios[5] < 2.0, "{step_deg}°: {ratios:?}");
    }
}

/// Gears that twist some joints by about as much as rounding would all of them.
#[test]
fn commanded_angles_are_exact_and_what_is_left_is_the_arms() {
    let twist = 0.08_f64.to_radians();
    for (seed, gears_rad) in (0..).zip([
        [0.0; 6],
        [0.0, 0.0, 0.0, twist, 0.0, 0.0],
        [0.0, 0.5 * twist, 0.0, 1.5 * twist, 0.0, 0.0],
        [0.3 * twist, 0.0, twist, 0.0, 0.6 * twist, 0.0],
    ]) {
        let Outcome { benefit, .. } = outcome(Angles::Commanded, 0.1, gears_rad, seed);
        // A target some 0.1 to 0.6 m from the joints; the mean of sin² is a half.
        let left = benefit.beyond_noise.unwrap().most_mm();
        let lever_mm = [450.0, 400.0, 300.0, 100.0, 100.0, 30.0];
        let twisted: f64 = (0..6).map(|j| 0.5 * (gears_rad[j] * lever_mm[j]).powi(2)).sum::<f64>().sqrt();
        assert!(left > 0.5 * twisted, "seed {seed}: {left} mm beyond noise, gears {twisted}");
    }
}
