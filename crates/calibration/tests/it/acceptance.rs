//! Acceptance by poses that a model was not fitted to.

mod path;

use nalgebra::{UnitQuaternion, Vector3};
use truegrind_arm::condition::Condition;
use truegrind_arm::effect::Effect;
use truegrind_arm::effect::thermal::Thermal;
use truegrind_arm::estimated::Estimated;
use truegrind_arm::model::Joints;
use truegrind_arm::robots;
use truegrind_calibration::acceptance::{AcceptError, Acceptance, Decision, Options, Uncertainty, accept};
use truegrind_calibration::identification::calibration::Frames;
use truegrind_calibration::identification::identify::{self, identify};
use truegrind_calibration::identification::register::starting_frames;
use truegrind_calibration::identification::tolerance::Tolerance;
use truegrind_calibration::measurement::dataset::{Dataset, Reading, Row, Sensor};
use truegrind_calibration::measurement::split;

/// Joints of pose `k` of a series, all over the range of an IRB 120.
fn pose(series: f64, k: usize) -> Joints {
    Joints::from_fn(|j, _| {
        let phase = (series + 1.618_034 * (k + 1) as f64 * (j + 1) as f64).fract();
        [2.4, 1.2, 1.0, 2.0, 1.4, 3.0][j] * (phase - 0.5)
    })
}

/// Rows of the arm of the data sheet, seen from its base.
fn rows(series: f64, count: usize) -> Vec<Row> {
    let nominal = robots::load("abb-irb-120").unwrap().model;
    let at = |k: usize| {
        let q = pose(series, k);
        let place = nominal.at_condition(&Condition::default()).forward(&q).translation.vector;
        // A hundredth of a millimetre, in one direction or another.
        let scatter = 0.01 * [-1.0, 1.0][k % 2];
        Row::new(k, q, Reading::Position(place.add_scalar(scatter)))
    };
    (0..count).map(at).collect()
}

fn dataset(rows: Vec<Row>) -> Dataset {
    Dataset::new("rows.csv", Sensor::Position, rows)
}

fn model(rows: &Dataset) -> Estimated {
    let nominal = robots::load("abb-irb-120").unwrap().model;
    let frames = starting_frames(rows, &nominal, &Tolerance::default(), false).unwrap();
    let split = |data: &Dataset| split::random(data, 0.2, 0);
    let options = identify::Options::default();
    identify(rows, "abb-irb-120", &nominal, &frames, &split, &options).unwrap().estimated
}

fn options(tolerance_mm: f64) -> Options {
    Options {
        tolerance_mm,
        uncertainty_mm: Some(0.02),
        tolerance_rad: None,
        uncertainty_rad: None,
        frames: None,
        seed: 0,
    }
}

#[test]
fn the_decision_leaves_room_for_the_uncertainty() {
    let model = model(&dataset(rows(0.1, 120)));
    let other = dataset(rows(0.7, 110));
    let of = |tolerance_mm: f64| accept(&other, &model, &options(tolerance_mm)).unwrap();
    let found: Acceptance = of(1.0);
    let largest = found.model.max;
    assert!((0.005..0.05).contains(&largest), "{largest}");
    assert_eq!((found.poses, found.rows, found.uncertainty), (110, 110, Uncertainty::Stated));
    assert_eq!(found.decision, Decision::Accepted);
    assert_eq!(of(largest + 0.021).decision, Decision::Accepted);
    assert_eq!(of(largest + 0.019).decision, Decision::Open);
    if largest > 0.021 {
        assert_eq!(of(largest - 0.021).decision, Decision::Refused);
    }
    // Too few poses decide nothing; readings of one pose are one pose.
    let few = accept(&dataset(rows(0.7, 99)), &model, &options(1.0)).unwrap();
    assert_eq!(few.decision, Decision::NotEvaluated);
    let mut again = rows(0.7, 60);
    again.extend(rows(0.7, 60));
    assert_eq!(accept(&dataset(again), &model, &options(1.0)).unwrap().poses, 60);
    assert!(matches!(accept(&other, &model, &options(-1.0)), Err(AcceptError::Length { .. })));
}

/// A cable sees one of the three coordinates of an error: an arm can miss a tolerance of its position by it, but not meet one. Simulated, arms
/// were accepted whose largest error was 1.4 times the tolerance.
#[test]
fn cables_refuse_an_arm_but_do_not_accept_one() {
    let model = model(&dataset(rows(0.1, 120)));
    let nominal = robots::load("abb-irb-120").unwrap().model;
    let outlet = Vector3::new(900.0, 200.0, 100.0);
    let by_cable = |off_mm: f64| {
        let read = |k: usize| {
            let q = pose(0.7, k);
            let place = nominal.at_condition(&Condition::default()).forward(&q).translation.vector;
            let length_mm = (place - outlet).norm() + off_mm * (k % 2) as f64;
            Row::new(k, q, Reading::Cable(length_mm))
        };
        Dataset::new("cable.csv", Sensor::Cable, (0..110).map(read).collect::<Vec<_>>())
    };
    let found = accept(&by_cable(0.0), &model, &options(1.0)).unwrap();
    assert!(found.model.max < 0.1, "{:?}", found.model);
    assert_eq!((found.decision, found.overall()), (Decision::Accepted, Decision::Open));
    let found = accept(&by_cable(3.0), &model, &options(1.0)).unwrap();
    assert_eq!(found.overall(), Decision::Refused, "{:?}", found.model);
}

