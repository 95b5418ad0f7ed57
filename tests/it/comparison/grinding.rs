//! A ground surface: an NC program from its equation, run by a simulated actual arm before and after each method.

use truegrind::comparison::experiment::{Experiment, Grinding, GrindingMethod, Kind};
use truegrind::comparison::grinding::{Actual, run};
use truegrind::comparison::{Results, simulated};
use truegrind::report::comparison as view;
use truegrind::report::format;

use super::experiment::nominal;

/// The shipped experiment with the methods that take no time.
fn small() -> (Experiment, Grinding) {
    let experiment = Experiment::by_name("ltlm-table-8").unwrap();
    let Some(Kind::Grinding(settings)) = experiment.kind() else { panic!("a grinding experiment") };
    let quick = |m: &&GrindingMethod| ["M1", "M7", "S1"].contains(&m.id.as_str());
    let method = settings.method.iter().filter(quick).cloned().collect();
    let settings = Grinding { method, ..settings.clone() };
    (experiment, settings)
}

#[test]
fn an_nc_program_is_ground_before_and_after_and_priors_decide() {
    let (experiment, settings) = small();
    let (dataset, simulation, robot) = simulated::measure(&experiment, nominal).unwrap();
    let dataset = dataset.subset(&(0..300).collect::<Vec<_>>());
    let actual = Actual::Simulated(&simulation.actual);
    let result = run(&settings, &experiment.name, &dataset, &robot, &simulation.nominal, actual, 0).unwrap();
    assert_eq!(result.program, "blade.mpf");
    assert!(result.simulated && result.points > 300, "{} points", result.points);
    let before = result.before.as_ref().unwrap().all.mean_absolute;
    let sound = result.rows.iter().find(|r| r.id == "S1").unwrap();
    let after = sound.after.as_ref().unwrap().all.mean_absolute;
    assert!(sound.failure.is_none() && sound.refused == 0, "{:?}", sound.failure);
    assert!(after < 0.8 * before, "{after} of {before} mm");
    // Five points of the same values that all of the cut is made of.
    let signed = result.reports[0].signed_mm(|p| p.before);
    assert!(result.before.as_ref().unwrap().five_mm.iter().all(|v| signed.contains(v)));
    let results = Results::Grinding(Box::new(result));
    let page = format::html::document(&view::document(&experiment, &results, &view::Origin::default()));
    for word in
        ["blade.mpf", "One part and one draw", "simulated actual arm", "The paper&#39;s Table 8", "<svg"]
    {
        assert!(page.contains(word) || page.contains(&word.replace("&#39;", "'")), "{word}");
    }
}
