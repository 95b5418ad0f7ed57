//! Tests of `kinematics::inverse` for single targets.

use nalgebra::{UnitQuaternion, Vector3};
use truegrind_arm::condition::Condition;
use truegrind_arm::inverse::configuration::{Configuration, configuration};
use truegrind_arm::inverse::{Inverse, InverseError, Singularity, Solution};
use truegrind_arm::model::{Joints, Limited, Model};
use truegrind_math::se3::{Pose, difference};

use super::arms::{SHEETS, Sheet, even, generator, joints_within, perturbed, with_effects};

fn misses(model: &Model, condition: &Condition, target: &Pose, joints: &Joints) -> (f64, f64) {
    let error = difference(&model.forward(joints, condition), target);
    (error.fixed_rows::<3>(0).norm(), error.fixed_rows::<3>(3).norm())
}

fn assert_reaches(model: &Model, condition: &Condition, target: &Pose, solution: &Solution) {
    let (mm, rad) = misses(model, condition, target, &solution.joints);
    assert!(mm <= 1e-9 && rad <= 1e-12, "misses by {mm:e} mm and {rad:e} rad");
    let limits = &model.limits;
    for j in 0..6 {
        let q = solution.joints[j];
        assert!(q >= limits.min_rad[j] - 1e-9 && q <= limits.max_rad[j] + 1e-9, "joint {j} at {q}");
    }
}

fn loaded() -> Condition {
    Condition { time_h: Some(1.0), payload_kg: Some(3.0), ..Condition::default() }
}

#[test]
fn every_branch_of_every_nominal_arm_reaches_the_pose_and_the_true_joints_are_among_them() {
    let condition = Condition::default();
    for sheet in SHEETS {
        let model = sheet.model();
        let inverse = Inverse::new(&model, &condition, &model);
        let mut random = generator(1);
        let poses = if sheet.name.starts_with("universal") { 6 } else { 25 };
        for k in 0..poses {
            let joints = joints_within(&model, &mut random);
            let target = model.forward(&joints, &condition);
            let all = inverse.all(&target);
            for solution in &all {
                assert_reaches(&model, &condition, &target, solution);
            }
            let nearest = all.iter().map(|s| (s.joints - joints).amax()).fold(f64::INFINITY, f64::min);
            assert!(nearest < 1e-6, "{} pose {k}: {} solutions, nearest {nearest}", sheet.name, all.len());
            for (i, a) in all.iter().enumerate() {
                assert!(
                    all[..i].iter().all(|b| (a.joints - b.joints).amax() > 1e-6),
                    "{}: twice",
                    sheet.name
                );
            }
        }
    }
}

#[test]
fn an_arm_without_limits_in_the_way_has_eight_branches_told_apart() {
    for name in
        ["abb-irb-120", "abb-irb-4600-60-2.05", "staubli-tx60", "kuka-kr10-r1420", "universal-robots-ur5"]
    {
        let mut model = Sheet::named(name);
        model.limits.min_rad = [-std::f64::consts::PI; 6];
        model.limits.max_rad = [std::f64::consts::PI; 6];
        let inverse = Inverse::new(&model, &Condition::default(), &model);
        // Near the base, where the arm reaches over its shoulder too.
        let joints = Joints::from([0.3, -0.5, 0.9, 0.4, 0.8, -0.7]);
        let target = model.forward(&joints, &Condition::default());
        let mut branches: Vec<_> =
            inverse.all(&target).iter().map(|s| inverse.branch(&s.joints).unwrap()).collect();
        branches.sort();
        branches.dedup();
        assert!(branches.len() == 8 || branches.len() == 4, "{name}: {branches:?}");
        assert!(branches.contains(&inverse.branch(&joints).unwrap()), "{name}");
    }
}

#[test]
fn every_turn_of_a_joint_is_a_solution_of_its_own() {
    let model = Sheet::named("abb-irb-120");
    let inverse = Inverse::new(&model, &Condition::default(), &model);
    let joints = Joints::from([0.3, 0.2, 0.1, 0.4, 0.8, 0.2]);
    let all = inverse.all(&model.forward(&joints, &Condition::default()));
    // Axis 6 runs from −400° to 400°: 11.5° is also −348.5° and 371.5°.
    let turns: Vec<i64> = all
        .iter()
        .filter(|s| (s.joints - joints).fixed_rows::<5>(0).amax() < 1e-6)
        .map(|s| ((s.joints[5] - joints[5]) / std::f64::consts::TAU).round() as i64)
        .collect();
    assert_eq!(turns.len(), 3, "{turns:?}");
    assert!([-1, 0, 1].iter().all(|t| turns.contains(t)));
}

