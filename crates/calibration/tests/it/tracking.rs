//! A simulated arm that is watched: what moves is named, and a stop changes nothing.

mod cable;
mod hidden_changes;
mod set_ups;

use std::sync::OnceLock;

use truegrind_arm::condition::Condition;
use truegrind_arm::effect::Effect;
use truegrind_arm::effect::thermal::Thermal;
use truegrind_arm::estimated::Estimated;
use truegrind_calibration::identification::identify::{self, identify};
use truegrind_calibration::identification::solver::SOLVERS;
use truegrind_calibration::identification::start::candidate_frames;
use truegrind_calibration::identification::tolerance::Tolerance;
use truegrind_calibration::measurement::dataset::{Dataset, Reading};
use truegrind_calibration::measurement::simulation::recipe::{LinkDeviation, Recipe};
use truegrind_calibration::measurement::{import, split};
use truegrind_calibration::tracking::alarm::Mount;
use truegrind_calibration::tracking::locate::{Form, locate};
use truegrind_calibration::tracking::{Course, Options, State, TrackError, Tracker, first_poses};
use truegrind_testing::keys::unread;

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

fn nominal(name: &str) -> Result<truegrind_arm::model::Model, String> {
    truegrind_arm::robots::load(name).map(|robot| robot.model).map_err(|error| error.to_string())
}

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
        let frames = candidate_frames(&dataset, &robot).unwrap().remove(0);
        let division = |d: &Dataset| split::random(d, 0.2, 0);
        identify(&dataset, "abb-irb-120", &robot, &frames, &division, &settings()).unwrap().estimated
    })
}

fn settings() -> identify::Options {
    identify::Options {
        tolerance: Tolerance::default(),
        solver: &SOLVERS[0],
        held_out: 0.2,
        seed: 0,
        fuse_readout: false,
        limit_rmse_mm: None,
        limit_max_mm: None,
        stated_frames: None,
    }
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
    let alarms = tracker.process_file(&dataset).unwrap();
    assert_eq!(alarms.len(), 1, "{alarms:?}");
    let alarm = &alarms[0];
    assert!(
        alarm.parameter == "link3.theta" || alarm.alternatives.contains(&"link3.theta".to_owned()),
        "{alarm}"
    );
    assert!(alarm.since_row.abs_diff(72) <= 2, "{alarm}");
    assert!(alarm.noticed_row <= 82, "{alarm}");
    assert!((alarm.shift.to_degrees() - 0.05).abs() < 0.01, "{alarm}");
    assert!(alarm.course != Course::Drift, "{alarm}");
    // The model has followed, and says what happened.
    let after = tracker.model();
    let theta = |m: &Estimated| m.model.links[2].theta_rad;
    assert!(((theta(&after) - theta(model())).to_degrees() - 0.05).abs() < 0.01);
    assert!(after.verdict.reasons.iter().any(|r| r.text == alarm.to_string()));
    let again = Estimated::from_toml(&after.to_toml().unwrap()).unwrap();
    assert_eq!(again.model.links[2].theta_rad.to_degrees(), after.model.links[2].theta_rad.to_degrees());
}

/// Rows without a clock are of the arm as warm as when it was identified, and the tracked model is used so.
#[test]
fn an_arm_that_had_warmed_up_is_not_tracked_as_a_cold_one() {
    let mut warm = model().clone();
    warm.model.effects.push(Effect::ThermalDrift(Thermal {
        growth: 1e-3,
        time_constant_h: 0.5,
        start_h: 0.0,
        growth_per_k: 0.0,
        reference_c: 20.0,
    }));
    warm.condition.time_h = Some(20.0);
    let mut dataset = measured(2, None);
    for row in &mut dataset.rows {
        let flange = warm.model.forward(&row.joints, &warm.condition);
        row.reading = Reading::Position((flange * nalgebra::Point3::new(38.2, 12.6, 61.3)).coords);
        row.condition = Condition::default().into();
    }
    let mut tracker = Tracker::begin(&warm, "hash", &dataset, &Options::default()).unwrap();
    let alarms = tracker.process_file(&dataset).unwrap();
    assert!(alarms.is_empty(), "{alarms:?}");
    let departure = tracker.departure().unwrap();
    assert!(!departure.is_significant, "{departure:?}");
    assert_eq!(tracker.model().condition.time_h, Some(20.0));
}

