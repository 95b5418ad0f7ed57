//! Methods over seeded cases of a simulated arm with known truth.

use truegrind_calibration::measurement::dataset::Dataset;
use truegrind_papers::experiment::{Experiment, ExperimentError, Kind};
use truegrind_papers::protocol::{Options, Study, run};
use truegrind_papers::verdict::Conclusion;
use truegrind_papers::views as view;
use truegrind_papers::{Results, simulated};
use truegrind_report::format;

use super::experiment::nominal;

const METHODS: &str = r#"
name = "small"
title = "Four methods"
paper = "ours"
recipe = "irb120-1024"
[methods]
reference = "B"
parameters = true
[methods.protocol]
rows = 90
held_out = 0.2
cases = 3
[[methods.method]]
id = "A"
name = "LM, two steps"
solver = "lm-as-printed"
units = "deg"
settings = { max-iterations = 2 }
paper = { rmse_mm = 0.36 }
[[methods.method]]
id = "B"
name = "LM"
solver = "lm-as-printed"
[[methods.method]]
id = "C"
name = "leaps"
solver = "vslm-as-printed"
settings = { step-size = 1e9 }
[[methods.method]]
id = "D"
name = "LM, sound"
solver = "lm"
treatment = "sound"
"#;

fn study(text: &str, rows: Option<usize>) -> Result<(Experiment, Study, Dataset), ExperimentError> {
    let experiment = Experiment::parse(text, "small.toml")?;
    let (dataset, simulation, robot) = simulated::measure(&experiment, nominal)?;
    let Some(Kind::Methods(methods)) = experiment.kind() else { panic!("methods") };
    let options = Options { rows, seed: 5, simulated: true, sensor_sigma_mm: 0.05 };
    let study = run(&experiment, methods, &dataset, &robot, &simulation.nominal, &options)?;
    Ok((experiment.clone(), study, dataset))
}

fn json(experiment: &Experiment, study: &Study) -> String {
    let results = Results::Methods(Box::new(study.clone()));
    format::json::text(&view::json(experiment, &results, &view::Origin::default())).unwrap()
}

#[test]
fn rows_that_say_what_they_are_whatever_the_method_does() {
    let (experiment, study, _) = study(METHODS, None).unwrap();
    assert_eq!(study.results.len(), 4);
    assert_eq!(study.cases.iter().map(|c| (c.train, c.test)).collect::<Vec<_>>(), [(72, 18); 3]);
    let of = |id: &str| study.results.iter().find(|r| r.method.id == id).unwrap();
    let rmse = |id: &str| of(id).outcomes.iter().map(|o| o.held_out.rmse).sum::<f64>() / 3.0;
    let before = study.cases.iter().map(|c| c.registered.rmse).sum::<f64>() / 3.0;
    assert!(rmse("B") < before && rmse("D") < before, "{} {} {before}", rmse("B"), rmse("D"));
    // A method that diverges is a row that says so.
    assert!(of("C").outcomes.iter().all(|o| o.diverged));
    let judged =
        |id: &str| study.judgement.comparisons.iter().find(|c| c.id == id).unwrap().conclusion.clone();
    assert!(matches!(judged("C"), Conclusion::Diverged { cases: 3 }));
    let results = Results::Methods(Box::new(study.clone()));
    let text = format::terminal::document(&view::summary(&experiment, &results), 120);
    assert!(text.contains("diverged in 3 of 3"), "{text}");
    assert!(text.contains("simulated") && !text.contains("Reduced"));
    // Budget in passes over the rows, cost of an iteration, and every least-squares method run to convergence.
    for word in ["residuals", "Jacobians", "each", "Stopped and converged", "further steps", "Holm"] {
        assert!(text.contains(word), "`{word}` is not in: {text}");
    }
    assert!(study.results.iter().all(|r| r.converged.as_ref().is_some_and(|c| c.len() == 3)));
    // Three cases can show nothing, and the verdict says so.
    assert!(!study.judgement.can_be_significant && text.contains("no difference could be significant"));
}

#[test]
fn two_methods_with_one_optimum_differ_only_by_where_they_were_stopped() {
    let (_, study, _) = study(METHODS, None).unwrap();
    let two_steps = &study.judgement.comparisons[0];
    assert!(two_steps.limited.largest_share > 1e-3, "stopped after two steps it is elsewhere");
    let Conclusion::SameOptimum { stopped, .. } = &two_steps.conclusion else {
        panic!("{:?}", two_steps);
    };
    assert!(stopped.contains(&"A".to_owned()));
    // Priors make another problem with another optimum: not the same.
    assert!(!matches!(study.judgement.comparisons[2].conclusion, Conclusion::SameOptimum { .. }));
}

