//! A ground surface: an NC program from its equation, run by a simulated actual arm before and after each method.

use truegrind_calibration::measurement::dataset::Dataset;
use truegrind_math::statistics::ErrorSummary;
use truegrind_papers::experiment::{Experiment, Grinding, GrindingMethod, Kind};
use truegrind_papers::grinding::{Actual, run};
use truegrind_papers::protocol::Options;
use truegrind_papers::views as view;
use truegrind_papers::{Results, simulated};
use truegrind_report::format;
use truegrind_report::table::Cell;

use super::experiment::nominal;

/// The shipped experiment with the methods that take no time.
fn small() -> (Experiment, Grinding) {
    let experiment = Experiment::by_name("ltlm-table-8").unwrap();
    let Some(Kind::Grinding(settings)) = experiment.kind() else { panic!("a grinding experiment") };
    let quick = |m: &&GrindingMethod| ["M1", "M7", "S1"].contains(&m.id.as_str());
    let method = settings.method.iter().filter(quick).cloned().collect();
    let settings = Grinding { method, cases: 2, ..settings.clone() };
    (experiment, settings)
}

#[test]
fn an_nc_program_is_ground_before_and_after_and_priors_decide() {
    let (experiment, settings) = small();
    let (dataset, simulation, robot) = simulated::measure(&experiment, nominal).unwrap();
    let actual = Actual::Simulated(&simulation.actual);
    let options = Options { simulated: true, ..Options::default() };
    let run_on = |dataset: &Dataset, settings: &Grinding, options: &Options| {
        run(settings, &experiment.name, dataset, &robot, &simulation.nominal, actual, options)
    };
    let result = run_on(&dataset, &settings, &options).unwrap();
    assert_eq!(result.program, "blade.mpf");
    assert!(result.simulated && result.points > 300, "{} points", result.points);
    assert!(result.measured == 300 && !result.reduced && !result.all_rows);
    let before = result.before.as_ref().unwrap().all.mean_absolute;
    let sound = result.rows.iter().find(|r| r.id == "S1").unwrap();
    let after = sound.sizes_mm().unwrap();
    assert!(after.len() == 2 && after[0] != after[1], "each case has rows of its own: {after:?}");
    assert!(after.iter().all(|a| *a < 0.8 * before), "{after:?} of {before} mm");
    // Every method but the reference itself is held against it.
    let tests: Vec<bool> = result.against.iter().map(Option::is_some).collect();
    assert_eq!(tests, [true, false, true]);
    let test = result.against[2].as_ref().unwrap();
    let reference = result.rows[1].sizes_mm().unwrap();
    let mean = (after[0] - reference[0] + after[1] - reference[1]) / 2.0;
    assert!((test.mean_mm - mean).abs() < 1e-12, "{} {mean}", test.mean_mm);
    // Too few rows are refused with a number that can be asked for, and that is then headed as reduced.
    let few = dataset.subset(&(0..200).collect::<Vec<_>>());
    let error = run_on(&few, &settings, &options).unwrap_err().to_string();
    assert!(error.contains("200 rows") && error.contains("--rows 160"), "{error}");
    let one = Grinding { cases: 1, ..settings.clone() };
    let reduced = run_on(&few, &one, &Options { rows: Some(160), ..options }).unwrap();
    assert!(reduced.reduced && reduced.measured == 160);
    // Five points of the same values that all of the cut is made of.
    let signed = result.reports[0].signed_mm(|p| p.before);
    assert!(result.before.as_ref().unwrap().five_mm.iter().all(|v| signed.contains(v)));
    let results = Results::Grinding(Box::new(result));
    let page = format::html::document(&view::document(&experiment, &results, &view::Origin::default()));
    for word in ["blade.mpf", "One part, in one place", "simulated actual arm", "paper&#39;s Table 8", "<svg"]
    {
        assert!(page.contains(word) || page.contains(&word.replace("&#39;", "'")), "{word}");
    }
}

/// Where measured rows stand for the actual arm, the diagnosis is judged on what was measured, never on the part.
#[test]
fn measured_rows_are_also_diagnosed() {
    let (experiment, settings) = small();
    let (dataset, simulation, robot) = simulated::measure(&experiment, nominal).unwrap();
    let settings = Grinding { cases: 1, ..settings };
    let mut result = run(
        &settings,
        &experiment.name,
        &dataset,
        &robot,
        &simulation.nominal,
        Actual::Estimated,
        &Options::default(),
    )
    .unwrap();
    let [Some(found)] = result.named_causes.as_deref().unwrap() else { panic!("one case, not refused") };
    let sound = result.rows.iter().find(|row| row.id == "S1").unwrap();
    let beside = sound.cases[0].held_out.rmse;
    // Causes beyond geometry are in the recipe.
    assert!(found.held_out.rmse < 1.05 * beside, "{} beside {beside} mm", found.held_out.rmse);
    // A method without a model in a case has no error, not one of zero.
    result.rows[0].cases[0].held_out = ErrorSummary::UNKNOWN;
    let results = Results::Grinding(Box::new(result));
    let page = format::html::document(&view::document(&experiment, &results, &view::Origin::default()));
    for words in ["named causes", "NC is not judged on the part"] {
        assert!(page.contains(words), "{words}");
    }
    let table = view::table(&results);
    assert_eq!(table.rows[1][6], Cell::Missing, "{:?}", table.rows[1]);
    let last = table.rows.last().unwrap();
    assert!(last[0] == Cell::from("NC") && last[2] == Cell::Missing && last[6] != Cell::Missing, "{last:?}");
}