#[test]
fn a_sensor_that_was_knocked_is_named_as_a_whole() {
    let mut dataset = measured(2, None);
    let shift = nalgebra::Vector3::new(0.3, -0.25, 0.1);
    for row in dataset.rows.iter_mut().skip(70) {
        let Reading::Position(p) = &mut row.reading else { panic!("a position") };
        *p += shift;
    }
    let mut tracker = Tracker::begin(model(), "hash", &dataset, &Options::default()).unwrap();
    let alarms = tracker.process_file(&dataset).unwrap();
    assert_eq!(alarms.len(), 1, "{alarms:#?}");
    let alarm = &alarms[0];
    assert!(alarm.is_of(Mount::Sensor) && !alarm.is_of(Mount::Target), "{alarm}");
    assert_eq!(alarm.parameter, "the sensor against the arm's base", "the word of files");
    assert!(alarm.since_row.abs_diff(72) <= 1 && alarm.parts.len() == 6, "{alarm:#?}");
    assert!((alarm.shift - shift.norm()).abs() < 0.03, "{alarm}");
    assert!(alarm.to_string().contains("sensor."), "{alarm}");
    // The arm's own parameters are what they would be without the knock: joints 2 to 5, since no sensor tells the first
    // from its frame, and the last from the touched point.
    let calm = measured(2, None);
    let mut undisturbed = Tracker::begin(model(), "hash", &calm, &Options::default()).unwrap();
    undisturbed.process_file(&calm).unwrap();
    let (after, calm) = (tracker.model(), undisturbed.model());
    for joint in 1..5 {
        let off = after.model.links[joint].theta_rad - calm.model.links[joint].theta_rad;
        assert!(off.to_degrees().abs() < 0.01, "joint {}: {}", joint + 1, off.to_degrees());
    }
    // The state with such an alarm is read again.
    let text = tracker.state().to_toml().unwrap();
    assert_eq!(State::from_toml(&text).unwrap().alarms, tracker.state().alarms);
}

#[test]
fn measurements_that_are_not_of_this_arm_are_refused_and_not_taken_for_noise() {
    // Joint 2 lost half a degree between identification and the first pose.
    let lost = LinkDeviation { joint: 1, theta_deg: 0.5, ..LinkDeviation::default() };
    let dataset = measured(2, Some(lost));
    let error = Tracker::begin(model(), "hash", &dataset, &Options::default()).unwrap_err();
    assert!(matches!(error, TrackError::Foreign { poses: 30, .. }), "{error}");
    assert!(error.to_string().contains("identify it again"), "{error}");
    // Who knows better says so.
    let stated = Options { sigma_mm: Some(2.0), ..Options::default() };
    assert!(Tracker::begin(model(), "hash", &dataset, &stated).is_ok());
}

/// Rows whose logged angle of joint 3 falls behind the arm by `rate_deg` more with every row from `from` on: what a zero that
/// drifts looks like.
fn with_drift(from: usize, rate_deg: f64) -> Dataset {
    let mut out = measured(2, None);
    // More rows than one file of the recipe has.
    out.rows.extend(measured(11, None).rows);
    for (i, row) in out.rows.iter_mut().enumerate() {
        row.number = i;
        row.joints[2] -= rate_deg.to_radians() * i.saturating_sub(from) as f64;
    }
    out
}

