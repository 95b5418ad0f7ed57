//! Rows beside which stands the reading of a neighbour: both verbs say which, in the same words; and what is no shift is not called one.

use truegrind_arm::model::Model;
use truegrind_arm::robots;
use truegrind_calibration::diagnosis::diagnose::{self, diagnose};
use truegrind_calibration::identification::identify::{Options, identify};
use truegrind_calibration::measurement::dataset::{Dataset, Sensor};
use truegrind_calibration::measurement::split;

use super::misread_poses::measured_poses;
use crate::diagnosis::scenarios::frames;
use crate::diagnosis::simulator::{Hidden, Log, Setup, run};

fn arm() -> Model {
    robots::load("abb-irb-120").unwrap().model
}

fn measured(sensor: Sensor, hidden: &[Hidden], seed: u64) -> Dataset {
    if sensor == Sensor::Pose {
        return measured_poses(seed);
    }
    let setup = Setup { sensor, rows: 120, sigma_mm: 0.03, dirty: false, seed, log: Log::default() };
    run(&arm(), hidden, &setup).dataset
}

/// The readings of these rows are those of the row `step` later.
fn shifted(dataset: &Dataset, rows: std::ops::Range<usize>, step: isize) -> Dataset {
    let mut out = dataset.clone();
    for (index, row) in out.rows.iter_mut().enumerate() {
        if rows.contains(&index) {
            row.reading = dataset.rows[index.checked_add_signed(step).unwrap()].reading.clone();
        }
    }
    out
}

/// What `identify` and `diagnose` say of a file: why they refuse it, or all reasons and notes.
fn told(dataset: &Dataset) -> [Result<String, String>; 2] {
    let (arm, options) = (arm(), Options::default());
    let frames = frames(dataset, &arm);
    let share = |rows: &Dataset| split::random(rows, options.held_out, options.seed);
    let identified = identify(dataset, "abb-irb-120", &arm, &frames, &share, &options);
    let identified = identified.map(|found| {
        found.estimated.verdict.reasons.into_iter().map(|reason| reason.text).collect::<Vec<_>>().join("\n")
    });
    let diagnosed = diagnose(dataset, "abb-irb-120", &arm, &frames, &diagnose::Options::default(), &|_| {});
    [
        identified.map_err(|error| error.to_string()),
        diagnosed.map(|found| found.diagnosis.notes.join("\n")).map_err(|error| error.to_string()),
    ]
}

#[test]
fn a_fifth_of_the_rows_that_is_shifted_is_refused_by_both_verbs_in_the_same_words() {
    for (sensor, seed) in [(Sensor::Position, 71), (Sensor::Pose, 72), (Sensor::Cable, 73)] {
        for (step, neighbour) in [(1, "after"), (-1, "before")] {
            let rows = measured(sensor, &[], seed);
            let [first, last] = [50, 73].map(|row: usize| rows.rows[row].number);
            let words = format!(
                "rows {first} to {last}: angles and readings look shifted by one, each reading belongs to the row {neighbour} it"
            );
            for told in told(&shifted(&rows, 50..74, step)) {
                assert!(
                    told.clone().is_err_and(|told| told.ends_with(&words)),
                    "{sensor:?} {step}: {told:?}"
                );
            }
        }
    }
}

/// Half of the file, and its beginning: no fit of all rows tells the frames.
#[test]
fn a_half_that_is_shifted_is_told() {
    for range in [30..90, 0..60] {
        let rows = measured(Sensor::Position, &[], 74);
        let [first, last] = [range.start, range.end - 1].map(|row| rows.rows[row].number);
        let words = format!("rows {first} to {last}: angles and readings look shifted by one");
        for told in told(&shifted(&rows, range, 1)) {
            assert!(
                told.clone().is_err_and(
                    |told| told.ends_with(&format!("{words}, each reading belongs to the row after it"))
                ),
                "{words}: {told:?}"
            );
        }
    }
}

/// So few rows are set aside by both verbs, which go on.
#[test]
fn a_few_shifted_rows_are_set_aside_by_both_verbs_with_the_same_note() {
    for (sensor, seed) in [(Sensor::Position, 75), (Sensor::Cable, 76)] {
        let rows = measured(sensor, &[], seed);
        let [first, last] = [60, 68].map(|row: usize| rows.rows[row].number);
        let words = format!("rows {first} to {last}: angles and readings look shifted by one");
        for told in told(&shifted(&rows, 60..69, -1)) {
            assert!(told.clone().is_ok_and(|told| told.contains(&words)), "{sensor:?}: {told:?}");
        }
    }
}

#[test]
fn wild_rows_are_not_called_shifted() {
    for (sensor, seed) in [(Sensor::Position, 77), (Sensor::Cable, 78)] {
        for list in [(60..69).collect::<Vec<usize>>(), vec![3, 20, 21, 50, 77, 90, 91, 92, 110]] {
            let rows = measured(sensor, &[Hidden::Outliers { list, mm: 300.0 }], seed);
            for told in told(&rows) {
                assert!(told.clone().is_ok_and(|told| !told.contains("shifted")), "{sensor:?}: {told:?}");
            }
        }
    }
}
