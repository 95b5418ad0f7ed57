//! The segments between the targets of a program: near a singularity, at the limits of joints, and where the configuration is open.
//!
//! Where no configuration applies, lines stay on their branch, and a joint motion goes to the solution nearest to its start.
//! Checked against: an independent controller in the tests, with all branches by Newton's method from spread seeds.

use std::cell::Cell;
use std::collections::{BTreeMap, HashSet};

use rayon::prelude::*;

use super::joint_jump::{flange_travel, travel_bound};
use super::path_check::{PathCheck, clear, curve_travel, margins};
use crate::arms::Arms;
use crate::configuration::monitored;
use crate::feasibility::joint_limits;
use crate::frames::frame_pair::FramePair;
use crate::frames::frame_table::FrameTable;
use crate::options::{Emit, Options, is_rewritable};
use crate::plan::reason::OutcomeReason;
use crate::search_budget;
use crate::segment::curve::Curve;
use crate::target::solved_target::{SolvedTarget, SolvedTargets, as_joints};
use truegrind_arm::inverse::InverseError;
use truegrind_arm::inverse::budget::{SearchBudget, with_budget};
use truegrind_arm::model::Joints;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::{Listing, Motion, MotionKind, MotionTarget, Switch, TargetValue};

/// Most samples of one segment.
const MAX_SAMPLES: usize = 400;

/// Margin below which an unknown start decides between two branches.
const BORDER_MARGIN: f64 = 0.05;

/// Forbids motions whose segment or start does not allow their correction; returns whether any was.
///
/// `stays`: if absent, every motion is checked as if its neighbours were corrected too; if present, those that start at an
/// unmodified motion, in program order.
pub(crate) fn forbid_segments(
    listing: &Listing,
    solved: &mut SolvedTargets<'_>,
    frame_table: &FrameTable,
    arms: &Arms<'_>,
    options: &Options,
    stays: Option<&BTreeMap<u32, OutcomeReason>>,
    budget: &mut SearchBudget,
) -> bool {
    let none = BTreeMap::new();
    let mut checker =
        SegmentChecker { listing, solved, unchanged: stays.unwrap_or(&none), frame_table, arms, options };
    let found = match stays {
        None => checker.forbid_each(),
        Some(stays) => stays.keys().map(|motion| *motion as usize).collect(),
    };
    checker.forbid_after_unchanged(&found, budget) || (stays.is_none() && !found.is_empty())
}

/// Samples for all segments of a program: at least so many, and so many per motion.
const SAMPLES: usize = 300_000;
/// See [`SAMPLES`].
const SAMPLES_EACH: usize = 2;

/// The segments between the targets of a program.
struct SegmentChecker<'a, 't> {
    listing: &'a Listing,
    solved: &'a mut SolvedTargets<'t>,
    /// Motions that remain unmodified although their targets could be corrected.
    unchanged: &'a BTreeMap<u32, OutcomeReason>,
    frame_table: &'a FrameTable,
    arms: &'a Arms<'a>,
    options: &'a Options,
}

/// Start of a motion.
struct SegmentStart {
    frames_index: usize,
    commanded: Pose,
    /// Before and after.
    joints: [Joints; 2],
    /// After.
    margins: [f64; 3],
    corrected: bool,
}

impl SegmentChecker<'_, '_> {
    /// Checks all motions in parallel; returns those that are forbidden.
    fn forbid_each(&mut self) -> HashSet<usize> {
        let count = self.listing.motions.len();
        let found: Vec<(usize, OutcomeReason)> = {
            let here = &*self;
            let suspects: Vec<usize> = (0..count).into_par_iter().filter(|m| here.needs_check(*m)).collect();
            let samples = here.samples(suspects.len());
            let whole = SearchBudget::of(search_budget::WAYS);
            let found = search_budget::shared_out(
                whole,
                suspects.len().div_ceil(search_budget::CHUNK),
                |chunk, budget| {
                    let segment_fault =
                        |motion: &usize| Some((*motion, here.segment_fault(*motion, samples, budget)?));
                    let mine = suspects.iter().skip(chunk * search_budget::CHUNK).take(search_budget::CHUNK);
                    mine.filter_map(segment_fault).collect::<Vec<_>>()
                },
            );
            found.into_iter().flatten().collect()
        };
        for (motion, why) in &found {
            self.solved.forbid(*motion, *why);
        }
        found.into_iter().map(|(motion, _)| motion).collect()
    }

