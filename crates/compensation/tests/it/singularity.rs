//! Corrections near singularities. The class of the fault: a claim that rests on joints which the controller does not take,
//! or takes by a leap. Where two solutions of a pose lie close together, or joints answer a millimetre with a quarter turn,
//! a correction is right only if the controller of the data-sheet arm, which knows nothing of it, goes where it was meant.
//!
//! That controller stands here by itself: Newton's method with a numerical Jacobian on the data-sheet arm's forward map,
//! from seeds spread over all branches, and the choice by confdata or by the nearest joints as the manual says.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::{Matrix6, Vector6};
use truegrind_arm::inverse::Inverse;
use truegrind_compensation::plan::MotionOutcome;
use truegrind_compensation::risk::placement::Placement;
use truegrind_programs::motion::{MotionKind, TargetValue};

use super::*;

const ARMS: [&str; 2] = ["abb-irb-120", "staubli-tx60"];

pub(super) fn sheet(robot: &str) -> Model {
    truegrind_arm::robots::load(robot).unwrap().model
}

/// An arm with every link off, some by three times what the blade's arms are.
pub(super) fn other(sheet: &Model, seed: u64) -> Model {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let scale = [1.0, 3.0][seed as usize % 2];
    let mut model = sheet.clone();
    for parameter in link_parameters(sheet) {
        let truegrind_arm::parameter::Parameter::Link { joint, coordinate } = parameter else {
            continue;
        };
        let size = if coordinate.is_length() { 0.4 } else { 0.002 };
        let link = &mut model.links[joint];
        link.set(coordinate, link.get(coordinate) + scale * size * random.random_range(-1.0..1.0));
    }
    model
}

pub(super) fn known(robot: &str, seed: u64) -> Estimated {
    let sheet = sheet(robot);
    let mut out = estimated(other(&sheet, seed), &[Joints::zeros()]);
    (out.robot, out.nominal) = (robot.into(), sheet);
    (out.region.min_deg, out.region.max_deg) = ([-720.0; 6], [720.0; 6]);
    out.region.spacing_deg = 1e6;
    out
}

pub(super) fn forward(arm: &Model, joints: &Joints) -> Pose {
    arm.at_condition(&Condition::default()).forward(joints)
}

/// From one pose to another: shift (mm) and turn (rad).
fn twist(from: &Pose, to: &Pose) -> Vector6<f64> {
    let shift = to.translation.vector - from.translation.vector;
    let turn = (to.rotation * from.rotation.inverse()).scaled_axis();
    Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
}

/// Newton's method with a numerical Jacobian; lengths in units of 300 mm.
fn newton(arm: &Model, goal: &Pose, start: &Joints) -> Option<Joints> {
    let units = Vector6::new(300.0, 300.0, 300.0, 1.0, 1.0, 1.0);
    let mut q = *start;
    for _ in 0..40 {
        let here = forward(arm, &q);
        let missing = twist(&here, goal);
        if missing.fixed_rows::<3>(0).norm() < 1e-8 && missing.fixed_rows::<3>(3).norm() < 1e-10 {
            return Some(q);
        }
        let column = |j: usize| {
            let mut beside = q;
            beside[j] += 1e-6;
            twist(&here, &forward(arm, &beside)).component_div(&units) / 1e-6
        };
        let jacobian = Matrix6::from_columns(&std::array::from_fn::<_, 6, _>(column));
        let normal = jacobian.transpose() * jacobian + Matrix6::identity() * 1e-14;
        let step = normal.cholesky()?.solve(&(jacobian.transpose() * missing.component_div(&units)));
        q += step * (0.3 / step.amax()).min(1.0);
    }
    None
}

/// RAPID's confdata by the words of the manual, for an arm whose wrist centre lies behind the flange on axis 6.
pub(super) fn confdata(arm: &Model, q: &Joints) -> [i32; 4] {
    let quarter = |angle: f64| (angle / FRAC_PI_2).floor() as i32;
    let [high, upper, behind] = [arm.links[0].d_mm, arm.links[1].a_mm, arm.links[5].d_mm];
    let wrist = forward(arm, q) * Point3::new(0.0, 0.0, -behind);
    // In the plane in which axis 1 has turned the arm: outwards and up.
    let out = wrist.x * q[0].cos() + wrist.y * q[0].sin();
    let (sin, cos) = q[1].sin_cos();
    let before_lower_arm = (out - upper * sin) * cos - (wrist.z - high - upper * cos) * sin;
    let bit = |behind: bool, value| if behind { value } else { 0 };
    let cfx = bit(out < 0.0, 4) + bit(before_lower_arm < 0.0, 2) + bit(q[4] < 0.0, 1);
    [quarter(q[0]), quarter(q[3]), quarter(q[5]), cfx]
}

