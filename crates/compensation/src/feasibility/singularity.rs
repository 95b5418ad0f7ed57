//! What a correction does near a singularity, and which of the solutions there the controller takes.
//!
//! Method. Elsewhere a correction of a millimetre costs each joint about a millimetre over half an arm's length; at a
//! distance d from a singularity it costs 1/d of it or more. A correction is written where no joint changes by more than
//! [`Options::joint_gain`] times its size, and nowhere nearer to a singularity than [`Options::min_singularity`]: at the
//! target before and after, and at samples of lines and arcs. The margins of the branches are 0 at the singularities and
//! change by at most about [`STEEP`] with the way that the flange goes (in half arm lengths and rad); a piece of a way at
//! whose ends they are larger than that cannot come near one and is not looked at further.
//!
//! On the same samples joints must stay in their ranges ([`joint_limits`]): between targets within them a corrected
//! way can leave one where the told way just kept to it.
//!
//! The configuration that is written is read again as the controller reads it. To the sign cfx is that of one solution
//! only; where the text states another one (some arms do not use it) the written numbers are solved again. Where no
//! configuration counts, lines stay on their branch, and a joint motion goes to the solution nearest to where it starts.
//! Checked against: a controller of its own in the tests, with all branches by Newton's method from spread seeds.

use std::cell::Cell;
use std::collections::{BTreeMap, HashSet};

use rayon::prelude::*;

use crate::arms::Arms;
use crate::configuration::{configured, monitored};
use crate::feasibility::joint_limits;
use crate::frames::frame_pair::FramePair;
use crate::frames::frame_table::FrameTable;
use crate::options::{Emit, Options, is_rewritable};
use crate::plan::reason::OutcomeReason;
use crate::search_budget;
use crate::segment::curve::Curve;
use crate::target::solved_target::{SolvedTarget, SolvedTargets, as_joints};
use truegrind_arm::inverse::budget::{SearchBudget, with_budget};
use truegrind_arm::inverse::{Inverse, InverseError};
use truegrind_arm::model::Joints;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::{Listing, Motion, MotionKind, MotionTarget, RobTarget, Switch, TargetValue};

/// How fast a margin changes with the way of the flange, at most: the sine of the wrist by as much as the tool turns and
/// as joints 2 and 3 turn the forearm below it.
const STEEP: f64 = 3.0;

/// Margins of shoulder, elbow and wrist beyond which joints turn no more than a few times as far as elsewhere.
const CLEAR: [f64; 3] = [0.05, 0.12, 0.15];

/// No piece of a way is cut finer than this (in half arm lengths and rad), nor than [`SHARP`] of its smallest margin.
const FINEST: f64 = 3e-4;
/// See [`FINEST`]: the joints sweep within about the margin itself.
const SHARP: f64 = 0.2;

/// Samples of one way at most.
const MOST_SAMPLES: usize = 400;

/// What stands next to a border of branches, where a start that is not known decides between them.
const OPEN: f64 = 0.05;

/// The joints that the controller takes for written numbers may differ by this from those that were meant (rad).
const SAME_RAD: f64 = 1e-6;

/// The distance to the singularity of the pose before is worked out where that after is below so many times the bound.
const WATCHED: f64 = 20.0;

/// What the controller makes of the numbers of one target.
pub(crate) struct WrittenTarget<'a> {
    /// Poses of the flange that the controller computes, before and after.
    pub(crate) flanges: [Pose; 2],
    /// The latter of the numbers as they are written.
    pub(crate) read_back: &'a Pose,
    /// Its joints for them.
    pub(crate) joints: &'a Joints,
    /// The target, where its configuration counts.
    pub(crate) stated: Option<&'a RobTarget>,
}