#[test]
fn thousands_of_perturbed_arms_poses_with_effects_are_all_solved() {
    for sheet in SHEETS {
        let nominal = sheet.model();
        let mut random = generator(2);
        let arm = with_effects(&perturbed(&nominal, &mut random, 0.5, 0.1), &mut random);
        let inverse = Inverse::new(&arm, &loaded(), &nominal);
        for k in 0..200 {
            let joints = joints_within(&arm, &mut random);
            let target = arm.forward(&joints, &loaded());
            // A seed as the nominal controller would have it: some tenths of a degree beside.
            let seed = joints.map(|q| q + 0.005 * even(&mut random));
            let solution = match inverse.solve_near(&target, &seed) {
                Ok(solution) => solution,
                // Near a singularity the other solution may be the near one, and lie outside.
                Err(InverseError::OutsideLimits {
                    what: Limited::Sum { .. },
                    angle_rad,
                    min_rad,
                    max_rad,
                }) => {
                    assert!((min_rad - angle_rad).max(angle_rad - max_rad) < 0.2, "{angle_rad}");
                    continue;
                }
                Err(InverseError::OutsideLimits { what: Limited::Joint(joint), angle_rad, .. }) => {
                    let joint = usize::from(joint);
                    let edge = arm.limits.max_rad[joint] - joints[joint];
                    assert!(edge.min(joints[joint] - arm.limits.min_rad[joint]) < 0.2, "{joint} {angle_rad}");
                    continue;
                }
                Err(error) => panic!("{} pose {k}: {error}", sheet.name),
            };
            assert_reaches(&arm, &loaded(), &target, &solution);
            let distances = inverse.singularity_distances(&joints).unwrap();
            if distances.nearest().1 > 0.05 {
                assert!((solution.joints - joints).amax() < 1e-6, "{} pose {k}", sheet.name);
            }
        }
    }
}

#[test]
fn targets_are_found_from_their_configuration_alone() {
    for sheet in SHEETS {
        let nominal = sheet.model();
        let mut random = generator(3);
        let arm = with_effects(&perturbed(&nominal, &mut random, 0.5, 0.1), &mut random);
        let inverse = Inverse::new(&arm, &loaded(), &nominal);
        for k in 0..12 {
            let joints = joints_within(&arm, &mut random);
            let target = arm.forward(&joints, &loaded());
            let wanted = inverse.configuration(&joints);
            let solution = inverse
                .solve_configured(&target, &wanted, Some(&joints))
                .unwrap_or_else(|e| panic!("{} pose {k}: {e}", sheet.name));
            assert_reaches(&arm, &loaded(), &target, &solution);
            let blind = inverse
                .solve_configured(&target, &wanted, None)
                .unwrap_or_else(|e| panic!("{} pose {k}, without a seed: {e}", sheet.name));
            assert_reaches(&arm, &loaded(), &target, &blind);
            assert!(wanted.overshoot_rad(&blind.joints) < 0.09);
            if sheet.name.starts_with("abb")
                && inverse.singularity_distances(&joints).unwrap().nearest().1 > 0.1
            {
                assert!((blind.joints - joints).amax() < 1e-6, "{} pose {k}", sheet.name);
            }
        }
    }
}