use nalgebra::Point3;

struct Controller {
    arm: Model,
    random: ChaCha8Rng,
}

impl Controller {
    fn new(robot: &str) -> Self {
        Self { arm: sheet(robot), random: ChaCha8Rng::seed_from_u64(77) }
    }

    /// All solutions that are found, each joint on the turn nearest to `near`, within the limits.
    fn solutions(&mut self, goal: &Pose, near: &Joints) -> Vec<Joints> {
        let (min, max) = (self.arm.limits.min_rad, self.arm.limits.max_rad);
        let mut found: Vec<Joints> = Vec::new();
        for k in 0..70 {
            let random = &mut self.random;
            let mut seed = match k {
                0 => *near,
                1..46 => {
                    let width = [0.02, 0.1, 0.4][k % 3];
                    near + Joints::from_fn(|_, _| random.random_range(-width..width))
                }
                _ => Joints::from_fn(|j, _| random.random_range(min[j]..max[j])),
            };
            if k % 2 == 1 {
                (seed[3], seed[4], seed[5]) = (seed[3] + PI, -seed[4], seed[5] + PI);
            }
            if k % 5 == 4 {
                // The wrist centre behind axis 1.
                (seed[0], seed[1]) = (seed[0] + PI, -seed[1]);
            }
            let Some(q) = newton(&self.arm, goal, &seed) else { continue };
            let q = q.zip_map(near, |q, near| q + TAU * ((near - q) / TAU).round());
            let new = found.iter().all(|f| (f - q).amax() > 1e-5);
            if new && (0..6).all(|j| q[j] > min[j] - 1e-9 && q[j] < max[j] + 1e-9) {
                found.push(q);
            }
        }
        found
    }

    /// The solution whose configuration is the stated one.
    fn stated(&mut self, goal: &Pose, conf: [i32; 4], near: &Joints) -> Vec<Joints> {
        let arm = self.arm.clone();
        let mut found = self.solutions(goal, near);
        found.retain(|q| confdata(&arm, q) == conf);
        found
    }

    /// The solution nearest to where the arm stands.
    fn nearest(&mut self, goal: &Pose, near: &Joints) -> Joints {
        let found = self.solutions(goal, near);
        let far = |q: &&Joints| (*q - near).norm();
        *found.iter().min_by(|a, b| far(a).total_cmp(&far(b))).expect("one was there")
    }
}

pub(super) fn target(pose: &Pose, conf: [i32; 4]) -> String {
    let (t, q) = (pose.translation.vector, pose.rotation.quaternion());
    format!(
        "[[{:.6},{:.6},{:.6}],[{:.10},{:.10},{:.10},{:.10}],[{},{},{},{}],[9E9,9E9,9E9,9E9,9E9,9E9]]",
        t.x, t.y, t.z, q.w, q.i, q.j, q.k, conf[0], conf[1], conf[2], conf[3]
    )
}

pub(super) fn module(lines: &[String]) -> String {
    format!("MODULE M\n PROC main()\n{} ENDPROC\nENDMODULE\n", lines.concat())
}

/// What the motions of a program say: pose and configuration of each end.
pub(super) fn ends(program: &[u8]) -> Vec<(MotionKind, Pose, [i32; 4])> {
    let task = Task::read(&[("p.mod", program)]);
    let end = |m: &truegrind_programs::motion::Motion| match m.to()?.value {
        Ok(TargetValue::Cartesian(target)) => Some((m.kind, target.pose(), target.conf)),
        _ => None,
    };
    task.listing.motions.iter().filter_map(end).collect()
}

pub(super) fn corrected(outcome: &MotionOutcome) -> bool {
    outcome.status.is_written()
}

/// The most that a correction may turn a joint (rad), as the option says.
fn bound(arm: &Model, from: &Pose, to: &Pose) -> f64 {
    let options = Options::default();
    let half: f64 = arm.links[1..].iter().map(|l| l.a_mm.abs() + l.d_mm.abs()).sum::<f64>() / 2.0;
    let off = twist(from, to);
    let size = off.fixed_rows::<3>(0).norm() / half + off.fixed_rows::<3>(3).norm();
    (options.joint_gain * size).max(options.free_joint_change_rad)
}