/// Why a target must not be corrected, for what its joints do or because the controller takes others. `singularity`: how far
/// the joints after are from one.
pub(crate) fn target_fault(
    solved: &SolvedTarget,
    singularity: f64,
    replay: &WrittenTarget<'_>,
    arms: &Arms<'_>,
    options: &Options,
) -> Option<OutcomeReason> {
    let [from, to] = &replay.flanges;
    let joints = [&solved.before, replay.joints];
    if let Some(joint_jump) = joint_jump([from, to], joints, &arms.nominal, options) {
        return Some(joint_jump);
    }
    if singularity < WATCHED * options.min_singularity
        && arms.nominal.singularity(&solved.before) < options.min_singularity
    {
        return Some(OutcomeReason::NearSingularity);
    }
    let stated = replay.stated.filter(|stated| stated.conf[3] != solved.conf.cfx)?;
    // The quarters are written as they are; cfx is not the one of these joints, so others may fit better.
    let conf = [solved.conf.cf1, solved.conf.cf4, solved.conf.cf6, stated.conf[3]];
    let written = RobTarget { conf, ..*stated };
    let taken = configured(&arms.nominal, replay.read_back, &written, Switch::On, Some(replay.joints));
    let same = taken.is_ok_and(|taken| (taken - replay.joints).amax() < SAME_RAD);
    (!same).then_some(OutcomeReason::OtherBranch)
}

/// The joint that a correction turns too far.
fn joint_jump(
    flanges: [&Pose; 2],
    joints: [&Joints; 2],
    nominal: &Inverse<'_>,
    options: &Options,
) -> Option<OutcomeReason> {
    let change = joints[1] - joints[0];
    let joint = change.iamax();
    let turned = change[joint].abs();
    if turned <= options.free_joint_change_rad {
        return None;
    }
    let most = (options.joint_gain * flange_travel(flanges[0], flanges[1], nominal))
        .max(options.free_joint_change_rad);
    (!(turned <= most)).then(|| OutcomeReason::JointJump {
        joint,
        deg: turned.to_degrees(),
        most_deg: most.to_degrees(),
        on_the_way: false,
    })
}

/// Whether a target that is put in turns a joint too far against where the arm stands with the program as it is. `intended`
/// and `commanded`: the poses in the work object.
pub(crate) fn jumps_joint(
    [intended, commanded]: [&Pose; 2],
    joints: &Joints,
    mounting: &FramePair,
    arms: &Arms<'_>,
    options: &Options,
) -> bool {
    let [intended, commanded] = [intended, commanded].map(|pose| mounting.flange_for(pose));
    let before = arms.nominal.solve_near(&intended, joints);
    before.is_ok_and(|before| {
        joint_jump([&intended, &commanded], [&before.joints, joints], &arms.nominal, options).is_some()
    })
}

/// How far a pose is from another: the shift over half an arm's length, and the turn (rad).
fn flange_travel(from: &Pose, to: &Pose, nominal: &Inverse<'_>) -> f64 {
    let shift = (to.translation.vector - from.translation.vector).norm();
    shift / nominal.length_mm() + from.rotation.angle_to(&to.rotation)
}

/// Forbids the motions whose ways or starts do not allow their correction; whether any was.
///
/// `stays`: absent, all motions are looked at as if each corrected one stood beside corrected ones; present, those that
/// start where a motion stays, in the order of the program.
pub(crate) fn forbid_segments(
    listing: &Listing,
    solved: &mut SolvedTargets,
    frame_table: &FrameTable,
    arms: &Arms<'_>,
    options: &Options,
    stays: Option<&BTreeMap<u32, OutcomeReason>>,
    budget: &mut SearchBudget,
) -> bool {
    let none = BTreeMap::new();
    let mut ways =
        SegmentChecker { listing, solved, left: stays.unwrap_or(&none), frame_table, arms, options };
    let found = match stays {
        None => ways.forbid_each(),
        Some(stays) => stays.keys().map(|motion| *motion as usize).collect(),
    };
    ways.forbid_after_unchanged(&found, budget) || (stays.is_none() && !found.is_empty())
}

/// Suspect motions that one thread takes at a time.
const PORTION: usize = 64;

