//! A raster in one orientation of the flange: the place of the target is not seen there, and stays where its prior has it.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use truegrind_arm::condition::Condition;
use truegrind_arm::inverse::Inverse;
use truegrind_arm::model::{Joints, Model};
use truegrind_arm::robots;
use truegrind_calibration::identification::calibration::Frames;
use truegrind_calibration::identification::identify::{Identification, Options, identify};
use truegrind_calibration::identification::start::candidate_frames;
use truegrind_calibration::identification::stated_frame::{beside, contradiction, with_touched_point};
use truegrind_calibration::measurement::dataset::{Dataset, Reading, Row, Sensor};
use truegrind_calibration::measurement::{registration, split};
use truegrind_math::se3::{Pose, pose_from_vector};

pub(crate) fn arm() -> Model {
    robots::load("abb-irb-120").unwrap().model
}

/// The target on the flange (mm).
pub(crate) const TARGET_MM: [f64; 3] = [20.0, -30.0, 90.0];

/// The tracker in the base.
pub(crate) fn tracker() -> Pose {
    Pose::from_parts(
        Vector3::new(1700.0, 350.0, 250.0).into(),
        UnitQuaternion::from_euler_angles(0.02, -0.01, 2.3),
    )
}

/// Play of joint 1 that the rasters hide (rad).
pub(crate) const PLAY_RAD: f64 = 4e-4;

/// Readings at flange positions (mm, about the middle of the raster) in one orientation: links that are off, a joint 2 that sags, play of
/// joint 1 between approaches, noise of 8 µm, angles logged with four decimals, sides of approach and hours.
pub(crate) fn measured(places_mm: &[[f64; 3]], seed: u64) -> Dataset {
    let (nominal, still) = (arm(), Condition::default());
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = |sigma: f64| {
        let v: f64 = StandardNormal.sample(&mut rng);
        v * sigma
    };
    let mut actual = nominal.clone();
    for link in &mut actual.links {
        link.a_mm += normal(0.3);
        link.d_mm += normal(0.3);
        link.alpha_rad += normal(6e-4);
        link.theta_rad += normal(1.2e-3);
    }
    let inverse = Inverse::new(&nominal, &still, &nominal);
    let middle = Joints::from_column_slice(&[0.0, 20.0, 0.0, 0.0, 60.0, 0.0].map(f64::to_radians));
    let centre = nominal.forward(&middle, &still);
    let step = 1e-4_f64.to_radians();
    let mut before = middle;
    let mut side = [1_i8; 6];
    let mut rows = Vec::new();
    for (i, place) in places_mm.iter().enumerate() {
        let at =
            Pose::from_parts((centre.translation.vector + Vector3::from(*place)).into(), centre.rotation);
        let q = inverse.solve_near(&at, &before).unwrap().joints;
        for j in 0..6 {
            let turn = q[j] - before[j];
            side[j] = if turn.abs() < 1e-9 {
                side[j]
            } else if turn > 0.0 {
                -1
            } else {
                1
            };
        }
        before = q;
        let mut turned = q;
        turned[0] += 0.5 * PLAY_RAD * f64::from(side[0]);
        turned[1] += 4e-4 * (q[1] + 0.3).sin();
        let seen = tracker().inverse() * (actual.forward(&turned, &still) * Point3::from(TARGET_MM));
        let noise = Vector3::from_fn(|_, _| normal(0.008));
        let mut row =
            Row::new(i, q.map(|v| (v / step).round() * step), Reading::Position(seen.coords + noise));
        let condition = Condition { time_h: Some(0.01 * i as f64), approach: side, ..Condition::default() };
        row.condition = condition.into();
        rows.push(row);
    }
    let mut dataset = Dataset::new("raster.csv", Sensor::Position, rows);
    dataset.angle_step_rad = Some(step);
    dataset
}

/// A raster of 8 lines of 12 points.
pub(crate) fn raster(seed: u64) -> Dataset {
    let line = |x: usize| (0..12).map(move |y| [31.0 * x as f64 - 110.0, 29.0 * y as f64 - 160.0, 0.0]);
    measured(&(0..8).flat_map(line).collect::<Vec<_>>(), seed)
}

pub(crate) fn start(dataset: &Dataset) -> Frames {
    candidate_frames(dataset, &arm()).unwrap().remove(0)
}

fn identified(dataset: &Dataset, frames: &Frames, target_mm: f64) -> Identification {
    let mut options = Options::default();
    options.tolerance.target_mm = target_mm;
    let halves = |rows: &Dataset| split::random(rows, 0.2, 0);
    identify(dataset, "arm", &arm(), frames, &halves, &options).unwrap()
}

fn told(found: &Identification) -> Option<&str> {
    let is_told = |reason: &&str| reason.contains("where the target sits");
    found.estimated.verdict.sentences().into_iter().find(is_told)
}

