//! Copied rows count once; rows are brought into the order of measuring; a clock in another unit and joints out of range are noticed.

use std::sync::Arc;

use nalgebra::Vector3;
use truegrind_arm::model::Joints;
use truegrind_calibration::measurement::convention::AngleConvention;
use truegrind_calibration::measurement::dataset::{Dataset, Reading, Row, Sensor};
use truegrind_calibration::measurement::matching::prepare_rows;

/// Rows at poses of their own, read to 0.1 µm.
fn rows(count: usize) -> Vec<Row> {
    let of = |i: usize| {
        let at = i as f64;
        let joints = Joints::from_fn(|j, _| (0.37 * at + j as f64).sin());
        let place = Vector3::new(1000.0 + at, 20.0 - 0.1237 * at, (at * 1.7).cos());
        Row::new(i, joints, Reading::Position(place))
    };
    (0..count).map(of).collect()
}

fn matched(rows: Vec<Row>) -> Dataset {
    let nominal = truegrind_arm::robots::load("abb-irb-120").unwrap().model;
    let dataset = Dataset::new("rows.csv", Sensor::Position, rows);
    // The readings are of no arm, so units cannot be told.
    prepare_rows(dataset, "abb-irb-120", &nominal, AngleConvention::Logged, true).unwrap()
}

fn numbers(dataset: &Dataset) -> Vec<usize> {
    dataset.rows.iter().map(|row| row.number).collect()
}

/// Which of the rows that [`rows`] makes they are.
fn made(dataset: &Dataset) -> Vec<usize> {
    let of = |row: &Row| match &row.reading {
        Reading::Position(at) => (at.x - 1000.0).round() as usize,
        _ => usize::MAX,
    };
    dataset.rows.iter().map(of).collect()
}

fn timed(mut rows: Vec<Row>, hours: impl Fn(usize) -> f64) -> Vec<Row> {
    for (i, row) in rows.iter_mut().enumerate() {
        Arc::make_mut(&mut row.condition).time_h = Some(hours(i));
    }
    rows
}

fn named(mut rows: Vec<Row>, session: impl Fn(usize) -> &'static str) -> Vec<Row> {
    for (i, row) in rows.iter_mut().enumerate() {
        row.extra_mut().session = Some(session(i).to_owned());
    }
    rows
}

#[test]
fn copied_rows_count_once() {
    let mut all = rows(5);
    for (number, of) in [(5, 2), (6, 2), (7, 4)] {
        all.push(Row { number, ..all[of].clone() });
    }
    let found = matched(all);
    assert_eq!(numbers(&found), [0, 1, 2, 3, 4]);
    assert!(found.notes[0].starts_with("rows 5, 6 and 7 are copies"), "{:?}", found.notes);
}

/// No tracker reads the same to 0.1 µm again: a row with another time or session is a copy too, where the sensor's steps are fine.
#[test]
fn rows_copied_to_another_time_count_once() {
    let later = |rows: Vec<Row>| timed(rows, |i| i as f64 / 60.0);
    let twice = [rows(3), rows(3)].concat();
    assert_eq!(matched(later(twice.clone())).rows.len(), 3);
    assert_eq!(matched(named(twice.clone(), |i| ["monday", "tuesday"][i / 3])).rows.len(), 3);
    let nominal = truegrind_arm::robots::load("abb-irb-120").unwrap().model;
    let mut coarse = Dataset::new("rows.csv", Sensor::Position, later(twice));
    coarse.reading_step_mm = Some(0.1);
    let coarse = prepare_rows(coarse, "abb-irb-120", &nominal, AngleConvention::Logged, true).unwrap();
    assert_eq!(coarse.rows.len(), 6);
}

/// Another reading is another measurement, and so is an equal reading of a coarse sensor.
#[test]
fn repeated_readings_are_no_copies() {
    let mut all = rows(5);
    let mut again = Row { number: 5, ..all[2].clone() };
    again.reading = Reading::Position(Vector3::new(1002.0, 20.0, 0.5));
    all.push(again);
    assert_eq!(matched(all).rows.len(), 6);
    // Five readings of a pose in steps of 0.1 mm, which scatter by as much.
    let coarse = |steps: i32| Reading::Position(Vector3::new(1000.0 + 0.1 * f64::from(steps), 0.0, 0.0));
    let mut pose = vec![rows(1)[0].clone(); 5];
    pose.iter_mut().zip([0, 1, 0, 1, 2]).for_each(|(row, steps)| row.reading = coarse(steps));
    assert_eq!(matched(pose).rows.len(), 5);
}

#[test]
fn rows_are_brought_into_the_order_of_the_clock() {
    let mixed = timed(rows(6), |i| [0.3, 0.1, 0.5, 0.2, 0.6, 0.4][i]);
    let found = matched(mixed);
    assert_eq!(made(&found), [1, 3, 0, 5, 2, 4]);
    // Steps of the set-up are ranges of numbers.
    assert_eq!(numbers(&found), [0, 1, 2, 3, 4, 5]);
    assert!(found.notes[0].contains("sorted by t"), "{:?}", found.notes);
    let in_order = matched(timed(rows(6), |i| i as f64 / 60.0));
    assert_eq!((numbers(&in_order), in_order.notes.len()), (vec![0, 1, 2, 3, 4, 5], 0));
}