#[test]
fn a_slow_drift_is_named_with_its_rate_and_followed() {
    let rate = 0.001;
    let dataset = with_drift(80, rate);
    let mut tracker = Tracker::begin(model(), "hash", &dataset, &Options::default()).unwrap();
    let alarms = tracker.process_file(&dataset).unwrap();
    let alarm = alarms.first().expect("the drift is noticed");
    assert!(
        alarm.parameter == "link3.theta" || alarm.alternatives.contains(&"link3.theta".to_owned()),
        "{alarm}"
    );
    assert!(alarm.course != Course::Jump, "{alarm}");
    assert!(alarm.since_row.abs_diff(80) <= 12, "{alarm}");
    // From then on the filter follows: it knows that this parameter drifts.
    assert!(alarms.len() <= 2, "{alarms:#?}");
    let theta = |m: &Estimated| m.model.links[2].theta_rad;
    let last = (theta(&tracker.model()) - theta(model())).to_degrees();
    let truth = rate * (dataset.rows.len() - 1 - 80) as f64;
    assert!((last - truth).abs() < 0.02, "{last} {truth}");
    // And goes on knowing it after a stop.
    let text = tracker.state().to_toml().unwrap();
    let state = State::from_toml(&text).unwrap();
    assert!(state.options.drift.values().any(|d| *d > 0.3 * rate.to_radians()), "{:?}", state.options.drift);
}

#[test]
fn a_change_is_found_as_least_squares_with_one_parameter_more_finds_it() {
    use nalgebra::{DMatrix, DVector};
    // Forty poses of two rows, three parameters with a prior, a known change of the second one.
    let (n, per, p) = (40, 2, 3);
    let mut rng = 12_345_u64;
    let mut random = || {
        rng = rng.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (rng >> 33) as f64 / 2f64.powi(31) - 0.5
    };
    let j = DMatrix::from_fn(n * per, p, |_, _| 4.0 * random());
    let covariance = DMatrix::from_diagonal(&DVector::from_vec(vec![0.04, 0.25, 1.0]));
    for (form, size) in [(Form::Jump, 2.0), (Form::Drift, 0.2)] {
        let weight = |pose: usize| match form {
            _ if pose < 22 => 0.0,
            Form::Jump => 1.0,
            Form::Drift => (pose - 22 + 1) as f64,
        };
        // Residuals are model minus reading: the model has not followed.
        let r = DVector::from_fn(n * per, |i, _| random() - size * weight(i / per) * j[(i, 1)]);
        let found = locate(r.as_slice(), j.as_slice(), per, &covariance, covariance.nrows(), &[]).unwrap();
        assert!(found.together.is_none() && found.nearly.is_none());
        assert_eq!((found.best.parameter, found.best.form), (1, form));
        assert!(found.best.since.abs_diff(22) <= 1, "{found:?}");
        // The same by least squares: prior rows, measured rows, and the change as a fourth column.
        let since = found.best.since;
        let change = |pose: usize| match form {
            _ if pose < since => 0.0,
            Form::Jump => 1.0,
            Form::Drift => (pose - since + 1) as f64,
        };
        let rows = n * per;
        let solve = |columns: usize| {
            let a = DMatrix::from_fn(rows + p, columns, |i, k| match (i < rows, k < p) {
                (true, true) => j[(i, k)],
                (true, false) => j[(i, 1)] * change(i / per),
                (false, _) if i - rows == k => 1.0 / covariance[(k, k)].sqrt(),
                _ => 0.0,
            });
            let b = DVector::from_fn(rows + p, |i, _| if i < rows { -r[i] } else { 0.0 });
            let x = (a.tr_mul(&a)).cholesky().unwrap().solve(&a.tr_mul(&b));
            (x.clone(), (&a * &x - &b).norm_squared())
        };
        let ((with, cost_with), (_, cost_without)) = (solve(p + 1), solve(p));
        assert!((found.best.ratio - (cost_without - cost_with)).abs() < 1e-8 * cost_without);
        let far = if form == Form::Drift { (n - since) as f64 } else { 1.0 };
        assert!((found.best.shift - with[p] * far).abs() < 1e-9, "{} {}", found.best.shift, with[p] * far);
    }
}