/// Without an uncertainty nothing is accepted, but an error beyond the tolerance is refused whatever the uncertainty.
#[test]
fn an_unknown_uncertainty_accepts_nothing() {
    let model = model(&dataset(rows(0.1, 120)));
    let other = dataset(rows(0.7, 110));
    let of = |tolerance_mm: f64| {
        accept(&other, &model, &Options { uncertainty_mm: None, ..options(tolerance_mm) }).unwrap()
    };
    let found = of(1.0);
    assert_eq!((found.uncertainty, found.decision), (Uncertainty::Unknown, Decision::Open));
    assert_eq!(of(0.5 * found.model.max).decision, Decision::Refused);
}

/// Programs are corrected for the arm as warm as in the rows of the fit: later rows without a clock judge that arm, not a cold one.
#[test]
fn an_arm_that_had_warmed_up_is_not_judged_as_a_cold_one() {
    let mut model = model(&dataset(rows(0.1, 120)));
    model.model.effects.push(Effect::ThermalDrift(Thermal {
        growth: 1e-3,
        time_constant_h: 0.5,
        start_h: 0.0,
        growth_per_k: 0.0,
        reference_c: 20.0,
    }));
    model.condition.time_h = Some(2.0);
    let warm = model.model.at_condition(&model.condition);
    let mut other = rows(0.7, 110);
    for row in &mut other {
        row.reading = Reading::Position(warm.forward(&row.joints).translation.vector);
    }
    let found = accept(&dataset(other.clone()), &model, &options(0.1)).unwrap();
    assert!(found.model.max < 0.001, "{:?}", found.model);
    assert_eq!((found.decision, found.conditions), (Decision::Accepted, [None; 3]));
    // A clock counts.
    for row in &mut other {
        row.condition = Condition { time_h: Some(0.0), ..Condition::default() }.into();
    }
    let cold = accept(&dataset(other), &model, &options(0.1)).unwrap();
    assert_eq!((cold.decision, cold.conditions[0]), (Decision::Refused, Some([0.0; 2])));
}

/// An error that is stated of rows of the fit is none: whatever the file is called, and if rows are left out.
#[test]
fn rows_of_the_fit_are_noticed() {
    let fitted = rows(0.1, 150);
    let model = model(&dataset(fitted.clone()));
    let part = dataset(fitted[..140].to_vec());
    assert!(matches!(accept(&part, &model, &options(1.0)), Err(AcceptError::RowsOfTheFit { .. })));
    let mut mixed = rows(0.7, 120);
    mixed.extend_from_slice(&fitted[..20]);
    assert!(accept(&dataset(mixed), &model, &options(1.0)).is_ok());
}

/// Pose accuracy is the way to the barycentre, repeatability the mean distance from it and three standard deviations.
#[test]
fn cycles_give_accuracy_and_repeatability() {
    let model = model(&dataset(rows(0.1, 120)));
    let nominal = &model.model;
    let mut cycled = rows(0.7, 100);
    for pose_of in 0..5 {
        let q = pose(0.3, pose_of);
        let place = nominal.at_condition(&Condition::default()).forward(&q).translation.vector;
        for cycle in 0..30 {
            let mut seen = place;
            seen.y += 0.1;
            seen.x += 0.03 * [-1.0, 1.0][cycle % 2];
            cycled.push(Row::new(cycled.len(), q, Reading::Position(seen)));
        }
    }
    let stated = Options { frames: Some(Frames::at_origin(1)), ..options(1.0) };
    let found = accept(&dataset(cycled.clone()), &model, &stated).unwrap();
    let cycles = found.cycles.unwrap();
    assert_eq!((cycles.poses, cycles.cycles, found.most_cycles), (5, 30, 30));
    assert!((cycles.accuracy_mm - 0.1).abs() < 1e-9, "{cycles:?}");
    assert!((cycles.repeatability_mm - 0.03).abs() < 1e-9, "{cycles:?}");
    // One cycle less, and there is nothing to be said.
    cycled.pop();
    assert!(accept(&dataset(cycled), &model, &stated).unwrap().cycles.is_none());
}