/// Samples for all ways of a program, so many at least, and so many for each motion.
const SAMPLES: usize = 300_000;
/// See [`SAMPLES`].
const SAMPLES_EACH: usize = 2;

/// The ways between the targets of a program.
struct SegmentChecker<'a> {
    listing: &'a Listing,
    solved: &'a mut SolvedTargets,
    /// Motions that stay although their targets could be corrected.
    left: &'a BTreeMap<u32, OutcomeReason>,
    frame_table: &'a FrameTable,
    arms: &'a Arms<'a>,
    options: &'a Options,
}

/// Where a motion starts.
struct SegmentStart {
    frames_index: usize,
    commanded: Pose,
    /// Before and after.
    joints: [Joints; 2],
    /// After.
    margins: [f64; 3],
    corrected: bool,
}

/// A margin is about so many times the distance to singularity.
const WITHOUT_BRANCHES: f64 = 5.0;

/// Margins at some joints of the data-sheet arm; for one without branches what its distance to singularity says.
fn margins(branches: [f64; 3], joints: &Joints, nominal: &Inverse<'_>) -> [f64; 3] {
    if branches == [1.0; 3] { [nominal.singularity(joints) * WITHOUT_BRANCHES; 3] } else { branches }
}

impl SegmentChecker<'_> {
    /// All motions side by side; hands back those that are forbidden.
    fn forbid_each(&mut self) -> HashSet<usize> {
        let count = self.listing.motions.len();
        let found: Vec<(usize, OutcomeReason)> = {
            let here = &*self;
            let suspects: Vec<usize> = (0..count).into_par_iter().filter(|m| here.needs_check(*m)).collect();
            let samples = here.samples(suspects.len());
            let whole = SearchBudget::of(search_budget::WAYS);
            let found =
                search_budget::shared_out(whole, suspects.len().div_ceil(PORTION), |portion, budget| {
                    let segment_fault =
                        |motion: &usize| Some((*motion, here.segment_fault(*motion, samples, budget)?));
                    let mine = suspects.iter().skip(portion * PORTION).take(PORTION);
                    mine.filter_map(segment_fault).collect::<Vec<_>>()
                });
            found.into_iter().flatten().collect()
        };
        for (motion, why) in &found {
            self.solved.forbid(*motion, *why);
        }
        found.into_iter().map(|(motion, _)| motion).collect()
    }

    /// Samples of each way, where so many have to be looked at.
    fn samples(&self, suspects: usize) -> usize {
        let all = SAMPLES.max(SAMPLES_EACH * self.listing.motions.len());
        (all / suspects.max(1)).clamp(1, MOST_SAMPLES)
    }

    /// In order, those that start where another one stays; whether any is forbidden.
    fn forbid_after_unchanged(
        &mut self,
        unchanged_motions: &HashSet<usize>,
        budget: &mut SearchBudget,
    ) -> bool {
        let mut stay = unchanged_motions.clone();
        let samples = self.samples(unchanged_motions.len());
        let mut found = false;
        let mut open = HashSet::new();
        for motion in 0..self.listing.motions.len() {
            if self.leaves_branch_ambiguous(motion, &open) {
                open.insert(motion);
                if self.corrected(motion).is_some() && !self.left.contains_key(&(motion as u32)) {
                    self.solved.forbid(motion, OutcomeReason::AmbiguousBranch);
                    stay.insert(motion);
                    found = true;
                }
            }
            let Some(previous) = self.listing.motions[motion].previous.map(|previous| previous as usize)
            else {
                continue;
            };
            if stay.contains(&previous)
                && !self.left.contains_key(&(motion as u32))
                && let Some(why) = self.segment_fault(motion, samples, budget)
            {
                self.solved.forbid(motion, why);
                stay.insert(motion);
                found = true;
            }
            if let Some(why) = self.endangers_unchanged(motion, samples, budget) {
                let line = self.listing.motions[motion].place.line;
                let why = match why {
                    OutcomeReason::PathOutsideLimits { joint } => {
                        OutcomeReason::StartOfLimitedPath { line, joint }
                    }
                    _ => OutcomeReason::StartOfSingularPath { line },
                };
                self.solved.forbid(previous, why);
                stay.insert(previous);
                found = true;
            }
        }
        found
    }

    /// Whether the text leaves open to which of several solutions a motion leads: no configuration is checked there for
    /// certain, and it goes on from where that is `open`, or is one of those for which it is.
    fn leaves_branch_ambiguous(&self, index: usize, open: &HashSet<usize>) -> bool {
        let motion = &self.listing.motions[index];
        let pose = |target: &MotionTarget| matches!(target.value, Ok(TargetValue::Cartesian(_)));
        if monitored(motion) == Switch::On || !motion.to().is_some_and(pose) {
            return false;
        }
        let goes_on = motion.previous.is_some_and(|previous| open.contains(&(previous as usize)));
        let forbidden = self.solved.of(index).last().and_then(|to| to.as_ref().ok()?.forbidden);
        if goes_on || forbidden == Some(OutcomeReason::AmbiguousBranch) {
            return true;
        }
        // A motion that stays for another reason has not been asked yet.
        if self.corrected(index).is_some() && !self.left.contains_key(&(index as u32)) {
            return false;
        }
        match (self.solved.original_end(index), self.from(motion)) {
            (None, _) => false,
            (Some(end), None) => end.margins.iter().any(|margin| margin.abs() < OPEN),
            (Some(end), Some(from)) => {
                motion.kind == MotionKind::Joint
                    && self.not_nearest(&from.joints[1], end.frames_index, &end.intended, &end.joints)
            }
        }
    }

    /// Why a motion that stays must not start where another one is corrected: its way would come too close to a singularity
    /// from there, or a joint leave its range.
    fn endangers_unchanged(
        &self,
        index: usize,
        samples: usize,
        budget: &mut SearchBudget,
    ) -> Option<OutcomeReason> {
        let left = Cell::new(samples);
        with_budget(budget, || self.unchanged_segment_fault(index, &left))
    }

    fn unchanged_segment_fault(&self, index: usize, samples: &Cell<usize>) -> Option<OutcomeReason> {
        let motion = &self.listing.motions[index];
        let stays = self.left.contains_key(&(index as u32)) || self.corrected(index).is_none();
        let curve = matches!(motion.kind, MotionKind::Linear | MotionKind::Circular);
        if !stays || !curve || motion.modal.wrist_interpolation == Switch::On {
            return None;
        }
        let from = self.from(motion).filter(|from| from.corrected)?;
        let targets = self.solved.original_targets(index);
        let to = targets.last()?;
        let nominal = &self.arms.nominal;
        let commanded = self.frame_table.list[to.frames_index].commanded;
        let start = from.joints.map(|joints| commanded.target_of(&nominal.arm().forward(&joints)));
        let far = flange_travel(&start[1], &to.intended, nominal) * LEVER;
        let end = margins(to.margins, &to.joints, nominal);
        if motion.kind == MotionKind::Linear
            && self.free([&from.joints[1], &to.joints], [&from.margins, &end], far)
        {
            return None;
        }
        let curves = match (motion.kind, targets.as_slice()) {
            (MotionKind::Linear, _) => start.map(|start| Curve::line(start, to.intended)),
            (_, [via, _]) => {
                let round = |start| Curve::round(start, &via.intended, to.intended, motion);
                [round(start[0])?, round(start[1])?]
            }
            _ => return None,
        };
        let cost = cost(&curves[1], &commanded, nominal);
        let walk = PathCheck { nominal, commanded, curves, cost, samples, options: self.options };
        walk.between(&walk.reached(0.0, from.joints[1]), &walk.reached(1.0, to.joints))
    }

    /// The motion with its last target, if it is to be corrected.
    fn corrected(&self, index: usize) -> Option<(&Motion, &SolvedTarget)> {
        let motion = &self.listing.motions[index];
        let all = |solved: &Result<SolvedTarget, OutcomeReason>| {
            solved.as_ref().is_ok_and(|s| s.forbidden.is_none())
        };
        let targets = self.solved.of(index);
        let to = targets.last()?.as_ref().ok()?;
        (is_rewritable(motion, self.options) && targets.iter().all(all)).then_some((motion, to))
    }

    /// Where a motion starts, if that is known.
    fn from(&self, motion: &Motion) -> Option<SegmentStart> {
        let previous = motion.previous?;
        let nominal = &self.arms.nominal;
        let corrected = self.corrected(previous as usize).is_some() && !self.left.contains_key(&previous);
        if let (true, Some(Ok(end))) = (corrected, self.solved.of(previous as usize).last()) {
            let margins = margins(end.margins[1], &end.after, nominal);
            let joints = [end.before, end.after];
            return Some(SegmentStart {
                frames_index: end.frames_index,
                commanded: end.commanded,
                joints,
                margins,
                corrected,
            });
        }
        let end = self.solved.original_end(previous as usize)?;
        let margins = margins(end.margins, &end.joints, nominal);
        Some(SegmentStart {
            frames_index: end.frames_index,
            commanded: end.intended,
            joints: [end.joints; 2],
            margins,
            corrected: false,
        })
    }

    /// Whether the way of a motion, or the choice of its configuration, needs a closer look.
    fn needs_check(&self, index: usize) -> bool {
        let Some((motion, to)) = self.corrected(index) else { return false };
        let from = self.from(motion);
        let open = self.written(motion) && monitored(motion) != Switch::On;
        let here = margins(to.margins[1], &to.after, &self.arms.nominal);
        let Some(from) = from else { return open && here.iter().any(|m| m.abs() < OPEN) };
        let there = from.margins;
        if open && motion.kind == MotionKind::Joint {
            return (to.after - from.joints[1]).amax() > LONE * alone(&here);
        }
        if !self.curve(motion) {
            return false;
        }
        // The told way of a circle is longer than between its ends.
        motion.kind == MotionKind::Circular
            || from.frames_index != to.frames_index
            || !self.free(
                [&from.joints[1], &to.after],
                [&there, &here],
                flange_travel(&from.commanded, &to.commanded, &self.arms.nominal) * LEVER,
            )
    }

    /// Whether nothing can happen on a way between these joints.
    fn free(&self, joints: [&Joints; 2], margins: [&[f64; 3]; 2], flange_travel: f64) -> bool {
        let limits = &self.arms.nominal.arm().model.limits;
        clear(margins[0], margins[1], flange_travel)
            && joint_limits::within_limits(limits, joints, margins, flange_travel)
    }

    /// Whether the end is written as a pose.
    fn written(&self, motion: &Motion) -> bool {
        motion.to().is_some_and(|target| !as_joints(motion, target, self.options.emit))
    }

    /// Whether the controller interpolates the pose on the way.
    fn curve(&self, motion: &Motion) -> bool {
        match motion.kind {
            MotionKind::Linear => self.options.emit == Emit::Targets,
            MotionKind::Circular => true,
            _ => false,
        }
    }

    /// Why a motion must not be corrected for its way, or for the choice of its configuration; also where that could not be
    /// looked at to the end.
    fn segment_fault(
        &self,
        index: usize,
        samples: usize,
        budget: &mut SearchBudget,
    ) -> Option<OutcomeReason> {
        if !self.needs_check(index) {
            return None;
        }
        let left = Cell::new(samples);
        let found = with_budget(budget, || self.segment_fault_within(index, &left));
        let unfinished = budget.exhausted || (left.get() == 0 && samples < MOST_SAMPLES);
        if unfinished { Some(OutcomeReason::Inverse(InverseError::Abandoned)) } else { found }
    }

    fn segment_fault_within(&self, index: usize, samples: &Cell<usize>) -> Option<OutcomeReason> {
        let (motion, to) = self.corrected(index)?;
        let open = self.written(motion) && monitored(motion) != Switch::On;
        let Some(from) = self.from(motion) else {
            return (open && to.margins[1].iter().any(|m| m.abs() < OPEN))
                .then_some(OutcomeReason::AmbiguousBranch);
        };
        if open && motion.kind == MotionKind::Joint {
            let another = self.not_nearest(&from.joints[1], to.frames_index, &to.commanded, &to.after);
            return another.then_some(OutcomeReason::AmbiguousBranch);
        }
        // With SingArea \Wrist the wrist goes in joints, past its singularity.
        if !self.curve(motion) || motion.modal.wrist_interpolation == Switch::On {
            return None;
        }
        let commanded = self.frame_table.list[to.frames_index].commanded;
        let start = from.joints.map(|joints| commanded.target_of(&self.arms.nominal.arm().forward(&joints)));
        let curves = match (motion.kind, self.solved.of(index)) {
            (MotionKind::Linear, _) => {
                [Curve::line(start[0], to.intended), Curve::line(start[1], to.commanded)]
            }
            (_, [Ok(via), _]) => [
                Curve::round(start[0], &via.intended, to.intended, motion)?,
                Curve::round(start[1], &via.commanded, to.commanded, motion)?,
            ],
            _ => return None,
        };
        let cost = cost(&curves[1], &commanded, &self.arms.nominal);
        let walk = PathCheck {
            nominal: &self.arms.nominal,
            commanded,
            curves,
            cost,
            samples,
            options: self.options,
        };
        let begin = walk.reached(0.0, from.joints[1]);
        let end = walk.reached(1.0, to.after);
        walk.between(&begin, &end)
    }

    /// Whether another solution is as near to where a joint motion starts as the one that was meant.
    fn not_nearest(&self, near: &Joints, frames_index: usize, commanded: &Pose, joints: &Joints) -> bool {
        let flange = self.frame_table.list[frames_index].commanded.flange_for(commanded);
        let distance = |joints: &Joints| [(joints - near).norm(), (joints - near).amax()];
        let [intended, meant_most] = distance(joints);
        self.arms.nominal.solve_all_branches(&flange, near).iter().any(|other| {
            let [far, most] = distance(other);
            (other - joints).amax() > SAME && (far <= intended || most <= meant_most)
        })
    }
}

