//! Tests of `kinematics::inverse`.

use truegrind::kinematics::condition::Condition;
use truegrind::kinematics::inverse::{Inverse, Solution};
use truegrind::kinematics::model::{Joints, Model};
use truegrind::math::se3::{Pose, difference};

use super::arms::{SHEETS, generator, joints_within, perturbed, with_effects};

fn misses(model: &Model, condition: &Condition, target: &Pose, joints: &Joints) -> (f64, f64) {
    let error = difference(&model.forward(joints, condition), target);
    (error.fixed_rows::<3>(0).norm(), error.fixed_rows::<3>(3).norm())
}

fn assert_reaches(model: &Model, condition: &Condition, target: &Pose, solution: &Solution) {
    let (mm, rad) = misses(model, condition, target, &solution.joints);
    assert!(mm <= 1e-9 && rad <= 1e-12, "misses by {mm:e} mm and {rad:e} rad");
    assert_eq!(model.limits.violated(&solution.joints), None);
}

/// Largest distance of a joint from the same joint of another vector.
fn apart(a: &Joints, b: &Joints) -> f64 {
    (a - b).amax()
}

#[test]
fn every_branch_of_every_nominal_arm_reaches_the_pose_and_the_true_joints_are_among_them() {
    let condition = Condition::default();
    for sheet in SHEETS {
        let model = sheet.model();
        let inverse = Inverse::new(&model, &condition, &model);
        let mut random = generator(1);
        for k in 0..60 {
            let joints = joints_within(&model, &mut random);
            let target = model.forward(&joints, &condition);
            let all = inverse.all(&target);
            for solution in &all {
                assert_reaches(&model, &condition, &target, solution);
            }
            let nearest = all.iter().map(|s| apart(&s.joints, &joints)).fold(f64::INFINITY, f64::min);
            assert!(nearest < 1e-6, "{} pose {k}: {} solutions, nearest {nearest}", sheet.name, all.len());
        }
    }
}

#[test]
fn perturbed_arms_with_effects_are_solved_near_the_nominal_joints() {
    let condition = Condition { time_h: Some(1.0), payload_kg: Some(3.0), ..Condition::default() };
    for sheet in SHEETS {
        let nominal = sheet.model();
        let mut random = generator(2);
        let arm = with_effects(&perturbed(&nominal, &mut random, 0.5, 0.1), &mut random);
        let inverse = Inverse::new(&arm, &condition, &nominal);
        for k in 0..100 {
            let joints = joints_within(&arm, &mut random);
            let target = arm.forward(&joints, &condition);
            let solution = inverse
                .solve_near(&target, &joints.map(|q| q + 0.01))
                .unwrap_or_else(|e| panic!("{} pose {k}: {e}", sheet.name));
            let (mm, rad) = misses(&arm, &condition, &target, &solution.joints);
            assert!(mm <= 1e-9 && rad <= 1e-12, "{}: misses by {mm:e} mm and {rad:e} rad", sheet.name);
        }
    }
}