/// Rows of the arm of the data sheet, seen as poses from its base, each turned by `turn_rad` about an axis of its own.
fn poses(series: f64, count: usize, turn_rad: f64) -> Vec<Row> {
    let nominal = robots::load("abb-irb-120").unwrap().model;
    let at = |k: usize| {
        let q = pose(series, k);
        let mut seen = nominal.at_condition(&Condition::default()).forward(&q);
        let axis =
            Vector3::from_fn(|i, _| ((k + 1) as f64 * [0.31, 0.57, 0.83][i]).fract() - 0.5).normalize();
        seen.rotation = UnitQuaternion::new(axis * turn_rad) * seen.rotation;
        Row::new(k, q, Reading::Pose(seen.into()))
    };
    (0..count).map(at).collect()
}

/// The orientation is judged by the rule of the position, and only where it was measured and a tolerance was stated.
#[test]
fn the_orientation_is_judged_as_the_position_is() {
    let model = model(&dataset(rows(0.1, 120)));
    let (turn, u) = (0.001, 0.0002);
    let other = Dataset::new("poses.csv", Sensor::Pose, poses(0.7, 110, turn));
    let stated = Options {
        uncertainty_rad: Some(u),
        // The model comes from positions: of the flange it knows no more than the data sheet.
        frames: Some(Frames::at_origin(1)),
        ..options(1.0)
    };
    let of = |tolerance_rad: Option<f64>| {
        accept(&other, &model, &Options { tolerance_rad, ..stated.clone() }).unwrap()
    };
    let told = of(None);
    let turns = told.orientation.as_ref().unwrap();
    assert_eq!(
        (turns.decision, told.overall(), turns.errors_rad.len()),
        (Decision::NotEvaluated, Decision::Accepted, 110)
    );
    // The arm of the data sheet sees exactly the turn that was put in.
    assert!(
        (turns.nominal.max - turn).abs() < 1e-12 && (turns.nominal.mean - turn).abs() < 1e-12,
        "{:?}",
        turns.nominal
    );
    assert!(turns.nominal.standard_deviation < 1e-12);
    let largest = turns.model.max;
    assert!(largest > 0.9 * turn && largest < 2.0 * turn, "{largest}");
    for (tolerance, expected) in [
        (largest + 1.1 * u, Decision::Accepted),
        (largest + 0.9 * u, Decision::Open),
        (largest - 0.9 * u, Decision::Open),
        (largest - 1.1 * u, Decision::Refused),
    ] {
        let found = of(Some(tolerance));
        assert_eq!(found.orientation.as_ref().unwrap().decision, expected, "{tolerance}");
        assert_eq!((found.overall(), found.decision), (expected, Decision::Accepted), "{tolerance}");
    }
    // A position that fails is not saved by its orientation.
    let tight = Options {
        tolerance_mm: 1e-6,
        uncertainty_mm: Some(1e-9),
        tolerance_rad: Some(0.1),
        ..stated.clone()
    };
    let found = accept(&other, &model, &tight).unwrap();
    assert_eq!((found.decision, found.overall()), (Decision::Refused, Decision::Refused));
    // Too few poses, and an orientation that nobody measured.
    let few = Dataset::new("poses.csv", Sensor::Pose, poses(0.7, 99, turn));
    let asked = Options { tolerance_rad: Some(0.1), ..stated.clone() };
    assert_eq!(accept(&few, &model, &asked).unwrap().overall(), Decision::NotEvaluated);
    let places = accept(&dataset(rows(0.7, 110)), &model, &asked).unwrap();
    assert!(places.orientation.is_none());
    assert_eq!((places.decision, places.overall()), (Decision::Accepted, Decision::NotEvaluated));
    let none = Options { tolerance_rad: Some(-0.1), ..stated };
    assert!(matches!(accept(&other, &model, &none), Err(AcceptError::Angle { .. })));
}

/// Without a stated frame, each orientation is judged by one that has not seen it; repeated poses tell the uncertainty.
#[test]
fn the_uncertainty_of_the_orientation_comes_from_repeats() {
    let model = model(&dataset(rows(0.1, 120)));
    let mut seen = poses(0.7, 110, 0.0005);
    let sigma = 0.0003;
    for k in 0..40 {
        let mut again = seen[k].clone();
        let Reading::Pose(pose) = &mut again.reading else { panic!("a pose") };
        pose.rotation *= UnitQuaternion::new(Vector3::x() * sigma * 2_f64.sqrt() * [-1.0, 1.0][k % 2]);
        seen.push(again);
    }
    let data = Dataset::new("poses.csv", Sensor::Pose, seen);
    let found = accept(&data, &model, &Options { tolerance_rad: Some(0.01), ..options(1.0) }).unwrap();
    let turns = found.orientation.unwrap();
    assert_eq!((turns.uncertainty, turns.decision), (Uncertainty::Repeats, Decision::Accepted));
    // Two readings that differ by d scatter by d / √2: forty pairs, three angles each.
    let scatter = turns.scatter.unwrap();
    assert!((scatter.sigma - sigma).abs() < 1e-9 && scatter.freedom == 120, "{scatter:?}");
    assert!((turns.uncertainty_rad / sigma - 2.0205).abs() < 1e-3, "{}", turns.uncertainty_rad);
    assert!(turns.model.max < 0.003 && turns.model.rmse > 0.0003, "{:?}", turns.model);
}

