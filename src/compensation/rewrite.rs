//! Rewriting: for every target what was meant, which joints make the estimated arm reach it, and what the controller
//! must be told.
//!
//! With P the target in the work object, T and W tool and work object (as told t, w; as real t*, w*), N the nominal and
//! E the estimated forward map: the program as it is reaches E(N⁻¹(w P t⁻¹)); meant is w* P in the base; the joints that
//! reach it are q = E⁻¹(w* P t*⁻¹); the controller goes there when it is told P′ = w⁻¹ N(q) t, or q itself.
//!
//! Between two ends of a straight line the told path is a straight line of the *nominal* arm; the estimated arm bends
//! it a little. The bend is sampled, and where it exceeds the tolerance targets are put in, by bisection.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::cell::Cell;
use super::deviation::{Deviation, PathPoint, Status};
use super::mounting::{Mounted, Mounting, mount};
use super::segment::{Ends, circle_bend, insertions, straight_bend};
use super::why::Why;
use crate::kinematics::condition::Condition;
use crate::kinematics::estimated::Estimated;
use crate::kinematics::inverse::configuration::Configuration;
use crate::kinematics::inverse::{Inverse, InverseError};
use crate::kinematics::model::{Joints, Model};
use crate::kinematics::region::Outside;
use crate::math::se3::Pose;
use crate::program::motion::{
    Listing, Motion, MotionKind, MotionTarget, Reason, RobTarget, Role, Switch, TargetValue,
};
use crate::program::rewrite::{Change, Extra, NewTarget};

/// What is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Emit {
    /// Moved robtargets: the program keeps its form.
    #[default]
    Targets,
    /// Joint targets, for controllers whose own model should have no say.
    Joints,
}

/// Bounds of a rewrite.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// What is written.
    pub emit: Emit,
    /// How far the path between two targets may leave the intended line (mm).
    pub tolerance_mm: f64,
    /// Largest correction of a position that is written (mm).
    pub max_correction_mm: f64,
    /// Largest correction of an orientation that is written (rad).
    pub max_turn_rad: f64,
    /// A pose with a smaller distance to singularity is refused (scaled smallest singular value, of order sin θ5 / 10).
    pub min_singularity: f64,
    /// Whether joint targets are rewritten too: a home position says joints, not a pose.
    pub joint_targets: bool,
    /// Decimals of positions as they will be written, to state what rounding leaves.
    pub position_decimals: u8,
    /// What circumstances the program will run under.
    pub condition: Condition,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            emit: Emit::Targets,
            tolerance_mm: 0.05,
            max_correction_mm: 10.0,
            max_turn_rad: 2.0_f64.to_radians(),
            min_singularity: 1e-3,
            joint_targets: false,
            position_decimals: 4,
            condition: Condition::default(),
        }
    }
}

/// What became of one motion, for the contract's JSON and the table.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionOutcome {
    /// Index into the listing.
    pub motion: u32,
    /// What became of it.
    pub status: Status,
    /// Why.
    pub reason: Option<Why>,
    /// Deviation of its end before and after (mm).
    pub before_mm: Option<f64>,
    /// See `before_mm`; a predicted remainder.
    pub after_mm: Option<f64>,
    /// Predicted standard deviation (mm).
    pub sigma_mm: Option<f64>,
    /// Largest bend of the path to this end that is left between targets (mm).
    pub bend_mm: Option<f64>,
    /// Targets put in before it.
    pub inserted: usize,
}

/// A planned rewrite.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// What shall change.
    pub changes: Vec<Change>,
    /// One entry for each motion of the listing.
    pub outcomes: Vec<MotionOutcome>,
    /// The ends of all motions that have a pose, in order.
    pub points: Vec<PathPoint>,
    /// What was assumed of tools and work objects.
    pub notes: Vec<String>,
}

/// One target worked out.
#[derive(Debug, Clone)]
struct Solved {
    mounted: usize,
    meant: Pose,
    before: Joints,
    after: Joints,
    told: Pose,
    conf: Configuration,
    deviation_before: Deviation,
    deviation_after: Deviation,
    sigma_mm: f64,
    outside: Option<Outside>,
    singularity: f64,
    base_from_object: Pose,
    flange_from_tool: Pose,
    intended: Pose,
}

