//! The planner: for every target the intended pose, the joints with which the estimated arm reaches it, and the commanded
//! pose.
//!
//! Let P be the target in the work object; t and w tool and work object as programmed, t* and w* the real ones; N and E the
//! nominal and the estimated forward map. The original program reaches E(N⁻¹(w P t⁻¹)). The intended pose in the base is
//! w* P, and the joints that reach it are q = E⁻¹(w* P t*⁻¹). The controller moves there when commanded P′ = w⁻¹ N(q) t, or
//! q itself.
//!
//! Between two corrected ends the commanded line is straight for the *nominal* arm; the estimated arm deviates slightly from
//! it. The deviation is sampled, and where it exceeds the tolerance, targets are inserted by bisection.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::arms::Arms;
use crate::condition::warmth::warmth_note;
use crate::configuration::monitored;
use crate::cut::{StartsOf, only_start};
use crate::deviation::{MotionStatus, PathPoint};
use crate::feasibility::unchanged::blocking_reason;
use crate::frames::frame_pair::FramePair;
use crate::frames::frame_table::FrameTable;
use crate::options::{Options, is_rewritable};
use crate::plan::notes::{
    at_poles_note, backlash_note, beyond_noise_note, doubtful_effects_note, load_notes, several_starts_note,
    unchecked_notes, unknown_loads,
};
use crate::plan::reason::OutcomeReason;
use crate::plan::steps_to_left::is_path;
use crate::plan::{MotionOutcome, Plan};
use crate::risk::assessment::Assessment;
use crate::risk::fixtures::part_of_motion;
use crate::search_budget;
use crate::segment::corner::cut_of_lines;
use crate::segment::joint_speed::{Pace, fastest};
use crate::segment::line::{Segment, SegmentEnd, midpoint_deviations};
use crate::segment::rounded_end::{CUT_MM, RoundedEnd};
use crate::segment::segment_plan::{SegmentPlan, corner};
use crate::target::original_joints::BranchGuess;
use crate::target::solve::reserve_memory;
use crate::target::solved_target::{SolvedTarget, SolvedTargets, as_joints};
use truegrind_arm::inverse::InverseError;
use truegrind_arm::inverse::budget::{SearchBudget, with_budget};
use truegrind_arm::region::Outside;
use truegrind_programs::motion::{
    Listing, Motion, MotionKind, MotionTarget, Reason, Role, Switch, TargetValue,
};
use truegrind_programs::rewrite::{Change, NewTarget};

/// The plan of motions whose targets are solved.
pub(super) fn planned(job: &Planner<'_>) -> Plan {
    let Planner { listing, solved, frame_table, arms, options, .. } = *job;
    let count = listing.motions.len();
    let whole = SearchBudget::of(search_budget::PATHS).with_near_solves(search_budget::path_steps(count));
    // Filled in place: concatenating per-chunk lists would hold everything twice.
    let motions = (0..count as u32).into_par_iter().with_min_len(search_budget::MANY_MOTIONS);
    let mut outcomes: Vec<MotionOutcome> = motions.clone().map(MotionOutcome::left).collect();
    let mut changes: Vec<Option<Change>> = motions.map(|_| None).collect();
    let mut slots: Vec<OutputSlots<'_>> =
        outcomes.chunks_mut(search_budget::CHUNK).zip(changes.chunks_mut(search_budget::CHUNK)).collect();
    let chunks: Vec<ChunkResult> =
        search_budget::shared_out_into(whole, &mut slots, |chunk, slots, budget| {
            let first = chunk * search_budget::CHUNK;
            job.chunk(first..(first + search_budget::CHUNK).min(count), slots, budget)
        });
    let mut notes = frame_table.notes();
    notes.extend(backlash_note(arms, solved));
    notes.extend(doubtful_effects_note(arms));
    notes.extend(load_notes(listing, arms, options));
    notes.extend(warmth_note(arms, options));
    let unchecked: Vec<u32> = chunks.iter().flat_map(|chunk| chunk.unchecked.iter().copied()).collect();
    notes.extend(unchecked_notes(listing, solved, &unchecked));
    let from_several: Vec<u32> = chunks.iter().flat_map(|chunk| &chunk.from_several).copied().collect();
    notes.extend(several_starts_note(listing, &from_several));
    notes.extend(at_poles_note(listing, solved, &outcomes, frame_table, arms));
    notes.extend(beyond_noise_note(arms, outcomes.iter().filter_map(|outcome| outcome.shape_sigma_mm.get())));
    #[expect(clippy::filter_map_identity, reason = "works in place, unlike `flatten`: memory is at its peak")]
    let changes = changes.into_iter().filter_map(|change| change).collect();
    let unstated_axes = frame_table.unstated_axes.clone();
    let unknown_loads = unknown_loads(arms, options, &outcomes);
    let mut plan = Plan {
        notes,
        changes,
        outcomes,
        unstated_axes,
        unknown_loads,
        assumes_origins: frame_table.assumes_origins(),
        ..Plan::default()
    };
    plan.points.reserve_exact(chunks.iter().map(|p| p.points.len()).sum());
    for mut chunk in chunks {
        plan.points.append(&mut chunk.points);
    }
    plan.points.iter_mut().enumerate().for_each(|(index, point)| point.index = index);
    plan
}

