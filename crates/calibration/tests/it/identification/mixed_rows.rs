//! Rows of two arms in one file are no arm: both verbs refuse them and say which rows are whose. One arm has two populations of readings, too
//! (the sides of play, two nests, a sensor that was moved): these are never taken for two arms.

use truegrind_arm::estimated::{Judgement, Verdict};
use truegrind_arm::robots;
use truegrind_calibration::diagnosis::diagnose::{self, diagnose};
use truegrind_calibration::identification::identify::{Options, identify};
use truegrind_calibration::measurement::dataset::{Dataset, Sensor};
use truegrind_calibration::measurement::{import, split};

use super::promise::Case;
use crate::diagnosis::scenarios::frames;
use crate::diagnosis::simulator::{Hidden, Log, Setup, run};

/// The verdicts of `identify` and `diagnose`.
fn verdicts(dataset: &Dataset, robot: &str) -> [Verdict; 2] {
    let arm = robots::load(robot).unwrap().model;
    let (frames, options) = (frames(dataset, &arm), Options::default());
    let share = |rows: &Dataset| split::random(rows, options.held_out, options.seed);
    let identified = identify(dataset, robot, &arm, &frames, &share, &options).unwrap();
    let diagnosed = diagnose(dataset, robot, &arm, &frames, &diagnose::Options::default(), &|_| {}).unwrap();
    [identified.estimated.verdict, diagnosed.estimated.verdict]
}

fn says_two_arms(verdict: &Verdict) -> bool {
    verdict.reasons.iter().any(|reason| reason.text.starts_with("rows of two arms"))
}

/// Rows of two arms of a type before one tracker; `is_second` by row.
fn mixed(robot: &'static str, rows: usize, is_second: impl Fn(usize) -> bool) -> Dataset {
    let of = |seed| Case { robot, cable: false, rows, noise_mm: 0.02, scale: 0.0, spread: 1.0, seed };
    let [first, second] = [of(3), of(4)].map(|case| case.measured().csv);
    let lines = first.lines().zip(second.lines()).enumerate();
    let text: String = lines
        .map(|(k, (a, b))| if k > 0 && is_second(k - 1) { format!("{b}\n") } else { format!("{a}\n") })
        .collect();
    import::read("mixed.csv", text.as_bytes(), &import::Options::default()).unwrap()
}

#[test]
fn rows_of_two_arms_are_refused_by_both_verbs() {
    for (robot, rows, every) in
        [("abb-irb-120", 60, 2), ("universal-robots-ur10", 160, 5), ("staubli-tx60", 160, 2)]
    {
        let dataset = mixed(robot, rows, |row| row % every == every - 1);
        for verdict in verdicts(&dataset, robot) {
            assert_eq!(verdict.status, Judgement::Fail, "{robot}: {verdict:?}");
            let number = dataset.rows[every - 1].number;
            let part = format!("The smaller part are rows {number}, {}, ", number + every);
            assert!(verdict.reasons[0].text.starts_with("rows of two arms"), "{robot}: {verdict:?}");
            // Of two halves either may be the smaller one by a row or two.
            assert!(every == 2 || verdict.reasons[0].text.contains(&part), "{robot}: {verdict:?}");
        }
    }
    let dataset = mixed("abb-irb-120", 160, |row| row >= 80);
    for verdict in verdicts(&dataset, "abb-irb-120") {
        let end = format!("The one part ends at row {}", dataset.rows[79].number);
        assert!(verdict.reasons[0].text.contains(&end), "{verdict:?}");
    }
}

#[test]
fn one_arm_with_two_populations_of_readings_is_not_two_arms() {
    let (from, to) = (60, 119);
    let cases: [&[Hidden]; 6] = [
        &[Hidden::Backlash { joint: 1, play_rad: 3e-3 }, Hidden::Backlash { joint: 3, play_rad: 5e-3 }],
        &[Hidden::Tool { from, to, mm: [2.0, -1.0, 1.5] }],
        &[Hidden::Frame { from, to, mm: [1.0, 2.0, -3.0] }],
        &[Hidden::Payload { from, to, kg: 12.0 }],
        &[Hidden::LostCounts { joint: 2, until: 70, rad: 4e-3 }],
        &[Hidden::Compliance { joint: 1, peak_rad: 3e-3 }, Hidden::Warp { mm: 0.6 }],
    ];
    let arm = robots::load("abb-irb-120").unwrap().model;
    for (seed, hidden) in (1..).zip(cases) {
        let log = Log::default();
        let setup = Setup { sensor: Sensor::Position, rows: 120, sigma_mm: 0.03, dirty: true, seed, log };
        let dataset = run(&arm, hidden, &setup).dataset;
        for verdict in verdicts(&dataset, "abb-irb-120") {
            assert!(!says_two_arms(&verdict), "{hidden:?}: {verdict:?}");
        }
    }
}