/// The two arms and their inverses, shared by all targets.
pub(super) struct Arms<'a> {
    pub(super) nominal: Inverse<'a>,
    pub(super) estimated: Inverse<'a>,
    pub(super) knowledge: Option<&'a Estimated>,
}

impl<'a> Arms<'a> {
    pub(super) fn of(estimated: &'a Estimated, condition: &Condition) -> Self {
        Self {
            nominal: Inverse::new(&estimated.nominal, &Condition::default(), &estimated.nominal),
            estimated: Inverse::new(&estimated.model, condition, &estimated.nominal),
            knowledge: Some(estimated),
        }
    }

    pub(super) fn simulated(nominal: &'a Model, actual: &'a Model, condition: &Condition) -> Self {
        Self {
            nominal: Inverse::new(nominal, &Condition::default(), nominal),
            estimated: Inverse::new(actual, condition, nominal),
            knowledge: None,
        }
    }
}

/// Plans the rewrite of a program.
///
/// Motions are independent but for those without monitored configuration (ConfL\Off), which go from the motion
/// before; the result does not depend on the number of threads.
pub fn plan(listing: &Listing, estimated: &Estimated, cell: &Cell, options: &Options) -> Plan {
    let arms = Arms::of(estimated, &options.condition);
    let mountings = Mountings::of(listing, &arms, cell);
    let solved = solve_all(listing, &arms, &mountings, options);
    let ends: Vec<Option<Ends<'_>>> = solved.iter().map(|targets| ends_of(targets, &mountings)).collect();
    let worked: Vec<Worked> = listing
        .motions
        .par_iter()
        .enumerate()
        .with_min_len(64)
        .map(|(i, motion)| work(i, motion, listing, &solved, &ends, &arms, options))
        .collect();
    let mut plan =
        Plan { changes: Vec::new(), outcomes: Vec::new(), points: Vec::new(), notes: mountings.notes() };
    for (i, worked) in worked.into_iter().enumerate() {
        plan.changes.extend(worked.change);
        plan.outcomes.push(worked.outcome);
        if let Some(mut point) = worked.point {
            point.index = plan.points.len();
            plan.points.push(point);
        }
        debug_assert_eq!(plan.outcomes.len(), i + 1);
    }
    plan
}

/// Mountings by (tool, work object) as motions use them.
pub(super) struct Mountings {
    pairs: Vec<(u32, u32)>,
    pub(super) list: Vec<Mounted>,
}

impl Mountings {
    pub(super) fn of(listing: &Listing, arms: &Arms<'_>, cell: &Cell) -> Self {
        let mut out = Self { pairs: Vec::new(), list: Vec::new() };
        for motion in &listing.motions {
            let (Some(tool), Some(object)) = (motion.tool, motion.work_object) else { continue };
            if out.pairs.contains(&(tool, object)) {
                continue;
            }
            let (Some(t), Some(o)) = (listing.tool(motion), listing.work_object(motion)) else { continue };
            let (Ok(tv), Ok(ov)) = (&t.value, &o.value) else { continue };
            let nominal = arms.nominal.arm();
            let usual = usual_joints(listing, motion, tv.frame.pose(), ov, arms);
            out.list.push(mount(
                (t, tv),
                (o, ov),
                cell,
                nominal,
                arms.estimated.arm(),
                arms.knowledge,
                &usual,
            ));
            out.pairs.push((tool, object));
        }
        out
    }

    pub(super) fn of_motion(&self, motion: &Motion) -> Option<usize> {
        let pair = (motion.tool?, motion.work_object?);
        self.pairs.iter().position(|p| *p == pair)
    }

    fn notes(&self) -> Vec<String> {
        let mut out: Vec<String> = Vec::new();
        for note in self.list.iter().flat_map(|m| &m.notes) {
            if !out.contains(note) {
                out.push(note.clone());
            }
        }
        out
    }
}