/// Solutions that differ by less are one (rad): rounding moves them by less, branches lie farther apart.
const SAME: f64 = 1e-4;

/// The flange goes farther than the tool where that turns: by so much of its length and turn, which only decides which
/// ways are looked at.
const LEVER: f64 = 1.5;

/// How far the nearest other solution is from one with these margins, at least (rad): joint 3 or 1 on the other side, or
/// joint 4 half a turn away.
fn alone(margins: &[f64; 3]) -> f64 {
    margins[0].abs().min(margins[1].abs()).min(1.0) * 1.5
}

/// Share of that within which the start cannot be nearer to the other one, by the largest joint or by the sum of squares:
/// 1/(1 + √6).
const LONE: f64 = 0.28;

/// Whether a piece of a way with these margins at its ends keeps clear of singularities.
fn clear(from: &[f64; 3], to: &[f64; 3], flange_travel: f64) -> bool {
    (0..3).all(|k| {
        (from[k] < 0.0) == (to[k] < 0.0)
            && from[k].abs() + to[k].abs() - STEEP * flange_travel > 2.0 * CLEAR[k]
    })
}

/// Length of a curve as the flange goes it (see [`flange_travel`]), from eight pieces.
fn cost(curve: &Curve, commanded: &FramePair, nominal: &Inverse<'_>) -> f64 {
    const PIECES: usize = 8;
    let at = |k: usize| commanded.flange_for(&curve.at(k as f64 / PIECES as f64));
    (0..PIECES).map(|k| flange_travel(&at(k), &at(k + 1), nominal)).sum()
}