#[test]
fn a_model_that_leaves_effects_unexplained_raises_no_alarm_on_the_arm_that_it_was_made_of() {
    // The shipped measurements are of an arm with compliance, eccentric gears and play, which links do not hold.
    let cable = include_bytes!("../../../../tests/data/irb120-cable.csv");
    let tracker_rows = include_bytes!("../../../../tests/data/irb120-tracker.csv");
    for (name, bytes) in [("cable", &cable[..]), ("tracker", &tracker_rows[..])] {
        let dataset = import::read("rows.csv", bytes, &import::Options::default()).unwrap();
        let half = dataset.rows.len() / 2;
        let rows = |range: std::ops::Range<usize>| dataset.subset(&range.collect::<Vec<_>>());
        let (first, second) = (rows(0..half), rows(half..dataset.rows.len()));
        let robot = nominal("abb-irb-120").unwrap();
        let frames = candidate_frames(&first, &robot).unwrap().remove(0);
        let division = |d: &Dataset| split::random(d, 0.2, 0);
        let found = identify(&first, "abb-irb-120", &robot, &frames, &division, &settings()).unwrap();
        let mut tracker = Tracker::begin(&found.estimated, "hash", &second, &Options::default()).unwrap();
        let alarms = tracker.process_file(&second).unwrap();
        assert!(alarms.is_empty(), "{name}: {alarms:#?}");
    }
}

#[test]
fn outliers_that_nothing_explains_raise_an_alarm_that_says_so_and_move_nothing() {
    // Two outliers near each other are two outliers.
    let mut dataset = measured(2, None);
    let other = measured(7, None);
    for at in [60, 66] {
        dataset.rows[at].reading = other.rows[at].reading.clone();
    }
    let mut tracker = Tracker::begin(model(), "hash", &dataset, &Options::default()).unwrap();
    assert!(tracker.process_file(&dataset).unwrap().is_empty());
    assert_eq!(tracker.state().outliers, 2);
    // Readings that scatter five times as much as they should are no parameter's doing.
    let mut dataset = measured(2, None);
    for (k, row) in dataset.rows.iter_mut().enumerate().skip(80) {
        let Reading::Position(p) = &mut row.reading else { panic!("a position") };
        let sign = |n: usize| if ((k * 2_654_435_761) >> n) & 1 == 0 { 0.055 } else { -0.055 };
        *p += nalgebra::Vector3::new(sign(7), sign(11), sign(13));
    }
    let mut tracker = Tracker::begin(model(), "hash", &dataset, &Options::default()).unwrap();
    let alarms = tracker.process_file(&dataset).unwrap();
    let first = alarms.first().expect("it is noticed");
    assert!(first.parameter.is_empty(), "{first}");
    assert_eq!(first.course, Course::Scatter, "{first}");
    assert!(first.shift > 2.0 && first.shift < 6.0, "{first}");
    // It is said once, not for every window.
    assert_eq!(alarms.len(), 1, "{alarms:?}");
}

#[test]
fn files_of_a_few_poses_each_begin_a_track_together() {
    let day = measured(2, None);
    let file = |k: usize| {
        let mut out = day.subset(&(12 * k..12 * k + 12).collect::<Vec<_>>());
        out.file = format!("day-{k}.csv");
        out
    };
    let files: Vec<Dataset> = (0..10).map(file).collect();
    let first = first_poses(&files, 30).unwrap();
    assert_eq!((first.rows.len(), first.file.as_str()), (36, "day-0.csv and 2 more"));
    assert!(first_poses(&[], 30).is_none());
    let mut apart = Tracker::begin(model(), "hash", &first, &Options::default()).unwrap();
    files.iter().for_each(|f| assert!(apart.process_file(f).unwrap().is_empty()));
    let mut whole = Tracker::begin(model(), "hash", &day, &Options::default()).unwrap();
    whole.process_file(&day).unwrap();
    assert_eq!(apart.deviations(), whole.deviations());
    assert_eq!(apart.state().consumed.len(), 10);
}

#[test]
fn where_the_arm_was_measured_grows_with_the_track_and_outlives_a_stop() {
    let mut day = measured(2, None);
    day.rows[70].joints[0] = 150f64.to_radians();
    day.rows[70].reading = day.rows[71].reading.clone();
    let far = measured(2, None);
    let mut tracker = Tracker::begin(model(), "hash", &far, &Options::default()).unwrap();
    tracker.process_file(&far).unwrap();
    let (before, after) = (&model().region, tracker.model().region);
    assert!(after.samples_deg.len() > before.samples_deg.len());
    assert!((0..6).all(|i| after.min_deg[i] <= before.min_deg[i] && after.max_deg[i] >= before.max_deg[i]));
    // A reading that was set aside says nothing of where the arm is known.
    let mut tracker = Tracker::begin(model(), "hash", &day, &Options::default()).unwrap();
    tracker.process_file(&day).unwrap();
    assert_eq!(tracker.state().outliers, 1);
    assert!(tracker.model().region.max_deg[0] < 149.0);
}