/// Joints whose margin to one singularity (0 shoulder, 1 elbow, 2 wrist) is about `margin`, anywhere else at random.
fn near_singular(arm: &Model, kind: usize, margin: f64, random: &mut ChaCha8Rng) -> Option<Joints> {
    let inverse = Inverse::new(arm, &Condition::default(), arm);
    let (min, max) = (arm.limits.min_rad, arm.limits.max_rad);
    let free = Joints::from_fn(|j, _| random.random_range(0.95 * min[j].max(-3.0)..0.95 * max[j].min(3.0)));
    let (joint, at) = [(1, 0), (2, 1), (4, 2)][kind];
    let off = |angle: f64| {
        let mut q = free;
        q[joint] = angle;
        inverse.branch_margins(&q)[at] - margin
    };
    // A sign change over the joint's range, halved.
    let steps: Vec<f64> =
        (0..=40).map(|k| min[joint] + (max[joint] - min[joint]) * f64::from(k) / 40.0).collect();
    let pair = steps.windows(2).find(|w| (off(w[0]) < 0.0) != (off(w[1]) < 0.0))?;
    let (mut low, mut high) = (pair[0], pair[1]);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if (off(middle) < 0.0) == (off(low) < 0.0) { low = middle } else { high = middle }
    }
    let mut q = free;
    q[joint] = low;
    let clear = inverse.branch_margins(&q);
    (0..3).all(|k| k == kind || clear[k].abs() > 0.25).then_some(q)
}

/// A margin from 0.0003 to 0.6, of either sign, as many in each factor of ten.
fn margin(random: &mut ChaCha8Rng) -> f64 {
    let size = 10f64.powf(random.random_range(-3.5..-0.2));
    if random.random_bool(0.5) { size } else { -size }
}

/// Margins of shoulder, elbow and wrist beyond which every correction is written.
const FAR: [f64; 3] = [0.2, 0.35, 0.45];

#[test]
fn near_each_singularity_the_controller_takes_the_joints_that_were_meant_or_nothing_is_written() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for robot in ARMS {
        let mut controller = Controller::new(robot);
        let arm = controller.arm.clone();
        let inverse = Inverse::new(&arm, &Condition::default(), &arm);
        for kind in 0..3 {
            let (mut written, mut far, mut jumps, mut count) = (0, 0, 0, 0);
            for seed in 0..4 {
                let known = known(robot, seed);
                let places: Vec<Joints> = (0..60)
                    .filter_map(|_| {
                        let m = margin(&mut random);
                        near_singular(&arm, kind, m, &mut random)
                    })
                    .collect();
                let line = |q: &Joints| {
                    format!("MoveJ {},v100,fine,tool0;\n", target(&forward(&arm, q), confdata(&arm, q)))
                };
                let source = module(&places.iter().map(line).collect::<Vec<_>>());
                let (plan, program) =
                    rewritten(source.as_bytes(), &known, &Cell::default(), &Options::default());
                let (before, after) = (ends(source.as_bytes()), ends(&program));
                assert_eq!(after.len(), places.len());
                for (k, q) in places.iter().enumerate() {
                    let outcome = &plan.outcomes[k];
                    count += 1;
                    jumps += usize::from(matches!(outcome.reason(), Some(OutcomeReason::JointJump { .. })));
                    let margins = inverse.branch_margins(q);
                    if (0..3).all(|k| margins[k].abs() > FAR[k]) {
                        far += 1;
                        assert!(corrected(outcome), "{robot} {kind} {margins:?}: {outcome:?}");
                    }
                    if !corrected(outcome) {
                        continue;
                    }
                    written += 1;
                    let (_, meant, conf) = before[k];
                    let (_, told, new) = after[k];
                    let say = |what: &str| format!("{robot} {kind} {margins:?} {q:?} {what}: {outcome:?}");
                    // What the program as it is leads to is the one solution of its configuration.
                    let was = controller.stated(&meant, conf, q);
                    assert_eq!(was.len(), 1, "{}", say("before"));
                    let takes = controller.stated(&told, new, &was[0]);
                    assert_eq!(takes.len(), 1, "{}", say("configuration written"));
                    let most = 1.001 * bound(&arm, &meant, &told);
                    let turned = (takes[0] - was[0]).amax();
                    assert!(turned <= most, "{}", say(&format!("turns {turned} of {most}")));
                    let off = twist(&meant, &forward(&known.model, &takes[0])).fixed_rows::<3>(0).norm();
                    let claimed = outcome.after_mm.get().unwrap();
                    assert!((off - claimed).abs() < 1e-3, "{}", say(&format!("is off {off}")));
                }
            }
            println!("{robot} {kind}: {count} targets, {written} written, {far} far, {jumps} jumps");
            assert!(count > 50 && 3 * written > count && far > 2 && jumps > 2);
        }
    }
}