/// Inputs of the plan.
pub(super) struct Planner<'a> {
    pub(super) listing: &'a Listing,
    pub(super) solved: &'a SolvedTargets<'a>,
    pub(super) starts: &'a StartsOf<'a>,
    /// For each work object the first of those that are placed as one with it.
    pub(super) part_of: &'a [u32],
    /// Motions that remain unmodified although their targets could be corrected.
    pub(super) unchanged: &'a BTreeMap<u32, OutcomeReason>,
    pub(super) frame_table: &'a FrameTable,
    /// The largest σ over the measured poses, by frame pair (mm).
    pub(super) measured_sigma_mm: &'a [f64],
    pub(super) assessment: &'a Assessment,
    pub(super) arms: &'a Arms<'a>,
    pub(super) options: &'a Options,
}

/// Output slots of consecutive motions.
type OutputSlots<'p> = (&'p mut [MotionOutcome], &'p mut [Option<Change>]);

/// Remaining results of a chunk.
struct ChunkResult {
    /// Lines and arcs that are written although their path was not checked.
    unchecked: Vec<u32>,
    /// Lines and arcs that may start at several places, from each of which their path was checked.
    from_several: Vec<u32>,
    points: Vec<PathPoint>,
}

/// The corrected end of a motion; `None` where its last target was not solved.
fn segment_end<'a>(
    motion: &'a Motion,
    targets: &[Result<SolvedTarget<'_>, OutcomeReason>],
    frame_table: &'a FrameTable,
) -> Option<SegmentEnd<'a>> {
    let Some(Ok(to)) = targets.last() else { return None };
    let stated = motion.to().and_then(|target| target.value.as_ref().ok());
    let cartesian = stated.and_then(TargetValue::cartesian);
    Some(SegmentEnd {
        frames: &frame_table.list[to.frames_index],
        index: to.frames_index,
        intended: to.intended.pose(),
        commanded: to.commanded,
        joints: to.after,
        condition_index: to.condition_index,
        before: to.before,
        conf: cartesian.filter(|_| monitored(motion) != Switch::Off).map(|target| target.conf),
        external: stated.map(TargetValue::external),
        between_ends: false,
    })
}

struct PlannedMotion {
    change: Option<Change>,
    outcome: MotionOutcome,
    point: Option<Box<PathPoint>>,
    /// The segment to it, where all its targets are corrected.
    segment_plan: Option<SegmentPlan>,
}

impl PlannedMotion {
    /// Takes over the worst of the segments from several starts.
    fn take_worst(&mut self, worst: &SegmentPlan) {
        self.outcome.path_deviation_mm = worst.path_deviation_mm.into();
        if let Some(flag) = worst.flag {
            self.flag_if_changed(flag);
        }
    }

    /// Flags a motion that is written without a flag.
    fn flag_if_changed(&mut self, why: OutcomeReason) {
        if self.outcome.status == MotionStatus::Changed {
            self.flag(why);
        }
    }

    /// Flags a motion that is written.
    fn flag(&mut self, why: OutcomeReason) {
        (self.outcome.status, self.outcome.reason) = (MotionStatus::Flagged, Some(Box::new(why)));
        if let Some(point) = &mut self.point {
            (point.status, point.reason) = (MotionStatus::Flagged, Some(why.to_string()));
        }
    }
}

