//! Joint limits along segments. The class of fault: a limit that is kept at targets and exceeded between them. Along a line
//! or an arc some joints move beyond their values at its ends; where the original segment just keeps a limit, the corrected
//! one, or an unmodified one from a corrected start, can exceed it, and the controller stops there.

use super::singularity::{confdata, corrected, ends, forward, known, marched, module, sheet, target};
use super::*;
use truegrind_arm::model::{Limited, SumLimit};

const STEPS: usize = 200;

/// Distance of the original segment from the narrowed limit (rad).
const ROOM: f64 = 1e-4;

/// What of these angles moves farthest beyond both ends of a segment, in which direction, how far, and its farthest angle.
fn beyond(way: &[Joints], angles: &[SumLimit]) -> (SumLimit, f64, f64, f64) {
    let mut most = (angles[0], 1.0, 0.0, 0.0);
    for of in angles {
        for sign in [-1.0, 1.0] {
            let at = |q: &Joints| sign * of.of(q);
            let end = at(&way[0]).max(at(&way[way.len() - 1]));
            let far = way.iter().fold(f64::NEG_INFINITY, |far, q| far.max(at(q)));
            if far - end > most.2 {
                most = (*of, sign, far - end, sign * far);
            }
        }
    }
    most
}

/// An angle without a limit: a joint, or the sum of two.
fn unlimited(of: &[usize]) -> SumLimit {
    let factors = std::array::from_fn(|joint| f64::from(u8::from(of.contains(&joint))));
    SumLimit { factors, min_rad: f64::NEG_INFINITY, max_rad: f64::INFINITY }
}

struct Scene {
    source: String,
    arm: Estimated,
    limited: Limited,
}

/// A line along which a joint, or the sum of two, reverses, on an arm whose limit is just beyond that.
fn scene(round: u64, sums: bool, random: &mut ChaCha8Rng) -> Option<Scene> {
    let robot = "abb-irb-120";
    let free = sheet(robot);
    let at = Joints::new(0.2, 0.3, 0.1, 0.4, 0.8, 0.3);
    let start = at + Joints::from_fn(|_, _| random.random_range(-0.3..0.3));
    let end = start + Joints::from_fn(|_, _| random.random_range(-0.4..0.4));
    let (from, to) = (forward(&free, &start), forward(&free, &end));
    let way = marched(&free, &from, &to, &start, STEPS)?;
    let angles: Vec<SumLimit> = match sums {
        true => (0..5).map(|joint| unlimited(&[joint, joint + 1])).collect(),
        false => (0..6).map(|joint| unlimited(&[joint])).collect(),
    };
    let (angle, sign, more, far) = beyond(&way, &angles);
    if more < 0.01 || (way[STEPS] - end).amax() > 1e-6 {
        return None;
    }
    let mut arm = known(robot, 2 * round);
    let limits = &mut arm.nominal.limits;
    let joint = angle.name().last();
    match (sums, sign > 0.0) {
        (true, true) => limits.sums.push(SumLimit { max_rad: far + ROOM, ..angle }),
        (true, false) => limits.sums.push(SumLimit { min_rad: far - ROOM, ..angle }),
        (false, true) => limits.max_rad[joint] = far + ROOM,
        (false, false) => limits.min_rad[joint] = far - ROOM,
    }
    let limited = if sums { angle.name() } else { Limited::joint(joint) };
    arm.model.limits = arm.nominal.limits.clone();
    let source = module(&[
        format!("MoveJ {},v100,fine,tool0;\n", target(&from, confdata(&free, &start))),
        format!("MoveL {},v100,fine,tool0;\n", target(&to, confdata(&free, &end))),
    ]);
    Some(Scene { source, arm, limited })
}

/// Whether the controller can execute the line of a program: all joints keep the arm's limits.
fn goes(program: &[u8], arm: &Model, near: &Joints) -> bool {
    let told = ends(program);
    let begin = marched(arm, &forward(arm, near), &told[0].1, near, 20).unwrap()[20];
    let way = marched(arm, &told[0].1, &told[told.len() - 1].1, &begin, STEPS).unwrap();
    way.iter().all(|q| arm.limits.violated(q).is_none())
}

#[test]
fn no_joint_leaves_its_range_on_a_corrected_way() {
    corrected_ways_stay_in_range(false);
}

#[test]
fn no_sum_of_joints_leaves_its_range_on_a_corrected_way() {
    corrected_ways_stay_in_range(true);
}

fn corrected_ways_stay_in_range(sums: bool) {
    let mut random = ChaCha8Rng::seed_from_u64(31);
    let (mut lines, mut written, mut refused) = (0, 0, 0);
    for round in 0..400 {
        let Some(Scene { source, arm, limited }) = scene(round, sums, &mut random) else { continue };
        let options = Options {
            tolerance_mm: 5.0,
            cuts: truegrind_compensation::cut::Cuts::Single,
            placement: truegrind_compensation::risk::placement::Placement::Absolute,
            max_risk: 1.0,
            ..Options::default()
        };
        let (plan, program) = rewritten(source.as_bytes(), &arm, &Cell::default(), &options);
        let near = plan.points[0].joints_before.unwrap();
        assert!(goes(source.as_bytes(), &arm.nominal, &near), "the told way keeps to its range");
        lines += 1;
        assert!(goes(&program, &arm.nominal, &near), "{round}: {:?}", plan.outcomes);
        written += usize::from(plan.outcomes.iter().all(corrected));
        let ways = plan.outcomes.iter().filter(|outcome| match outcome.reason() {
            Some(
                OutcomeReason::PathOutsideLimits { what } | OutcomeReason::StartOfLimitedPath { what, .. },
            ) => what == limited,
            _ => false,
        });
        refused += usize::from(ways.count() > 0);
    }
    assert!(lines > 40 && 3 * written > lines && 4 * refused > lines, "{lines} {written} {refused}");
}