#[test]
fn away_from_singularities_no_correction_of_three_arms_is_refused() {
    let mut random = ChaCha8Rng::seed_from_u64(2);
    for robot in ["abb-irb-120", "universal-robots-ur10", "staubli-tx60"] {
        let arm = sheet(robot);
        let inverse = Inverse::new(&arm, &Condition::default(), &arm);
        let (min, max) = (arm.limits.min_rad, arm.limits.max_rad);
        for seed in 0..4 {
            let mut lines = Vec::new();
            while lines.len() < 400 {
                let q = Joints::from_fn(|j, _| {
                    random.random_range(0.97 * min[j].max(-3.0)..0.97 * max[j].min(3.0))
                });
                let margins = inverse.branch_margins(&q);
                if (0..3).all(|k| margins[k].abs() > FAR[k]) {
                    let conf = inverse.configuration(&q);
                    let conf = [conf.cf1, conf.cf4, conf.cf6, conf.cfx];
                    lines.push(format!("MoveJ {},v100,fine,tool0;\n", target(&forward(&arm, &q), conf)));
                }
            }
            let source = module(&lines);
            let task = Task::read(&[("p.mod", source.as_bytes())]);
            // A long arm is off by more than a centimetre at its full reach, which is another bound.
            let options = Options { max_correction_mm: 30.0, ..Options::default() };
            let plan = plan(&task.listing, &known(robot, seed), &Cell::default(), &options);
            let refused: Vec<_> = plan.outcomes.iter().filter(|o| !corrected(o)).collect();
            assert!(refused.is_empty(), "{robot}: {} {:?}", refused.len(), refused[0]);
        }
    }
}

/// Joints along a line between two poses, from where it begins; `None` where a step cannot be gone without a leap.
pub(super) fn marched(
    arm: &Model,
    from: &Pose,
    to: &Pose,
    start: &Joints,
    steps: usize,
) -> Option<Vec<Joints>> {
    let mut out = vec![*start];
    for k in 1..=steps {
        let s = k as f64 / steps as f64;
        let position = from.translation.vector.lerp(&to.translation.vector, s);
        let pose = Pose::from_parts(position.into(), from.rotation.slerp(&to.rotation, s));
        let last = out[k - 1];
        let next = newton(arm, &pose, &last).filter(|q| (q - last).amax() < 0.5)?;
        out.push(next);
    }
    Some(out)
}

