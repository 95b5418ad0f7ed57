//! What is wrong with the rows or the data sheet is a finding, and hides no cause.

use nalgebra::Vector3;
use truegrind_arm::estimated::Judgement;
use truegrind_arm::model::Model;
use truegrind_arm::robots;
use truegrind_calibration::diagnosis::diagnose::{Diagnosed, Options, diagnose};
use truegrind_calibration::diagnosis::finding::{Alternative, Confidence, Finding};
use truegrind_calibration::diagnosis::transfer::new_rows;
use truegrind_calibration::identification::identify;
use truegrind_calibration::identification::tolerance::Tolerance;
use truegrind_calibration::measurement::dataset::{Dataset, Reading, Row, Sensor};
use truegrind_calibration::measurement::split;

use super::scenarios::frames;
use super::simulator::{Hidden, Log, Setup, run};

fn arm() -> Model {
    robots::load("abb-irb-120").unwrap().model
}

fn setup(rows: usize, seed: u64) -> Setup {
    Setup { sensor: Sensor::Position, rows, sigma_mm: 0.03, dirty: false, seed, log: Log::default() }
}

fn diagnosed(dataset: &Dataset, nominal: &Model) -> Diagnosed {
    let frames = frames(dataset, nominal);
    diagnose(dataset, "abb-irb-120", nominal, &frames, &Options::default(), &|_| ()).unwrap()
}

fn finding<'a>(found: &'a Diagnosed, effect: &str) -> Option<&'a Finding> {
    found.diagnosis.findings.iter().find(|f| f.effect == effect)
}

/// Four rows at eleven standard deviations are no tail, even where the heaviest tail that the others allow reaches twelve.
#[test]
fn a_few_readings_that_a_gap_parts_from_the_others_are_outliers() {
    let wild = vec![23, 71, 119, 160];
    for seed in [3, 4, 5] {
        let hidden = [Hidden::Outliers { list: wild.clone(), mm: 0.33 }];
        let found = diagnosed(&run(&arm(), &hidden, &setup(200, seed)).dataset, &arm());
        let outliers = finding(&found, "outliers").unwrap();
        assert_eq!(outliers.row_list.as_ref(), Some(&wild), "{seed}");
        // RMS over all rows of 4 readings of 200 that are 0.33 mm off.
        let worth = outliers.worth_mm.unwrap();
        assert!((worth - 0.33 * (4.0_f64 / 200.0).sqrt()).abs() < 0.01, "{worth}");
        assert!(outliers.cause.contains("by up to 0.3"), "{}", outliers.cause);
    }
}

/// One reading that is metres off says nothing about causes.
#[test]
fn one_wild_reading_hides_no_cause() {
    let gear = Hidden::Gear { joint: 3, order: 1.0, peak_rad: 0.0015, phase: 0.4 };
    let names = |hidden: &[Hidden]| -> Vec<(String, Option<Vec<usize>>)> {
        let found = diagnosed(&run(&arm(), hidden, &setup(200, 11)).dataset, &arm());
        let sure = found.diagnosis.findings.into_iter().filter(|f| f.confidence == Confidence::Identified);
        sure.filter(|f| f.effect != "outliers").map(|f| (f.effect.as_str().to_owned(), f.joints)).collect()
    };
    let alone = names(std::slice::from_ref(&gear));
    assert_eq!(alone, [("gear-eccentricity".to_owned(), Some(vec![4]))]);
    assert_eq!(names(&[gear, Hidden::Outliers { list: vec![50], mm: 2000.0 }]), alone);
}

/// What the other parameters absorb of a gear's error in a row whose reading is metres off is no size of the gear's error; nor do such readings
/// say how the poses turn the flange.
#[test]
fn wild_readings_change_neither_the_size_of_a_finding_nor_what_is_said_of_the_poses() {
    let gear = Hidden::Gear { joint: 3, order: 1.0, peak_rad: 0.0015, phase: 0.4 };
    let told = |hidden: &[Hidden]| {
        let found = diagnosed(&run(&arm(), hidden, &setup(200, 11)).dataset, &arm());
        let worth = finding(&found, "gear-eccentricity").and_then(|gear| gear.worth_mm).unwrap();
        let reasons = found.estimated.verdict.reasons;
        assert!(!reasons.iter().any(|reason| reason.text.contains("where the target sits")), "{reasons:?}");
        worth
    };
    let alone = told(std::slice::from_ref(&gear));
    let list = vec![5, 30, 55, 80, 105, 130, 155];
    let beside = told(&[gear, Hidden::Outliers { list, mm: 3000.0 }]);
    assert!((beside / alone - 1.0).abs() < 0.1, "{beside} mm beside wild readings, {alone} mm without them");
}