impl<'a> Planner<'a> {
    fn chunk(
        &self,
        motions: std::ops::Range<usize>,
        (outcomes, changes): &mut OutputSlots<'_>,
        budget: &mut SearchBudget,
    ) -> ChunkResult {
        reserve_memory();
        let count = motions.len();
        let paths: Vec<Option<Segment<'a>>> = motions.clone().map(|index| self.path(index)).collect();
        // The midpoint of a line shows whether it is straight; midpoints are computed together in lanes.
        let straight = |index: usize| self.listing.motions[index].kind == MotionKind::Linear;
        let lines: Vec<&Segment<'a>> = motions
            .clone()
            .zip(&paths)
            .filter(|(i, _)| straight(*i))
            .filter_map(|(_, p)| p.as_ref())
            .collect();
        let middles = with_budget(budget, || midpoint_deviations(&lines, self.arms, self.options.emit));
        let mut middles = middles.into_iter();
        // Segment plan of the previous motion, needed for the corner.
        let mut last: Option<(u32, SegmentPlan)> = None;
        let mut out = ChunkResult {
            unchecked: Vec::new(),
            from_several: Vec::new(),
            points: Vec::with_capacity(if self.options.points { count } else { 0 }),
        };
        let slots = outcomes.iter_mut().zip(changes.iter_mut());
        for ((index, path), (outcome, change)) in motions.zip(&paths).zip(slots) {
            let middle = if straight(index) && path.is_some() { middles.next() } else { None };
            let middle = middle.unwrap_or(f64::INFINITY);
            let mut worked =
                with_budget(budget, || plan_motion(index, self, path.as_ref(), middle, last.as_ref()));
            if budget.exhausted && worked.change.is_some() {
                worked.flag(OutcomeReason::Inverse(InverseError::Abandoned));
            }
            last = worked.segment_plan.take().map(|segment_plan| (index as u32, segment_plan));
            let motion = &self.listing.motions[index];
            let curve = matches!(motion.kind, MotionKind::Linear | MotionKind::Circular);
            if curve && path.is_none() && worked.change.is_some() {
                match with_budget(budget, || self.worst_of_starts(index)) {
                    Some(segment_plan) => {
                        worked.take_worst(&segment_plan);
                        out.from_several.push(index as u32);
                    }
                    None => {
                        if let Some(why) = with_budget(budget, || self.unchecked_path(index)) {
                            worked.flag_if_changed(why);
                        }
                        out.unchecked.push(index as u32);
                    }
                }
            }
            (*outcome, *change) = (worked.outcome, worked.change);
            out.points.extend(worked.point.map(|point| *point));
        }
        out
    }

    fn start(&self, index: usize) -> Option<usize> {
        only_start(self.listing, index)
    }

    /// The motion that begins where another ends, in whichever routine; `None` unless it is one.
    fn end(&self, index: usize) -> Option<usize> {
        let behind = self.listing.motions.get(index + 1);
        if behind.is_some_and(|behind| behind.previous == Some(index as u32)) {
            return Some(index + 1);
        }
        let across_calls = &self.listing.across_calls;
        let first = across_calls.partition_point(|[start, _]| (*start as usize) < index);
        let mut ends = across_calls[first..].iter().take_while(|[start, _]| *start as usize == index);
        let [_, end] = ends.next().filter(|_| ends.next().is_none())?;
        Some(*end as usize)
    }

    /// How the path is rounded where a line begins and where it ends.
    fn rounded_ends(&self, index: usize) -> [RoundedEnd; 2] {
        let start = self.start(index);
        [
            self.rounded_end(start.and_then(|start| self.start(start)), start, Some(index)),
            self.rounded_end(start, Some(index), self.end(index)),
        ]
    }

    /// How the path is rounded at the end of the second of three motions.
    fn rounded_end(&self, before: Option<usize>, corner: Option<usize>, behind: Option<usize>) -> RoundedEnd {
        let points = || {
            let [before, corner, behind] = [before?, corner?, behind?].map(|index| self.solved.of(index));
            let [before, corner, behind] =
                [before.last()?, corner.last()?, behind.first()?].map(|target| target.as_ref().ok());
            let targets = [before?, corner?, behind?];
            let is_one = targets.iter().all(|target| target.frames_index == targets[1].frames_index);
            is_one.then(|| targets.map(|target| target.intended.position_mm()))
        };
        let zone = |index: usize| {
            let zone = self.listing.zone(&self.listing.motions[index])?.value.as_ref().ok()?;
            (!zone.fine).then_some(zone.tcp_mm)
        };
        let is_path = |index: Option<usize>| {
            let kind = index.map(|index| self.listing.motions[index].kind);
            matches!(kind, Some(MotionKind::Linear | MotionKind::Circular))
        };
        match (points(), corner.and_then(zone)) {
            (Some(points), Some(zone_mm)) if is_path(corner) && is_path(behind) => {
                RoundedEnd::of(&points, zone_mm)
            }
            _ => RoundedEnd::default(),
        }
    }