#[test]
fn an_arm_that_stays_raises_no_alarm_and_the_bounds_hold() {
    for seed in 2..6 {
        let dataset = measured(seed, None);
        let mut tracker = Tracker::begin(model(), "hash", &dataset, &Options::default()).unwrap();
        let alarms = tracker.process_file(&dataset).unwrap();
        assert!(alarms.is_empty(), "seed {seed}: {alarms:?}");
        let history = &tracker.state().history;
        let mean = history.iter().map(|s| s.nis).sum::<f64>() / history.len() as f64;
        // Three rows in a pose: χ² with three degrees of freedom has mean 3.
        assert!((1.5..4.5).contains(&mean), "seed {seed}: mean NIS {mean}");
    }
}

#[test]
fn one_wrong_reading_is_an_outlier_and_no_alarm() {
    let mut dataset = measured(2, None);
    let other = measured(7, None);
    dataset.rows[60].reading = other.rows[3].reading.clone();
    let mut tracker = Tracker::begin(model(), "hash", &dataset, &Options::default()).unwrap();
    assert!(tracker.process_file(&dataset).unwrap().is_empty());
    assert_eq!(tracker.state().outliers, 1);
}

#[test]
fn a_stop_in_the_middle_changes_no_bit() {
    let dataset = with_jump(70, zero_of_joint_3());
    let rows = |n: usize| dataset.subset(&(0..n).collect::<Vec<_>>());
    let mut whole = Tracker::begin(model(), "hash", &rows(40), &Options::default()).unwrap();
    whole.process_file(&dataset).unwrap();
    let mut parts = Tracker::begin(model(), "hash", &rows(40), &Options::default()).unwrap();
    for n in [40, 41, 75, 90, 120] {
        parts.process_file(&rows(n)).unwrap();
        let text = parts.state().to_toml().unwrap();
        parts = Tracker::resume(model(), State::from_toml(&text).unwrap(), "state.toml").unwrap();
    }
    assert_eq!(whole.state().alarms, parts.state().alarms);
    assert_eq!(whole.deviations(), parts.deviations());
    assert_eq!(whole.state().to_toml().unwrap(), parts.state().to_toml().unwrap());
    assert_eq!(whole.model().to_toml().unwrap(), parts.model().to_toml().unwrap());
}

#[test]
fn what_cannot_be_tracked_is_said() {
    let dataset = measured(2, None);
    let few = dataset.subset(&(0..12).collect::<Vec<_>>());
    let error = Tracker::begin(model(), "hash", &few, &Options::default()).unwrap_err();
    assert!(error.to_string().contains("12 poses so far, 30 are needed"), "{error}");
    let mut tracker = Tracker::begin(model(), "hash", &dataset, &Options::default()).unwrap();
    tracker.process_file(&few).unwrap();
    let mut edited = dataset.clone();
    edited.rows[3].joints[0] += 1e-3;
    let error = tracker.process_file(&edited).unwrap_err();
    assert!(error.to_string().contains("12 rows that were already processed have changed"), "{error}");
    let cable = import::read(
        "cable.csv",
        include_bytes!("../../../../tests/data/irb120-cable.csv"),
        &import::Options::default(),
    )
    .unwrap();
    assert!(matches!(tracker.process_file(&cable), Err(TrackError::Sensor { .. })));
    let mut state = tracker.state().to_toml().unwrap();
    state = state.replace("truegrind.track/1", "truegrind.track/9");
    let state = State::from_toml(&state).unwrap();
    let error = Tracker::resume(model(), state, "state.toml").unwrap_err();
    assert!(error.to_string().contains("truegrind.track/9"), "{error}");
    assert!(State::from_toml("x = 1").is_err());
}