/// Joints of the first target of a motion with this mounting, at which the effect of unknown origins is estimated.
fn usual_joints(
    listing: &Listing,
    motion: &Motion,
    tool: Pose,
    object: &crate::program::motion::WorkObjectValue,
    arms: &Arms<'_>,
) -> Joints {
    let mounting = Mounting {
        tool,
        object: object.user_frame.pose() * object.object_frame.pose(),
        holds_part: object.robhold,
    };
    let same = |m: &&Motion| m.tool == motion.tool && m.work_object == motion.work_object;
    let middle = Joints::from_fn(|i, _| {
        let limits = &arms.nominal.arm().model.limits;
        0.5 * (limits.min_rad[i] + limits.max_rad[i])
    });
    listing
        .motions
        .iter()
        .filter(same)
        .take(50)
        .filter_map(|m| m.to())
        .filter_map(|t| t.value.ok().and_then(|v| v.cartesian().copied()))
        .find_map(|t| {
            let flange = mounting.flange_for(&t.pose());
            configured(&arms.nominal, &flange, &t, Switch::Off, None).ok()
        })
        .unwrap_or(middle)
}

/// The joints that the controller takes for a flange pose with a target's configuration.
pub(super) fn configured(
    nominal: &Inverse<'_>,
    flange: &Pose,
    target: &RobTarget,
    monitored: Switch,
    near: Option<&Joints>,
) -> Result<Joints, Why> {
    let [cf1, cf4, cf6, cfx] = target.conf;
    let wanted = Configuration { cf1, cf4, cf6, cfx };
    if monitored == Switch::Off
        && let Some(near) = near
    {
        return nominal.solve_near(flange, near).map(|s| s.joints).map_err(Why::of_inverse);
    }
    match nominal.solve_configured(flange, &wanted, near) {
        Ok(solution) => Ok(solution.joints),
        // Some arms do not use cfx: the quarter turns alone may still single out one solution.
        Err(error @ InverseError::OtherConfiguration { .. }) => {
            let all = nominal.all(flange);
            let mut fitting = all.iter().filter(|s| wanted.overshoot_rad(&s.joints) <= 1e-6);
            match (fitting.next(), fitting.next(), monitored) {
                (Some(only), None, _) => Ok(only.joints),
                // Not monitored and nothing to be near to: the branch that keeps to the quarters best.
                (_, _, Switch::Off) => all
                    .iter()
                    .min_by(|a, b| {
                        wanted.overshoot_rad(&a.joints).total_cmp(&wanted.overshoot_rad(&b.joints))
                    })
                    .map(|s| s.joints)
                    .ok_or_else(|| Why::of_inverse(error)),
                _ => Err(Why::of_inverse(error)),
            }
        }
        Err(error) => Err(Why::of_inverse(error)),
    }
}

type SolvedTargets = Vec<Result<Solved, Why>>;

/// Whether the controller checks the configuration of a motion.
pub(super) fn monitored(motion: &Motion) -> Switch {
    match motion.kind {
        MotionKind::Joint => motion.modal.conf_joint,
        _ => motion.modal.conf_linear,
    }
}

fn solve_all(
    listing: &Listing,
    arms: &Arms<'_>,
    mountings: &Mountings,
    options: &Options,
) -> Vec<SolvedTargets> {
    let independent = |motion: &Motion| monitored(motion) != Switch::Off;
    let mut out: Vec<SolvedTargets> = listing
        .motions
        .par_chunks(256)
        .flat_map_iter(|motions| {
            let mut near: Option<Joints> = None;
            motions
                .iter()
                .map(|motion| {
                    if !independent(motion) {
                        return Vec::new();
                    }
                    let solved = solve_motion(motion, arms, mountings, options, near.as_ref());
                    if let Some(Ok(last)) = solved.last() {
                        near = Some(last.before);
                    }
                    solved
                })
                .collect::<Vec<_>>()
        })
        .collect();
    for i in 0..listing.motions.len() {
        let motion = &listing.motions[i];
        if independent(motion) {
            continue;
        }
        let before = |p: u32| out[p as usize].last().and_then(|t| t.as_ref().ok().map(|s| s.before));
        let near = motion.previous.and_then(before);
        out[i] = solve_motion(motion, arms, mountings, options, near.as_ref());
    }
    out
}

fn solve_motion(
    motion: &Motion,
    arms: &Arms<'_>,
    mountings: &Mountings,
    options: &Options,
    near: Option<&Joints>,
) -> SolvedTargets {
    if motion.left.is_some() {
        return Vec::new();
    }
    let mut near = near.copied();
    motion
        .targets
        .iter()
        .map(|target| {
            let solved = solve_target(motion, target, arms, mountings, options, near.as_ref());
            if let Ok(s) = &solved {
                near = Some(s.before);
            }
            solved
        })
        .collect()
}