/// Where the line stays it keeps its joints too, although it starts at a corrected end: else that end stays as well.
#[test]
fn lines_past_a_singularity_keep_their_joints_or_stay() {
    const STEPS: usize = 120;
    let mut random = ChaCha8Rng::seed_from_u64(3);
    for robot in ARMS {
        let mut controller = Controller::new(robot);
        let arm = controller.arm.clone();
        let (mut count, mut written, mut on_the_way, mut alone, mut before_one) = (0, 0, 0, 0, 0);
        for round in 0..150 {
            let kind = round % 3;
            let m = margin(&mut random);
            let Some(q) = near_singular(&arm, kind, m, &mut random) else { continue };
            let middle = forward(&arm, &q);
            let mut off = || random.random_range(-1.0..1.0);
            let (shift, turn) =
                (Vector3::new(off(), off(), off()) * 30.0, Vector3::new(off(), off(), off()) * 0.15);
            let beside = |sign: f64| {
                let turn = nalgebra::UnitQuaternion::from_scaled_axis(turn * sign);
                Pose::from_parts((middle.translation.vector + shift * sign).into(), turn * middle.rotation)
            };
            let (from, to) = (beside(-1.0), beside(1.0));
            // Only what the controller can go as it is.
            let Some(back) = marched(&arm, &middle, &from, &q, STEPS) else { continue };
            let Some(on) = marched(&arm, &from, &to, &back[STEPS], STEPS) else { continue };
            let (min, max) = (arm.limits.min_rad, arm.limits.max_rad);
            if on.iter().any(|q| (0..6).any(|j| q[j] < min[j] + 0.02 || q[j] > max[j] - 0.02)) {
                continue;
            }
            let source = module(&[
                format!("MoveJ {},v100,fine,tool0;\n", target(&from, confdata(&arm, &on[0]))),
                format!("MoveL {},v100,fine,tool0;\n", target(&to, confdata(&arm, &on[STEPS]))),
            ]);
            let known = known(robot, round as u64);
            let options = Options {
                tolerance_mm: 5.0,
                placement: Placement::Absolute,
                max_risk: 1.0,
                ..Options::default()
            };
            let (plan, program) = rewritten(source.as_bytes(), &known, &Cell::default(), &options);
            count += 1;
            on_the_way += usize::from(matches!(
                plan.outcomes[1].reason(),
                Some(OutcomeReason::SingularPath | OutcomeReason::JointJump { on_the_way: true, .. })
            ));
            before_one += usize::from(matches!(
                plan.outcomes[0].reason(),
                Some(OutcomeReason::StartOfSingularPath { .. })
            ));
            if !corrected(&plan.outcomes[0]) || plan.outcomes[1].inserted > 0 {
                continue;
            }
            let stays = !corrected(&plan.outcomes[1]);
            if stays {
                alone += 1
            } else {
                written += 1
            }
            let say = format!("{robot} {kind} {m} {:?}", plan.outcomes);
            let (was, new) = (ends(source.as_bytes()), ends(&program));
            let before = marched(&arm, &was[0].1, &was[1].1, &on[0], STEPS).expect("went before");
            let begin = controller.stated(&new[0].1, new[0].2, &on[0]);
            assert_eq!(begin.len(), 1, "{say}");
            let after = marched(&arm, &new[0].1, &new[1].1, &begin[0], STEPS).expect(&say);
            for (a, b) in before.iter().zip(&after) {
                let most = 1.3 * bound(&arm, &forward(&arm, a), &forward(&arm, b));
                assert!((a - b).amax() <= most, "{say} turns {} of {most}", (a - b).amax());
            }
            assert_eq!(confdata(&arm, &after[STEPS]), new[1].2, "{say}");
            if stays {
                continue;
            }
            let reached = forward(&known.model, &after[STEPS]);
            let off = twist(&was[1].1, &reached).fixed_rows::<3>(0).norm();
            assert!((off - plan.outcomes[1].after_mm.get().unwrap()).abs() < 1e-3, "{say}: off {off}");
        }
        println!(
            "{robot}: {count} lines, {written} written, {on_the_way} stay for their way, {alone} behind a corrected end, {before_one} \
             with the end before them"
        );
        assert!(count > 15 && 3 * written > count);
    }
}

#[test]
fn without_a_stated_configuration_the_nearest_solution_is_the_one_that_was_meant() {
    let mut random = ChaCha8Rng::seed_from_u64(4);
    // Positions are compared in the base.
    let absolute = Options { placement: Placement::Absolute, ..Options::default() };
    for robot in ARMS {
        let mut controller = Controller::new(robot);
        let arm = controller.arm.clone();
        let (mut count, mut written, mut open) = (0, 0, 0);
        for round in 0..60 {
            let m = margin(&mut random);
            let Some(q) = near_singular(&arm, round % 3, m, &mut random) else { continue };
            let stride = [0.02, 0.3, 1.2][round % 2 + usize::from(round % 4 == 3)];
            let start = q + Joints::from_fn(|_, _| random.random_range(-stride..stride));
            if arm.limits.violated(&start).is_some() {
                continue;
            }
            let source = module(&[
                "ConfJ\\On;\n".into(),
                format!(
                    "MoveJ {},v100,fine,tool0;\n",
                    target(&forward(&arm, &start), confdata(&arm, &start))
                ),
                "ConfJ\\Off;\n".into(),
                format!("MoveJ {},v100,fine,tool0;\n", target(&forward(&arm, &q), [0; 4])),
            ]);
            let known = known(robot, round as u64);
            let (plan, program) = rewritten(source.as_bytes(), &known, &Cell::default(), &absolute);
            count += 1;
            open += usize::from(plan.outcomes[1].reason() == Some(OutcomeReason::AmbiguousBranch));
            if !corrected(&plan.outcomes[1]) {
                continue;
            }
            written += 1;
            let (was, new) = (ends(source.as_bytes()), ends(&program));
            let begin = controller.stated(&new[0].1, new[0].2, &start);
            assert_eq!(begin.len(), 1);
            let takes = controller.nearest(&new[1].1, &begin[0]);
            let off = twist(&was[1].1, &forward(&known.model, &takes)).fixed_rows::<3>(0).norm();
            let claimed = plan.outcomes[1].after_mm.get().unwrap();
            assert!((off - claimed).abs() < 1e-3, "{robot} {m} {q:?} {start:?}: {off} {:?}", plan.outcomes);
        }
        println!("{robot}: {count} without configuration, {written} written, {open} open");
        assert!(count > 20 && 3 * written > count && open > 0);
    }
}