/// The rows with the readings that `of` makes of them.
fn with_readings(dataset: &Dataset, of: impl Fn(usize) -> Vector3<f64>) -> Dataset {
    let mut out = dataset.clone();
    for (index, row) in out.rows.iter_mut().enumerate() {
        row.reading = Reading::Position(of(index));
    }
    out
}

fn refused(dataset: &Dataset) -> Option<String> {
    let frames = frames(dataset, &arm());
    let found = diagnose(dataset, "abb-irb-120", &arm(), &frames, &Options::default(), &|_| ());
    found.err().map(|error| error.to_string())
}

/// One reading is missing, so that each later row has that of the next: most rows fit all the same, but no cause is to be found in the others.
#[test]
fn a_missing_reading_is_told_and_no_cause_is_searched() {
    let rows = run(&arm(), &[], &setup(132, 61)).dataset;
    for first in [60, 85] {
        let place = |row: usize| rows.rows[row].reading.place_mm();
        let slipped = with_readings(&rows, |row| place(if row < first { row } else { (row + 1).min(131) }));
        let told = refused(&slipped).expect("rows that are refused");
        assert!(told.contains("each reading belongs to the row after it"), "{first}: {told}");
    }
}

/// Half of the rows are a mirror image, in a station of their own: whatever is set aside, the others are no diagnosis.
#[test]
fn a_mirrored_station_is_refused() {
    let rows = run(&arm(), &[], &setup(132, 62)).dataset;
    let mut mirrored = with_readings(&rows, |row| {
        let place = rows.rows[row].reading.place_mm();
        if row < 66 { place } else { Vector3::new(place.x, -place.y, place.z) }
    });
    mirrored.rows.iter_mut().skip(66).for_each(|row| row.anchor = 1);
    let told = refused(&mirrored).expect("rows that are refused");
    assert!(told.contains("more than any arm"), "{told}");
}

#[test]
fn rounded_angles_are_told_behind_a_larger_fault() {
    let hidden = [Hidden::Frame { from: 90, to: 199, mm: [4.0, -3.0, 1.0] }];
    let log = Log { angle_step_rad: Some(0.1_f64.to_radians()), ..Log::default() };
    let mut dataset = run(&arm(), &hidden, &Setup { log, ..setup(200, 21) }).dataset;
    // Without a read-out nothing makes up for the rounding.
    for row in dataset.rows.iter_mut() {
        row.extra_mut().readout_mm = None;
    }
    let found = diagnosed(&dataset, &arm());
    let rounding = finding(&found, "angle-rounding").unwrap();
    assert!(rounding.worth_mm.unwrap() > 0.2 && rounding.worth_mm.unwrap() < 0.8, "{rounding:?}");
    assert!(finding(&found, "sensor-frame-shift").is_some());
}

/// `identify` refuses a link 20 mm off; here it has a name besides.
#[test]
fn a_link_of_another_length_is_told_and_the_arm_refused() {
    let dataset = run(&arm(), &[], &setup(200, 31)).dataset;
    let mut sheet = arm();
    sheet.links[2].a_mm -= 20.0;
    let found = diagnosed(&dataset, &sheet);
    let link = finding(&found, "link-geometry").unwrap();
    assert_eq!((link.joints.as_deref(), link.confidence), (Some(&[3][..]), Confidence::Identified));
    let off = &link.parameters[0];
    assert!((off.value - 20.0).abs() < 1.5 && off.unit == "mm", "{off:?}");
    assert!(link.cause.contains("another variant of the arm"), "{}", link.cause);
    assert!(link.worth_mm.unwrap() > 1.0);
    assert_eq!(found.estimated.verdict.status, Judgement::Fail);
    // And not where the sheet is the arm's.
    assert!(finding(&diagnosed(&dataset, &arm()), "link-geometry").is_none());
}

