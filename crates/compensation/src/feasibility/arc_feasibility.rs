//! Arcs that must remain unmodified, or that pin the start before them, because correction would make them different arcs.
//!
//! An arc depends on its start. If the previous motion is corrected too, the arc moves as a whole; otherwise two of its three
//! points move, and an arc that is small compared with the correction becomes a different one. Conversely, an unmodified arc
//! becomes a different one where the motion before it is corrected. The controller stops at an arc whose points lie too near to
//! each other or to a line: none may become so short or so flat. Where the start is known only at run time, neither is checked.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::frames::frame_table::FrameTable;
use crate::options::{Options, is_rewritable};
use crate::plan::reason::OutcomeReason;
use crate::search_budget::MANY_MOTIONS;
use crate::segment::curve::{CLOSED_MM, Curve};
use crate::segment::line::distance;
use crate::target::solved_target::{SolvedTarget, SolvedTargets};
use truegrind_math::se3::Pose;
use truegrind_programs::motion::{Listing, Motion, MotionKind, MotionTarget, TargetValue};

/// Largest difference in swept angle between commanded and intended arc (rad).
const TURN_RAD: f64 = 0.5;

/// Largest distance from the intended arc, in corrections.
const SHARE: f64 = 1.5;

/// Additional distance allowed for uncorrected points (mm).
const NEAR_MM: f64 = 5e-3;

/// Largest correction of an arc with unknown start, relative to the distance of its two points.
const UNKNOWN_SHARE: f64 = 0.25;

/// Number of samples on an arc.
const SAMPLES: u8 = 12;

/// A controller takes three points for a circle if circle point and end are at least as far from the start (mm), and seen from it
/// under at least this angle (rad). Source: ABB, Technical reference manual, RAPID instructions, MoveC, limitations.
const MIN_DISTANCE_MM: f64 = 0.1;
const MIN_ANGLE_RAD: f64 = std::f64::consts::PI / 180.0;

/// The motions that arcs forbid to correct, by index. `stays`: motions that remain unmodified for reasons other than their
/// own targets.
pub(crate) fn infeasible_arcs(
    listing: &Listing,
    solved: &SolvedTargets<'_>,
    frame_table: &FrameTable,
    options: &Options,
    unchanged_motions: &BTreeMap<u32, OutcomeReason>,
) -> BTreeMap<u32, OutcomeReason> {
    let circular = circular(listing);
    let mut infeasible_arcs = circles(&circular, listing, solved, frame_table, options, unchanged_motions);
    let corrected = |index: u32, infeasible_arcs: &BTreeMap<u32, OutcomeReason>| {
        is_corrected(index, listing, solved, options, unchanged_motions)
            && !infeasible_arcs.contains_key(&index)
    };
    for index in circular {
        let motion = &listing.motions[index as usize];
        if let Some(previous) = motion.previous
            && corrected(previous, &infeasible_arcs)
            && !corrected(index, &infeasible_arcs)
            && let Some(Ok(start)) = solved.of(previous as usize).last()
            && (changes_unmodified_arc(start, motion, frame_table)
                || stops_unmodified_arc(start, motion, frame_table))
        {
            infeasible_arcs.insert(previous, OutcomeReason::StartOfUnchangedArc { line: motion.place.line });
        }
    }
    infeasible_arcs
}

/// The circular motions, by index: few of many.
fn circular(listing: &Listing) -> Vec<u32> {
    let motions = listing.motions.par_iter().with_min_len(MANY_MOTIONS).enumerate();
    motions.filter(|(_, motion)| motion.kind == MotionKind::Circular).map(|(index, _)| index as u32).collect()
}

/// Whether a motion is corrected, as far as is known.
pub(super) fn is_corrected(
    index: u32,
    listing: &Listing,
    solved: &SolvedTargets<'_>,
    options: &Options,
    unchanged_motions: &BTreeMap<u32, OutcomeReason>,
) -> bool {
    is_rewritable(&listing.motions[index as usize], options)
        && all_corrected(solved.of(index as usize))
        && !unchanged_motions.contains_key(&index)
}

