//! Every key of an experiment, and of the JSON that is read back, is used or it is an error: the walk of `keys`.

use toml::{Table, Value};
use truegrind::arm::model::Model;
use truegrind::papers::experiment::{Experiment, Kind};
use truegrind::papers::grinding::Actual;
use truegrind::papers::protocol::Options;
use truegrind::papers::views::{self, Origin};
use truegrind::papers::{Results, degradation, grinding, protocol, signed_rank, simulated, uniformity};
use truegrind::planning::poses::questions::questions;
use truegrind::report::format::markdown;
use truegrind_testing::keys::unread;

fn nominal(name: &str) -> Result<Model, String> {
    truegrind::robots::load(name).map(|robot| robot.model).map_err(|error| error.to_string())
}

/// What `compare` shows of an experiment, without its clock.
fn shown(text: &str) -> Result<String, String> {
    let told = |error: &dyn std::fmt::Display| error.to_string();
    let experiment = Experiment::parse(text, "e.toml").map_err(|error| told(&error))?;
    let name = &experiment.name;
    let (seed, options) =
        (3, |sigma| Options { rows: None, seed: 3, simulated: true, sensor_sigma_mm: sigma });
    let measured = || simulated::measure(&experiment, nominal).map_err(|error| error.to_string());
    let results = match experiment.kind().ok_or("nothing to run")? {
        Kind::Methods(methods) => {
            let (data, simulation, robot) = measured()?;
            let study =
                protocol::run(&experiment, methods, &data, &robot, &simulation.nominal, &options(0.05));
            Results::Methods(Box::new(study.map_err(|error| told(&error))?))
        }
        Kind::Grinding(settings) => {
            let (data, simulation, robot) = measured()?;
            let actual = Actual::Simulated(&simulation.actual);
            let sheet = &simulation.nominal;
            let ground = grinding::run(settings, name, &data, &robot, sheet, actual, &options(0.05));
            Results::Grinding(Box::new(ground.map_err(|error| told(&error))?))
        }
        Kind::Uniformity(settings) => Results::Uniformity(uniformity::run(settings, seed)),
        Kind::SignedRank(tables) => Results::SignedRank(signed_rank::run(tables)),
        Kind::Degradation(settings) => {
            let recipe = experiment.recipe.as_deref().unwrap_or_default();
            let worn =
                degradation::run(settings, name, recipe, seed, nominal).map_err(|error| told(&error))?;
            Results::Degradation(Box::new(worn))
        }
    };
    let origin = Origin { seed, ..Origin::default() };
    let page = markdown::document(&views::document(&experiment, &results, &origin));
    Ok(page + &format!("{:?}", views::json(&experiment, &results, &origin)))
}

const HEAD: &str = r#"
name = "own"
title = "One of ours"
paper = "ltlm-2024"
figures = ["Table 6"]
about = "What is done"
caveats = ["Few rows"]
"#;

#[test]
fn every_key_of_an_experiment_of_methods_is_read() {
    let text = HEAD.to_owned()
        + r#"
recipe = "irb120-1024-position"
[methods]
reference = "B"
parameters = true
before = { rmse_mm = 0.9, mean_absolute_mm = 0.8, max_mm = 2.1 }
[methods.protocol]
rows = 60
held_out = 0.25
cases = 2
treatment = "printed"
reading = "distance"
fixed_point_mm = [900.0, 100.0, 300.0]
fuse_readout = false
[[methods.method]]
id = "A"
name = "LM as printed"
solver = "lm-as-printed"
units = "deg"
settings = { max-iterations = 3 }
paper = { rmse_mm = 0.36, mean_absolute_mm = 0.3, max_mm = 0.8, time_s = 2.0, iterations = 11.0 }
paper_links = [
    { a_mm = 0.1, d_mm = 0.2, alpha_deg = 0.01, theta_deg = 0.02 }, {}, {}, {}, {}, { a_mm = 0.3 },
]
[[methods.method]]
id = "B"
name = "LM"
solver = "lm"
treatment = "sound"
"#;
    assert_eq!(unread(&text, shown), Vec::<String>::new());
}

