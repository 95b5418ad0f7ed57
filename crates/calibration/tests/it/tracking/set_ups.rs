//! A tracker that is set up anew for each visit, as the column `station` says: no alarm, and changes of the arm are found as before.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use truegrind_calibration::measurement::dataset::{Dataset, Reading};
use truegrind_calibration::measurement::simulation::recipe::LinkDeviation;
use truegrind_calibration::tracking::{Options, State, TrackError, Tracker, first_poses};
use truegrind_math::se3::Pose;

use super::{measured, model};

/// Poses of a visit.
const VISIT: usize = 14;

/// Visits of an arm that loses the zero of joint 3 after some of them, each read from another place.
fn visits(count: usize, lost_after: usize) -> Vec<Dataset> {
    let lost = LinkDeviation { joint: 2, theta_deg: 0.05, ..LinkDeviation::default() };
    let days = [2, 3].map(|seed| [measured(seed, None), measured(seed, Some(lost))]);
    let visit = |visit: usize| {
        let day = &days[visit / 8][usize::from(visit >= lost_after)];
        let from = visit % 8 * VISIT;
        let mut rows = day.subset(&(from..from + VISIT).collect::<Vec<_>>());
        let k = visit as f64;
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.1 * k, 0.02, 0.7 * k));
        let moved = Pose::from_parts(Vector3::new(300.0 * k, -150.0 * k, 40.0).into(), turn);
        for row in rows.rows.iter_mut() {
            let Reading::Position(place) = &mut row.reading else { panic!("a position") };
            *place = (moved * Point3::from(*place)).coords;
        }
        rows.file = format!("week{visit:02}.csv");
        rows.station_names = vec![format!("w{visit:02}")];
        rows
    };
    (0..count).map(visit).collect()
}

fn begun(visits: &[Dataset]) -> Tracker {
    let options = Options::default();
    let first = first_poses(visits, options.first_poses).unwrap();
    Tracker::begin(model(), "hash", &first, &options).unwrap()
}

#[test]
fn a_sensor_that_was_set_up_anew_as_stated_raises_no_alarm() {
    let visits = visits(10, usize::MAX);
    let mut tracker = begun(&visits);
    for visit in &visits {
        let alarms = tracker.process_file(visit).unwrap();
        assert!(alarms.is_empty(), "{}: {alarms:#?}", visit.file);
    }
    assert_eq!((tracker.state().poses, tracker.state().outliers), (10 * VISIT, 0));
    assert!(!tracker.departure().unwrap().is_significant);
    // The same in one file after a stop.
    let mut whole = first_poses(&visits, usize::MAX).unwrap();
    whole.file = "all.csv".to_owned();
    let mut other = begun(&visits);
    for rows in [31, 45, 10 * VISIT] {
        let state = State::from_toml(&other.state().to_toml().unwrap()).unwrap();
        other = Tracker::resume(model(), state, "state").unwrap();
        let grown = whole.subset(&(0..rows).collect::<Vec<_>>());
        other.process_file(&grown).unwrap();
    }
    assert_eq!(other.deviations(), tracker.deviations());
}

#[test]
fn a_change_between_visits_is_found_though_the_sensor_moved_with_it() {
    let visits = visits(12, 6);
    let mut tracker = begun(&visits);
    let mut alarms = Vec::new();
    for visit in &visits {
        alarms.extend(tracker.process_file(visit).unwrap());
    }
    assert_eq!(alarms.len(), 1, "{alarms:#?}");
    let alarm = &alarms[0];
    assert!(
        alarm.parameter == "link3.theta" || alarm.alternatives.contains(&"link3.theta".to_owned()),
        "{alarm}"
    );
    assert_eq!(alarm.since_file, "week06.csv", "{alarm}");
    let theta = tracker.model().model.links[2].theta_rad - model().model.links[2].theta_rad;
    assert!((theta.to_degrees() - 0.05).abs() < 0.01, "{}", theta.to_degrees());
}

/// Three poses do not place a sensor: they wait, or are refused where no more can come.
#[test]
fn too_few_poses_of_a_set_up_wait_or_are_refused() {
    let mut visits = visits(3, usize::MAX);
    let whole = visits[2].clone();
    visits[2] = whole.subset(&[0, 1, 2]);
    let mut tracker = begun(&visits);
    for visit in &visits {
        tracker.process_file(visit).unwrap();
    }
    assert_eq!((tracker.state().poses, tracker.waiting(&visits[2])), (2 * VISIT, 3));
    tracker.process_file(&whole).unwrap();
    assert_eq!((tracker.state().poses, tracker.waiting(&whole)), (3 * VISIT, 0));
    let mut short = first_poses(&visits, usize::MAX).unwrap();
    let last = short.rows[2 * VISIT + 2].clone();
    short.rows.extend(
        (0..5).map(|_| truegrind_calibration::measurement::dataset::Row { anchor: 0, ..last.clone() }),
    );
    short.file = "short.csv".to_owned();
    let refused = begun(&visits).process_file(&short).unwrap_err();
    assert!(matches!(refused, TrackError::Station { rows: 3, .. }), "{refused}");
}
