//! Circular motions that stay because their corrected points make no circle, or one that strays from what was meant.
//!
//! A circle hangs on where it starts. Where the motion before is corrected as well the circle moves as a whole; where it
//! is not, two points of three move, and of a circle that is small against the correction another one becomes. The same
//! holds the other way round: a circle that stays becomes another one where the motion before it is corrected.

use std::collections::BTreeMap;

use crate::frames::frame_table::FrameTable;
use crate::options::{Options, is_rewritable};
use crate::plan::reason::OutcomeReason;
use crate::segment::curve::{CLOSED_MM, Curve};
use crate::segment::line::distance;
use crate::target::solved_target::{SolvedTarget, SolvedTargets};
use truegrind_math::se3::Pose;
use truegrind_programs::motion::{Listing, Motion, MotionKind, MotionTarget, TargetValue};

/// How much more or less of a turn the told circle may be than the one that was meant (rad).
const TURN_RAD: f64 = 0.5;

/// How far it may leave that one, in corrections.
const SHARE: f64 = 1.5;

/// The same for points that are not corrected at all (mm).
const NEAR_MM: f64 = 5e-3;

/// The largest correction of a circle whose start is not known, in distances of its two points.
const UNKNOWN_SHARE: f64 = 0.25;

/// Places on a circle that are looked at.
const SAMPLES: u8 = 12;

/// The motions of a listing that cannot be corrected for such a reason, by index. `stays`: motions that are not corrected
/// for other reasons than their own targets.
pub(crate) fn infeasible_arcs(
    listing: &Listing,
    solved: &SolvedTargets,
    frame_table: &FrameTable,
    options: &Options,
    stays: &BTreeMap<u32, OutcomeReason>,
) -> BTreeMap<u32, OutcomeReason> {
    let mut infeasible_arcs = circles(listing, solved, frame_table, options, stays);
    let corrected = |index: u32, infeasible_arcs: &BTreeMap<u32, OutcomeReason>| {
        is_rewritable(&listing.motions[index as usize], options)
            && all_corrected(solved.of(index as usize))
            && !stays.contains_key(&index)
            && !infeasible_arcs.contains_key(&index)
    };
    for (index, motion) in (0_u32..).zip(&listing.motions) {
        if motion.kind == MotionKind::Circular
            && let Some(previous) = motion.previous
            && corrected(previous, &infeasible_arcs)
            && !corrected(index, &infeasible_arcs)
            && let Some(Ok(start)) = solved.of(previous as usize).last()
            && changes_unmodified_arc(start, motion, frame_table)
        {
            infeasible_arcs.insert(previous, OutcomeReason::StartOfUnchangedArc { line: motion.place.line });
        }
    }
    infeasible_arcs
}

/// Whether all targets of a motion can be corrected.
fn all_corrected(targets: &[Result<SolvedTarget, OutcomeReason>]) -> bool {
    let can =
        |target: &Result<SolvedTarget, _>| target.as_ref().is_ok_and(|solved| solved.forbidden.is_none());
    !targets.is_empty() && targets.iter().all(can)
}

/// The circular motions among them.
fn circles(
    listing: &Listing,
    solved: &SolvedTargets,
    frame_table: &FrameTable,
    options: &Options,
    stays: &BTreeMap<u32, OutcomeReason>,
) -> BTreeMap<u32, OutcomeReason> {
    let mut infeasible_arcs = BTreeMap::new();
    for (index, motion) in (0_u32..).zip(&listing.motions) {
        if motion.kind != MotionKind::Circular
            || !is_rewritable(motion, options)
            || stays.contains_key(&index)
        {
            continue;
        }
        let ([Ok(via), Ok(to)], Some(previous)) = (solved.of(index as usize), motion.previous) else {
            continue;
        };
        let before = &listing.motions[previous as usize];
        let targets = solved.of(previous as usize);
        let from = solved.original_end(previous as usize).filter(|from| from.frames_index == to.frames_index);
        if from.is_some_and(|from| no_circle(&from.intended, via, to, motion)) {
            infeasible_arcs.insert(index, OutcomeReason::NoCircle);
            continue;
        }
        let corrected = is_rewritable(before, options)
            && all_corrected(targets)
            && !infeasible_arcs.contains_key(&previous)
            && !stays.contains_key(&previous);
        if corrected {
            continue;
        }
        let start = match from {
            Some(from) => Some(from.intended),
            None => stated(before, to.frames_index, frame_table),
        };
        if changes_arc(start, via, to, motion) {
            infeasible_arcs.insert(index, OutcomeReason::NoCircle);
        }
    }
    infeasible_arcs
}

/// Whether a circle has a known start with which its points make none. One that closes is another matter: its ends say
/// nothing of its plane.
fn no_circle(from: &Pose, via: &SolvedTarget, to: &SolvedTarget, motion: &Motion) -> bool {
    distance(&from.translation.vector, &to.intended.translation.vector) >= CLOSED_MM
        && Curve::round(*from, &via.intended, to.intended, motion).is_none()
}

/// Where a motion that stays ends, in the frames of the one after it.
fn stated(before: &Motion, frames_index: usize, frame_table: &FrameTable) -> Option<Pose> {
    let Ok(TargetValue::Cartesian(target)) = before.to()?.value else { return None };
    (frame_table.of_motion(before).ok()? == frames_index).then(|| target.pose())
}

/// Whether the circle from a start that is not corrected through two corrected points is another one than was meant.
fn changes_arc(start: Option<Pose>, via: &SolvedTarget, to: &SolvedTarget, motion: &Motion) -> bool {
    let shift = via.shift_mm().max(to.shift_mm());
    let Some(start) = start else {
        return shift
            > UNKNOWN_SHARE * distance(&via.intended.translation.vector, &to.intended.translation.vector);
    };
    if distance(&start.translation.vector, &to.intended.translation.vector) < CLOSED_MM {
        // A whole circle whose ends do not meet is none.
        return shift > CLOSED_MM;
    }
    let intended = Curve::round(start, &via.intended, to.intended, motion);
    let commanded = Curve::round(start, &via.commanded, to.commanded, motion);
    is_another_arc(intended, commanded, shift)
}

/// Whether a circle that stays becomes another one where its start alone is corrected; also where the text does not tell its
/// points.
fn changes_unmodified_arc(start: &SolvedTarget, motion: &Motion, frame_table: &FrameTable) -> bool {
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
    if distance(&start.intended.translation.vector, &to.translation.vector) < CLOSED_MM {
        return shift > CLOSED_MM;
    }
    let intended = Curve::round(start.intended, &via, to, motion);
    // Points that make no circle stop the controller as the program is.
    intended.is_some() && is_another_arc(intended, Curve::round(start.commanded, &via, to, motion), shift)
}

/// Whether a told circle is another one than was meant, where what is corrected moves by `shift` (mm).
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