#[test]
fn every_key_of_an_experiment_of_grinding_is_read() {
    let text = HEAD.to_owned()
        + r#"
recipe = "irb120-1024-position"
[grinding]
surface = "plate"
rows = 40
held_out = 0.25
cases = 1
reference = "S1"
before = { points_mm = [1.8, 3.4, 1.6, -0.9, 0.6], mean_mm = 1.3, sd_mm = 1.6 }
[[grinding.method]]
id = "S1"
solver = "lm"
paper = { points_mm = [0.9, 0.2, 0.1, 0.4, 0.4], mean_mm = 0.4, sd_mm = 0.3 }
"#;
    assert_eq!(unread(&text, shown), Vec::<String>::new());
}

#[test]
fn every_key_of_an_experiment_that_measures_nothing_is_read() {
    let uniformity = "[uniformity]\npoints = 100\nlong_points = 400\nbins = 8\nstarts = 3\nrange = [0.5, 3.5]\nsteps = 4\n\
                      claimed = 0.5\n";
    let ranks = r#"
[signed_rank]
reference = "A"
[[signed_rank.table]]
title = "Errors"
rows = ["one", "two", "three", "four", "five"]
dependence = "The same rows"
method = [
    { id = "A", figures = [1.0, 2.0, 3.0, 4.0, 5.0] },
    { id = "B", figures = [1.5, 2.5, 2.9, 4.5, 5.5], paper_p = 0.04 },
]
"#
    .replace("signed_rank", "signed-rank");
    for section in [uniformity, &ranks] {
        let text = format!("{HEAD}{section}");
        assert_eq!(unread(&text, shown), Vec::<String>::new());
    }
}

#[test]
fn every_key_of_an_experiment_of_an_arm_that_degrades_is_read() {
    let text = HEAD.to_owned()
        + r#"
recipe = "tx60-pose"
[degradation]
groups = 2
hours_apart = 2.0
identification = 12
counts = [6, 12]
continuous = [6]
arms = 1
forgetting = 0.95
stopped_after = 2
[degradation.heat]
growth_per_k = 23e-6
rise_k = [4.0, 6.0, 8.0, 9.0, 7.0, 5.0]
time_constant_h = 3.0
[degradation.wear]
zero_deg_per_h = [0.002, -0.004, 0.005, -0.003, 0.006, 0.004]
[[degradation.paper]]
count = 12
method = "RLS"
figure = "Fig. 9"
identification_before_mm = 0.65
identification_after_mm = 0.05
verification_before_mm = 0.69
verification_after_mm = 0.09
improvement_percent = 86.0
[[degradation.paper_counts]]
count = 6
identification_percent = 91.0
verification_percent = 87.0
"#;
    assert_eq!(unread(&text, shown), Vec::<String>::new());
}

/// What `plan --for` reads of a diagnosis: a key that is misspelt must not be taken for one that found nothing.
#[test]
fn every_key_that_is_read_back_of_a_diagnosis_counts() {
    const FOUND: &str = r#"
schema = "truegrind.diagnosis/1"
[[findings]]
effect = "gear-ratio"
joints = [4]
confidence = "identified"
alternatives = []
[[findings]]
effect = "backlash"
joints = [2]
confidence = "ambiguous"
alternatives = [{ effect = "joint-compliance", joints = [3] }]
[[not_testable]]
effect = "thermal-drift"
joints = [1]
"#;
    let seen = |text: &str| -> Result<String, String> {
        let json = serde_json::to_string(&text.parse::<Table>().unwrap()).unwrap();
        questions(&json).map(|asked| format!("{asked:?}")).map_err(|error| error.to_string())
    };
    // A certain finding asks nothing: its rivals only have to be there.
    assert_eq!(unread(FOUND, seen), ["[Key(\"findings\"), Place(0), Key(\"alternatives\")]"]);
    for key in ["findings", "not_testable"] {
        let mut without: Table = FOUND.parse().unwrap();
        without.remove(key);
        assert!(seen(&toml::to_string(&without).unwrap()).is_err_and(|error| error.contains(key)));
    }
    let mut odd: Table = FOUND.parse().unwrap();
    odd["findings"][0]["joints"] = Value::Array(vec![Value::Integer(7)]);
    assert!(seen(&toml::to_string(&odd).unwrap()).is_err_and(|error| error.contains("expected 1 to 6")));
}
