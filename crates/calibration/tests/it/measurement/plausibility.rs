//! Wrong units and conventions are noticed by the arm itself and named.

use nalgebra::{Quaternion, UnitQuaternion};
use truegrind_arm::model::{Joints, Model};
use truegrind_calibration::measurement::convention::AngleConvention;
use truegrind_calibration::measurement::dataset::{Dataset, Reading};
use truegrind_calibration::measurement::plausibility::{
    AngleUnit, ComparedReading, LengthUnit, Orientation, UnitSuspicion, implausible_payload, plausibility,
};

use super::simulation::{CABLE, SIX, TRACKER, measure, random};

/// Deviations of a real arm: frames alone leave some millimetre.
const WORN: &str = "[arm.random]\nseed = 3\na_mm = 0.3\nd_mm = 0.3\nalpha_deg = 0.05\nbeta_deg = 0.05\n\
    theta_deg = 0.15\n[noise]\nsigma_mm = 0.05\n";

fn arm() -> Model {
    truegrind_arm::robots::load("abb-irb-120").unwrap().model
}

fn sensors() -> Vec<Dataset> {
    // Only a pose has an orientation that can be noisy.
    [(CABLE, ""), (TRACKER, ""), (SIX, "sigma_deg = 0.01\n")]
        .map(|(sensor, noise)| measure(&random(60, &format!("{sensor}{WORN}{noise}"))).1)
        .to_vec()
}

fn scaled(data: &Dataset, by: f64) -> Dataset {
    let mut out = data.clone();
    for row in &mut out.rows {
        match &mut row.reading {
            Reading::Cable(l) => *l *= by,
            Reading::Position(p) => *p *= by,
            Reading::Pose(pose) => pose.translation.vector *= by,
        }
    }
    out
}

fn one(data: &Dataset) -> UnitSuspicion {
    let mut found = plausibility(data, &arm(), AngleConvention::Logged);
    assert_eq!(found.len(), 1, "{:?} {found:?}", data.sensor);
    found.remove(0)
}

#[test]
fn a_proper_file_is_not_doubted() {
    for data in sensors() {
        assert_eq!(plausibility(&data, &arm(), AngleConvention::Logged), []);
    }
    let (_, data) = measure(
        &std::fs::read_to_string(concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../tests/data/irb120-rounded.toml"
        ))
        .unwrap(),
    );
    assert_eq!(plausibility(&data, &arm(), AngleConvention::Logged), []);
}

#[test]
fn lengths_in_other_units_are_named() {
    for data in sensors() {
        for (unit, words) in [
            (LengthUnit::Metres, "metres: read that way"),
            (LengthUnit::Inches, "inches"),
            (LengthUnit::Centimetres, "centimetres"),
        ] {
            let found = one(&scaled(&data, 1.0 / unit.millimetres()));
            assert_eq!((found.likely.lengths, found.compared), (unit, ComparedReading::Sensor));
            assert_eq!(found.differences().len(), 1);
            let message = found.to_string();
            assert!(message.contains(words) && message.contains("multiply"), "{message}");
        }
    }
}

#[test]
fn radians_are_named() {
    for mut data in sensors() {
        // What an import makes of radians that it takes for degrees.
        data.rows.iter_mut().for_each(|row| row.joints = row.joints.map(f64::to_radians));
        let found = one(&data);
        assert_eq!(found.likely.angles, AngleUnit::Radians, "{found:?}");
        assert!(found.to_string().contains("q1 to q6 look like radians"));
        let both = one(&scaled(&data, 1e-3));
        assert_eq!((both.likely.angles, both.likely.lengths), (AngleUnit::Radians, LengthUnit::Metres));
        assert_eq!(both.differences().len(), 2);
    }
}

#[test]
fn dh_angles_are_named_and_taken_back() {
    let model = arm();
    for data in sensors() {
        let mut dh = data.clone();
        for row in &mut dh.rows {
            row.joints = model.joint_map * row.joints + Joints::from_fn(|j, _| model.links[j].theta_rad);
        }
        let found = one(&dh);
        assert_eq!(found.likely.convention, AngleConvention::Dh, "{found:?}");
        assert!(found.to_string().contains("--angles dh"));
        assert_eq!(plausibility(&dh, &model, AngleConvention::Dh), []);
        let back = AngleConvention::Dh.apply(dh, &model).unwrap();
        for (a, b) in back.rows.iter().zip(&data.rows) {
            assert!((a.joints - b.joints).amax() < 1e-12);
        }
        let wrongly = plausibility(&data, &model, AngleConvention::Dh);
        assert_eq!(wrongly[0].likely.convention, AngleConvention::Logged);
        assert!(wrongly[0].to_string().contains("--angles logged"));
    }
}

#[test]
fn quaternions_in_another_order_are_named() {
    let data = sensors().remove(2);
    let turned = |change: fn(UnitQuaternion<f64>) -> UnitQuaternion<f64>| {
        let mut out = data.clone();
        for row in &mut out.rows {
            if let Reading::Pose(pose) = &mut row.reading {
                pose.rotation = change(pose.rotation);
            }
        }
        one(&out)
    };
    // x, y, z, w in the columns of w, x, y, z.
    let last = turned(|q| UnitQuaternion::from_quaternion(Quaternion::new(q.i, q.j, q.k, q.w)));
    assert_eq!(last.likely.orientation, Orientation::ScalarLast);
    assert!(last.to_string().contains("scalar-last"));
    assert_eq!(turned(|q| q.inverse()).likely.orientation, Orientation::Inverted);
}

#[test]
fn too_few_rows_are_not_judged() {
    let (_, data) = measure(&random(5, CABLE));
    assert_eq!(plausibility(&scaled(&data, 1e-3), &arm(), AngleConvention::Logged), []);
}

/// A payload in grams is far above what the arm carries; one that is only somewhat too heavy is the user's matter.
#[test]
fn a_payload_in_grams_is_named() {
    let mut data = sensors().remove(1);
    let mut logged = |kg: f64| {
        for row in &mut data.rows {
            std::sync::Arc::make_mut(&mut row.condition).payload_kg = Some(kg);
        }
        implausible_payload(&data, 3.0).map(|suspicion| suspicion.to_string())
    };
    assert_eq!(logged(1.5), None);
    assert_eq!(logged(4.5), None);
    let grams = logged(1500.0).unwrap();
    assert!(grams.contains("a payload of 1500 kg, but the arm is rated for 3 kg"), "{grams}");
    assert!(grams.contains("row 2:") && grams.contains("looks like grams: divide it by 1000"), "{grams}");
}