#[test]
fn the_verdict_says_what_the_paper_has_and_which_method_costs_least() {
    let (experiment, study, _) =
        study(&METHODS.replace("name = \"LM\"\n", "name = \"LM\"\npaper = { rmse_mm = 0.3 }\n"), None)
            .unwrap();
    let results = Results::Methods(Box::new(study));
    let text = format::terminal::document(&view::summary(&experiment, &results), 400);
    for word in [
        "Of 3 methods compared with B (LM): 1 with the same optimum, 1 without significant difference, 1 diverged",
        "Diverged and not compared, with the cases: C (3 of 3)",
        "The paper has B before all others. Here there is no significant difference from A.",
        "fewest passes over the rows: A (3), D (",
    ] {
        assert!(text.contains(word), "`{word}` is not in: {text}");
    }
}

/// One of two tests finds a difference: that was "no significant difference" in the headline, and undecided ten lines below.
#[test]
fn a_difference_that_one_test_finds_is_undecided_and_not_absent() {
    let with_paper = METHODS.replace("name = \"LM\"\n", "name = \"LM\"\npaper = { rmse_mm = 0.3 }\n");
    let (experiment, mut study, _) = study(&with_paper, None).unwrap();
    let judged = &mut study.judgement.comparisons;
    let unsure = judged.iter_mut().find(|c| c.conclusion == Conclusion::NotSignificant).unwrap();
    unsure.limited.signed_rank_holm = 0.02;
    let id = unsure.id.clone();
    let results = Results::Methods(Box::new(study));
    let text = format::terminal::document(&view::summary(&experiment, &results), 400);
    assert!(text.contains("1 undecided, since only one of the two tests finds a difference"), "{text}");
    assert!(!text.contains("without significant difference"), "{text}");
    assert!(!text.contains(&format!("there is no significant difference from {id}")), "{text}");
}

#[test]
fn curves_are_in_millimetres_of_what_the_method_is_judged_by() {
    // A length; the network's rows are weighed by the sensor, and begin where the frames alone are all the same.
    let text =
        METHODS.to_owned() + "[[methods.method]]\nid = \"N\"\nname = \"RBF\"\nsolver = \"rbf-alone\"\n";
    let (_, cable, _) = study(&text, None).unwrap();
    let first = |study: &Study, k: usize| study.results[k].outcomes[0].curve[0].rmse;
    let last = |study: &Study, k: usize| study.results[k].outcomes[0].curve.last().unwrap().rmse;
    let fitted = |study: &Study, k: usize| study.results[k].outcomes[0].fitted.rmse;
    assert!(
        (last(&cable, 1) / fitted(&cable, 1) - 1.0).abs() < 1e-6,
        "{} {}",
        last(&cable, 1),
        fitted(&cable, 1)
    );
    assert!(
        (first(&cable, 4) / first(&cable, 1) - 1.0).abs() < 0.3,
        "{} {}",
        first(&cable, 4),
        first(&cable, 1)
    );
    // Three coordinates make one distance.
    let position = METHODS.replace("irb120-1024", "irb120-1024-position").replace("cases = 3", "cases = 1");
    let (_, position, _) = study(&position, None).unwrap();
    assert!((last(&position, 1) / fitted(&position, 1) - 1.0).abs() < 1e-6);
}