/// As many random poses of each arm as the variable TRUEGRIND_SWEEP says (50; 20,000 take minutes). Closer than 0.01 to a
/// singularity, where no program is rewritten, two solutions lie so near a fold that one may not be found.
#[test]
fn every_random_pose_off_the_singularities_is_found_from_its_configuration_alone() {
    let poses = std::env::var("TRUEGRIND_SWEEP").ok().and_then(|n| n.parse().ok()).unwrap_or(50);
    let (mut missed, mut folded) = (Vec::new(), 0);
    for sheet in SHEETS {
        let nominal = sheet.model();
        let mut random = generator(11);
        let arm = with_effects(&perturbed(&nominal, &mut random, 0.5, 0.1), &mut random);
        let inverse = Inverse::new(&arm, &loaded(), &nominal);
        for k in 0..poses {
            let joints = joints_within(&arm, &mut random);
            let target = arm.forward(&joints, &loaded());
            let wanted = inverse.configuration(&joints);
            match inverse.solve_configured(&target, &wanted, None) {
                Ok(solution) => assert_reaches(&arm, &loaded(), &target, &solution),
                Err(_) if inverse.singularity_distances(&joints).unwrap().nearest().1 < 0.01 => folded += 1,
                Err(error) => missed.push(format!("{} pose {k}: {error}", sheet.name)),
            }
        }
    }
    println!("{poses} poses of each of {} arms, {folded} next to a singularity not found", SHEETS.len());
    assert!(missed.is_empty(), "{} of {}:\n{}", missed.len(), poses * SHEETS.len(), missed.join("\n"));
    assert!(folded * 1000 <= poses * SHEETS.len(), "{folded}");
}

#[test]
fn configuration_is_rapids_confdata() {
    let model = Sheet::named("abb-irb-120");
    let of = |deg: [f64; 6]| configuration(&model, &Joints::from(deg.map(f64::to_radians)));
    let conf = |cf1, cf4, cf6, cfx| Configuration { cf1, cf4, cf6, cfx };
    // The usual working position: wrist in front, elbow up, axis 5 bent down.
    assert_eq!(of([10.0, 0.0, 0.0, 5.0, 30.0, 5.0]), conf(0, 0, 0, 0));
    assert_eq!(of([-10.0, 0.0, 0.0, 100.0, -30.0, -100.0]), conf(-1, 1, -2, 1));
    assert_eq!(of([95.0, 0.0, 0.0, 0.0, 30.0, 400.0]), conf(1, 0, 4, 0));
    // Forearm folded up beyond the lower arm's line: axis 3 at −110° puts the wrist behind it.
    assert_eq!(of([10.0, 60.0, -110.0, 5.0, 30.0, 5.0]).cfx, 2);
    assert_eq!(of([10.0, 60.0, -110.0, 5.0, -30.0, 5.0]).cfx, 3);
    // Leaning back over the base.
    assert_eq!(of([10.0, -110.0, 10.0, 5.0, 30.0, 5.0]).cfx, 4);
    assert_eq!(of([10.0, -110.0, -90.0, 5.0, -30.0, 5.0]).cfx, 7);
    assert_eq!(of([10.0, 0.0, 0.0, 5.0, 30.0, 5.0]).to_string(), "[0,0,0,0]");
}

#[test]
fn a_border_between_quarters_is_no_wall() {
    let nominal = Sheet::named("abb-irb-120");
    let arm = perturbed(&nominal, &mut generator(4), 0.5, 0.1);
    let condition = Condition::default();
    // The controller stands exactly at the border; the estimated arm needs a little less.
    let told = Joints::from([0.0, 0.3, 0.1, 0.0, 0.7, std::f64::consts::FRAC_PI_2]);
    let target = nominal.forward(&told, &condition);
    let inverse = Inverse::new(&arm, &condition, &nominal);
    let wanted = Configuration { cf1: 0, cf4: 0, cf6: 1, cfx: 0 };
    let solution = inverse.solve_configured(&target, &wanted, None).unwrap();
    assert!((solution.joints - told).amax() < 0.05, "{}", solution.joints);
}

#[test]
fn a_configuration_that_cannot_be_is_named_with_the_nearest() {
    let model = Sheet::named("abb-irb-120");
    let inverse = Inverse::new(&model, &Condition::default(), &model);
    let joints = Joints::from([0.3, 0.3, 0.1, 0.5, 0.7, 0.2]);
    let target = model.forward(&joints, &Condition::default());
    let wanted = Configuration { cf1: 1, cf4: 0, cf6: 0, cfx: 0 };
    match inverse.solve_configured(&target, &wanted, Some(&joints)) {
        Err(InverseError::OtherConfiguration { nearest, .. }) => assert_eq!(nearest.cf1, 0),
        other => panic!("{other:?}"),
    }
}

