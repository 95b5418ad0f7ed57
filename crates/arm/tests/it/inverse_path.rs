//! Tests of `kinematics::inverse` along paths.

use truegrind_arm::condition::Condition;
use truegrind_arm::inverse::{Inverse, InverseError};
use truegrind_arm::model::Joints;
use truegrind_math::lanes::{Instructions, with_instructions};
use truegrind_math::se3::{Pose, difference};

use super::arms::{SHEETS, Sheet, even, generator, joints_within, perturbed, with_effects};

fn condition() -> Condition {
    Condition { time_h: Some(1.0), payload_kg: Some(3.0), ..Condition::default() }
}

/// A smooth path in joint space around `middle`, well inside a branch.
fn around(middle: &Joints, points: usize) -> Vec<Joints> {
    (0..points)
        .map(|i| {
            let t = i as f64 / points as f64 * std::f64::consts::TAU;
            Joints::from_fn(|j, _| middle[j] + 0.12 * (t * (1.0 + j as f64) + j as f64).sin())
        })
        .collect()
}

/// Joints away from limits and singularities.
fn comfortable(sheet: &Sheet, random: &mut rand_chacha::ChaCha8Rng) -> Joints {
    let model = sheet.model();
    let inverse = Inverse::new(&model, &Condition::default(), &model);
    for _ in 0..10_000 {
        let q = joints_within(&model, random);
        let away =
            (0..6).all(|j| q[j] > model.limits.min_rad[j] + 0.2 && q[j] < model.limits.max_rad[j] - 0.2);
        let distances = inverse.singularity_distances(&q).expect("a closed form");
        if away && distances.wrist > 0.35 && distances.elbow > 0.35 && distances.shoulder > 0.15 {
            return q;
        }
    }
    panic!("{} has no comfortable joints", sheet.name)
}

#[test]
fn a_path_is_solved_on_its_branch_by_every_arm_with_effects() {
    let mut random = generator(71);
    for sheet in SHEETS {
        let nominal = sheet.model();
        let arm = with_effects(&perturbed(&nominal, &mut random, 0.5, 0.1), &mut random);
        let inverse = Inverse::new(&arm, &condition(), &nominal);
        let joints = around(&comfortable(sheet, &mut random), 203);
        let targets: Vec<Pose> = joints.iter().map(|q| inverse.arm().forward(q)).collect();
        let solved = inverse.solve_path(&targets, &joints[0].map(|q| q + 0.01));
        assert_eq!(solved.len(), targets.len());
        for ((solution, q), target) in solved.iter().zip(&joints).zip(&targets) {
            let solution = solution.unwrap_or_else(|e| panic!("{}: {e}", sheet.name));
            assert!(
                (solution.joints - q).amax() < 1e-8,
                "{}: {} instead of {q}",
                sheet.name,
                solution.joints
            );
            let error = difference(&inverse.arm().forward(&solution.joints), target);
            assert!(error.fixed_rows::<3>(0).norm() <= 1e-9 && error.fixed_rows::<3>(3).norm() <= 1e-12);
            assert!(solution.iterations <= 5, "{} steps", solution.iterations);
        }
    }
}

#[test]
fn seeded_targets_get_the_bits_of_one_by_one_whatever_the_threads() {
    let mut random = generator(72);
    for sheet in SHEETS.iter().step_by(9) {
        let nominal = sheet.model();
        let arm = with_effects(&perturbed(&nominal, &mut random, 0.5, 0.1), &mut random);
        let inverse = Inverse::new(&arm, &condition(), &nominal);
        let seeds: Vec<Joints> = (0..1032).map(|_| joints_within(&arm, &mut random)).collect();
        let mut targets: Vec<Pose> =
            seeds.iter().map(|q| inverse.arm().forward(&q.map(|q| q + 0.01 * even(&mut random)))).collect();
        // Some that cannot be reached, and one that is no pose.
        for k in (0..targets.len()).step_by(275) {
            targets[k].translation.vector *= 40.0;
        }
        targets[50].translation.x = f64::NAN;
        let single: Vec<_> = targets.iter().zip(&seeds).map(|(t, q)| inverse.solve_near(t, q)).collect();
        for threads in [1, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let many = pool.install(|| inverse.solve_seeded(&targets, &seeds));
            assert_eq!(format!("{many:?}"), format!("{single:?}"));
        }
        assert_eq!(single[50], Err(InverseError::NotFinite));
        assert!(matches!(single[275], Err(InverseError::Unreachable { .. })), "{:?}", single[275]);
    }
}