    /// The segment to the end of a motion, in the frames of that motion; `None` unless both ends are corrected.
    fn path(&self, index: usize) -> Option<Segment<'a>> {
        let motion = &self.listing.motions[index];
        if !matches!(motion.kind, MotionKind::Linear | MotionKind::Circular | MotionKind::Joint) {
            return None;
        }
        self.path_from(self.start(index)?, index)
    }

    /// The same from the end of a motion that may come before it.
    fn path_from(&self, previous: usize, index: usize) -> Option<Segment<'a>> {
        let motion = &self.listing.motions[index];
        let before = &self.listing.motions[previous];
        let targets = self.solved.of(previous);
        let changes = |target: &Result<SolvedTarget<'_>, OutcomeReason>| {
            target.as_ref().is_ok_and(|solved| solved.forbidden.is_none())
        };
        if !is_rewritable(before, self.options)
            || !targets.iter().all(changes)
            || self.unchanged.contains_key(&(previous as u32))
        {
            return None;
        }
        let from = segment_end(before, targets, self.frame_table)?;
        let mut to = segment_end(motion, self.solved.of(index), self.frame_table)?;
        let at_poles = &self.listing.nc.at_poles;
        to.between_ends = [previous, index].iter().any(|end| at_poles.contains_key(&(*end as u32)));
        let schedule = self.solved.condition_schedule(index, to.condition_index);
        let from = if from.index == to.index { from } else { from.with_frames_of(&to) };
        Some(Segment { from, to, schedule })
    }

    /// The worst segment to the end of a motion that several motions may come before, without inserted targets: those of a line from one start
    /// do not lie on the line from another. `None` unless all starts are known and corrected.
    fn worst_of_starts(&self, index: usize) -> Option<SegmentPlan> {
        let starts = self.listing.predecessors.get(&(index as u32))?.iter();
        let paths: Vec<Segment<'a>> =
            starts.map(|start| self.path_from(*start as usize, index)).collect::<Option<_>>()?;
        self.worst_of(index, &paths)
    }

    /// The worst of some segments to the end of a motion, without inserted targets.
    fn worst_of(&self, index: usize, paths: &[Segment<'a>]) -> Option<SegmentPlan> {
        let motion =
            Motion { insertable: false, can_straighten: false, ..self.listing.motions[index].clone() };
        let via = circle_point(self.solved.of(index));
        let middles = midpoint_deviations(&paths.iter().collect::<Vec<_>>(), self.arms, self.options.emit);
        let plans = paths.iter().zip(middles);
        let plans = plans.map(|(path, middle)| {
            SegmentPlan::of(&motion, Some(path), via, middle, &Default::default, self.arms, self.options)
        });
        // A segment whose deviation is unknown is the worst.
        let rank = |plan: &SegmentPlan| plan.path_deviation_mm.unwrap_or(f64::INFINITY);
        plans.max_by(|a, b| rank(a).total_cmp(&rank(b)))
    }

    /// Why a line or arc on which the tool may cut is flagged, of which not every start is known and corrected: what it leaves its way by from
    /// the starts that are known, or that others may be. A line with which the program begins has no intended way. Beside an uncorrected
    /// start a step above the tolerance is reported as such.
    fn unchecked_path(&self, index: usize) -> Option<OutcomeReason> {
        let motion = &self.listing.motions[index];
        if !is_path(motion) {
            return None;
        }
        let mut starts = Vec::new();
        self.starts.each(index as u32, |start| starts.push(start as usize));
        // What is counted from the robot's position, mostly the lift of an error handler, has no intended way back.
        starts.retain(|&start| {
            let to = self.listing.motions[start].to();
            to.is_none_or(|to| !matches!(to.value, Err(Reason::CurrentPosition)))
        });
        if starts.is_empty() {
            return None;
        }
        let is_all_known =
            motion.previous.is_some() || self.listing.predecessors.contains_key(&(index as u32));
        let to = self.solved.of(index).last()?.as_ref().ok()?;
        if is_all_known && !(to.shift_mm() <= self.options.tolerance_mm) {
            let moves = |start: &usize| self.listing.motions[*start].kind != MotionKind::Unknown;
            return (!starts.iter().all(moves)).then_some(OutcomeReason::UncheckedPath);
        }
        let from =
            |start: &usize| self.path_from(*start, index).or_else(|| self.path_from_left(*start, index));
        let paths: Vec<Segment<'a>> = starts.iter().filter_map(from).collect();
        let is_whole = is_all_known && paths.len() == starts.len();
        let worst = self.worst_of(index, &paths).and_then(|worst| worst.flag);
        // Where nothing else may move the arm, the start that is not known is that of a repetition after an error: it was checked without.
        let moves_elsewhere =
            !self.listing.outside_calls.is_empty() || !self.listing.nc.external_calls.is_empty();
        worst.or((!is_whole && (moves_elsewhere || paths.is_empty())).then_some(OutcomeReason::UncheckedPath))
    }

    /// The segment to the end of a motion from one that is not corrected: it begins where the arm is with the original program.
    fn path_from_left(&self, previous: usize, index: usize) -> Option<Segment<'a>> {
        let before = &self.listing.motions[previous];
        let to = segment_end(&self.listing.motions[index], self.solved.of(index), self.frame_table)?;
        let end = self.solved.of(previous).last()?.as_ref().ok()?;
        let real = &self.frame_table.list[end.frames_index].real;
        let stays = SegmentEnd {
            intended: real.target_of(&self.arms.conditions.arm(end.condition_index).forward(&end.before)),
            commanded: end.intended.pose(),
            joints: end.before,
            ..segment_end(before, self.solved.of(previous), self.frame_table)?
        };
        let schedule = self.solved.condition_schedule(index, to.condition_index);
        let from = if stays.index == to.index { stays } else { stays.with_frames_of(&to) };
        Some(Segment { from, to, schedule })
    }

    /// Deviation from the intended corner at the start of a motion, where the robot rounds it. `last`: segment plan of the
    /// previously planned motion.
    fn corner(
        &self,
        index: usize,
        path: Option<&Segment<'a>>,
        segment_plan: &SegmentPlan,
        last: Option<&(u32, SegmentPlan)>,
    ) -> Option<f64> {
        let motion = &self.listing.motions[index];
        let Segment { from: point, to, schedule } = path?;
        segment_plan.curves.as_ref()?;
        let previous = self.start(index)?;
        let before = &self.listing.motions[previous];
        let zone_mm = self.listing.zone(before)?.value.as_ref().ok().filter(|zone| !zone.fine)?.tcp_mm;
        // The manuals do not specify how a corner continues under another tool or work object.
        if self.solved.of(previous).last()?.as_ref().ok()?.frames_index != point.index {
            return None;
        }
        if before.kind == MotionKind::Linear && motion.kind == MotionKind::Linear {
            // Nearly all lines continue almost straight; three points show that.
            let first = self.solved.of(self.start(previous)?).last()?.as_ref().ok()?;
            let [from, to] = [point, to].map(|end| end.intended.translation.vector);
            let points = [first.intended.position_mm(), from, to];
            if !(cut_of_lines(&points, zone_mm) > CUT_MM) {
                return None;
            }
        }
        let condition_indices = [point.condition_index, schedule.at(0.0)];
        let deviation = |segment_in: &SegmentPlan| {
            corner(point, segment_in, segment_plan, zone_mm, condition_indices, self.arms, self.options.emit)
        };
        if let Some((index, segment_in)) = last
            && *index as usize == previous
        {
            return deviation(segment_in);
        }
        let path = self.path(previous)?;
        let middle = midpoint_deviations(&[&path], self.arms, self.options.emit)[0];
        let via = circle_point(self.solved.of(previous));
        let corners = || self.rounded_ends(previous);
        deviation(&SegmentPlan::of(before, Some(&path), via, middle, &corners, self.arms, self.options))
    }
}