#[test]
fn what_lies_out_of_reach_is_unreachable_by_about_as_much() {
    let nominal = Sheet::named("abb-irb-120");
    let arm = perturbed(&nominal, &mut generator(5), 0.5, 0.1);
    let inverse = Inverse::new(&arm, &Condition::default(), &nominal);
    let seed = Joints::from([0.0, 0.3, 0.1, 0.1, 0.7, 0.0]);
    let target = Pose::from_parts(Vector3::new(1000.0, 0.0, 290.0).into(), UnitQuaternion::identity());
    // Wrist centre 72 mm below the flange; the arm reaches 270 + √(302² + 70²) from the shoulder.
    let reach = 270.0 + 302.0_f64.hypot(70.0);
    let beyond = 1000.0_f64.hypot(72.0) - reach;
    for result in [
        inverse.solve_near(&target, &seed),
        inverse.solve_configured(&target, &Configuration::default(), None),
    ] {
        match result {
            Err(InverseError::Unreachable { beyond_mm }) => {
                assert!((beyond_mm - beyond).abs() < 0.1 * beyond, "{beyond_mm} instead of {beyond}");
            }
            other => panic!("{other:?}"),
        }
    }
    assert!(inverse.all(&target).is_empty());
}

#[test]
fn a_target_at_the_edge_of_reach_is_solved_and_one_beyond_is_not() {
    for sheet in SHEETS {
        let nominal = sheet.model();
        let arm = perturbed(&nominal, &mut generator(6), 0.5, 0.1);
        let inverse = Inverse::new(&arm, &Condition::default(), &nominal);
        let mut random = generator(7);
        // Straighten the elbow: turn joint 3 until the elbow's distance is least.
        let mut joints = joints_within(&arm, &mut random).map(|q| 0.3 * q);
        joints[4] += 0.5;
        let elbow = |joints: &Joints| inverse.singularity_distances(joints).unwrap().elbow;
        for k in 0..7200 {
            let mut turned = joints;
            turned[2] = f64::from(k) * std::f64::consts::TAU / 7200.0 - std::f64::consts::PI;
            if elbow(&turned) < elbow(&joints) {
                joints = turned;
            }
        }
        let mut wide = arm.clone();
        wide.limits.min_rad[2] = -4.0;
        wide.limits.max_rad[2] = 4.0;
        let inverse = Inverse::new(&wide, &Condition::default(), &nominal);
        let target = wide.forward(&joints, &Condition::default());
        let seed = joints.map(|q| q + 0.01);
        let solution = inverse.solve_near(&target, &seed).unwrap_or_else(|e| panic!("{}: {e}", sheet.name));
        assert_reaches(&wide, &Condition::default(), &target, &solution);
        assert!(solution.singularity < 0.02, "{}: {}", sheet.name, solution.singularity);
    }
}

/// The forearm of an LR Mate does not fold onto its upper arm though joint 3, which counts from the horizontal, is within its range.
#[test]
fn a_sum_of_joints_outside_its_range_is_named() {
    let model = truegrind_arm::robots::load("fanuc-lr-mate-200id").unwrap().model;
    let inverse = Inverse::new(&model, &Condition::default(), &model);
    let reached = |degrees: [f64; 6]| {
        let joints = Joints::from(degrees.map(f64::to_radians));
        inverse.solve_near(&model.forward(&joints, &Condition::default()), &joints)
    };
    assert!(reached([10.0, 30.0, -99.0, 5.0, 40.0, 20.0]).is_ok());
    let message = reached([10.0, 30.0, -101.0, 5.0, 40.0, 20.0]).unwrap_err().to_string();
    assert_eq!(message, "the sum of joints 2 and 3 would need -71.000°, its range is -70.000° to 205.000°");
    assert!(reached([10.0, -40.0, -101.0, 5.0, 40.0, 20.0]).is_err());
    // A path ends where the sum leaves its range, row by row as in lanes.
    let path: Vec<Joints> = (0..40)
        .map(|i| Joints::from([10.0, 30.0, -80.0 - f64::from(i), 5.0, 40.0, 20.0].map(f64::to_radians)))
        .collect();
    let flanges: Vec<_> = path.iter().map(|q| model.forward(q, &Condition::default())).collect();
    let along = inverse.solve_path(&flanges, &path[0]);
    assert_eq!(along.iter().position(Result::is_err), Some(21));
    for solution in inverse.all(&flanges[30]) {
        assert_eq!(model.limits.violated(&solution.joints), None);
    }
}