/// The class: a solution is taken by guess and nobody is told at which motions. Where the configuration is not checked the
/// controller goes to the one next to where the arm stands: where that is not known, at the start of a program or behind a
/// motion that is not known, the stated one is taken, and each motion that rests on it is flagged until one states it and is
/// checked.
#[test]
fn motions_that_rest_on_a_guess_are_flagged_one_by_one() {
    let robot = ARMS[0];
    let arm = sheet(robot);
    let joints: Vec<Joints> =
        (0..6).map(|k| Joints::from_fn(|j, _| 0.3 + 0.05 * f64::from(k) + 0.1 * j as f64)).collect();
    let line = |k: usize| {
        let target = target(&forward(&arm, &joints[k]), confdata(&arm, &joints[k]));
        format!("MoveL {target},v100,fine,tool0;\n")
    };
    let text = module(&[
        "ConfL\\Off;\n".into(),
        line(0),
        line(1),
        "ConfL\\On;\n".into(),
        line(2),
        "ConfL\\Off;\n".into(),
        line(3),
        "pElsewhere;\n".into(),
        line(4),
        "ConfL\\On;\n".into(),
        line(5),
    ]);
    let options = Options::default();
    let (plan, _) = rewritten(text.as_bytes(), &known(robot, 1), &Cell::default(), &options);
    let motions = &plan.outcomes;
    let open: Vec<bool> = motions.iter().map(|o| o.reason() == Some(OutcomeReason::UnknownStart)).collect();
    assert_eq!(open[..4], [true, true, false, false], "{motions:#?}");
    let targets: Vec<_> = motions.iter().filter(|o| o.before_mm.is_some()).collect();
    assert_eq!(targets.len(), 6, "{motions:#?}");
    assert!(targets.iter().all(|o| corrected(o)), "{motions:#?}");
    assert!(
        targets[4].reason() == Some(OutcomeReason::UnknownStart) && targets[5].reason.is_none(),
        "{motions:#?}"
    );
}

/// A program whose configurations are checked in its first cycle alone: `ConfL \\Off` stays in force when main begins again. Where
/// the controller then keeps to the branch in which it stands, a correction for the stated one is flagged.
#[test]
fn a_configuration_checked_in_the_first_cycle_alone_is_flagged_where_the_second_goes_otherwise() {
    let robot = "abb-irb-120";
    let sheet = sheet(robot);
    let inverse = Inverse::new(&sheet, &Condition::default(), &sheet);
    let joints = |deg: [f64; 6]| Joints::from_fn(|j, _| f64::to_radians(deg[j]));
    let target = |deg: [f64; 6]| {
        let q = joints(deg);
        let (pose, conf) = (forward(&sheet, &q), inverse.configuration(&q));
        let (p, r) = (pose.translation.vector, pose.rotation);
        format!(
            "[[{:.4},{:.4},{:.4}],[{:.8},{:.8},{:.8},{:.8}],[{},{},{},{}],[9E9,9E9,9E9,9E9,9E9,9E9]]",
            p.x, p.y, p.z, r.w, r.i, r.j, r.k, conf.cf1, conf.cf4, conf.cf6, conf.cfx
        )
    };
    let reasons = |places: [[f64; 6]; 2], last: &str| {
        let source = format!(
            "MODULE M\n PROC main()\n  MoveAbsJ [[5,10,5,40,30,20],[9E9,9E9,9E9,9E9,9E9,9E9]]\\NoEOffs,v50,fine,tool0;\n  MoveL \
             {},v50,fine,tool0;\n  MoveL {},v50,fine,tool0;\n{last} ENDPROC\nENDMODULE\n",
            target(places[0]),
            target(places[1])
        );
        let task = Task::read(&[("p.mod", source.as_bytes())]);
        let options = Options {
            tolerance_mm: 50.0,
            cuts: truegrind_compensation::cut::Cuts::Single,
            ..Options::default()
        };
        let planned = plan(&task.listing, &known(robot, 2), &Cell::default(), &options);
        planned.outcomes.iter().map(|outcome| outcome.reason()).collect::<Vec<_>>()
    };
    // The other solution of the wrist.
    let flipped = |[a, b, c, d, e, f]: [f64; 6]| [a, b, c, d - 180.0, -e, f - 180.0];
    let near = [[7.0, 12.0, 4.0, 42.0, 31.0, 22.0], [8.0, 13.0, 3.0, 43.0, 32.0, 23.0]];
    let far = near.map(flipped);
    let unknown = Some(OutcomeReason::UnknownStart);
    assert_eq!(reasons(far, "")[2], None);
    assert_eq!(reasons(far, "  ConfL \\Off;\n")[2], unknown);
    assert_eq!(reasons(near, "")[1..], [None, None]);
    assert_eq!(reasons(near, "  ConfL \\Off;\n")[1..], [None, None]);
    // The stated solution is the nearest one to the start, but a line to it turns the wrist over: where joints follow the line, they may
    // arrive with the other.
    let through = [[7.0, 12.0, 4.0, 42.0, -3.0, 22.0], [8.0, 13.0, 3.0, 43.0, -4.0, 23.0]];
    assert_eq!(reasons(through, "  ConfL \\Off;\n")[2], unknown);
    assert_ne!(reasons(through, "")[2], unknown);
}