fn solve_target(
    motion: &Motion,
    target: &MotionTarget,
    arms: &Arms<'_>,
    mountings: &Mountings,
    options: &Options,
    near: Option<&Joints>,
) -> Result<Solved, Why> {
    let value = target.value.map_err(Why::Program)?;
    let index = mountings.of_motion(motion).ok_or(Why::Program(Reason::ToolUnknown))?;
    let mounted = &mountings.list[index];
    let (nominal, acting) = (arms.nominal.arm(), arms.estimated.arm());
    let (meant, before) = match value {
        TargetValue::Cartesian(t) => {
            let meant = t.pose();
            let flange = mounted.told.flange_for(&meant);
            (meant, configured(&arms.nominal, &flange, &t, monitored(motion), near)?)
        }
        TargetValue::Joint(t) => {
            let joints = Joints::from_fn(|i, _| t.robot_deg[i].to_radians());
            if let Some(joint) = nominal.model.limits.violated(&joints) {
                return Err(Why::OutsideLimits { joint });
            }
            (mounted.told.target_of(&nominal.forward(&joints)), joints)
        }
    };
    let reached_before = mounted.real.target_of(&acting.forward(&before));
    let flange = mounted.real.flange_for(&meant);
    let solution = arms.estimated.solve_near(&flange, &before).map_err(Why::of_inverse)?;
    let after = solution.joints;
    let told = mounted.told.target_of(&nominal.forward(&after));
    let joint_form = matches!(value, TargetValue::Joint(_)) || options.emit == Emit::Joints;
    let replayed = if joint_form {
        after
    } else {
        let rounded = rounded(&told, options.position_decimals);
        let flange = mounted.told.flange_for(&rounded);
        arms.nominal.solve_near(&flange, &after).map_err(Why::of_inverse)?.joints
    };
    let reached_after = mounted.real.target_of(&acting.forward(&replayed));
    let base_from_object = mounted.real.base_from_object(&flange);
    let flange_from_tool = mounted.real.flange_from_tool(&flange);
    let in_object = |reached: &Pose| Deviation::between(&meant, reached, &Pose::identity(), None);
    let (sigma_mm, outside) = match arms.knowledge {
        Some(knowledge) => {
            let carried = mounted.carried.as_ref();
            let sigma = knowledge.position_sigma_mm(acting, &after, &flange_from_tool, carried);
            (sigma, knowledge.region.outside(&after))
        }
        None => (0.0, None),
    };
    Ok(Solved {
        mounted: index,
        meant,
        before,
        after,
        told,
        conf: arms.nominal.configuration(&after),
        deviation_before: in_object(&reached_before),
        deviation_after: in_object(&reached_after),
        sigma_mm,
        outside,
        singularity: solution.singularity,
        intended: base_from_object * meant,
        base_from_object,
        flange_from_tool,
    })
}

/// A pose as it will be read back: positions with so many decimals, quaternions with seven.
fn rounded(pose: &Pose, decimals: u8) -> Pose {
    let scale = 10f64.powi(i32::from(decimals));
    let position = pose.translation.vector.map(|v| (v * scale).round() / scale);
    let q = pose.rotation.quaternion().coords.map(|v| (v * 1e7).round() / 1e7);
    Pose::from_parts(
        position.into(),
        nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::from_vector(q)),
    )
}

fn ends_of<'a>(targets: &SolvedTargets, mountings: &'a Mountings) -> Option<Ends<'a>> {
    let Some(Ok(to)) = targets.last() else { return None };
    Some(Ends {
        mounted: &mountings.list[to.mounted],
        index: to.mounted,
        meant: to.meant,
        told: to.told,
        joints: to.after,
    })
}

struct Worked {
    change: Option<Change>,
    outcome: MotionOutcome,
    point: Option<PathPoint>,
}