/// Whatever their number, poses that show little of an arm do not accept it; those of a usual working volume do.
#[test]
fn poses_of_a_small_part_of_the_arm_accept_nothing() {
    let model = model(&dataset(rows(0.1, 120)));
    // The series of the poses, drawn together about a pose.
    let about = |share: f64| {
        let nominal = robots::load("abb-irb-120").unwrap().model;
        let centre = Joints::from([0.1, 0.3, 0.2, 0.1, 0.8, 0.2]);
        let near = |row: Row| {
            let q = centre + share * row.joints;
            let place = nominal.at_condition(&Condition::default()).forward(&q).translation.vector;
            Row::new(row.number, q, Reading::Position(place.add_scalar(0.01 * [-1.0, 1.0][row.number % 2])))
        };
        dataset(rows(0.7, 110).into_iter().map(near).collect())
    };
    let mut before = 1.0;
    for (share, overall) in [
        (0.6, Decision::Accepted),
        (0.35, Decision::Accepted),
        (0.02, Decision::Open),
        (0.002, Decision::Open),
    ] {
        let found = accept(&about(share), &model, &options(1.0)).unwrap();
        assert_eq!(
            (found.decision, found.overall()),
            (Decision::Accepted, overall),
            "{share}: {:?}",
            found.tested
        );
        assert!(found.tested.share < before && found.is_registered, "{share}: {:?}", found.tested);
        assert!(found.is_nominal_within(), "the arm is that of the data sheet");
        before = found.tested.share;
    }
}

/// A stated uncertainty that repeated poses refute does not count.
#[test]
fn the_larger_of_the_stated_and_the_seen_uncertainty_counts() {
    let model = model(&dataset(rows(0.1, 120)));
    let mut twice = rows(0.7, 110);
    for k in 0..110 {
        let Reading::Position(at) = twice[k].reading.clone() else { panic!("a position") };
        // Second readings 0.2 mm away.
        let away = Vector3::from_fn(|axis, _| 0.2 * [-1.0, 1.0][(k / 3 + axis) % 2] / 3f64.sqrt());
        twice.push(Row::new(110 + k, twice[k].joints, Reading::Position(at + away)));
    }
    let twice = dataset(twice);
    let of = |uncertainty_mm| accept(&twice, &model, &Options { uncertainty_mm, ..options(0.25) }).unwrap();
    let (unstated, low, high) = (of(None), of(Some(0.005)), of(Some(1.0)));
    assert_eq!((low.uncertainty, low.stated_mm), (Uncertainty::AboveStated, Some(0.005)));
    assert_eq!((low.uncertainty_mm, low.decision), (unstated.uncertainty_mm, unstated.decision));
    assert!(unstated.scatter.unwrap().coverage_factor() < 2.01, "{:?}", unstated.scatter);
    assert_eq!((high.uncertainty, high.uncertainty_mm), (Uncertainty::Stated, 1.0));
    assert_ne!(low.overall(), Decision::Accepted);
}

/// The scatter of one pair is known by three degrees of freedom: its factor is that of Student's t (GUM, table G.2), and a stated
/// uncertainty is not refuted by a pair that scatters more by chance.
#[test]
fn one_repeated_pair_has_a_larger_factor() {
    let model = model(&dataset(rows(0.1, 120)));
    let of = |apart_mm: f64, uncertainty_mm| {
        let mut all = rows(0.7, 110);
        let Reading::Position(at) = all[5].reading.clone() else { panic!("a position") };
        all.push(Row::new(110, all[5].joints, Reading::Position(at + Vector3::z() * apart_mm)));
        accept(&dataset(all), &model, &Options { uncertainty_mm, ..options(1.0) }).unwrap()
    };
    let sigma = 0.03 / 2f64.sqrt();
    let unstated = of(0.03, None);
    assert_eq!(unstated.scatter.unwrap().freedom, 3);
    assert!((unstated.uncertainty_mm / sigma - 3.307).abs() < 2e-3, "{}", unstated.uncertainty_mm);
    let by_chance = of(0.03, Some(0.03));
    assert!((by_chance.uncertainty_mm / sigma - 2.0).abs() < 1e-6, "{}", by_chance.uncertainty_mm);
    // An absurdly small statement gains nothing.
    assert_eq!(of(0.03, Some(1e-6)).uncertainty_mm, unstated.uncertainty_mm);
}