/// Where configurations are not checked, what is executed before decides: across calls, loops and branches, if all that may come before
/// leads to the same joints.
#[test]
fn an_unchecked_configuration_follows_from_all_that_may_come_before() {
    let robot = "abb-irb-120";
    let sheet = sheet(robot);
    let joints = |deg: [f64; 6]| Joints::from_fn(|j, _| f64::to_radians(deg[j]));
    // The quarter turns are those of another branch than the one in which the arm stands.
    let go = |deg: [f64; 6]| {
        let pose = forward(&sheet, &joints(deg));
        let (p, r) = (pose.translation.vector, pose.rotation);
        format!(
            "MoveL [[{:.4},{:.4},{:.4}],[{:.8},{:.8},{:.8},{:.8}],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,fine,tool0;\n",
            p.x, p.y, p.z, r.w, r.i, r.j, r.k
        )
    };
    let places = [
        [7.0, 12.0, 4.0, 138.0, -31.0, 202.0],
        [8.0, 13.0, 3.0, 137.0, -32.0, 203.0],
        [9.0, 14.0, 2.0, 136.0, -33.0, 204.0],
    ];
    let [a, b, c] = places.map(go);
    let home = "MoveAbsJ [[5,10,5,140,-30,200],[9E9,9E9,9E9,9E9,9E9,9E9]]\\NoEOffs,v50,fine,tool0;\n";
    let other = "MoveAbsJ [[5,10,5,-40,30,20],[9E9,9E9,9E9,9E9,9E9,9E9]]\\NoEOffs,v50,fine,tool0;\n";
    // Of the lines: whether each is a guess, and its fourth joint.
    let lines = |main: &str, routines: &str| -> Vec<(bool, f64)> {
        let text =
            format!("MODULE M\n PROC main()\nConfL\\Off;\nConfJ\\Off;\n{main}ENDPROC\n{routines}ENDMODULE\n");
        let task = Task::read(&[("p.mod", text.as_bytes())]);
        assert!(task.listing.opaque.is_empty(), "{text}");
        let options =
            Options { cuts: truegrind_compensation::cut::Cuts::Single, points: true, ..Options::default() };
        let plan = plan(&task.listing, &known(robot, 2), &Cell::default(), &options);
        let guessed = |line: u32| {
            let index = task.listing.motions.iter().position(|motion| motion.place.line == line).unwrap();
            plan.outcomes[index].reason() == Some(OutcomeReason::UnknownStart)
        };
        let lines = plan.points.iter().filter(|point| point.instruction == "MoveL");
        let fourth = |joints: Option<Joints>| joints.unwrap()[3].to_degrees().round();
        lines.map(|point| (guessed(point.line), fourth(point.joints_before))).collect()
    };
    let inline = [(false, 138.0), (false, 137.0), (false, 136.0)];
    assert_eq!(lines(&format!("{home}{a}{b}{c}"), ""), inline);
    // In a routine, whichever stands first in the file, and behind it.
    assert_eq!(
        lines(&format!("{home}{a}side;\n{c}"), &format!("PROC side()\n{b}ENDPROC\n")),
        [inline[0], inline[2], inline[1]]
    );
    let deep = format!("PROC outer()\nside;\nENDPROC\nPROC side()\n{a}{b}{c}ENDPROC\n");
    assert_eq!(lines(&format!("{home}outer;\n"), &deep), inline);
    // In loops and behind branches.
    assert_eq!(lines(&format!("{home}FOR i FROM 1 TO 3 DO\n{a}{b}ENDFOR\n{c}"), ""), inline);
    assert_eq!(lines(&format!("{home}IF n=1 THEN\n{a}ELSE\n{b}ENDIF\n{c}"), ""), inline);
    // From two places with the same arm, and with another one; then what follows is a guess as well.
    let side = format!("PROC side()\n{b}{c}ENDPROC\n");
    assert_eq!(lines(&format!("{home}side;\n{home}side;\n"), &side), inline[1..]);
    let two = lines(&format!("{home}side;\n{other}side;\n"), &side);
    assert!(two.iter().all(|(guess, _)| *guess), "{two:?}");
    let turned = lines(&format!("{home}IF n=1 THEN\n{other}ENDIF\n{a}{b}"), "");
    assert!(turned.iter().all(|(guess, _)| *guess), "{turned:?}");
    // A routine of no file may move the arm, a jump may come from anywhere, and a routine that nobody calls begins anywhere.
    for (main, routines) in [
        (format!("{home}Elsewhere;\n{a}"), String::new()),
        (format!("{home}IF n=1 GOTO on;\n{other}on:\n{a}"), String::new()),
        (home.to_owned(), format!("PROC alone()\n{a}ENDPROC\n")),
        (format!("{home}side;\n"), format!("PROC side()\nElsewhere;\n{a}ENDPROC\n")),
        (format!("{home}side;\n{a}"), "PROC side()\nElsewhere;\nENDPROC\n".to_owned()),
    ] {
        let found = lines(&main, &routines);
        // Where the switch itself may be set or not, the target may be refused for its quarter turns.
        assert!(found.iter().all(|(guess, _)| *guess), "{main}{routines}: {found:?}");
    }
}