/// Plans one motion. `middle_mm`: deviation of its commanded line at the midpoint. `last`: segment plan of the previously
/// planned motion.
fn plan_motion<'a>(
    index: usize,
    job: &Planner<'a>,
    path: Option<&Segment<'a>>,
    middle_mm: f64,
    last: Option<&(u32, SegmentPlan)>,
) -> PlannedMotion {
    let Planner { listing, solved, arms, options, .. } = *job;
    let motion = &listing.motions[index];
    let mut outcome = MotionOutcome::left(index as u32);
    let finish = |mut outcome: MotionOutcome,
                  status: MotionStatus,
                  reason: Option<OutcomeReason>,
                  change,
                  point: Option<Box<PathPoint>>| {
        outcome.status = status;
        outcome.reason = reason.map(Box::new);
        let point = point.map(|mut p| {
            p.status = status;
            p.reason = reason.map(|r| r.to_string());
            if !status.is_written() {
                (p.after, p.joints_after) = (p.before, p.joints_before);
            }
            p
        });
        PlannedMotion { change, outcome, point, segment_plan: None }
    };
    let targets = solved.of(index);
    let point = match targets.last() {
        Some(Ok(to)) => {
            // Of an arc the circle point counts as well.
            outcome.before_mm = largest_mm(targets, 0).into();
            outcome.after_mm = outcome.before_mm;
            outcome.sigma_mm = to.sigma_mm.into();
            outcome.shape_sigma_mm = to.shape_sigma_mm;
            options.points.then(|| {
                let real = &job.frame_table.list[to.frames_index].real;
                let shape_alone = job.assessment.shape_alone(index as u32);
                Box::new(path_point(motion, to, real, part_of_motion(motion, job.part_of), shape_alone))
            })
        }
        _ => None,
    };
    if let Some((status, why)) = blocking_reason(index as u32, listing, solved, options, job.unchanged) {
        return finish(outcome, status, Some(why), None, point);
    }
    let solved_targets = || targets.iter().flatten();
    // The segment from the previous motion.
    let corners = || job.rounded_ends(index);
    let segment_plan =
        SegmentPlan::of(motion, path, circle_point(targets), middle_mm, &corners, arms, options);
    (outcome.path_deviation_mm, outcome.inserted) =
        (segment_plan.path_deviation_mm.into(), segment_plan.before.len() as u32);
    // All other flags hold only for the guessed configuration, so this one takes precedence.
    let guessed = motion.accepts_configuration && solved_targets().any(|s| s.guess != BranchGuess::Known);
    let mut flag = if guessed { Some(OutcomeReason::UnknownStart) } else { segment_plan.flag };
    if let Some(corner) = job.corner(index, path, &segment_plan, last) {
        let deviation = outcome.path_deviation_mm.get();
        outcome.path_deviation_mm = deviation.map_or(corner, |deviation| deviation.max(corner)).into();
        if !(corner <= options.tolerance_mm) {
            // Of the line and the corner before it the worse is named.
            let is_worse =
                flag.is_none_or(|flag| matches!(flag, OutcomeReason::PathDeviation { mm } if mm < corner));
            if is_worse {
                flag = Some(OutcomeReason::CornerDeviation { mm: corner });
            }
        }
    }
    let flag =
        flag.or_else(|| path.and_then(|path| too_fast(index, motion, listing, path, &segment_plan, arms)));
    let flag = flag.or_else(|| solved_targets().find_map(|s| uncertainty_flag(s, job.measured_sigma_mm)));
    let new = |(target, solved): (&MotionTarget, &SolvedTarget<'_>)| match target.role {
        Role::Via if segment_plan.straight => NewTarget::Drop,
        _ => new_target(target, solved, motion, options),
    };
    let new_targets = motion.targets.iter().zip(solved_targets()).map(new).collect();
    outcome.after_mm = largest_mm(targets, 1).into();
    let change = Change { motion: index as u32, targets: new_targets, before: segment_plan.before.clone() };
    let status = if flag.is_some() { MotionStatus::Flagged } else { MotionStatus::Changed };
    PlannedMotion { segment_plan: Some(segment_plan), ..finish(outcome, status, flag, Some(change), point) }
}

