//! Bases that tilt and axes that wobble, against poses composed link by link.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use crate::arms::{SHEETS, generator, joints_within, perturbed, with_effects};
use truegrind_arm::condition::Condition;
use truegrind_arm::effect::Effect;
use truegrind_arm::effect::axis_wobble::AxisWobble;
use truegrind_arm::effect::base_tilt::{BaseTilt, TiltTerm};
use truegrind_arm::effect::link_twist::LinkTwist;
use truegrind_arm::model::Model;
use truegrind_math::se3::{Pose, difference};

/// The displacement and the turn of what stands at a point, about that point.
fn moved(shift: Vector3<f64>, turn: Vector3<f64>) -> Pose {
    Isometry3::from_parts(Translation3::from(shift), UnitQuaternion::from_scaled_axis(turn))
}

const SOFT: TiltTerm = TiltTerm { frame: None, about: None, tilt_rad_per_nm: 2e-6, sway_mm_per_nm: 1e-3 };

/// An arm with masses and nothing else.
fn bare(sheet: usize, seed: u64) -> Model {
    let mut random = generator(seed);
    let arm = with_effects(&perturbed(&SHEETS[sheet].model(), &mut random, 1.0, 0.5), &mut random);
    Model { effects: Vec::new(), ..arm }
}

#[test]
fn a_soft_base_turns_and_sways_under_masses_and_payload() {
    let mut random = generator(61);
    let load =
        Condition { payload_kg: Some(4.0), payload_centre_mm: [10.0, -20.0, 60.0], ..Condition::default() };
    for sheet in 0..SHEETS.len() {
        let arm = bare(sheet, 60);
        let lump =
            TiltTerm { frame: Some(3), about: Some([1, 0]), tilt_rad_per_nm: 3e-5, sway_mm_per_nm: 0.0 };
        let tilt = BaseTilt { deep: true, term: vec![SOFT, lump] };
        let soft = Model { effects: vec![Effect::BaseTilt(tilt)], ..arm.clone() };
        let q = joints_within(&arm, &mut random);
        let (mut pose, mut moment, mut of_lump) = (Pose::identity(), Vector3::zeros(), Vector3::zeros());
        let newton = arm.gravity * 9.80665e-3;
        for (i, (link, body)) in arm.links.iter().zip(arm.bodies.unwrap()).enumerate() {
            pose *= link.pose(arm.mapped(&q)[i]);
            let centre = pose * nalgebra::Point3::from(body.centre_mm);
            moment += body.mass_kg * centre.coords.cross(&newton);
            if i + 1 == 3 {
                of_lump = pose.translation.vector.cross(&newton);
            }
        }
        let held = pose * arm.flange * nalgebra::Point3::from(load.payload_centre_mm);
        moment += 4.0 * held.coords.cross(&newton);
        let of_lump = Vector3::new(of_lump.y, of_lump.x, 0.0) * 3e-5;
        let base = moved(arm.gravity.cross(&moment) * 1e-3, moment * 2e-6 + of_lump);
        let error = difference(&soft.forward(&q, &load), &(base * arm.forward(&q, &load)));
        assert!(error.fixed_rows::<3>(0).amax() < 1e-6, "{}: {error}", SHEETS[sheet].name);
        assert!(error.fixed_rows::<3>(3).amax() < 1e-9, "{}: {error}", SHEETS[sheet].name);
    }
}

#[test]
fn a_link_twists_and_the_axis_at_its_end_leans() {
    let mut random = generator(65);
    let still = Condition::default();
    for sheet in 0..SHEETS.len() {
        let arm = bare(sheet, 64);
        for joint in 0..5 {
            let twist = LinkTwist { joint, twist_rad: 2e-4, lean_rad: Some(5e-4) };
            let soft = Model { effects: vec![Effect::LinkTwist(twist)], ..arm.clone() };
            let q = joints_within(&arm, &mut random);
            // What stands in the base at the end of the link turns there; the rest of the arm goes along.
            let mut poses = vec![Pose::identity()];
            for (i, link) in arm.links.iter().enumerate() {
                poses.push(poses[i] * link.pose(arm.mapped(&q)[i]));
            }
            let (root, end) = (poses[joint], poses[joint + 1].translation.vector);
            let z = poses[joint + 1].rotation * Vector3::z();
            let angle = arm.mapped(&q)[joint] + arm.links[joint].theta_rad;
            let x = root.rotation * Vector3::new(angle.cos(), angle.sin(), 0.0);
            let (y, h) = (z.cross(&x), z.cross(&arm.gravity));
            let turn = x * (2e-4 * x.dot(&h)) + y * (5e-4 * y.dot(&h));
            let to_end = Pose::translation(end.x, end.y, end.z);
            let expected = to_end * moved(Vector3::zeros(), turn) * to_end.inverse() * poses[6] * arm.flange;
            let error = difference(&soft.forward(&q, &still), &expected);
            assert!(error.fixed_rows::<3>(0).amax() < 1e-6, "{}: {error}", SHEETS[sheet].name);
            assert!(error.fixed_rows::<3>(3).amax() < 1e-9, "{}: {error}", SHEETS[sheet].name);
        }
    }
}

#[test]
fn an_axis_wobbles_about_the_origin_of_its_frame() {
    let mut random = generator(63);
    let still = Condition::default();
    for sheet in 0..SHEETS.len() {
        let arm = bare(sheet, 62);
        for joint in 0..6 {
            let wobble = AxisWobble {
                joint,
                tilt_rad: [2e-4, -1e-4, 5e-5, 3e-4],
                radial_mm: Some([0.02, 0.01, -0.03, 0.04]),
            };
            let worn = Model { effects: vec![Effect::AxisWobble(wobble)], ..arm.clone() };
            let q = joints_within(&arm, &mut random);
            let mut pose = Pose::identity();
            for (i, link) in arm.links.iter().enumerate() {
                let angle = arm.mapped(&q)[i];
                if i == joint {
                    let (sin, cos) = (2.0 * angle).sin_cos();
                    let x = Vector3::new(link.theta_rad.cos(), link.theta_rad.sin(), 0.0);
                    let y = Vector3::z().cross(&x);
                    let turn = x * (2e-4 * cos - 1e-4 * sin) + y * (5e-5 * cos + 3e-4 * sin);
                    let shift = x * (0.02 * cos + 0.01 * sin) + y * (-0.03 * cos + 0.04 * sin);
                    pose *= moved(shift, turn);
                }
                pose *= link.pose(angle);
            }
            let error = difference(&worn.forward(&q, &still), &(pose * arm.flange));
            assert!(error.fixed_rows::<3>(0).amax() < 1e-8, "{}: {error}", SHEETS[sheet].name);
            assert!(error.fixed_rows::<3>(3).amax() < 1e-9, "{}: {error}", SHEETS[sheet].name);
        }
    }
}