    /// Samples per segment for so many suspects.
    fn samples(&self, suspects: usize) -> usize {
        let all = SAMPLES.max(SAMPLES_EACH * self.listing.motions.len());
        (all / suspects.max(1)).clamp(1, MAX_SAMPLES)
    }

    /// Checks, in order, motions that start at an unmodified one; returns whether any is forbidden.
    fn forbid_after_unchanged(
        &mut self,
        unchanged_motions: &HashSet<usize>,
        budget: &mut SearchBudget,
    ) -> bool {
        let mut stay = unchanged_motions.clone();
        let samples = self.samples(unchanged_motions.len());
        let mut found = false;
        let mut open = HashSet::new();
        let quiet = self.quiet();
        for motion in 0..self.listing.motions.len() {
            // Nearly every motion; where one was forbidden, its neighbours may no longer be quiet.
            if quiet[motion] && stay.is_empty() {
                continue;
            }
            if self.leaves_branch_ambiguous(motion, &open) {
                open.insert(motion);
                if self.corrected(motion).is_some() && !self.unchanged.contains_key(&(motion as u32)) {
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
                && !self.unchanged.contains_key(&(motion as u32))
                && let Some(why) = self.segment_fault(motion, samples, budget)
            {
                self.solved.forbid(motion, why);
                stay.insert(motion);
                found = true;
            }
            if let Some(why) = self.endangers_unchanged(motion, samples, budget) {
                let line = self.listing.motions[motion].place.line;
                let why = match why {
                    OutcomeReason::PathOutsideLimits { what } => {
                        OutcomeReason::StartOfLimitedPath { line, what }
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

    /// For each motion, whether nothing can be wrong with it as long as every motion before it is corrected: its configuration is
    /// checked, and it is corrected itself.
    fn quiet(&self) -> Vec<bool> {
        let motions = self.listing.motions.par_iter().with_min_len(search_budget::MANY_MOTIONS).enumerate();
        let quiet = |(index, motion): (usize, &Motion)| {
            monitored(motion) == Switch::On
                && self.corrected(index).is_some()
                && !self.unchanged.contains_key(&(index as u32))
        };
        motions.map(quiet).collect()
    }

    /// Whether the program leaves open which of several solutions a motion reaches: no configuration is certainly checked
    /// there, and it continues from a motion in `open` or is ambiguous itself.
    fn leaves_branch_ambiguous(&self, index: usize, open: &HashSet<usize>) -> bool {
        let motion = &self.listing.motions[index];
        let pose = |target: &MotionTarget| matches!(target.value, Ok(TargetValue::Cartesian(_)));
        if monitored(motion) == Switch::On || !motion.to().is_some_and(pose) {
            return false;
        }
        let goes_on = motion.previous.is_some_and(|previous| open.contains(&(previous as usize)));
        let forbidden = self.solved.of(index).last().and_then(|to| to.as_ref().ok()?.forbidden.as_deref());
        if goes_on || forbidden == Some(&OutcomeReason::AmbiguousBranch) {
            return true;
        }
        // A motion that remains unmodified for another reason has not been checked yet.
        if self.corrected(index).is_some() && !self.unchanged.contains_key(&(index as u32)) {
            return false;
        }
        match (self.solved.original_end(index), self.segment_start(motion)) {
            (None, _) => false,
            (Some(end), None) => end.margins.iter().any(|margin| margin.abs() < BORDER_MARGIN),
            (Some(end), Some(from)) => {
                motion.kind == MotionKind::Joint
                    && self.is_not_nearest(
                        &from.joints[1],
                        end.frames_index,
                        &end.intended.pose(),
                        &end.joints,
                    )
            }
        }
    }

    /// Why a motion must not be corrected because the next, unmodified one starts there: its segment would come too close to
    /// a singularity, or a joint would exceed its limits.
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
        let stays = self.unchanged.contains_key(&(index as u32)) || self.corrected(index).is_none();
        let curve = matches!(motion.kind, MotionKind::Linear | MotionKind::Circular);
        if !stays || !curve || motion.modal.wrist_interpolation == Switch::On {
            return None;
        }
        let from = self.segment_start(motion).filter(|from| from.corrected)?;
        let targets = self.solved.original_targets(index);
        let to = targets.last()?;
        let nominal = &self.arms.nominal;
        let commanded = self.frame_table.list[to.frames_index].commanded;
        let start = from.joints.map(|joints| commanded.target_of(&nominal.arm().forward(&joints)));
        let far = flange_travel(&start[1], &to.intended.pose(), nominal) * LEVER;
        let end = margins(to.margins, &to.joints, nominal);
        if motion.kind == MotionKind::Linear
            && motion.axis_turn.is_none()
            && self.is_clear([&from.joints[1], &to.joints], [&from.margins, &end], far)
        {
            return None;
        }
        let curves = match (motion.kind, targets.as_slice()) {
            (MotionKind::Linear, _) => start.map(|start| Curve::line(start, to.intended.pose())),
            (_, [via, _]) => {
                let round = |start| Curve::round(start, &via.intended.pose(), to.intended.pose(), motion);
                [round(start[0])?, round(start[1])?]
            }
            _ => return None,
        };
        self.curves_fault(motion, curves, &commanded, [from.joints[1], to.joints], samples)
    }

    /// The motion with its last target, if it is corrected.
    fn corrected(&self, index: usize) -> Option<(&Motion, &SolvedTarget<'_>)> {
        let motion = &self.listing.motions[index];
        let all = |solved: &Result<SolvedTarget<'_>, OutcomeReason>| {
            solved.as_ref().is_ok_and(|s| s.forbidden.is_none())
        };
        let targets = self.solved.of(index);
        let to = targets.last()?.as_ref().ok()?;
        (is_rewritable(motion, self.options) && targets.iter().all(all)).then_some((motion, to))
    }

    /// Start of a motion, if known.
    fn segment_start(&self, motion: &Motion) -> Option<SegmentStart> {
        let previous = motion.previous?;
        let nominal = &self.arms.nominal;
        let corrected =
            self.corrected(previous as usize).is_some() && !self.unchanged.contains_key(&previous);
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
            commanded: end.intended.pose(),
            joints: [end.joints; 2],
            margins,
            corrected: false,
        })
    }

    /// Whether the segment of a motion, or the choice of its configuration, must be checked closely.
    fn needs_check(&self, index: usize) -> bool {
        let Some((motion, to)) = self.corrected(index) else { return false };
        let from = self.segment_start(motion);
        let open = self.written(motion) && monitored(motion) != Switch::On;
        let here = margins(to.margins[1], &to.after, &self.arms.nominal);
        let Some(from) = from else { return open && here.iter().any(|m| m.abs() < BORDER_MARGIN) };
        let there = from.margins;
        if open && motion.kind == MotionKind::Joint {
            return (to.after - from.joints[1]).amax() > NEAREST_SHARE * nearest_branch_rad(&here);
        }
        if !self.curve(motion) {
            return false;
        }
        let clear = |travel| self.is_clear([&from.joints[1], &to.after], [&there, &here], travel * LEVER);
        let (start, end, nominal) = (&from.commanded, &to.commanded, &self.arms.nominal);
        // The commanded circle is longer than its chord, and a turn by axes than the shortest one.
        motion.kind == MotionKind::Circular
            || motion.axis_turn.is_some()
            || from.frames_index != to.frames_index
            || !clear(travel_bound(start, end, nominal)) && !clear(flange_travel(start, end, nominal))
    }

    /// Whether a segment between these joints is certainly free of faults.
    fn is_clear(&self, joints: [&Joints; 2], margins: [&[f64; 3]; 2], flange_travel: f64) -> bool {
        let limits = &self.arms.nominal.arm().model.limits;
        clear(margins[0], margins[1], flange_travel)
            && joint_limits::within_limits(limits, joints, margins, flange_travel)
    }

    /// Whether the end is written as a pose.
    fn written(&self, motion: &Motion) -> bool {
        motion.to().is_some_and(|target| !as_joints(motion, target, self.options.emit))
    }

    /// Whether the controller interpolates the pose along the segment.
    fn curve(&self, motion: &Motion) -> bool {
        match motion.kind {
            MotionKind::Linear => self.options.emit == Emit::Targets,
            MotionKind::Circular => true,
            _ => false,
        }
    }

    /// Why a motion must not be corrected because of its segment or the choice of its configuration; also where the check
    /// could not be completed.
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
        let unfinished = budget.exhausted || (left.get() == 0 && samples < MAX_SAMPLES);
        if unfinished { Some(OutcomeReason::Inverse(InverseError::Abandoned)) } else { found }
    }

    fn segment_fault_within(&self, index: usize, samples: &Cell<usize>) -> Option<OutcomeReason> {
        let (motion, to) = self.corrected(index)?;
        let open = self.written(motion) && monitored(motion) != Switch::On;
        let Some(from) = self.segment_start(motion) else {
            return (open && to.margins[1].iter().any(|m| m.abs() < BORDER_MARGIN))
                .then_some(OutcomeReason::AmbiguousBranch);
        };
        if open && motion.kind == MotionKind::Joint {
            let another = self.is_not_nearest(&from.joints[1], to.frames_index, &to.commanded, &to.after);
            return another.then_some(OutcomeReason::AmbiguousBranch);
        }
        // With SingArea \Wrist the wrist is interpolated in joints, through its singularity.
        if !self.curve(motion) || motion.modal.wrist_interpolation == Switch::On {
            return None;
        }
        let commanded = self.frame_table.list[to.frames_index].commanded;
        let start = from.joints.map(|joints| commanded.target_of(&self.arms.nominal.arm().forward(&joints)));
        let curves = match (motion.kind, self.solved.of(index)) {
            (MotionKind::Linear, _) => {
                [Curve::line(start[0], to.intended.pose()), Curve::line(start[1], to.commanded)]
            }
            (_, [Ok(via), _]) => [
                Curve::round(start[0], &via.intended.pose(), to.intended.pose(), motion)?,
                Curve::round(start[1], &via.commanded, to.commanded, motion)?,
            ],
            _ => return None,
        };
        self.curves_fault(motion, curves, &commanded, [from.joints[1], to.after], samples)
    }

    /// Why the tool must not follow a curve (original and commanded) between these joints, in whichever way the control may turn it.
    fn curves_fault(
        &self,
        motion: &Motion,
        curves: [Curve; 2],
        commanded: &FramePair,
        [begin, end]: [Joints; 2],
        samples: &Cell<usize>,
    ) -> Option<OutcomeReason> {
        let nominal = &self.arms.nominal;
        let by_axes = motion.axis_turn.as_deref().map(|turn| [0, 1].map(|k: usize| curves[k].by_axes(turn)));
        std::iter::once(curves).chain(by_axes).find_map(|curves| {
            let curve_travel = curve_travel(&curves[1], commanded, nominal);
            let check = PathCheck {
                nominal,
                commanded: *commanded,
                curves,
                curve_travel,
                samples,
                options: self.options,
            };
            check.check_piece(&check.reached(0.0, begin), &check.reached(1.0, end))
        })
    }

    /// Whether another solution is as near to the start of a joint motion as the intended one.
    fn is_not_nearest(&self, near: &Joints, frames_index: usize, commanded: &Pose, joints: &Joints) -> bool {
        let flange = self.frame_table.list[frames_index].commanded.flange_for(commanded);
        let distance = |joints: &Joints| [(joints - near).norm(), (joints - near).amax()];
        let [intended, meant_most] = distance(joints);
        self.arms.nominal.solve_all_branches(&flange, near).iter().any(|other| {
            let [far, most] = distance(other);
            (other - joints).amax() > SAME && (far <= intended || most <= meant_most)
        })
    }
}

/// Solutions closer than this are the same (rad): rounding moves them by less, branches are farther apart.
const SAME: f64 = 1e-4;

/// The flange travels farther than the tool where the tool rotates: factor on its travel, which only selects the segments to
/// check.
const LEVER: f64 = 1.5;

/// Smallest distance to the nearest other solution with these margins (rad): joint 3 or 1 on the other side, or joint 4 half
/// a turn away.
fn nearest_branch_rad(margins: &[f64; 3]) -> f64 {
    margins[0].abs().min(margins[1].abs()).min(1.0) * 1.5
}

/// Share of that within which the start cannot be nearer to the other solution, by the largest joint change or by the sum of
/// squares: 1/(1 + √6).
const NEAREST_SHARE: f64 = 0.28;