/// Such a clock says nothing of the time between the two parts.
#[test]
fn a_clock_that_was_restarted_is_not_used() {
    let found = matched(timed(rows(6), |i| (i % 3) as f64 / 60.0));
    assert_eq!(numbers(&found), [0, 1, 2, 3, 4, 5]);
    assert!(found.rows.iter().all(|row| row.condition.time_h.is_none()));
    assert!(found.notes[0].contains("starts again at row 3"), "{:?}", found.notes);
}

#[test]
fn rows_of_mixed_sessions_are_brought_together() {
    let found = matched(named(rows(8), |i| ["monday", "tuesday"][i % 2]));
    assert_eq!(made(&found), [0, 2, 4, 6, 1, 3, 5, 7]);
    assert_eq!(numbers(&found), [0, 1, 2, 3, 4, 5, 6, 7]);
    assert!(found.notes[0].contains("2 sessions are mixed"), "{:?}", found.notes);
    // A session that is continued once is in the order of measuring.
    let continued = named(rows(6), |i| ["monday", "monday", "tuesday"][i % 3]);
    assert_eq!(numbers(&matched(continued)), [0, 1, 2, 3, 4, 5]);
}

fn refused(rows: Vec<Row>) -> Option<String> {
    let nominal = truegrind_arm::robots::load("abb-irb-120").unwrap().model;
    let dataset = Dataset::new("rows.csv", Sensor::Position, rows);
    prepare_rows(dataset, "abb-irb-120", &nominal, AngleConvention::Logged, false)
        .err()
        .map(|error| error.to_string())
}

#[test]
fn a_clock_in_seconds_is_refused() {
    let of = |seconds: f64| refused(timed(rows(5), |i| i as f64 * seconds));
    assert!(of(20.0).is_some_and(|why| why.contains("divide it by 3600")));
    assert_eq!(of(20.0 / 3600.0), None);
}

#[test]
fn kelvin_and_fahrenheit_are_refused() {
    let of = |temperature: f64| {
        let mut rows = rows(5);
        rows.iter_mut().for_each(|row| Arc::make_mut(&mut row.condition).temperature_c = Some(temperature));
        refused(rows)
    };
    assert!(of(294.2).is_some_and(|why| why.contains("273.15")));
    assert!(of(70.5).is_some_and(|why| why.contains("Fahrenheit")));
    assert_eq!(of(21.3), None);
}

#[test]
fn a_reading_beyond_all_reach_is_left_out() {
    let nominal = truegrind_arm::robots::load("abb-irb-120").unwrap().model;
    let of = |rows: Vec<Row>| {
        let dataset = Dataset::new("rows.csv", Sensor::Position, rows);
        prepare_rows(dataset, "abb-irb-120", &nominal, AngleConvention::Logged, false).unwrap()
    };
    let mut wrong = rows(20);
    wrong[7].reading = Reading::Position(Vector3::new(1007.0, 65535.0, 0.0));
    let found = of(wrong);
    assert_eq!(found.rows.len(), 19);
    assert!(found.notes[0].starts_with("row 7 left out"), "{:?}", found.notes);
    assert_eq!(of(rows(20)).rows.len(), 20);
}

#[test]
fn joints_out_of_their_range_are_noted() {
    let mut all = rows(12);
    for (number, degrees) in [(3, 131.0), (7, -140.0), (8, 120.5)] {
        all[number].joints[4] = f64::to_radians(degrees);
    }
    let found = matched(all);
    assert_eq!(found.rows.len(), 12);
    let expected = "rows 3 and 7 (2 of 12): joint 5 is at up to -140.0°, its range in the data sheet is -120.0° to 120.0°";
    assert!(found.notes.iter().any(|note| note.starts_with(expected)), "{:?}", found.notes);
}

/// Sides as the row before has them are not remarked on, nor are those of a program that chooses its sides; reversed ones are.
#[test]
fn reversed_sides_of_approach_are_noted() {
    let notes = |side: &dyn Fn(usize, f64) -> i8| {
        let mut all = rows(40);
        for i in 1..all.len() {
            let step = all[i].joints - all[i - 1].joints;
            Arc::make_mut(&mut all[i].condition).approach = std::array::from_fn(|j| side(i + j, step[j]));
        }
        matched(all).notes.iter().filter(|note| note.contains("sides of approach")).count()
    };
    let direction = |step: f64| if step > 0.0 { 1 } else { -1 };
    assert_eq!(notes(&|_, step| -direction(step)), 0);
    assert_eq!(notes(&|k, _| if k % 2 == 0 { 1 } else { -1 }), 0);
    assert_eq!(notes(&|_, step| direction(step)), 1);
}