#[test]
fn a_failed_target_leaves_the_rest_of_the_path() {
    let sheet = &SHEETS[0];
    let model = sheet.model();
    let inverse = Inverse::new(&model, &Condition::default(), &model);
    let joints = around(&comfortable(sheet, &mut generator(73)), 64);
    let mut targets: Vec<Pose> = joints.iter().map(|q| model.forward(q, &Condition::default())).collect();
    targets[20].translation.x = 1e5;
    let solved = inverse.solve_path(&targets, &joints[0]);
    for (k, solution) in solved.iter().enumerate() {
        match solution {
            Ok(solution) => assert!((solution.joints - joints[k]).amax() < 1e-8),
            Err(error) => {
                assert!(k == 20 && matches!(error, InverseError::Unreachable { .. }), "{k}: {error}")
            }
        }
    }
}

#[test]
fn a_path_of_long_strides_keeps_its_branch() {
    let mut random = generator(74);
    for sheet in SHEETS {
        let model = sheet.model();
        let inverse = Inverse::new(&model, &Condition::default(), &model);
        let joints: Vec<Joints> =
            around(&comfortable(sheet, &mut random), 400).into_iter().step_by(45).collect();
        let targets: Vec<Pose> = joints.iter().map(|q| model.forward(q, &Condition::default())).collect();
        let solved = inverse.solve_path(&targets, &joints[0]);
        for (solution, q) in solved.iter().zip(&joints) {
            let solution = solution.unwrap_or_else(|e| panic!("{}: {e}", sheet.name));
            assert!((solution.joints - q).amax() < 1e-8, "{}", sheet.name);
        }
    }
}

#[test]
fn through_the_wrist_singularity_the_joints_run_on() {
    let model = Sheet::named("abb-irb-120");
    let inverse = Inverse::new(&model, &Condition::default(), &model);
    // Axis 5 passes through zero; axes 4 and 6 stand still.
    let joints: Vec<Joints> =
        (0..=200).map(|k| Joints::from([0.2, 0.3, -0.2, 0.4, 0.2 - 0.002 * f64::from(k), -0.3])).collect();
    let targets: Vec<Pose> = joints.iter().map(|q| model.forward(q, &Condition::default())).collect();
    for (solution, target) in inverse.solve_path(&targets, &joints[0]).iter().zip(&targets) {
        let solution = solution.unwrap();
        let error = difference(&model.forward(&solution.joints, &Condition::default()), target);
        assert!(error.fixed_rows::<3>(0).norm() <= 1e-9 && error.fixed_rows::<3>(3).norm() <= 1e-12);
    }
}

#[test]
fn an_interpolated_orientation_costs_no_more_steps_than_any_other() {
    let model = Sheet::named("abb-irb-120");
    let inverse = Inverse::new(&model, &Condition::default(), &model);
    let joints: Vec<Joints> =
        (0..400).map(|k| Joints::from([0.2, 0.3, -0.2, 0.4, 0.9 - 0.001 * f64::from(k), -0.3])).collect();
    let poses: Vec<Pose> = joints.iter().map(|q| model.forward(q, &Condition::default())).collect();
    for (pair, q) in poses.windows(2).zip(&joints) {
        // Spherical interpolation over a small angle leaves a quaternion that is not quite of length 1.
        let rotation = pair[0].rotation.slerp(&pair[1].rotation, 0.5);
        let middle = pair[0].translation.vector.lerp(&pair[1].translation.vector, 0.5);
        let solution = inverse.solve_near(&Pose::from_parts(middle.into(), rotation), q).unwrap();
        assert!(solution.iterations <= 3, "{} steps", solution.iterations);
    }
}

/// The joints of a path, of seeded targets and their residuals are the same to the bit on every set of instructions.
#[test]
fn every_set_of_instructions_solves_to_the_same_bits() {
    let mut random = generator(79);
    for sheet in SHEETS {
        let nominal = sheet.model();
        let arm = with_effects(&perturbed(&nominal, &mut random, 0.5, 0.1), &mut random);
        let inverse = Inverse::new(&arm, &condition(), &nominal);
        let joints = around(&comfortable(sheet, &mut random), 43);
        let seeds: Vec<Joints> = joints.iter().map(|q| q.map(|q| q + 0.01)).collect();
        let targets: Vec<Pose> = joints.iter().map(|q| inverse.arm().forward(q)).collect();
        let found = |set| {
            with_instructions(set, || {
                (
                    inverse.solve_path(&targets, &seeds[0]),
                    inverse.solve_path_joints(&targets, &seeds[0]),
                    inverse.solve_seeded_joints(&targets, &seeds),
                    inverse.solve_offset_seeded(&targets, &seeds),
                )
            })
        };
        let alone = found(Instructions::Scalar);
        for set in Instructions::available() {
            assert_eq!(found(set), alone, "{}: {set:?}", sheet.name);
        }
    }
}