#[test]
fn a_joint_outside_its_range_is_named() {
    let model = Sheet::named("abb-irb-120");
    let inverse = Inverse::new(&model, &Condition::default(), &model);
    let joints = Joints::from([3.0, 0.3, 0.1, 0.5, 0.7, 0.2]);
    let target = model.forward(&joints, &Condition::default());
    match inverse.solve_near(&target, &joints) {
        Err(InverseError::OutsideLimits { what: Limited::Joint(0), angle_rad, max_rad, .. }) => {
            assert!((angle_rad - 3.0).abs() < 1e-9 && angle_rad > max_rad);
        }
        other => panic!("{other:?}"),
    }
    let message = inverse.solve_near(&target, &joints).unwrap_err().to_string();
    assert_eq!(message, "joint 1 would need 171.887°, its range is -165.000° to 165.000°");
    // Its own other turn or branch may do: all() must not hand out what lies outside.
    for solution in inverse.all(&target) {
        assert_reaches(&model, &Condition::default(), &target, &solution);
    }
}

#[test]
fn a_joint_at_its_limit_is_inside() {
    let model = Sheet::named("abb-irb-120");
    let inverse = Inverse::new(&model, &Condition::default(), &model);
    let mut joints = Joints::from([0.1, 0.3, 0.1, 0.5, 0.7, 0.2]);
    joints[0] = model.limits.max_rad[0];
    joints[1] = model.limits.min_rad[1];
    let target = model.forward(&joints, &Condition::default());
    assert!((inverse.solve_near(&target, &joints.map(|q| q - 0.01)).unwrap().joints - joints).amax() < 1e-9);
}

#[test]
fn not_a_number_is_an_error_of_its_own() {
    let model = Sheet::named("abb-irb-120");
    let inverse = Inverse::new(&model, &Condition::default(), &model);
    let seed = Joints::repeat(0.3);
    let target = model.forward(&seed, &Condition::default());
    let mut broken = target;
    broken.translation.y = f64::NAN;
    assert_eq!(inverse.solve_near(&broken, &seed), Err(InverseError::NotFinite));
    assert_eq!(inverse.solve_near(&target, &Joints::repeat(f64::INFINITY)), Err(InverseError::NotFinite));
    assert_eq!(
        inverse.solve_configured(&broken, &Configuration::default(), None),
        Err(InverseError::NotFinite)
    );
    assert!(inverse.all(&broken).is_empty());
}

/// The antisymmetric part of half a turn is zero, as that of none: a flange that is to turn by half a turn is not there yet.
#[test]
fn a_flange_half_a_turn_from_the_seed_is_turned() {
    let condition = Condition::default();
    let seed = Joints::from_row_slice(&[0.0, 0.2, 0.3, 0.0, 0.9, 0.0]);
    for sheet in SHEETS {
        let model = sheet.model();
        let inverse = Inverse::new(&model, &condition, &model);
        let here = model.forward(&seed, &condition);
        let mut solved = 0;
        for axis in [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()] {
            for shift in [Vector3::zeros(), Vector3::new(-20.0, 30.0, 10.0)] {
                let half = UnitQuaternion::from_axis_angle(&axis, std::f64::consts::PI);
                for turned in [half * here.rotation, here.rotation * half] {
                    let target = Pose::from_parts((here.translation.vector + shift).into(), turned);
                    let Ok(solution) = inverse.solve_near(&target, &seed) else { continue };
                    let (mm, rad) = misses(&model, &condition, &target, &solution.joints);
                    assert!(
                        mm <= 1e-9 && rad <= 1e-12,
                        "{}: misses by {mm:e} mm and {rad:e} rad",
                        sheet.name
                    );
                    solved += 1;
                }
            }
        }
        assert!(solved > 0, "{}: no target is in reach", sheet.name);
    }
}

