//! A cable over a pulley, or a camera whose lens distorts, and a box of poses: the arm's links take up what the sensor does, and programs are worse for it. The class:
//! readings that agree with the model are no proof where the poses do not tell the arm from its sensor.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use rand::{RngExt as _, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use truegrind_arm::condition::Condition;
use truegrind_arm::estimated::Judgement;
use truegrind_arm::inverse::Inverse;
use truegrind_arm::model::{Joints, Model};
use truegrind_arm::robots;
use truegrind_calibration::identification::identify::Identification;
use truegrind_calibration::measurement::dataset::{Dataset, Reading, Row, Sensor};
use truegrind_math::se3::Pose;

use super::promise::{identified, placed_rms_mm};

/// Hook on the flange (mm).
const HOOK_MM: [f64; 3] = [20.0, -15.0, 60.0];

/// Rows, of which the last repeat the first ones.
const ROWS: usize = 170;
const REPEATED: usize = 12;

/// Noise of a camera (mm along each axis), and its distance from the part (mm).
const CAMERA_MM: f64 = 0.06;
const DISTANCE_MM: f64 = 1500.0;

struct Measured {
    dataset: Dataset,
    nominal: Model,
    actual: Model,
    poses: Vec<Joints>,
}

/// An arm that differs a little from its data sheet.
fn actual_arm(nominal: &Model, rng: &mut ChaCha8Rng) -> Model {
    let mut actual = nominal.clone();
    for link in &mut actual.links {
        link.a_mm += normal(rng, 0.1);
        link.d_mm += normal(rng, 0.1);
        link.alpha_rad += normal(rng, 2.5e-4);
        link.theta_rad += normal(rng, 7e-4);
    }
    actual
}

fn normal(rng: &mut ChaCha8Rng, sigma: f64) -> f64 {
    let v: f64 = StandardNormal.sample(rng);
    v * sigma
}

fn joints_in_box(nominal: &Model, rng: &mut ChaCha8Rng, count: usize) -> Vec<Joints> {
    let still = Condition::default();
    let inverse = Inverse::new(nominal, &still, nominal);
    let middle = Joints::from_column_slice(&[0.0, 20.0, 0.0, 0.0, 60.0, 0.0].map(f64::to_radians));
    let centre = nominal.forward(&middle, &still);
    let mut out = Vec::new();
    while out.len() < count {
        let mut within = |half: f64| rng.random_range(-half..half);
        let place = Vector3::new(within(130.0), within(160.0), within(100.0));
        let turn = Vector3::new(within(0.5), within(0.5), within(0.5));
        let at = Pose::from_parts(
            (centre.translation.vector + place).into(),
            UnitQuaternion::from_scaled_axis(turn) * centre.rotation,
        );
        out.extend(inverse.solve_near(&at, &middle).ok().map(|found| found.joints));
    }
    out
}

fn random_joints(rng: &mut ChaCha8Rng, count: usize) -> Vec<Joints> {
    let half = [90.0, 55.0, 55.0, 120.0, 100.0, 150.0];
    (0..count).map(|_| Joints::from_fn(|j, _| f64::to_radians(rng.random_range(-half[j]..half[j])))).collect()
}

/// Length of a wire to a place from the outlet (mm) over a pulley of a radius (mm) that swivels about the vertical, beside a constant.
fn length_mm(away: &Vector3<f64>, radius_mm: f64) -> f64 {
    let across = away.x.hypot(away.y) - radius_mm;
    let tangent = (across.hypot(away.z).powi(2) - radius_mm * radius_mm).max(1.0).sqrt();
    tangent + radius_mm * (away.z.atan2(across) + radius_mm.atan2(tangent))
}

fn measured(is_box: bool, radius_mm: f64, seed: u64) -> Measured {
    let nominal = robots::load("abb-irb-120").unwrap().model;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let actual = actual_arm(&nominal, &mut rng);
    let mut poses = if is_box {
        joints_in_box(&nominal, &mut rng, ROWS - REPEATED)
    } else {
        random_joints(&mut rng, ROWS - REPEATED)
    };
    poses.extend_from_within(..REPEATED);
    let outlet = Vector3::new(rng.random_range(300.0..450.0), rng.random_range(-250.0..250.0), 60.0);
    let still = Condition::default();
    let rows: Vec<Row> = poses
        .iter()
        .enumerate()
        .map(|(i, q)| {
            let away = (actual.forward(q, &still) * Point3::from(HOOK_MM)).coords - outlet;
            let length = length_mm(&away, radius_mm) + normal(&mut rng, 0.06);
            Row::new(i, *q, Reading::Cable(length))
        })
        .collect();
    let mut dataset = Dataset::new("pulley.csv", Sensor::Cable, rows);
    dataset.file = "pulley.csv".to_owned();
    let poses = if is_box { joints_in_box(&nominal, &mut rng, 100) } else { random_joints(&mut rng, 100) };
    Measured { dataset, nominal, actual, poses }
}

/// The identification, and the RMS error of data sheet and estimate at fresh poses (mm).
fn judged(case: &Measured) -> (Identification, [f64; 2]) {
    let found = identified(&case.dataset, "abb-irb-120", &case.nominal).unwrap();
    let target = found.geometry.frames.flange_from_target;
    let rms = |model: &Model| placed_rms_mm(&case.actual, model, &case.poses, &target);
    let both = [rms(&case.nominal), rms(&found.estimated.model)];
    (found, both)
}

