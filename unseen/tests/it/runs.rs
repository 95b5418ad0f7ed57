//! Whole runs: the same for any number of workers, and nothing is true of rows in which nothing is wrong.

use truegrind_unseen::case::{Case, Limits};
use truegrind_unseen::designs::Design;
use truegrind_unseen::report::{Plan, line, table};
use truegrind_unseen::score::{Marks, marks, outcome};
use truegrind_unseen::table::text;
use truegrind_unseen::truth::{Kind, Mark};
use truegrind_unseen::under_test::diagnosed;

fn plan(kinds: &[Kind], runs: usize, workers: usize) -> Plan {
    let limits = Limits { rows: 90, design: Some(Design::Random) };
    Plan { kinds: kinds.to_vec(), runs, first: 0, seed: 11, limits, workers }
}

/// Everything but the time.
fn timeless(outcome: &truegrind_unseen::score::Outcome) -> truegrind_unseen::score::Outcome {
    let mut out = outcome.clone();
    if let Ok(marks) = &mut out.marks {
        marks.seconds = 0.0;
    }
    out
}

#[test]
fn marks_are_the_same_for_any_number_of_workers() {
    let kinds = [Kind::Clean, Kind::Correlated, Kind::Hardening];
    let one: Vec<_> = plan(&kinds, 3, 1).outcomes(|_, _| {}).iter().map(timeless).collect();
    let two: Vec<_> = plan(&kinds, 3, 2).outcomes(|_, _| {}).iter().map(timeless).collect();
    assert_eq!(one, two);
    // A run is the same whichever kinds stand beside it.
    let alone = plan(&[Kind::Hardening], 1, 1).outcomes(|_, _| {});
    assert_eq!(timeless(&alone[0]), one[2]);
    let page = table(&plan(&kinds, 3, 1), &one);
    for kind in kinds {
        assert!(page.contains(kind.name()));
    }
    assert!(one.iter().enumerate().all(|(k, o)| line(k, o).contains(o.setting.robot)));
}

/// With nothing hidden no name is true, and geometry, which then is all there is, tells fresh rows as well as held-out ones.
#[test]
fn clean_rows_have_no_true_name_and_fresh_rows_show_the_held_out_error() {
    let limits = Limits { rows: 200, design: Some(Design::Random) };
    let case = Case::draw(12, Kind::Clean, 3, limits);
    let marks = outcome(&case).marks.unwrap();
    assert!(marks.findings.iter().all(|m| m.mark != Mark::True));
    assert_eq!(marks.true_names(), 0);
    assert!(!marks.told());
    let sigma = case.sensor.sigma_mm * (case.sensor.lengths() as f64).sqrt();
    // The rows are few: noise and what it does to the fit.
    assert!(marks.fresh_mm > 0.9 * sigma && marks.fresh_mm < 2.0 * sigma, "{} {sigma}", marks.fresh_mm);
    let [sheet, geometry, _, _] = marks.distances;
    assert!(geometry.shape < 0.3 * sheet.shape, "{geometry:?} {sheet:?}");
    assert!(false_of(&marks) <= marks.findings.len());
}

fn false_of(marks: &Marks) -> usize {
    marks.false_names().count()
}

/// The judge reads the model that is written: where nothing was named, it is the arm of `identify`.
#[test]
fn without_a_cause_the_written_arm_is_that_of_identify() {
    let limits = Limits { rows: 120, design: Some(Design::Random) };
    let case = (0..20)
        .map(|run| Case::draw(13, Kind::Clean, run, limits))
        .find_map(|case| {
            let file = text(case.sensor.kind, &case.lines(), None);
            let reply = diagnosed(&file, case.sheet.name).unwrap();
            reply.findings.is_empty().then(|| marks(&case, &reply).unwrap())
        })
        .unwrap();
    let [_, _, identified, written] = case.distances;
    // But for the rounding of a model file's degrees.
    assert!((identified.shape - written.shape).abs() < 1e-9 * identified.shape, "{identified:?} {written:?}");
    assert!((identified.as_is - written.as_is).abs() < 1e-9 * identified.as_is, "{identified:?} {written:?}");
}