/// The size of a finding is what nothing else explains, so no finding is larger than the error of geometry alone.
#[test]
fn no_finding_is_larger_than_what_geometry_leaves() {
    let hidden = [
        Hidden::Gear { joint: 1, order: 1.0, peak_rad: 0.0015, phase: 0.7 },
        Hidden::Compliance { joint: 1, peak_rad: 0.002 },
        Hidden::Ratio { joint: 0, error: 8e-4 },
    ];
    let found = diagnosed(&run(&arm(), &hidden, &setup(300, 41)).dataset, &arm());
    let left = found.diagnosis.fits.geometric.rmse_mm;
    assert!(!found.diagnosis.findings.is_empty());
    for f in &found.diagnosis.findings {
        assert!(f.worth_mm.is_none_or(|mm| mm < 1.02 * left), "{} {:?} of {left}", f.cause, f.worth_mm);
    }
}

#[test]
fn of_too_few_poses_no_benefit_is_stated() {
    let mut dataset = run(&arm(), &[], &setup(200, 51)).dataset;
    dataset.rows = dataset.rows.iter().take(6).cloned().collect::<Vec<_>>().into();
    let found = diagnosed(&dataset, &arm());
    assert!(found.diagnosis.poses_needed.is_some() && found.benefit.is_none());
    let verdict = &found.estimated.verdict;
    assert_eq!(verdict.status, Judgement::Doubtful, "{verdict:?}");
    assert!(verdict.reasons[0].text.contains("too few"), "{verdict:?}");
    assert!(!verdict.reasons.iter().any(|reason| reason.text.contains("expected RMS")), "{verdict:?}");
}

/// Poses that are too few to search causes in may well determine the links: then the arm and its verdict are those of `identify`.
#[test]
fn few_poses_have_the_verdict_of_identify() {
    let mut dataset = run(&arm(), &[], &setup(200, 53)).dataset;
    dataset.rows = dataset.rows.iter().take(17).cloned().collect::<Vec<_>>().into();
    let found = diagnosed(&dataset, &arm());
    assert!(found.diagnosis.poses_needed.is_some() && found.diagnosis.notes[0].contains("too few"));
    let options =
        identify::Options { tolerance: Options::default().arm_tolerance, ..identify::Options::default() };
    let share = |rows: &Dataset| split::random(rows, options.held_out, options.seed);
    let frames = frames(&dataset, &arm());
    let own = identify::identify(&dataset, "arm", &arm(), &frames, &share, &options).unwrap();
    assert_eq!(found.estimated.verdict, own.estimated.verdict);
    assert_eq!(found.estimated.model, own.estimated.model);
    assert_eq!(own.estimated.verdict.status, Judgement::NotEvaluated, "{:?}", own.estimated.verdict);
}

/// Another series of the same arm judges the arm that is written: here first as it is, then one that is worse than geometry there.
#[test]
fn another_series_judges_the_written_arm() {
    let hidden = [Hidden::Gear { joint: 2, order: 1.0, peak_rad: 0.0015, phase: 0.7 }];
    let all = run(&arm(), &hidden, &setup(400, 61)).dataset;
    let (own, other): (Vec<usize>, Vec<usize>) = (0..400).partition(|i| i % 2 == 0);
    let (own, other) = (all.subset(&own), all.subset(&other));
    let tolerance = Tolerance::default();
    let mut found = diagnosed(&own, &arm());
    let mut worse = found.clone();
    found.test_on(&other, &frames(&other, &arm()), &tolerance, true);
    let tested = &found.diagnosis.transfers[0];
    assert!(tested.written_rmse_mm.unwrap() < 0.5 * tested.geometric_rmse_mm, "{tested:?}");
    assert_eq!(found.estimated.verdict.status, Judgement::NotEvaluated);
    // A gear error of the other sign.
    let mut wrong = worse.estimated.model.clone();
    for effect in &mut wrong.effects {
        let values: Vec<f64> = effect.parameters().iter().map(|p| p.value).collect();
        values.iter().enumerate().for_each(|(k, value)| effect.set(k, -value));
    }
    worse.estimated.model = wrong;
    worse.test_on(&other, &frames(&other, &arm()), &tolerance, true);
    assert_eq!(worse.estimated.verdict.status, Judgement::Fail);
    assert!(worse.estimated.verdict.reasons[0].text.contains("`identify`"), "{:?}", worse.estimated.verdict);
    assert_eq!(worse.diagnosis.verdict.as_ref(), Some(&worse.estimated.verdict));
}