#[test]
fn singular_poses_are_solved_and_named() {
    for sheet in SHEETS.iter().filter(|s| !s.name.starts_with("universal") && !s.name.starts_with("hsr")) {
        let nominal = sheet.model();
        let mut random = generator(8);
        let arm = with_effects(&perturbed(&nominal, &mut random, 0.5, 0.1), &mut random);
        let inverse = Inverse::new(&arm, &loaded(), &nominal);
        let mut solved = 0;
        for _ in 0..50 {
            let mut joints = joints_within(&arm, &mut random).map(|q| 0.5 * q);
            joints[4] = 1e-3 * even(&mut random);
            let target = arm.forward(&joints, &loaded());
            let seed = joints.map(|q| q + 2e-3 * even(&mut random));
            match inverse.solve_near(&target, &seed) {
                Ok(solution) => {
                    assert_reaches(&arm, &loaded(), &target, &solution);
                    let (nearest, distance) =
                        inverse.singularity_distances(&solution.joints).unwrap().nearest();
                    assert!(nearest == Singularity::Wrist || distance < 0.01, "{}: {nearest}", sheet.name);
                    assert!(solution.singularity < 0.02);
                    solved += 1;
                }
                // Axes 4 and 6 may have to turn far.
                Err(InverseError::OutsideLimits { .. }) => {}
                Err(error) => panic!("{}: {error}", sheet.name),
            }
        }
        assert!(solved >= 45, "{}: {solved} of 50", sheet.name);
    }
}

#[test]
fn distance_to_singularity_bounds_the_smallest_singular_value() {
    let model = perturbed(&Sheet::named("kuka-kr6-r900-sixx"), &mut generator(9), 0.5, 0.1);
    let inverse = Inverse::new(&model, &Condition::default(), &Sheet::named("kuka-kr6-r900-sixx"));
    let mut random = generator(10);
    for _ in 0..200 {
        let joints = joints_within(&model, &mut random);
        let target = model.forward(&joints, &Condition::default());
        let Ok(solution) = inverse.solve_near(&target, &joints) else { continue };
        let smallest = inverse.smallest_singular_value(&solution.joints);
        assert!(solution.singularity <= smallest * (1.0 + 1e-6), "{} of {smallest}", solution.singularity);
        assert!(solution.singularity >= smallest / 6.0_f64.sqrt() * (1.0 - 1e-6));
    }
}

/// A wrist whose three axes pass each other by 40 mm, as painting arms have it: no closed form.
fn hollow_wrist() -> Model {
    let mut model = Sheet::named("abb-irb-2600-12-1.85");
    model.links[3].a_mm = 40.0;
    model.links[4].a_mm = 60.0;
    model.links[2].d_mm = 30.0;
    model.links[1].alpha_rad = 0.2;
    model
}

#[test]
fn an_arm_without_a_closed_form_is_solved_by_newton_alone() {
    let nominal = hollow_wrist();
    let mut random = generator(11);
    let arm = with_effects(&perturbed(&nominal, &mut random, 0.5, 0.1), &mut random);
    let inverse = Inverse::new(&arm, &loaded(), &nominal);
    assert_eq!(inverse.branch(&Joints::zeros()), None);
    assert_eq!(inverse.singularity_distances(&Joints::zeros()), None);
    for _ in 0..20 {
        let joints = joints_within(&arm, &mut random).map(|q| 0.8 * q);
        let target = arm.forward(&joints, &loaded());
        let solution = inverse.solve_near(&target, &joints.map(|q| q + 0.01)).unwrap();
        assert_reaches(&arm, &loaded(), &target, &solution);
        let all = inverse.all(&target);
        assert!(!all.is_empty());
        for solution in &all {
            assert_reaches(&arm, &loaded(), &target, solution);
        }
        let wanted = inverse.configuration(&joints);
        let configured = inverse.solve_configured(&target, &wanted, Some(&joints)).unwrap();
        assert!((configured.joints - joints).amax() < 1e-4);
    }
}

#[test]
fn a_target_on_the_other_branch_only_is_said_to_be_there() {
    let model = Sheet::named("abb-irb-120");
    let inverse = Inverse::new(&model, &Condition::default(), &model);
    // Far in front and low: not to be reached backwards over the shoulder.
    let joints = Joints::from([0.0, 1.2, -0.6, 0.3, 0.5, 0.0]);
    let target = model.forward(&joints, &Condition::default());
    let behind = Joints::from([0.1, -1.8, 0.1, 0.1, 0.5, 0.1]);
    assert!(inverse.branch(&behind).unwrap().behind);
    let error = inverse.solve_near(&target, &behind).unwrap_err();
    assert!(
        matches!(error, InverseError::OtherBranch { .. } | InverseError::OutsideLimits { .. }),
        "{error}"
    );
}
