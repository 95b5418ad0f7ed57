//! What explains poses that fit no arm is told as it is of positions.

use nalgebra::{Quaternion, Translation3, UnitQuaternion, Vector3};
use truegrind_arm::robots;
use truegrind_calibration::diagnosis::diagnose::{self, diagnose};
use truegrind_calibration::identification::identify::{Options, identify};
use truegrind_calibration::measurement::dataset::{Dataset, Reading, Sensor};
use truegrind_calibration::measurement::split;
use truegrind_math::se3::Pose;

use crate::diagnosis::scenarios::frames;
use crate::diagnosis::simulator::{Log, Setup, run};

/// The poses that a camera measures of an arm that differs from its data sheet.
pub(super) fn measured_poses(seed: u64) -> Dataset {
    let nominal = robots::load("abb-irb-120").unwrap().model;
    let mut actual = nominal.clone();
    for (joint, link) in actual.links.iter_mut().enumerate() {
        let by = joint as f64 - 2.5;
        link.a_mm += 0.2 * by;
        link.d_mm -= 0.1 * by;
        link.theta_rad += 3e-4 * by;
    }
    let setup = Setup {
        sensor: Sensor::Position,
        rows: 120,
        sigma_mm: 0.03,
        dirty: false,
        seed,
        log: Log::default(),
    };
    let mut out = run(&nominal, &[], &setup).dataset;
    out.sensor = Sensor::Pose;
    let base_from_sensor = Pose::from_parts(
        Translation3::new(1800.0, -700.0, 300.0),
        UnitQuaternion::from_euler_angles(0.1, -0.2, 2.0),
    );
    let flange_from_target = Pose::from_parts(
        Translation3::new(15.0, -8.0, 60.0),
        UnitQuaternion::from_euler_angles(0.5, 0.3, -1.0),
    );
    for (k, row) in out.rows.iter_mut().enumerate() {
        let mut seen =
            base_from_sensor.inverse() * actual.forward(&row.joints, &row.condition) * flange_from_target;
        // Some hundredths of a millimetre of noise.
        seen.translation.vector +=
            Vector3::from_fn(|axis, _| 0.04 * (1.7 * k as f64 + 2.1 * axis as f64).sin());
        row.reading = Reading::Pose(Box::new(seen));
    }
    out
}

/// Poses with other positions and quaternions (w, x, y, z).
fn misread(place: impl Fn(Vector3<f64>) -> Vector3<f64>, turn: impl Fn([f64; 4]) -> [f64; 4]) -> Dataset {
    let mut out = measured_poses(81);
    for row in out.rows.iter_mut() {
        let Reading::Pose(pose) = &row.reading else { unreachable!("a camera measures poses") };
        let [w, x, y, z] = turn([pose.rotation.w, pose.rotation.i, pose.rotation.j, pose.rotation.k]);
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        let place = Translation3::from(place(pose.translation.vector));
        row.reading = Reading::Pose(Box::new(Pose::from_parts(place, turn)));
    }
    out
}

/// Why both verbs refuse a file.
fn refused(dataset: &Dataset) -> [String; 2] {
    let (arm, options) = (robots::load("abb-irb-120").unwrap().model, Options::default());
    let frames = frames(dataset, &arm);
    let share = |rows: &Dataset| split::random(rows, options.held_out, options.seed);
    let identified = identify(dataset, "abb-irb-120", &arm, &frames, &share, &options);
    let diagnosed = diagnose(dataset, "abb-irb-120", &arm, &frames, &diagnose::Options::default(), &|_| {});
    [identified.err().unwrap().to_string(), diagnosed.err().unwrap().to_string()]
}

#[test]
fn positions_that_are_a_mirror_image_are_told() {
    let swapped = misread(|p| Vector3::new(p.y, p.x, p.z), |q| q);
    let negated = misread(|p| Vector3::new(p.x, p.y, -p.z), |q| q);
    for told in [refused(&swapped), refused(&negated)].concat() {
        assert!(told.contains("two of measured_x, measured_y and measured_z are swapped"), "{told}");
    }
}

/// The remedy that is told for a left-handed frame makes a right-handed one, whichever axis was mirrored.
#[test]
fn a_left_handed_frame_is_told_with_its_remedy() {
    let upside_down = misread(|p| Vector3::new(p.x, p.y, -p.z), |[w, x, y, z]| [w, -x, -y, z]);
    let swapped = misread(|p| Vector3::new(p.y, p.x, p.z), |[w, x, y, z]| [w, -y, -x, -z]);
    for told in [refused(&upside_down), refused(&swapped)].concat() {
        assert!(told.contains("left-handed") && told.contains("measured_qx and measured_qz"), "{told}");
    }
    let mended = misread(|p| Vector3::new(p.x, -p.y, -p.z), |[w, x, y, z]| [w, x, -y, -z]);
    let (arm, options) = (robots::load("abb-irb-120").unwrap().model, Options::default());
    let share = |rows: &Dataset| split::random(rows, options.held_out, options.seed);
    identify(&mended, "abb-irb-120", &arm, &frames(&mended, &arm), &share, &options).unwrap();
}

#[test]
fn swapped_joints_are_told_of_poses_too() {
    let mut swapped = misread(|p| p, |q| q);
    swapped.rows.iter_mut().for_each(|row| row.joints.swap_rows(1, 2));
    for told in refused(&swapped) {
        assert!(told.contains("joints 2 and 3 change places"), "{told}");
    }
}
