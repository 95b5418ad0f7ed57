//! A draw-wire that watches an arm: each reading alone leaves outlet, zero and hook open by centimetres, and a scale that changes looks like links
//! that grew.

use truegrind_arm::estimated::Estimated;
use truegrind_calibration::identification::identify::{self, identify};
use truegrind_calibration::identification::start::candidate_frames;
use truegrind_calibration::identification::tolerance::Tolerance;
use truegrind_calibration::measurement::dataset::{Dataset, Reading};
use truegrind_calibration::measurement::simulation::recipe::Recipe;
use truegrind_calibration::measurement::{import, split};
use truegrind_calibration::tracking::{Alarm, Options, SCALE_NAME, State, Tracker};

use super::{nominal, settings};

const RECIPE: &str = r#"
robot = "abb-irb-1600-6-1.2"
seed = 9
[arm.random]
seed = 4
a_mm = 0.25
d_mm = 0.25
alpha_deg = 0.05
beta_deg = 0.05
theta_deg = 0.10
[poses]
kind = "random"
count = 144
min_deg = [-150.0, -50.0, -160.0, -180.0, -100.0, -180.0]
max_deg = [150.0, 100.0, 40.0, 180.0, 100.0, 180.0]
[sensor]
kind = "cable"
outlets_mm = [[1040.0, 240.0, 40.0]]
zeros_mm = [2.3]
hook_mm = [0.0, 0.0, 40.0]
[noise]
sigma_mm = 0.05
"#;

fn measured(arm: u64, seed: u64) -> Dataset {
    let mut recipe = Recipe::parse(RECIPE, "cable.toml").unwrap();
    recipe.seed = seed;
    recipe.arm.random.as_mut().unwrap().seed = arm;
    let simulation = recipe.simulate(nominal).unwrap();
    import::read("weeks.csv", simulation.csv.as_bytes(), &import::Options::default()).unwrap()
}

fn model(arm: u64) -> Estimated {
    let dataset = measured(arm, 1);
    let robot = nominal("abb-irb-1600-6-1.2").unwrap();
    let frames = candidate_frames(&dataset, &robot).unwrap().remove(0);
    let division = |d: &Dataset| split::random(d, 0.2, 0);
    let settings = identify::Options {
        tolerance: Tolerance { scale: Some(2e-4), learn_widths: true, ..Tolerance::default() },
        ..settings()
    };
    identify(&dataset, "abb-irb-1600-6-1.2", &robot, &frames, &division, &settings).unwrap().estimated
}

fn tracked(model: &Estimated, dataset: &Dataset, first_poses: usize) -> (Tracker, Vec<Alarm>) {
    let options = Options { first_poses, ..Options::default() };
    let mut tracker = Tracker::begin(model, "hash", dataset, &options).unwrap();
    let alarms = tracker.process_file(dataset).unwrap();
    (tracker, alarms)
}

#[test]
fn a_healthy_arm_raises_no_alarm_whatever_the_number_of_first_poses() {
    for arm in 1..3 {
        let model = model(arm);
        for seed in 5..8 {
            let dataset = measured(arm, seed);
            for first_poses in [30, 45, 60, 80] {
                let (tracker, alarms) = tracked(&model, &dataset, first_poses);
                let told: Vec<String> = alarms.iter().map(ToString::to_string).collect();
                assert!(told.is_empty(), "arm {arm}, rows {seed}, {first_poses} first poses: {told:?}");
                assert!(tracker.state().outliers <= 1 && !tracker.departure().unwrap().is_significant);
            }
        }
    }
}

#[test]
fn a_draw_wire_of_another_scale_is_told_as_one_and_not_as_longer_links() {
    let model = model(4);
    for error in [0.002, -0.001] {
        let mut dataset = measured(4, 2);
        for row in dataset.rows.iter_mut().skip(72) {
            let Reading::Cable(length) = &mut row.reading else { panic!("a cable") };
            *length = 2.3 + (*length - 2.3) * (1.0 + error);
        }
        let (tracker, alarms) = tracked(&model, &dataset, 30);
        assert_eq!(alarms.len(), 1, "{alarms:#?}");
        let alarm = &alarms[0];
        assert!(alarm.is_of_scale() && alarm.parameter == SCALE_NAME, "{alarm}");
        assert!((alarm.shift - error).abs() < 1e-4, "{alarm}");
        assert!(alarm.to_string().starts_with("the scale of the sensor") && alarm.to_string().contains(" %"));
        let departure = tracker.departure().unwrap();
        assert!(!departure.is_significant && departure.rms_mm < 0.3, "{departure:?}");
        // It is known after a stop, bit for bit.
        let state = State::from_toml(&tracker.state().to_toml().unwrap()).unwrap();
        let again = Tracker::resume(&model, state, "state.toml").unwrap();
        assert_eq!(again.deviations(), tracker.deviations());
        assert_eq!(again.name(model.order.len()), SCALE_NAME);
    }
}