/// Whether all targets of a motion can be corrected.
fn all_corrected(targets: &[Result<SolvedTarget<'_>, OutcomeReason>]) -> bool {
    let can =
        |target: &Result<SolvedTarget<'_>, _>| target.as_ref().is_ok_and(|solved| solved.forbidden.is_none());
    !targets.is_empty() && targets.iter().all(can)
}

/// The arcs themselves that must remain unmodified.
fn circles(
    circular: &[u32],
    listing: &Listing,
    solved: &SolvedTargets<'_>,
    frame_table: &FrameTable,
    options: &Options,
    unchanged_motions: &BTreeMap<u32, OutcomeReason>,
) -> BTreeMap<u32, OutcomeReason> {
    let mut infeasible_arcs = BTreeMap::new();
    for &index in circular {
        let motion = &listing.motions[index as usize];
        if !is_rewritable(motion, options) || unchanged_motions.contains_key(&index) {
            continue;
        }
        let ([Ok(via), Ok(to)], Some(previous)) = (solved.of(index as usize), motion.previous) else {
            continue;
        };
        let before = &listing.motions[previous as usize];
        let targets = solved.of(previous as usize);
        let from = solved.original_end(previous as usize).filter(|from| from.frames_index == to.frames_index);
        if from.as_ref().is_some_and(|from| no_circle(&from.intended.pose(), via, to, motion)) {
            infeasible_arcs.insert(index, OutcomeReason::NoCircle);
            continue;
        }
        let corrected = is_rewritable(before, options)
            && all_corrected(targets)
            && !infeasible_arcs.contains_key(&previous)
            && !unchanged_motions.contains_key(&previous);
        let original =
            solved.original_end(previous as usize).map(|end| (end.frames_index, end.intended.pose()));
        if let Some((frames_index, original)) = original.or_else(|| stated_end(before, frame_table)) {
            let now = match targets.last() {
                Some(Ok(end)) if corrected => end.commanded,
                _ => original,
            };
            let [start, now] =
                [original, now].map(|pose| seen_from(&pose, frames_index, to.frames_index, frame_table));
            let told = [start, via.intended.pose(), to.intended.pose()];
            if stops(motion, &told, &[now, via.commanded, to.commanded]) {
                infeasible_arcs.insert(index, OutcomeReason::NoCircle);
                continue;
            }
        }
        if corrected {
            continue;
        }
        let start = match from {
            Some(from) => Some(from.intended.pose()),
            None => stated(before, to.frames_index, frame_table),
        };
        if changes_arc(start, via, to, motion) {
            let line = before.place.line;
            let reason =
                start.map_or(OutcomeReason::NoCircle, |_| OutcomeReason::ArcFromUncorrected { line });
            infeasible_arcs.insert(index, reason);
        }
    }
    infeasible_arcs
}

/// Whether the points of an arc with known start make no circle. Full circles are a separate case: their coincident ends do
/// not determine their plane.
fn no_circle(from: &Pose, via: &SolvedTarget<'_>, to: &SolvedTarget<'_>, motion: &Motion) -> bool {
    distance(&from.translation.vector, &to.intended.pose().translation.vector) >= CLOSED_MM
        && Curve::round(*from, &via.intended.pose(), to.intended.pose(), motion).is_none()
}

/// A pose that one pair of frames states, as another states it where the arm does not move.
fn seen_from(pose: &Pose, stated: usize, wanted: usize, frame_table: &FrameTable) -> Pose {
    if stated == wanted {
        return *pose;
    }
    let [stated, wanted] = [stated, wanted].map(|index| &frame_table.list[index].commanded);
    wanted.target_of(&stated.flange_for(pose))
}

/// Whether the controller stops at an arc through start, circle point and end as they are `after`, but not as they were `before`.
/// An NC block states the arc itself and is subject to no such limits.
fn stops(motion: &Motion, before: &[Pose; 3], after: &[Pose; 3]) -> bool {
    motion.axis.is_none() && makes_circle(before) && !makes_circle(after)
}

/// Whether three points are far enough from each other and from a line for a controller.
fn makes_circle([from, via, to]: &[Pose; 3]) -> bool {
    let [via, to] = [via, to].map(|point| point.translation.vector - from.translation.vector);
    via.norm() >= MIN_DISTANCE_MM && to.norm() >= MIN_DISTANCE_MM && via.angle(&to) >= MIN_ANGLE_RAD
}

/// Whether the controller stops at an unmodified arc if only its start is corrected.
fn stops_unmodified_arc(start: &SolvedTarget<'_>, motion: &Motion, frame_table: &FrameTable) -> bool {
    let Ok(wanted) = frame_table.of_motion(motion) else { return false };
    let pose = |target: &MotionTarget| target.value.as_ref().ok()?.cartesian().map(|target| target.pose());
    let [Some(via), Some(to)] = [0, 1].map(|k| motion.targets.get(k).and_then(pose)) else {
        return false;
    };
    let from = |pose: &Pose| seen_from(pose, start.frames_index, wanted, frame_table);
    stops(motion, &[from(&start.intended.pose()), via, to], &[from(&start.commanded), via, to])
}

/// End of an unmodified motion, in the frames of the following one.
fn stated(before: &Motion, frames_index: usize, frame_table: &FrameTable) -> Option<Pose> {
    stated_end(before, frame_table).filter(|end| end.0 == frames_index).map(|end| end.1)
}

/// End of an unmodified motion, with its frames.
fn stated_end(before: &Motion, frame_table: &FrameTable) -> Option<(usize, Pose)> {
    let Ok(TargetValue::Cartesian(target)) = before.to()?.value else { return None };
    Some((frame_table.of_motion(before).ok()?, target.pose()))
}

/// Whether two corrected points and an uncorrected start make a different arc than intended.
fn changes_arc(start: Option<Pose>, via: &SolvedTarget<'_>, to: &SolvedTarget<'_>, motion: &Motion) -> bool {
    let shift = via.shift_mm().max(to.shift_mm());
    let Some(start) = start else {
        return shift
            > UNKNOWN_SHARE
                * distance(&via.intended.pose().translation.vector, &to.intended.pose().translation.vector);
    };
    if distance(&start.translation.vector, &to.intended.pose().translation.vector) < CLOSED_MM {
        // Full circles need coincident ends.
        return shift > CLOSED_MM;
    }
    let intended = Curve::round(start, &via.intended.pose(), to.intended.pose(), motion);
    let commanded = Curve::round(start, &via.commanded, to.commanded, motion);
    is_another_arc(intended, commanded, shift)
}

/// Whether an unmodified arc becomes a different one if only its start is corrected; also where the program does not
/// determine its points.
fn changes_unmodified_arc(start: &SolvedTarget<'_>, motion: &Motion, frame_table: &FrameTable) -> bool {
    let shift = start.shift_mm();
    let pose = |target: &MotionTarget| match target.value {
        Ok(TargetValue::Cartesian(target)) => Some(target.pose()),
        _ => None,
    };
    let [Some(via), Some(to)] = [0, 1].map(|k| motion.targets.get(k).and_then(pose)) else {
        return shift > NEAR_MM;
    };
    if !frame_table.of_motion(motion).is_ok_and(|frames_index| frames_index == start.frames_index) {
        return shift > UNKNOWN_SHARE * distance(&via.translation.vector, &to.translation.vector);
    }
    if distance(&start.intended.pose().translation.vector, &to.translation.vector) < CLOSED_MM {
        return shift > CLOSED_MM;
    }
    let intended = Curve::round(start.intended.pose(), &via, to, motion);
    // Points that make no circle already stop the controller in the original program.
    intended.is_some() && is_another_arc(intended, Curve::round(start.commanded, &via, to, motion), shift)
}

/// Whether a commanded arc differs from the intended one, for corrections of size `shift` (mm).
fn is_another_arc(intended: Option<Curve>, commanded: Option<Curve>, shift: f64) -> bool {
    let (Some(intended), Some(commanded)) = (intended, commanded) else { return true };
    let turn = |curve: &Curve| curve.arc().map_or(0.0, |arc| arc.sweep);
    let off = |k: u8| {
        let s = f64::from(k) / f64::from(SAMPLES);
        intended.distance(&commanded.at(s), s)
    };
    (turn(&intended) - turn(&commanded)).abs() > TURN_RAD
        || (1..SAMPLES).any(|k| off(k) > SHARE * shift + NEAR_MM)
}
