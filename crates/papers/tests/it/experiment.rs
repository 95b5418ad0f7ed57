//! Experiments as data: what ships is whole, and what is wrong is said with file, line and remedy.

use truegrind_calibration::identification::solver;
use truegrind_papers::experiment::{Experiment, ExperimentError, Kind, RECIPES};
use truegrind_papers::{simulated, uniformity};

pub(super) fn nominal(name: &str) -> Result<truegrind_arm::model::Model, String> {
    truegrind_arm::robots::load(name).map(|r| r.model).map_err(|e| e.to_string())
}

#[test]
fn all_experiments_that_ship_are_read_and_every_method_of_the_papers_is_in_one() {
    let all = Experiment::shipped().unwrap();
    assert_eq!(all.len(), 10);
    let mut used: Vec<String> = Vec::new();
    for experiment in &all {
        assert!(!experiment.caveats.is_empty(), "{} says what must be known", experiment.name);
        if let Some(Kind::Methods(methods)) = experiment.kind() {
            used.extend(methods.method.iter().map(|m| m.solver.clone()));
        }
    }
    for name in [
        "lm", "ltlm", "sslm", "vslm", "ekf", "ukf", "ukf-vslm", "pf", "sca", "bas", "qibas", "pso", "de",
        "rbf",
    ] {
        assert!(used.iter().any(|u| u.starts_with(name)), "{name} is compared somewhere");
    }
    for (name, _) in RECIPES {
        simulated::recipe(name, "test").unwrap().check().unwrap();
    }
}

#[test]
fn the_papers_rows_are_simulated_in_full() {
    let all = Experiment::shipped().unwrap();
    for experiment in all.iter().filter(|e| e.paper != "rls-2025" && e.takes_rows()) {
        let (dataset, ..) = simulated::measure(experiment, nominal).unwrap();
        assert_eq!(dataset.rows.len(), 1024, "{}", experiment.name);
    }
    let table_6 = all.iter().find(|e| e.name == "ltlm-table-6").unwrap();
    let (dataset, simulation, robot) = simulated::measure(table_6, nominal).unwrap();
    assert_eq!((dataset.rows.len(), robot.as_str()), (1024, "abb-irb-120"));
    assert!(simulation.actual != simulation.nominal);
    assert!(dataset.angle_step_rad.is_some(), "angles as coarse as in the public file");
}

const SMALL: &str = r#"
name = "small"
title = "small"
paper = "ours"
[methods]
reference = "B"
[methods.protocol]
rows = 60
held_out = 0.2
cases = 2
[[methods.method]]
id = "A"
name = "LM as printed"
solver = "lm-as-printed"
[[methods.method]]
id = "B"
name = "LM"
solver = "lm"
"#;

fn refused(text: &str, words: &[&str]) {
    let message = Experiment::parse(text, "mine.toml").unwrap_err().to_string();
    for word in words {
        assert!(message.contains(word), "`{word}` is not in: {message}");
    }
}

#[test]
fn what_is_wrong_in_an_experiment_is_said() {
    assert!(Experiment::parse(SMALL, "mine.toml").is_ok());
    refused(&SMALL.replace("cases = 2", "cases = two"), &["mine.toml", "line 10"]);
    refused(&SMALL.replace("cases = 2", "casse = 2"), &["mine.toml", "casse", "held_out"]);
    refused(&SMALL.replace("cases = 2", "cases = 0"), &["cases", "at least 1"]);
    refused(&SMALL.replace("held_out = 0.2", "held_out = 1.0"), &["held_out", "share"]);
    refused(&SMALL.replace("solver = \"lm\"", "solver = \"lmx\""), &["method 2 (B)", "lmx", "ukf-vslm"]);
    refused(&SMALL.replace("id = \"B\"", "id = \"A\""), &["reference"]);
    refused(&SMALL.replace("reference = \"B\"", "reference = \"C\""), &["reference", "C"]);
    let settings = "solver = \"lm\"\nsettings = { max-iteration = 3 }";
    refused(&SMALL.replace("solver = \"lm\"", settings), &["max-iteration", "max-iterations"]);
    refused("name = \"x\"\ntitle = \"x\"\npaper = \"x\"", &["sections", "methods"]);
    refused(
        &format!(
            "{SMALL}\n[uniformity]\npoints = 1\nlong_points = 1\nbins = 2\nstarts = 1\nrange = [0, 4]\nsteps = 2\nclaimed = 0.5\n"
        ),
        &["sections"],
    );
    refused(&format!("recipe = \"none\"\n{SMALL}"), &["recipe", "irb120-1024"]);
}

#[test]
fn an_unknown_experiment_or_method_gets_the_list() {
    let Err(ExperimentError::Unknown { known, .. }) = Experiment::by_name("table-7") else {
        panic!("there is no table-7");
    };
    assert!(known.contains(&"ltlm-table-6".to_owned()) && known.len() == 10);
    let message = solver::by_name("annealing").unwrap_err().to_string();
    assert!(solver::all().all(|s| message.contains(s.name)), "{message}");
}

#[test]
fn every_method_takes_its_settings_from_a_file() {
    for method in solver::all() {
        let whole = method.configured(&toml::Table::new()).unwrap();
        // What it is by default can be stated in full.
        let again = method.configured(&whole.settings).unwrap();
        assert_eq!(whole.settings, again.settings, "{}", method.name);
        let unknown = "no-such-setting = 1".parse::<toml::Table>().unwrap();
        assert!(method.configured(&unknown).is_err_and(|why| why.to_string().contains("no-such-setting")));
    }
}

#[test]
fn the_claim_about_the_chaotic_map_is_sampling_noise() {
    let all = Experiment::shipped().unwrap();
    let figure = all.iter().find(|e| e.name == "ltlm-figure-2").unwrap();
    let Some(Kind::Uniformity(settings)) = figure.kind() else { panic!("a uniformity experiment") };
    // The whole protocol in little: fewer r, fewer starts.
    let less = truegrind_papers::experiment::Uniformity { steps: 9, starts: 12, ..settings.clone() };
    let result = uniformity::run(&less, 1);
    assert!(result.study.verdict.sampling_noise);
    assert_eq!(result.points.len(), 1000);
    // The maps of the paper's Table 2: those of uniform density, the two that would collapse among them, scatter as random
    // counts do; the logistic map is far from it.
    assert_eq!(result.maps.len(), 7);
    let excess = |name: &str| {
        let of = result.maps.iter().find(|m| m.map.name() == name).unwrap();
        of.long.deviation / of.long.random
    };
    assert!(excess("tent") < 1.3 && excess("bernoulli") < 1.3, "{} {}", excess("tent"), excess("bernoulli"));
    assert!(excess("logistic") > 10.0);
}
