//! A simulated arm that is watched: what moves is named, and a stop changes nothing.

use std::sync::OnceLock;

use truegrind::comparison::tracking::{Options, State, TrackError, Tracker};
use truegrind::identification::identify::{self, identify};
use truegrind::identification::solver::SOLVERS;
use truegrind::identification::start::starts;
use truegrind::identification::tolerance::Tolerance;
use truegrind::kinematics::estimated::Estimated;
use truegrind::measurement::dataset::Dataset;
use truegrind::measurement::simulation::recipe::{LinkDeviation, Recipe};
use truegrind::measurement::{import, split};

use super::experiment::nominal;

/// A tracker on an arm without effects, so that links are the whole truth.
const RECIPE: &str = r#"
robot = "abb-irb-120"
seed = 9
[arm.random]
seed = 4
a_mm = 0.25
d_mm = 0.25
alpha_deg = 0.03
beta_deg = 0.03
theta_deg = 0.10
[poses]
kind = "random"
count = 120
min_deg = [-110.0, -60.0, -80.0, -150.0, -110.0, -180.0]
max_deg = [110.0, 100.0, 60.0, 150.0, 110.0, 180.0]
[view]
box_mm = [[100.0, -550.0, 60.0], [650.0, 550.0, 900.0]]
[sensor]
kind = "position"
frame = { position_mm = [2310.5, -640.2, 512.7], wxyz = [0.12, 0.02, -0.03, 0.99] }
reflector_mm = [38.2, 12.6, 61.3]
[noise]
sigma_mm = 0.015
"#;

fn measured(seed: u64, moved: Option<LinkDeviation>) -> Dataset {
    let mut recipe = Recipe::parse(RECIPE, "track.toml").unwrap();
    recipe.seed = seed;
    recipe.arm.link.extend(moved);
    let simulation = recipe.simulate(nominal).unwrap();
    import::read("day.csv", simulation.csv.as_bytes(), &import::Options::default()).unwrap()
}

fn model() -> &'static Estimated {
    static MODEL: OnceLock<Estimated> = OnceLock::new();
    MODEL.get_or_init(|| {
        let dataset = measured(1, None);
        let robot = nominal("abb-irb-120").unwrap();
        let frames = starts(&dataset, &robot).unwrap().remove(0);
        let options = identify::Options {
            tolerance: Tolerance::default(),
            solver: &SOLVERS[0],
            held_out: 0.2,
            seed: 0,
            sharpen: false,
            limit_rmse_mm: None,
            limit_max_mm: None,
            stated_frames: None,
        };
        let division = |d: &Dataset| split::random(d, 0.2, 0);
        identify(&dataset, "abb-irb-120", &robot, &frames, &division, &options).unwrap().estimated
    })
}

/// `before` rows of the arm as it was identified, then of the arm after a jump.
fn with_jump(before: usize, moved: LinkDeviation) -> Dataset {
    let (old, new) = (measured(2, None), measured(2, Some(moved)));
    let mut out = old.clone();
    for i in before..out.rows.len() {
        out.rows[i] = new.rows[i].clone();
    }
    out
}

fn zero_of_joint_3() -> LinkDeviation {
    LinkDeviation { joint: 2, theta_deg: 0.05, ..LinkDeviation::default() }
}

#[test]
fn a_joint_that_lost_its_zero_is_named_with_its_size_and_its_pose() {
    let dataset = with_jump(70, zero_of_joint_3());
    let mut tracker = Tracker::begin(model(), "hash", &dataset, &Options::default()).unwrap();
    let alarms = tracker.take(&dataset).unwrap();
    assert_eq!(alarms.len(), 1, "{alarms:?}");
    let alarm = &alarms[0];
    assert!(
        alarm.parameter == "link3.theta" || alarm.alternatives.contains(&"link3.theta".to_owned()),
        "{alarm}"
    );
    assert!(alarm.since_row.abs_diff(70) <= 2, "{alarm}");
    assert!(alarm.noticed_row <= 80, "{alarm}");
    assert!((alarm.shift.to_degrees() - 0.05).abs() < 0.01, "{alarm}");
    assert!(alarm.to_string().contains("moved by"));
    // The model has followed, and says what happened.
    let after = tracker.model();
    let theta = |m: &Estimated| m.model.links[2].theta_rad;
    assert!(((theta(&after) - theta(model())).to_degrees() - 0.05).abs() < 0.01);
    assert!(after.verdict.reasons.iter().any(|r| r.contains("moved by")));
    let again = Estimated::from_toml(&after.to_toml().unwrap()).unwrap();
    assert_eq!(again.model.links[2].theta_rad.to_degrees(), after.model.links[2].theta_rad.to_degrees());
}