/// The class: a key of the state that nobody looks at, and a number of it that is none and goes on into the next model. Each
/// key is changed and taken away in turn: the track goes on otherwise, or the file is refused; and no key may hold NaN.
#[test]
fn every_key_of_the_state_is_kept_or_refused_and_no_number_is_nan() {
    let dataset = with_jump(40, zero_of_joint_3());
    let rows = |n: usize| dataset.subset(&(0..n).collect::<Vec<_>>());
    // A change that was noticed, and few poses, so that there are not too many keys.
    let options = Options { window: 10, history: 24, sigma_mm: Some(0.02), ..Options::default() };
    let mut tracker = Tracker::begin(model(), "hash", &dataset, &options).unwrap();
    let noticed = (41..110).find(|n| !tracker.process_file(&rows(*n)).unwrap().is_empty()).unwrap() + 6;
    tracker.process_file(&rows(noticed)).unwrap();
    let state = tracker.state().to_toml().unwrap();
    assert!(state.contains("[[alarms]]") && state.contains("[[history]]"), "{state}");
    let state = state.replace("alternatives = []", "alternatives = [\"link3.d\"]");
    let next = |text: &str| -> Result<String, String> {
        let state = State::from_toml(text).map_err(|error| error.to_string())?;
        let mut track = Tracker::resume(model(), state, "state.toml").map_err(|error| error.to_string())?;
        let alarms = track.process_file(&rows(noticed + 1)).map_err(|error| error.to_string())?;
        let after = track.model().to_toml().map_err(|error| error.to_string())?;
        Ok(format!("{alarms:?}{after}{}", track.state().to_toml().map_err(|error| error.to_string())?))
    };
    assert_eq!(unread(&state, next), Vec::<String>::new());
    for line in
        state.lines().filter(|line| line.contains('.') && line.contains(" = ") && !line.contains('\"'))
    {
        let (key, value) = line.split_once(" = ").unwrap();
        let number = value.trim_start_matches('[').split([',', ']']).next().unwrap();
        if number.parse::<f64>().is_err() {
            continue;
        }
        let broken = state.replacen(line, &format!("{key} = {}", value.replacen(number, "nan", 1)), 1);
        let error = State::from_toml(&broken).unwrap_err().to_string();
        assert!(error.contains("finite"), "{line}: {error}");
    }
}

/// The recipe with another target and another kind of sensor.
fn measured_with(seed: u64, from: &str, to: &str) -> Dataset {
    let text = RECIPE.replace(from, to);
    assert_ne!(text, RECIPE);
    simulated(&text, seed)
}

fn simulated(recipe: &str, seed: u64) -> Dataset {
    let mut recipe = Recipe::parse(recipe, "track.toml").unwrap();
    recipe.seed = seed;
    let simulation = recipe.simulate(nominal).unwrap();
    import::read("day.csv", simulation.csv.as_bytes(), &import::Options::default()).unwrap()
}

/// A track over `before` rows of one measurement and the rest of another.
fn spliced(first: &Dataset, second: &Dataset, before: usize) -> Dataset {
    let mut out = first.clone();
    for i in before..out.rows.len() {
        out.rows[i] = second.rows[i].clone();
    }
    out
}

