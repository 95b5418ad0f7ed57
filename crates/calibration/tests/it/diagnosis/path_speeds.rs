//! Speeds of the joints where a path turns sharply.

use std::sync::Arc;

use nalgebra::Vector3;
use truegrind_arm::model::Joints;
use truegrind_arm::robots;
use truegrind_calibration::diagnosis::preparation::prepare;
use truegrind_calibration::measurement::dataset::{Dataset, Rates, Reading, Row, Sensor};

/// Rows at times of 1 h on a path that turns from `first` to `second` at `corner_h`.
fn rates(first: Joints, second: Joints, corner_h: f64) -> Vec<Option<Rates>> {
    let at = |hours: f64| first * hours.min(corner_h) + second * (hours - corner_h).max(0.0);
    let rows: Vec<Row> = (0..60)
        .map(|number| {
            let hours = f64::from(number);
            let place = Vector3::new(600.0 + 1.7 * hours, 20.0, 500.0);
            let mut row = Row::new(number as usize, at(hours), Reading::Position(place));
            Arc::make_mut(&mut row.condition).time_h = Some(hours);
            row
        })
        .collect();
    let arm = robots::load("abb-irb-120").unwrap().model;
    let dataset = Dataset::new("path.csv", Sensor::Position, rows);
    prepare(&dataset, &arm, false).observed.dataset.rows.iter().map(|row| row.motion()?.rates).collect()
}

fn speeds() -> [Joints; 2] {
    [Joints::new(0.01, 0.02, -0.01, 0.0, 0.03, 0.01), Joints::new(-0.02, 0.01, 0.01, 0.02, 0.0, 0.01)]
}

fn assert_near(found: Joints, wanted: Joints) {
    assert!((found - wanted).norm() < 1e-12, "{found} instead of {wanted}");
}

#[test]
fn a_corner_at_a_row_has_both_speeds() {
    let [first, second] = speeds();
    let all = rates(first, second, 30.0);
    let corner = all[30].unwrap();
    assert!(corner.is_corner());
    assert_near(corner.mean, 0.5 * (first + second));
    assert_near(corner.before, first);
    assert_near(corner.after, second);
    assert_eq!(all.iter().flatten().filter(|rates| rates.is_corner()).count(), 1);
}

/// A corner close to one of the rows leaves the other little of the wrong speed: there the mean is kept.
#[test]
fn beside_a_corner_between_rows_the_arm_has_one_speed() {
    let [first, second] = speeds();
    for corner_h in [30.45, 30.5, 30.55] {
        let all = rates(first, second, corner_h);
        for (row, speed) in [(30, first), (31, second)] {
            let beside = all[row].unwrap();
            assert!(beside.is_corner());
            assert_near(beside.before, speed);
            assert_near(beside.after, speed);
        }
        assert_eq!(all.iter().flatten().filter(|rates| rates.is_corner()).count(), 2);
    }
}