fn work(
    index: usize,
    motion: &Motion,
    listing: &Listing,
    solved: &[SolvedTargets],
    ends: &[Option<Ends<'_>>],
    arms: &Arms<'_>,
    options: &Options,
) -> Worked {
    let mut outcome = MotionOutcome {
        motion: index as u32,
        status: Status::Left,
        reason: None,
        before_mm: None,
        after_mm: None,
        sigma_mm: None,
        bend_mm: None,
        inserted: 0,
    };
    let finish = |mut outcome: MotionOutcome, status, reason, change, point: Option<PathPoint>| {
        outcome.status = status;
        outcome.reason = reason;
        let point = point.map(|mut p| {
            p.status = status;
            p.reason = reason.map(|r| r.to_string());
            if !matches!(status, Status::Changed | Status::Flagged) {
                (p.after, p.joints_after) = (p.before, p.joints_before);
            }
            p
        });
        Worked { change, outcome, point }
    };
    if let Some(reason) = motion.left {
        return finish(outcome, Status::Left, Some(Why::Program(reason)), None, None);
    }
    let targets = &solved[index];
    let point = match targets.last() {
        Some(Ok(to)) => {
            outcome.before_mm = Some(to.deviation_before.norm_mm());
            outcome.after_mm = outcome.before_mm;
            outcome.sigma_mm = Some(to.sigma_mm);
            Some(path_point(motion, to))
        }
        _ => None,
    };
    // First what forbids a change, of any target of the motion.
    if let Some(why) = targets.iter().find_map(|t| t.as_ref().err().copied()) {
        let status = if matches!(why, Why::Program(_)) { Status::Left } else { Status::Refused };
        return finish(outcome, status, Some(why), None, point);
    }
    let good: Vec<&Solved> = targets.iter().filter_map(|t| t.as_ref().ok()).collect();
    if good.is_empty() {
        return finish(outcome, Status::Left, Some(Why::Program(Reason::ExternalOnly)), None, point);
    }
    if motion.kind == MotionKind::AbsoluteJoint && !options.joint_targets {
        return finish(outcome, Status::Left, Some(Why::JointTarget), None, point);
    }
    if let Some(why) = good.iter().find_map(|s| forbidden(s, arms, options)) {
        return finish(outcome, Status::Refused, Some(why), None, point);
    }
    // Then the path from the motion before.
    let from = motion.previous.and_then(|p| ends[p as usize].as_ref());
    let from_changes = motion.previous.is_some_and(|p| may_change(&listing.motions[p as usize], options));
    let (mut before, mut flag) = (Vec::new(), None);
    if let (Some(from), Some(to)) = (from, ends[index].as_ref())
        && from.index == to.index
        && from_changes
    {
        match motion.kind {
            MotionKind::Linear => {
                let bend = straight_bend(from, to, arms, options.emit);
                outcome.bend_mm = Some(bend);
                if bend > options.tolerance_mm {
                    if motion.timed {
                        flag = Some(Why::Bend { mm: bend });
                    } else {
                        let (extra, left) = insertions(from, to, arms, options);
                        outcome.inserted = extra.len();
                        outcome.bend_mm = Some(left);
                        before = extra;
                        if left > options.tolerance_mm {
                            flag = Some(Why::Bend { mm: left });
                        }
                    }
                }
            }
            MotionKind::Circular if good.len() == 2 => {
                let bend = circle_bend(from, &good[0].meant, &good[0].told, to, arms);
                outcome.bend_mm = Some(bend);
                if bend > options.tolerance_mm {
                    flag = Some(Why::Bend { mm: bend });
                }
            }
            _ => {}
        }
    }
    let flag = flag.or_else(|| good.iter().find_map(|s| doubtful(s, arms)));
    let new_targets: Vec<NewTarget> =
        motion.targets.iter().zip(&good).map(|(t, s)| new_target(t, s, motion, options)).collect();
    outcome.after_mm = good.last().map(|s| s.deviation_after.norm_mm());
    let change = Change { motion: index as u32, targets: new_targets, before };
    let status = if flag.is_some() { Status::Flagged } else { Status::Changed };
    finish(outcome, status, flag, Some(change), point)
}

/// Whether a motion is of a kind that is rewritten at all.
fn may_change(motion: &Motion, options: &Options) -> bool {
    motion.left.is_none() && (motion.kind != MotionKind::AbsoluteJoint || options.joint_targets)
}

fn forbidden(solved: &Solved, arms: &Arms<'_>, options: &Options) -> Option<Why> {
    let shift = (solved.told.translation.vector - solved.meant.translation.vector).norm();
    if !(shift <= options.max_correction_mm) {
        return Some(Why::TooFar { mm: shift });
    }
    let turn = solved.told.rotation.angle_to(&solved.meant.rotation);
    if !(turn <= options.max_turn_rad) {
        return Some(Why::TooMuchTurn { deg: turn.to_degrees() });
    }
    if let Some(joint) = arms.nominal.arm().model.limits.violated(&solved.after) {
        return Some(Why::OutsideLimits { joint });
    }
    if solved.singularity < options.min_singularity {
        return Some(Why::NearSingularity);
    }
    let branch = |q: &Joints| arms.nominal.branch(q).map(|b| b.index());
    if branch(&solved.before) != branch(&solved.after) {
        return Some(Why::OtherBranch);
    }
    None
}

fn doubtful(solved: &Solved, arms: &Arms<'_>) -> Option<Why> {
    match solved.outside {
        Some(Outside::Joint { joint, by_deg }) => return Some(Why::JointNotMeasured { joint, by_deg }),
        Some(Outside::Coverage { ratio }) => return Some(Why::NotCovered { ratio }),
        None => {}
    }
    let reference = arms.knowledge.map_or(f64::INFINITY, |k| k.region.sigma_mm);
    (solved.sigma_mm > SIGMA_GROWTH * reference).then_some(Why::Uncertain { sigma_mm: solved.sigma_mm })
}

/// A pose whose predicted σ exceeds the worst measured pose's by this factor is flagged.
const SIGMA_GROWTH: f64 = 2.0;

fn new_target(target: &MotionTarget, solved: &Solved, motion: &Motion, options: &Options) -> NewTarget {
    let joint_value = matches!(target.value, Ok(TargetValue::Joint(_)));
    let can_be_joint = target.role == Role::To && motion.kind != MotionKind::Circular;
    if joint_value || (options.emit == Emit::Joints && can_be_joint) {
        return NewTarget::Joint { robot_deg: std::array::from_fn(|i| solved.after[i].to_degrees()) };
    }
    let q = solved.told.rotation.quaternion();
    let old = target.value.ok().and_then(|v| v.cartesian().map(|t| t.conf));
    let new = [solved.conf.cf1, solved.conf.cf4, solved.conf.cf6, solved.conf.cfx];
    // A dummy configuration that nobody monitors stays as it is; cfx stays where only the quarters are used.
    let conf = match old {
        Some(old) if monitored(motion) != Switch::Off && old[..3] != new[..3] => {
            Some([new[0], new[1], new[2], old[3]])
        }
        _ => None,
    };
    NewTarget::Cartesian {
        position_mm: solved.told.translation.vector.into(),
        quaternion: [q.w, q.i, q.j, q.k],
        conf,
    }
}

fn path_point(motion: &Motion, solved: &Solved) -> PathPoint {
    PathPoint {
        index: 0,
        line: motion.place.line,
        instruction: motion.instruction.to_string(),
        kind: motion.kind,
        cutting: matches!(motion.kind, MotionKind::Linear | MotionKind::Circular),
        base_from_object: solved.base_from_object,
        flange_from_tool: solved.flange_from_tool,
        intended: solved.intended,
        normal: None,
        joints_before: Some(solved.before),
        joints_after: Some(solved.after),
        before: Some(solved.deviation_before),
        after: Some(solved.deviation_after),
        sigma_mm: Some(solved.sigma_mm),
        outside: solved.outside,
        status: Status::Changed,
        reason: None,
    }
}

/// A target that the told path needs between two ends.
pub(super) fn extra_of(told: &Pose, joints: &Joints, emit: Emit) -> Extra {
    let q = told.rotation.quaternion();
    match emit {
        Emit::Targets => Extra {
            kind: MotionKind::Linear,
            target: NewTarget::Cartesian {
                position_mm: told.translation.vector.into(),
                quaternion: [q.w, q.i, q.j, q.k],
                conf: None,
            },
            external: None,
        },
        Emit::Joints => Extra {
            kind: MotionKind::AbsoluteJoint,
            target: NewTarget::Joint { robot_deg: std::array::from_fn(|i| joints[i].to_degrees()) },
            external: None,
        },
    }
}

/// Distance between two positions (mm).
pub(super) fn gap(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    (a - b).norm()
}