/// A target that is taken off and put on again lies anywhere, turned by any angle: that is one alarm, and the poses after
/// it are taken in. The class: a change that no linearisation reaches, complained of window after window.
#[test]
fn a_target_that_was_mounted_anew_is_one_alarm_and_the_track_goes_on() {
    const POINT: &str = "reflector_mm = [38.2, 12.6, 61.3]";
    const KIND: &str = "kind = \"position\"\nframe = { position_mm = [2310.5, -640.2, 512.7], wxyz = [0.12, 0.02, -0.03, 0.99] }\nreflector_mm = [38.2, 12.6, 61.3]\n[noise]\nsigma_mm = 0.015";
    let pose = |target: &str| {
        let frame = "frame = { position_mm = [2310.5, -640.2, 512.7], wxyz = [0.12, 0.02, -0.03, 0.99] }";
        format!("kind = \"pose\"\n{frame}\ntarget = {target}\n[noise]\nsigma_mm = 0.015\nsigma_deg = 0.003")
    };
    let before = pose("{ position_mm = [38.2, 12.6, 61.3], wxyz = [1.0, 0.0, 0.0, 0.0] }");
    let turned = pose(
        "{ position_mm = [-20.0, 35.0, 61.3], wxyz = [0.7071067811865476, 0.0, 0.0, 0.7071067811865476] }",
    );
    for (first, second, turn_deg) in [
        (measured(2, None), measured_with(2, POINT, "reflector_mm = [-20.0, 35.0, 61.3]"), None),
        (measured_with(2, KIND, &before), measured_with(2, KIND, &turned), Some(90.0)),
    ] {
        let dataset = spliced(&first, &second, 70);
        let mut tracker = Tracker::begin(model(), "hash", &dataset, &Options::default()).unwrap();
        let alarms = tracker.process_file(&dataset).unwrap();
        let said: Vec<String> = alarms.iter().map(ToString::to_string).collect();
        assert_eq!(alarms.len(), 1, "{said:#?}");
        assert_eq!((alarms[0].course, alarms[0].since_row), (Course::Mounted, 72), "{said:#?}");
        assert!(alarms[0].is_of(Mount::Target), "{}", alarms[0]);
        assert!((alarms[0].shift - 62.4).abs() < 0.5, "{said:#?}");
        let turn = alarms[0].parts.first().map(|part| part.shift.to_degrees());
        assert_eq!(turn.is_some(), turn_deg.is_some(), "{said:#?}");
        assert!(turn.zip(turn_deg).is_none_or(|(found, told)| (found - told).abs() < 0.1), "{said:#?}");
        assert!(said[0].contains("remounted at row 72 of day.csv"), "{said:#?}");
        assert!(tracker.state().outliers <= 2 && !tracker.mostly_set_aside(), "{}", tracker.state().outliers);
        // A stop among the poses that were set aside changes no bit.
        let rows = |n: usize| dataset.subset(&(0..n).collect::<Vec<_>>());
        let mut parts = Tracker::begin(model(), "hash", &rows(40), &Options::default()).unwrap();
        for n in [40, 74, 76, 90, 120] {
            parts.process_file(&rows(n)).unwrap();
            let text = parts.state().to_toml().unwrap();
            parts = Tracker::resume(model(), State::from_toml(&text).unwrap(), "state.toml").unwrap();
        }
        let [whole, parts] = [&tracker, &parts].map(|track| track.state().to_toml().unwrap());
        let apart = whole.lines().zip(parts.lines()).position(|(one, other)| one != other);
        assert!(whole == parts, "line {apart:?}");
    }
}

/// Readings that are far off one after the other and agree on nothing are a burst: one alarm, nothing moves, and what fits
/// again is taken in. A track of which a quarter was set aside does not end as a healthy one.
#[test]
fn a_burst_of_outliers_is_one_alarm_and_no_change() {
    let mut dataset = measured(2, None);
    let calm = dataset.clone();
    let other = measured(7, None);
    for at in 60..92 {
        dataset.rows[at].reading = other.rows[at].reading.clone();
    }
    let mut tracker = Tracker::begin(model(), "hash", &dataset, &Options::default()).unwrap();
    let alarms = tracker.process_file(&dataset).unwrap();
    let said: Vec<String> = alarms.iter().map(ToString::to_string).collect();
    assert_eq!(alarms.len(), 1, "{said:#?}");
    assert_eq!((alarms[0].course, alarms[0].since_row), (Course::Burst, 62), "{said:#?}");
    assert_eq!(tracker.state().outliers, 32);
    assert!(tracker.mostly_set_aside());
    let mut undisturbed = Tracker::begin(model(), "hash", &calm, &Options::default()).unwrap();
    undisturbed.process_file(&calm).unwrap();
    assert!(!undisturbed.mostly_set_aside());
    // Joints 2 to 5, which a sensor tells from its frame and from the touched point.
    let (after, calm) = (tracker.model(), undisturbed.model());
    for joint in 1..5 {
        let off = (after.model.links[joint].theta_rad - calm.model.links[joint].theta_rad).to_degrees();
        assert!(off.abs() < 0.01, "joint {}: {off}", joint + 1);
    }
}