/// A joint motion whose configuration is not checked ends with the wrist turned over if that is nearer: which of the two the controller
/// takes is a guess, and said to be one also where the correction is written as joints.
#[test]
fn an_unchecked_joint_motion_to_which_another_branch_is_nearer_is_a_guess() {
    let over = Joints::from([5.0, 10.0, 10.0, -30.0, 10.3, -205.0].map(f64::to_radians));
    let pose = nominal().forward(&over, &Condition::default());
    let [x, y, z] = pose.translation.vector.into();
    let q = pose.rotation;
    let source = |fourth: f64| {
        format!(
            "MODULE M\nPROC main()\nConfJ\\Off;\nMoveAbsJ [[0,0,0,{fourth},-7,-120],[9E9,9E9,9E9,9E9,9E9,9E9]]\\NoEOffs,v100,fine,tool0;\n\
             MoveJ [[{x:.6},{y:.6},{z:.6}],[{:.9},{:.9},{:.9},{:.9}],[0,-1,-3,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;\n\
             ENDPROC\nENDMODULE\n",
            q.w, q.i, q.j, q.k
        )
    };
    let known = estimated(perturbed(3, 1.0), &[over]);
    let planned = |fourth: f64, emit: Emit| {
        let text = source(fourth);
        let task = Task::read(&[("p.mod", text.as_bytes())]);
        let options = Options { emit, ..Options::default() };
        plan(&task.listing, &known, &Cell::default(), &options)
    };
    // From 50° it is 80° to -30° and 100° to 150° with the wrist as it is; from 100° it is 130° and 50°.
    let reason = |plan: &Plan| plan.outcomes[1].reason();
    assert_eq!(reason(&planned(50.0, Emit::Targets)), Some(OutcomeReason::AmbiguousBranch));
    assert_eq!(reason(&planned(50.0, Emit::Joints)), Some(OutcomeReason::UnknownStart));
    let plain = planned(100.0, Emit::Joints);
    assert_ne!(reason(&plain), Some(OutcomeReason::UnknownStart), "{:?}", plain.outcomes);
    assert!((plain.points.last().unwrap().joints_before.unwrap()[3].to_degrees() - 150.0).abs() < 1e-3);
}
