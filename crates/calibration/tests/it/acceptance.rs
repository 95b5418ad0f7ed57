//! Acceptance by poses that a model was not fitted to.

use truegrind_arm::condition::Condition;
use truegrind_arm::estimated::Estimated;
use truegrind_arm::model::Joints;
use truegrind_arm::robots;
use truegrind_calibration::acceptance::{AcceptError, Acceptance, Decision, Options, Uncertainty, accept};
use truegrind_calibration::identification::calibration::Frames;
use truegrind_calibration::identification::identify::{self, identify};
use truegrind_calibration::identification::register::starting_frames;
use truegrind_calibration::identification::tolerance::Tolerance;
use truegrind_calibration::measurement::dataset::{Dataset, Reading, Row, Sensor};
use truegrind_calibration::measurement::split;

/// Joints of pose `k` of a series, all over the range of an IRB 120.
fn pose(series: f64, k: usize) -> Joints {
    Joints::from_fn(|j, _| {
        let phase = (series + 1.618_034 * (k + 1) as f64 * (j + 1) as f64).fract();
        [2.4, 1.2, 1.0, 2.0, 1.4, 3.0][j] * (phase - 0.5)
    })
}

/// Rows of the arm of the data sheet, seen from its base.
fn rows(series: f64, count: usize) -> Vec<Row> {
    let nominal = robots::load("abb-irb-120").unwrap().model;
    let at = |k: usize| {
        let q = pose(series, k);
        let place = nominal.at_condition(&Condition::default()).forward(&q).translation.vector;
        // A hundredth of a millimetre, in one direction or another.
        let scatter = 0.01 * [-1.0, 1.0][k % 2];
        Row::new(k, q, Reading::Position(place.add_scalar(scatter)))
    };
    (0..count).map(at).collect()
}

fn dataset(rows: Vec<Row>) -> Dataset {
    Dataset::new("rows.csv", Sensor::Position, rows)
}

fn model(rows: &Dataset) -> Estimated {
    let nominal = robots::load("abb-irb-120").unwrap().model;
    let frames = starting_frames(rows, &nominal, &Tolerance::default(), false).unwrap();
    let split = |data: &Dataset| split::random(data, 0.2, 0);
    let options = identify::Options::default();
    identify(rows, "abb-irb-120", &nominal, &frames, &split, &options).unwrap().estimated
}

fn options(tolerance_mm: f64) -> Options {
    Options { tolerance_mm, uncertainty_mm: Some(0.02), frames: None, seed: 0 }
}

#[test]
fn the_decision_leaves_room_for_the_uncertainty() {
    let model = model(&dataset(rows(0.1, 120)));
    let other = dataset(rows(0.7, 110));
    let of = |tolerance_mm: f64| accept(&other, &model, &options(tolerance_mm)).unwrap();
    let found: Acceptance = of(1.0);
    let largest = found.model.max;
    assert!((0.005..0.05).contains(&largest), "{largest}");
    assert_eq!((found.poses, found.rows, found.uncertainty), (110, 110, Uncertainty::Stated));
    assert_eq!(found.decision, Decision::Accepted);
    assert_eq!(of(largest + 0.021).decision, Decision::Accepted);
    assert_eq!(of(largest + 0.019).decision, Decision::Open);
    if largest > 0.021 {
        assert_eq!(of(largest - 0.021).decision, Decision::Refused);
    }
    // Too few poses decide nothing; readings of one pose are one pose.
    let few = accept(&dataset(rows(0.7, 99)), &model, &options(1.0)).unwrap();
    assert_eq!(few.decision, Decision::NotEvaluated);
    let mut again = rows(0.7, 60);
    again.extend(rows(0.7, 60));
    assert_eq!(accept(&dataset(again), &model, &options(1.0)).unwrap().poses, 60);
    assert!(matches!(accept(&other, &model, &options(-1.0)), Err(AcceptError::Length { .. })));
}

/// An error that is stated of rows of the fit is none: whatever the file is called, and if rows are left out.
#[test]
fn rows_of_the_fit_are_noticed() {
    let fitted = rows(0.1, 150);
    let model = model(&dataset(fitted.clone()));
    let part = dataset(fitted[..140].to_vec());
    assert!(matches!(accept(&part, &model, &options(1.0)), Err(AcceptError::RowsOfTheFit { .. })));
    let mut mixed = rows(0.7, 120);
    mixed.extend_from_slice(&fitted[..20]);
    assert!(accept(&dataset(mixed), &model, &options(1.0)).is_ok());
}

/// Pose accuracy is the way to the barycentre, repeatability the mean distance from it and three standard deviations.
#[test]
fn cycles_give_accuracy_and_repeatability() {
    let model = model(&dataset(rows(0.1, 120)));
    let nominal = &model.model;
    let mut cycled = rows(0.7, 100);
    for pose_of in 0..5 {
        let q = pose(0.3, pose_of);
        let place = nominal.at_condition(&Condition::default()).forward(&q).translation.vector;
        for cycle in 0..30 {
            let mut seen = place;
            seen.y += 0.1;
            seen.x += 0.03 * [-1.0, 1.0][cycle % 2];
            cycled.push(Row::new(cycled.len(), q, Reading::Position(seen)));
        }
    }
    let stated = Options { frames: Some(Frames::at_origin(1)), ..options(1.0) };
    let found = accept(&dataset(cycled.clone()), &model, &stated).unwrap();
    let cycles = found.cycles.unwrap();
    assert_eq!((cycles.poses, cycles.cycles, found.most_cycles), (5, 30, 30));
    assert!((cycles.accuracy_mm - 0.1).abs() < 1e-9, "{cycles:?}");
    assert!((cycles.repeatability_mm - 0.03).abs() < 1e-9, "{cycles:?}");
    // One cycle less, and there is nothing to be said.
    cycled.pop();
    assert!(accept(&dataset(cycled), &model, &stated).unwrap().cycles.is_none());
}