/// The largest deviation of the targets of a motion, before (0) or after (1) the correction (mm).
fn largest_mm(targets: &[Result<SolvedTarget<'_>, OutcomeReason>], side: usize) -> Option<f64> {
    targets.iter().flatten().map(|target| target.deviation_mm[side]).reduce(f64::max)
}

/// The circle point of a motion with one.
fn circle_point<'s, 'a>(
    targets: &'s [Result<SolvedTarget<'a>, OutcomeReason>],
) -> Option<&'s SolvedTarget<'a>> {
    let [Ok(via), Ok(_)] = targets else { return None };
    Some(via)
}

/// A joint that would exceed its speed limit at the programmed speed: the controller slows down there, or stops.
fn too_fast(
    index: usize,
    motion: &Motion,
    listing: &Listing,
    Segment { from, to, .. }: &Segment<'_>,
    segment_plan: &SegmentPlan,
    arms: &Arms<'_>,
) -> Option<OutcomeReason> {
    let pace = if motion.timed {
        Pace::Duration(*listing.durations_s.get(&(index as u32))?.as_ref().ok()?)
    } else {
        Pace::Speed(listing.speed(motion)?.value.as_ref().ok()?)
    };
    let [_, commanded] = segment_plan.curves.as_ref()?;
    let (joint, ratio) = fastest(from, to, commanded, &pace, arms)?;
    (ratio > 1.0).then_some(OutcomeReason::TooFast { joint, ratio })
}