/// One corrected way, beside the one of the program as it is.
struct PathCheck<'a> {
    nominal: &'a Inverse<'a>,
    commanded: FramePair,
    /// As it is, and as it is told.
    curves: [Curve; 2],
    /// See [`cost`].
    cost: f64,
    /// Samples that may still be taken.
    samples: &'a Cell<usize>,
    options: &'a Options,
}

/// Why a way ends where it has no joints.
fn nowhere(error: InverseError) -> OutcomeReason {
    match error {
        InverseError::OutsideLimits { joint, .. } => OutcomeReason::PathOutsideLimits { joint },
        _ => OutcomeReason::SingularPath,
    }
}

/// A place on the corrected way.
struct PathSample {
    share: f64,
    joints: Joints,
    margins: [f64; 3],
}

impl PathCheck<'_> {
    fn reached(&self, share: f64, joints: Joints) -> PathSample {
        let margins = match self.nominal.has_branches() {
            true => self.nominal.branch_margins(&joints),
            false => [self.nominal.singularity(&joints) * WITHOUT_BRANCHES; 3],
        };
        PathSample { share, joints, margins }
    }

    /// Why a piece of the way must not be gone.
    fn between(&self, a: &PathSample, b: &PathSample) -> Option<OutcomeReason> {
        let flange_travel = (b.share - a.share) * self.cost;
        let least = a.margins.iter().chain(&b.margins).fold(f64::INFINITY, |least, m| least.min(m.abs()));
        let crosses = (0..3).any(|k| (a.margins[k] < 0.0) != (b.margins[k] < 0.0));
        let regular =
            clear(&a.margins, &b.margins, flange_travel) || (!crosses && flange_travel < SHARP * least);
        let limits = &self.nominal.arm().model.limits;
        let keeps = || {
            joint_limits::within_limits(
                limits,
                [&a.joints, &b.joints],
                [&a.margins, &b.margins],
                flange_travel,
            )
        };
        if flange_travel < FINEST || (regular && keeps()) || self.samples.get() == 0 {
            return crosses.then_some(OutcomeReason::SingularPath);
        }
        self.samples.set(self.samples.get() - 1);
        let middle = match self.place(0.5 * (a.share + b.share), a) {
            Ok(middle) => middle,
            Err(why) => return why,
        };
        if regular && joint_limits::within_limits_curved(limits, [&a.joints, &middle.joints, &b.joints]) {
            return None;
        }
        self.between(a, &middle).or_else(|| self.between(&middle, b))
    }

    /// A place on the way, reached from one nearby; else what is to be said of the way.
    fn place(&self, share: f64, near: &PathSample) -> Result<PathSample, Option<OutcomeReason>> {
        let [intended, flange] = [0, 1].map(|k| self.commanded.flange_for(&self.curves[k].at(share)));
        let before = || self.nominal.solve_near(&intended, &near.joints).ok();
        let solution = match self.nominal.solve_near(&flange, &near.joints) {
            Ok(solution) => solution,
            // Where the program as it is cannot go either, the bend of the way says so.
            Err(error) => return Err(before().map(|_| nowhere(error))),
        };
        let place = self.reached(share, solution.joints);
        if (0..3).all(|k| place.margins[k].abs() > CLEAR[k]) {
            return Ok(place);
        }
        if self.nominal.singularity(&place.joints) < self.options.min_singularity {
            return Err(Some(OutcomeReason::SingularPath));
        }
        let jumped = before().and_then(|s| {
            joint_jump([&intended, &flange], [&s.joints, &place.joints], self.nominal, self.options)
        });
        match jumped {
            Some(OutcomeReason::JointJump { joint, deg, most_deg, .. }) => {
                Err(Some(OutcomeReason::JointJump { joint, deg, most_deg, on_the_way: true }))
            }
            _ => Ok(place),
        }
    }
}