#[test]
fn same_seed_same_bits_for_any_number_of_threads() {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let (experiment, study, _) = pool.install(|| study(METHODS, None)).unwrap();
        json(&experiment, &study)
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn fewer_rows_are_named_with_the_command_that_takes_them() {
    let error = study(&METHODS.replace("rows = 90", "rows = 2000"), None).unwrap_err();
    let message = error.to_string();
    for word in ["1024 rows", "needs 2000", "--rows 1024", "reduced protocol"] {
        assert!(message.contains(word), "`{word}` is not in: {message}");
    }
    let (experiment, study_reduced, _) = study(METHODS, Some(60)).unwrap();
    assert!(study_reduced.reduced && study_reduced.cases[0].train == 48);
    let results = Results::Methods(Box::new(study_reduced));
    let page = format::markdown::document(&view::document(&experiment, &results, &view::Origin::default()));
    assert!(page.contains("Reduced protocol"));
    let message = study(METHODS, Some(25)).unwrap_err().to_string();
    assert!(message.contains("parameters") && message.contains("--rows"), "{message}");
}

#[test]
fn parameters_that_one_cable_cannot_see_are_marked() {
    let (_, study, _) = study(METHODS, None).unwrap();
    let table = study.parameters.iter().find(|t| t.id == "B").unwrap();
    assert_eq!(table.rows.len(), 24);
    let of = |name: &str| table.rows.iter().find(|r| r.parameter.to_string() == name).unwrap();
    // The hook sits on the axis of joint 6: its zero moves nothing, nor does the last twist.
    assert!(!of("link6.theta").is_observable() && !of("link6.alpha").is_observable());
    assert!(of("link3.theta").is_observable());
    assert!(table.rows.iter().all(|r| r.sigma.is_finite() && (0.0..=1.0).contains(&r.determined)));
    assert!(table.rows.iter().all(|r| r.paper.is_none()));
}

#[test]
fn what_a_paper_identified_stands_beside_and_is_no_target() {
    let links =
        (1..=6).map(|k| format!("{{ a_mm = {k}.0, theta_deg = 0.5 }}")).collect::<Vec<_>>().join(", ");
    let stated = METHODS.replace("name = \"LM\"\n", &format!("name = \"LM\"\npaper_links = [{links}]\n"));
    let (experiment, study, _) = study(&stated, None).unwrap();
    let table = study.parameters.iter().find(|t| t.id == "B").unwrap();
    let of = |name: &str| table.rows.iter().find(|r| r.parameter.to_string() == name).unwrap().paper;
    assert_eq!((of("link3.a"), of("link3.alpha"), of("link2.beta")), (Some(3.0), None, None));
    assert!((of("link1.theta").unwrap().to_degrees() - 0.5).abs() < 1e-12);
    let results = Results::Methods(Box::new(study));
    let page = format::markdown::document(&view::document(&experiment, &results, &view::Origin::default()));
    assert!(page.contains("no target"), "{page}");
    let five = stated.replace(", { a_mm = 6.0, theta_deg = 0.5 }", "");
    let message = Experiment::parse(&five, "small.toml").unwrap_err().to_string();
    assert!(message.contains("5 links") && message.contains("6 links"), "{message}");
}

#[test]
fn readings_can_be_taken_as_distances_from_a_fixed_point_but_not_invented() {
    let cable = METHODS.replace("cases = 3", "cases = 1\nreading = \"distance\"");
    let message = study(&cable, None).unwrap_err().to_string();
    assert!(message.contains("cable lengths") && message.contains("positions or poses"), "{message}");
    let tracker = include_bytes!("../../../../tests/data/irb120-tracker.csv");
    let dataset =
        truegrind_calibration::measurement::import::read("irb120-tracker.csv", tracker, &Default::default())
            .unwrap();
    let experiment = Experiment::parse(&cable, "small.toml").unwrap();
    let Some(Kind::Methods(methods)) = experiment.kind() else { panic!("methods") };
    let robot = nominal("abb-irb-120").unwrap();
    let study = run(&experiment, methods, &dataset, "abb-irb-120", &robot, &Options::default()).unwrap();
    assert_eq!(study.sensor, truegrind_calibration::measurement::dataset::Sensor::Cable);
    let (before, after) = (study.cases[0].registered.rmse, study.results[3].outcomes[0].held_out.rmse);
    assert!(after < 0.5 * before, "{before} {after}");
}

/// Measured rows are diagnosed as well. These are of an arm with compliant joints, an eccentric gear and backlash: no optimiser of
/// geometry comes near the model with its causes.
#[test]
fn measured_rows_are_diagnosed_beside_the_methods() {
    let tracker = include_bytes!("../../../../tests/data/irb120-tracker.csv");
    let dataset =
        truegrind_calibration::measurement::import::read("irb120-tracker.csv", tracker, &Default::default())
            .unwrap();
    let experiment = Experiment::parse(
        &METHODS.replace("rows = 90", "rows = 180").replace("cases = 3", "cases = 2"),
        "small.toml",
    )
    .unwrap();
    let Some(Kind::Methods(methods)) = experiment.kind() else { panic!("methods") };
    let robot = nominal("abb-irb-120").unwrap();
    let study = run(&experiment, methods, &dataset, "abb-irb-120", &robot, &Options::default()).unwrap();
    let found = study.named_causes.clone().unwrap();
    for (k, case) in found.iter().enumerate() {
        let case = case.as_ref().unwrap();
        let best = study.results.iter().filter_map(|r| r.converged.as_ref()).map(|c| c[k].held_out.rmse);
        let best = best.fold(f64::INFINITY, f64::min);
        assert!(case.held_out.rmse < 0.6 * best, "case {k}: {} mm against {best}", case.held_out.rmse);
        assert!(case.identified > 0 && case.identified <= case.findings, "{case:?}");
    }
    let page = format::terminal::document(
        &view::summary(&experiment, &Results::Methods(Box::new(study.clone()))),
        1_000,
    );
    assert!(page.contains("named causes") && page.contains("no optimiser of geometry can reach"), "{page}");
    let written: serde_json::Value = serde_json::from_str(&json(&experiment, &study)).unwrap();
    let rmse = |case: &serde_json::Value| case["held_out"]["rmse"].as_f64().unwrap();
    let cases = written["result"]["named_causes"].as_array().unwrap();
    for (written, case) in cases.iter().zip(&found) {
        assert!((rmse(written) - case.as_ref().unwrap().held_out.rmse).abs() < 1e-9, "{written}");
    }
    assert!(cases.iter().all(|case| case["seconds"].is_null()), "the same bytes in every run");
    let table = view::table(&Results::Methods(Box::new(study)));
    assert_eq!(table.rows.iter().filter(|row| format!("{:?}", row[0]).contains("NC")).count(), 2);
}

/// What a recipe hides is no measurement: simulated rows are not diagnosed.
#[test]
fn simulated_rows_are_not_diagnosed() {
    let (experiment, study, _) = study(METHODS, None).unwrap();
    assert!(study.named_causes.is_none());
    let page =
        format::terminal::document(&view::summary(&experiment, &Results::Methods(Box::new(study))), 1_000);
    assert!(!page.contains("named causes"), "{page}");
}