fn uncertainty_flag(solved: &SolvedTarget<'_>, measured_sigma_mm: &[f64]) -> Option<OutcomeReason> {
    match solved.outside.as_deref().copied() {
        Some(Outside::Joint { joint, by_deg }) => {
            return Some(OutcomeReason::JointNotMeasured { joint, by_deg });
        }
        Some(Outside::Coverage { ratio }) => return Some(OutcomeReason::NotCovered { ratio }),
        None => {}
    }
    (solved.sigma_mm > SIGMA_GROWTH * measured_sigma_mm[solved.frames_index])
        .then_some(OutcomeReason::Uncertain { sigma_mm: solved.sigma_mm })
}

/// A pose whose predicted σ exceeds that of the same tool at the worst measured pose by this factor is flagged.
const SIGMA_GROWTH: f64 = 2.0;

fn new_target(
    target: &MotionTarget,
    solved: &SolvedTarget<'_>,
    motion: &Motion,
    options: &Options,
) -> NewTarget {
    if as_joints(motion, target, options.emit) {
        return NewTarget::Joint { robot_deg: std::array::from_fn(|i| solved.after[i].to_degrees()) };
    }
    let q = solved.commanded.rotation.quaternion();
    let old = target.value.ok().and_then(|v| v.cartesian().map(|t| t.conf));
    let new = [solved.conf.cf1, solved.conf.cf4, solved.conf.cf6, solved.conf.cfx];
    // An unmonitored dummy configuration remains unchanged; so does cfx where only the quarter turns are
    // used.
    let conf = match old {
        Some(old) if monitored(motion) != Switch::Off && old[..3] != new[..3] => {
            Some([new[0], new[1], new[2], old[3]])
        }
        _ => None,
    };
    NewTarget::Cartesian {
        position_mm: solved.commanded.translation.vector.into(),
        quaternion: [q.w, q.i, q.j, q.k],
        conf,
    }
}

fn path_point(
    motion: &Motion,
    solved: &SolvedTarget<'_>,
    real: &FramePair,
    part: u32,
    shape_alone: bool,
) -> PathPoint {
    let shape_sigma_mm = solved.shape_sigma_mm.get();
    let of_shape = shape_sigma_mm.filter(|_| shape_alone);
    let intended = solved.intended.pose();
    let flange = real.flange_for(&intended);
    let base_from_object = real.base_from_object(&flange);
    PathPoint {
        index: 0,
        file: motion.place.file,
        line: motion.place.line,
        instruction: motion.instruction.to_string(),
        kind: motion.kind,
        cutting: matches!(motion.kind, MotionKind::Linear | MotionKind::Circular),
        base_from_object,
        part,
        part_from_object: real.object,
        flange_from_tool: real.flange_from_tool(&flange),
        intended: base_from_object * intended,
        normal: None,
        joints_before: Some(solved.before),
        joints_after: Some(solved.after),
        before: solved.deviations.as_ref().map(|deviations| deviations[0]),
        after: solved.deviations.as_ref().map(|deviations| deviations[1]),
        sigma_mm: Some(of_shape.unwrap_or(solved.sigma_mm)),
        shape_sigma_mm,
        outside: solved.outside.as_deref().copied(),
        status: MotionStatus::Changed,
        reason: None,
    }
}