#[test]
fn a_box_of_poses_that_does_not_tell_the_arm_from_a_pulley_writes_no_worse_arm() {
    let mut worse = 0;
    for seed in 0..5 {
        let (found, [sheet_mm, estimated_mm]) = judged(&measured(true, 12.0, seed));
        let verdict = &found.estimated.verdict;
        if estimated_mm < sheet_mm {
            continue;
        }
        worse += 1;
        let context = format!("seed {seed}: {sheet_mm:.3} to {estimated_mm:.3} mm, {verdict:?}");
        assert!(matches!(verdict.status, Judgement::Doubtful | Judgement::Fail), "{context}");
        if verdict.status == Judgement::Doubtful {
            assert!(verdict.reasons.iter().any(|reason| reason.text.contains("over a pulley")), "{context}");
        }
    }
    assert!(worse > 2, "the box must be one that misleads: {worse} of 5");
}

/// Random poses tell: without a pulley the arm is written and helps; with one it is written only where it helps.
#[test]
fn random_poses_tell_the_arm_from_a_pulley() {
    for seed in 0..3 {
        for radius_mm in [0.0, 3.0, 10.0] {
            let (found, [sheet_mm, estimated_mm]) = judged(&measured(false, radius_mm, seed));
            let verdict = &found.estimated.verdict;
            let is_written = verdict.status == Judgement::NotEvaluated;
            let context = format!(
                "seed {seed}, radius {radius_mm} mm: {sheet_mm:.3} to {estimated_mm:.3} mm, {verdict:?}"
            );
            assert!(is_written || radius_mm > 0.0, "{context}");
            assert!(estimated_mm < sheet_mm || !is_written, "{context}");
            eprintln!("{context}");
        }
    }
}

/// A part of sixty poses before a camera whose lens distorts by the share `distortion` at the edge of the poses; the last repeat the first.
fn part_before_camera(distortion: f64, seed: u64) -> Measured {
    let nominal = robots::load("abb-irb-120").unwrap().model;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let actual = actual_arm(&nominal, &mut rng);
    let mut poses = joints_in_box(&nominal, &mut rng, 48);
    poses.extend_from_within(..REPEATED);
    let still = Condition::default();
    let places: Vec<Vector3<f64>> =
        poses.iter().map(|q| (actual.forward(q, &still) * Point3::from(HOOK_MM)).coords).collect();
    let middle = places.iter().sum::<Vector3<f64>>() / places.len() as f64;
    // The camera looks along its z axis, past the middle of the part.
    let aside = Vector3::new(normal(&mut rng, 60.0), normal(&mut rng, 60.0), DISTANCE_MM);
    let turned = UnitQuaternion::from_euler_angles(1.9, 0.4, 0.3);
    let edge_mm = places.iter().map(|place| (place - middle).norm()).fold(0.0, f64::max);
    let rows: Vec<Row> = places
        .iter()
        .zip(&poses)
        .enumerate()
        .map(|(i, (place, q))| {
            let seen = turned * (place - middle) + aside;
            let across = Vector3::new(seen.x, seen.y, 0.0);
            let distorted = seen + across * (distortion * (across.norm() / edge_mm).powi(2));
            Row::new(
                i,
                *q,
                Reading::Position(distorted + Vector3::from_fn(|_, _| normal(&mut rng, CAMERA_MM))),
            )
        })
        .collect();
    let mut dataset = Dataset::new("camera.csv", Sensor::Position, rows);
    dataset.file = "camera.csv".to_owned();
    let poses = joints_in_box(&nominal, &mut rng, 100);
    Measured { dataset, nominal, actual, poses }
}

/// Round a part the links take up what a lens does, and programs are worse for it; without a distortion the model is written.
#[test]
fn a_part_before_a_camera_whose_lens_distorts_writes_no_worse_arm() {
    let (mut worse, mut put_down_to_lens) = (0, 0);
    for seed in 0..5 {
        for distortion in [0.0, 0.006, 0.015] {
            let (found, [sheet_mm, estimated_mm]) = judged(&part_before_camera(distortion, seed));
            let verdict = &found.estimated.verdict;
            let is_written = verdict.status == Judgement::NotEvaluated;
            let context = format!(
                "seed {seed}, distortion {distortion}: {sheet_mm:.3} to {estimated_mm:.3} mm, {verdict:?}"
            );
            // Of so few rows one in ten is refused by chance of its held-out error.
            assert!(verdict.status != Judgement::Doubtful || distortion > 0.0, "{context}");
            if estimated_mm > sheet_mm {
                worse += 1;
                assert!(!is_written, "{context}");
                let names = |words: &str| verdict.reasons.iter().any(|reason| reason.text.contains(words));
                // A slight distortion is a scale error in first degree, which is the simpler explanation and as well the sensor's.
                let names_sensor = names("lens distorts") || names("a sensor that reads");
                assert!(names_sensor || verdict.status == Judgement::Fail, "{context}");
                put_down_to_lens += usize::from(names("lens distorts"));
            }
        }
    }
    assert!(worse > 2, "the lens must be one that misleads: {worse} of 10");
    assert!(2 * put_down_to_lens > worse, "{put_down_to_lens} of {worse} are put down to the lens");
}