#[test]
fn an_unseen_target_stays_at_its_prior_and_is_told() {
    for seed in [1, 2, 3] {
        let dataset = raster(seed);
        let first = start(&dataset).flange_from_target.translation.vector;
        assert!(first.norm() < 150.0, "seed {seed}: the start puts the target at {first}");
        let found = identified(&dataset, &start(&dataset), 50.0);
        let at = found.geometry.frames.flange_from_target.translation.vector;
        assert!(at.norm() < 200.0, "seed {seed}: {at}");
        let told = told(&found).expect("a sentence on the target");
        for words in [
            "one orientation (within 0.0°)",
            "known only to ± ",
            "a tool whose tip is 100 mm",
            "turned by 30°",
        ] {
            assert!(told.contains(words), "seed {seed}: {told}");
        }
    }
}

/// The right frame and target are accepted, alone and together; wrong ones are not.
#[test]
fn the_right_frame_and_target_of_a_raster_are_accepted() {
    let nominal = arm();
    for seed in [1, 2, 3] {
        let dataset = raster(seed);
        let found = start(&dataset);
        let at = |frame: Pose| Frames { base_from_sensor: frame, ..Frames::at_origin(1) };
        let touched = Pose::translation(TARGET_MM[0], TARGET_MM[1], TARGET_MM[2]);
        for touched in [None, Some(&touched)] {
            let against = |frame: Pose| {
                let stated = at(frame);
                let best = beside(&dataset, &nominal, &stated, touched, &found);
                contradiction(&dataset, &nominal, &stated, &best, 1.0)
            };
            assert_eq!(against(tracker()), None, "seed {seed}");
            let shifted = pose_from_vector(&[0.0, 0.0, 0.0, 0.0, 0.0, 0.2]) * tracker();
            for wrong in [tracker().inverse(), Pose::translation(1.7, 0.35, 0.25), shifted] {
                assert!(against(wrong).is_some(), "seed {seed}: {wrong}");
            }
        }
        // The target alone: it is where the fit begins and stays, as sure as it was stated.
        let begun = identified(&dataset, &with_touched_point(&dataset, &nominal, &touched, found), 1.0);
        let off = begun.geometry.frames.flange_from_target.translation.vector - Vector3::from(TARGET_MM);
        assert!(
            off.norm() < 3.0 && told(&begun).is_some_and(|told| told.contains("± 1 mm")),
            "seed {seed}: {off}"
        );
    }
}

/// Where the poses turn the flange, the start is the one without a prior, and nothing is told.
#[test]
fn a_seen_target_is_not_held() {
    let dataset = raster(4);
    let nominal = arm();
    let mut rows: Vec<Row> = dataset.rows.iter().cloned().collect();
    for (i, row) in rows.iter_mut().enumerate() {
        row.joints += Joints::from_fn(|j, _| 0.3 * (1.7 * (i * (j + 2)) as f64).sin());
        let at = nominal.forward(&row.joints, &Condition::default()) * Point3::from(TARGET_MM);
        row.reading =
            Reading::Position((tracker().inverse() * at).coords.map(|v| (v * 100.0).round() / 100.0));
    }
    let dataset = Dataset::new("turned.csv", Sensor::Position, rows);
    let flanges: Vec<Pose> =
        dataset.rows.iter().map(|row| nominal.forward(&row.joints, &Condition::default())).collect();
    let seen: Vec<Vector3<f64>> = dataset.rows.iter().map(|row| row.reading.place_mm()).collect();
    let found = registration::target_point(&flanges, &seen).unwrap();
    assert!(!found.is_target_held && (found.target_mm - Vector3::from(TARGET_MM)).norm() < 0.1, "{found:?}");
    assert_eq!(told(&identified(&dataset, &start(&dataset), 50.0)), None);
}

/// How poses turn the flange does not follow from where the stations of a tracker are thought to stand before the fit.
#[test]
fn stations_that_are_not_yet_placed_leave_a_target_seen() {
    let mut dataset = raster(5);
    let nominal = arm();
    let mut turned: Vec<Row> = dataset.rows.iter().cloned().collect();
    for (i, row) in turned.iter_mut().enumerate() {
        row.joints += Joints::from_fn(|j, _| 0.3 * (1.7 * (i * (j + 2)) as f64).sin());
        let at = nominal.forward(&row.joints, &Condition::default()) * Point3::from(TARGET_MM);
        let placed = if i < 48 { Vector3::zeros() } else { Vector3::new(120.0, -80.0, 60.0) };
        row.reading = Reading::Position((tracker().inverse() * at).coords + placed);
        row.anchor = usize::from(i >= 48);
    }
    dataset.rows = turned.into();
    let found = identified(&dataset, &start(&dataset), 50.0);
    assert_eq!(told(&found), None);
}