/// Another measurement of an arm that is not as it was fitted is no number beside a good verdict: a joint that has moved since, a joint that
/// has the opposite sign, another arm of the type.
#[test]
fn another_measurement_says_that_the_arm_was_another() {
    let all = run(&arm(), &[], &setup(400, 61)).dataset;
    let (own, other): (Vec<usize>, Vec<usize>) = (0..400).partition(|i| i % 2 == 0);
    let (own, other) = (all.subset(&own), all.subset(&other));
    let tolerance = Tolerance::default();
    let found = diagnosed(&own, &arm());
    assert_eq!(found.estimated.verdict.status, Judgement::NotEvaluated);
    let with = |change: &dyn Fn(&mut Row)| {
        let mut rows: Vec<Row> = other.rows.iter().cloned().collect();
        rows.iter_mut().for_each(change);
        let changed = Dataset { rows: rows.into(), ..other.clone() };
        let mut judged = found.clone();
        judged.test_on(&changed, &frames(&changed, &arm()), &tolerance, true);
        let verdict = judged.estimated.verdict;
        (verdict.status, verdict.reasons[0].text.clone())
    };
    assert_eq!(with(&|_| ()).0, Judgement::NotEvaluated, "the arm itself");
    let (status, said) = with(&|row| row.joints[1] += 0.1_f64.to_radians());
    assert!(status == Judgement::Doubtful && said.contains("has changed"), "{status:?} {said}");
    let (status, said) = with(&|row| row.joints[3] *= -1.0);
    assert!(status == Judgement::Fail && said.contains("has the opposite sign"), "{status:?} {said}");
    let another = run(&arm(), &[], &setup(200, 62)).dataset;
    let mut judged = found.clone();
    judged.test_on(&another, &frames(&another, &arm()), &tolerance, true);
    let verdict = judged.estimated.verdict;
    assert!(
        matches!(verdict.status, Judgement::Doubtful | Judgement::Fail)
            && verdict.reasons[0].text.contains("another"),
        "{verdict:?}"
    );
}

/// The rows of the fit are no other measurement.
#[test]
fn copies_test_nothing() {
    let all = run(&arm(), &[], &setup(100, 61)).dataset;
    let [own, part, mixed] = [0..60, 20..50, 30..100].map(|rows| all.subset(&rows.collect::<Vec<usize>>()));
    let mut notes = Vec::new();
    assert_eq!(new_rows(&own, &part, &mut notes), None);
    assert!(notes.remove(0).contains("30 of its 30 rows"));
    assert_eq!(new_rows(&own, &mixed, &mut notes).unwrap().rows.len(), 40);
    assert!(notes.remove(0).contains("the other 40"));
    let fresh = all.subset(&(60..100).collect::<Vec<usize>>());
    assert_eq!(new_rows(&own, &fresh, &mut notes).unwrap().rows.len(), 40);
    assert!(notes.is_empty());
}

/// A tracker that moved while it stood in its second place: each place has a frame of its own, so that a shift of its first rows and one of
/// its later rows are the same.
#[test]
fn a_station_that_moved_is_one_event() {
    for (from, to) in [(130, 199), (100, 129)] {
        let hidden = [Hidden::Frame { from, to, mm: [0.3, -0.2, 0.1] }];
        let mut dataset = run(&arm(), &hidden, &setup(200, 71)).dataset;
        dataset.rows.iter_mut().skip(100).for_each(|row| row.anchor = 1);
        let found = diagnosed(&dataset, &arm());
        let shift = finding(&found, "sensor-frame-shift").unwrap();
        assert_eq!((shift.rows, shift.confidence), (Some([130, 199]), Confidence::Identified), "{shift:?}");
        let level =
            |other: &&Alternative| other.effect == shift.effect && other.twice_log_bayes_factor < 100.0;
        assert_eq!(shift.alternatives.iter().find(level), None, "{shift:?}");
    }
}