#[test]
fn an_arm_that_stays_raises_no_alarm_and_the_bounds_hold() {
    for seed in 2..6 {
        let dataset = measured(seed, None);
        let mut tracker = Tracker::begin(model(), "hash", &dataset, &Options::default()).unwrap();
        let alarms = tracker.take(&dataset).unwrap();
        assert!(alarms.is_empty(), "seed {seed}: {alarms:?}");
        let history = &tracker.state().history;
        let mean = history.iter().map(|s| s.nis).sum::<f64>() / history.len() as f64;
        // Three rows in a pose: χ² with three degrees of freedom has mean 3.
        assert!((1.5..4.5).contains(&mean), "seed {seed}: mean NIS {mean}");
    }
}

#[test]
fn one_wrong_reading_is_an_accident_and_no_alarm() {
    let mut dataset = measured(2, None);
    let other = measured(7, None);
    dataset.rows[60].reading = other.rows[3].reading;
    let mut tracker = Tracker::begin(model(), "hash", &dataset, &Options::default()).unwrap();
    assert!(tracker.take(&dataset).unwrap().is_empty());
    assert_eq!(tracker.state().accidents, 1);
}

#[test]
fn a_stop_in_the_middle_changes_no_bit() {
    let dataset = with_jump(70, zero_of_joint_3());
    let rows = |n: usize| dataset.subset(&(0..n).collect::<Vec<_>>());
    let mut whole = Tracker::begin(model(), "hash", &rows(40), &Options::default()).unwrap();
    whole.take(&dataset).unwrap();
    let mut parts = Tracker::begin(model(), "hash", &rows(40), &Options::default()).unwrap();
    for n in [40, 41, 75, 90, 120] {
        parts.take(&rows(n)).unwrap();
        let text = parts.state().to_toml().unwrap();
        parts = Tracker::resume(model(), State::from_toml(&text).unwrap(), "state.toml").unwrap();
    }
    assert_eq!(whole.state().alarms, parts.state().alarms);
    assert_eq!(whole.deviations(), parts.deviations());
    assert_eq!(whole.state().to_toml().unwrap(), parts.state().to_toml().unwrap());
}

#[test]
fn what_cannot_be_tracked_is_said() {
    let dataset = measured(2, None);
    let few = dataset.subset(&(0..12).collect::<Vec<_>>());
    let error = Tracker::begin(model(), "hash", &few, &Options::default()).unwrap_err();
    assert!(error.to_string().contains("12 poses so far, 30 are needed"), "{error}");
    let mut tracker = Tracker::begin(model(), "hash", &dataset, &Options::default()).unwrap();
    tracker.take(&few).unwrap();
    let mut edited = dataset.clone();
    edited.rows[3].joints[0] += 1e-3;
    let error = tracker.take(&edited).unwrap_err();
    assert!(error.to_string().contains("12 rows that were taken in have changed"), "{error}");
    let cable =
        import::read("cable.csv", include_bytes!("../../data/irb120-cable.csv"), &import::Options::default())
            .unwrap();
    assert!(matches!(tracker.take(&cable), Err(TrackError::Sensor { .. })));
    let mut state = tracker.state().to_toml().unwrap();
    state = state.replace("truegrind.track/1", "truegrind.track/9");
    let state = State::from_toml(&state).unwrap();
    let error = Tracker::resume(model(), state, "state.toml").unwrap_err();
    assert!(error.to_string().contains("truegrind.track/9"), "{error}");
    assert!(State::from_toml("x = 1").is_err());
}
