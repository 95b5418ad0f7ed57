//! Circular motions that stay because their corrected points make no circle, or one that strays from what was meant.
//!
//! A circle hangs on where it starts. Where the motion before is corrected as well the circle moves as a whole; where it
//! is not, two points of three move, and of a circle that is small against the correction another one becomes. The same
//! holds the other way round: a circle that stays becomes another one where the motion before it is corrected.

use std::collections::BTreeMap;

use crate::frames::frame_table::Mountings;
use crate::options::{Options, may_change};
use crate::plan::reason::Why;
use crate::segment::curve::{CLOSED_MM, Curve};
use crate::segment::line::gap;
use crate::target::solved_target::{Solved, SolvedTargets};
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
pub(crate) fn strayed(
    listing: &Listing,
    solved: &SolvedTargets,
    mountings: &Mountings,
    options: &Options,
    stays: &BTreeMap<u32, Why>,
) -> BTreeMap<u32, Why> {
    let mut strayed = circles(listing, solved, mountings, options, stays);
    let corrected = |index: u32, strayed: &BTreeMap<u32, Why>| {
        may_change(&listing.motions[index as usize], options)
            && all_corrected(solved.of(index as usize))
            && !stays.contains_key(&index)
            && !strayed.contains_key(&index)
    };
    for (index, motion) in (0_u32..).zip(&listing.motions) {
        if motion.kind == MotionKind::Circular
            && let Some(previous) = motion.previous
            && corrected(previous, &strayed)
            && !corrected(index, &strayed)
            && let Some(Ok(start)) = solved.of(previous as usize).last()
            && turned(start, motion, mountings)
        {
            strayed.insert(previous, Why::BeforeCircle { line: motion.place.line });
        }
    }
    strayed
}

/// Whether all targets of a motion can be corrected.
fn all_corrected(targets: &[Result<Solved, Why>]) -> bool {
    let can = |target: &Result<Solved, _>| target.as_ref().is_ok_and(|solved| solved.forbidden.is_none());
    !targets.is_empty() && targets.iter().all(can)
}

/// The circular motions among them.
fn circles(
    listing: &Listing,
    solved: &SolvedTargets,
    mountings: &Mountings,
    options: &Options,
    stays: &BTreeMap<u32, Why>,
) -> BTreeMap<u32, Why> {
    let mut strayed = BTreeMap::new();
    for (index, motion) in (0_u32..).zip(&listing.motions) {
        if motion.kind != MotionKind::Circular || !may_change(motion, options) || stays.contains_key(&index) {
            continue;
        }
        let ([Ok(via), Ok(to)], Some(previous)) = (solved.of(index as usize), motion.previous) else {
            continue;
        };
        let before = &listing.motions[previous as usize];
        let targets = solved.of(previous as usize);
        let from = solved.end_as_it_is(previous as usize).filter(|from| from.mounted == to.mounted);
        if from.is_some_and(|from| no_circle(&from.meant, via, to, motion)) {
            strayed.insert(index, Why::NoCircle);
            continue;
        }
        let corrected = may_change(before, options)
            && all_corrected(targets)
            && !strayed.contains_key(&previous)
            && !stays.contains_key(&previous);
        if corrected {
            continue;
        }
        let start = match from {
            Some(from) => Some(from.meant),
            None => stated(before, to.mounted, mountings),
        };
        if strays(start, via, to, motion) {
            strayed.insert(index, Why::NoCircle);
        }
    }
    strayed
}

/// Whether a circle has a known start with which its points make none. One that closes is another matter: its ends say
/// nothing of its plane.
fn no_circle(from: &Pose, via: &Solved, to: &Solved, motion: &Motion) -> bool {
    gap(&from.translation.vector, &to.meant.translation.vector) >= CLOSED_MM
        && Curve::round(*from, &via.meant, to.meant, motion).is_none()
}

/// Where a motion that stays ends, in the frames of the one after it.
fn stated(before: &Motion, mounted: usize, mountings: &Mountings) -> Option<Pose> {
    let Ok(TargetValue::Cartesian(target)) = before.to()?.value else { return None };
    (mountings.of_motion(before).ok()? == mounted).then(|| target.pose())
}

/// Whether the circle from a start that is not corrected through two corrected points is another one than was meant.
fn strays(start: Option<Pose>, via: &Solved, to: &Solved, motion: &Motion) -> bool {
    let shift = via.shift_mm().max(to.shift_mm());
    let Some(start) = start else {
        return shift > UNKNOWN_SHARE * gap(&via.meant.translation.vector, &to.meant.translation.vector);
    };
    if gap(&start.translation.vector, &to.meant.translation.vector) < CLOSED_MM {
        // A whole circle whose ends do not meet is none.
        return shift > CLOSED_MM;
    }
    let meant = Curve::round(start, &via.meant, to.meant, motion);
    let told = Curve::round(start, &via.told, to.told, motion);
    is_another(meant, told, shift)
}

/// Whether a circle that stays becomes another one where its start alone is corrected; also where the text does not tell its
/// points.
fn turned(start: &Solved, motion: &Motion, mountings: &Mountings) -> bool {
    let shift = start.shift_mm();
    let pose = |target: &MotionTarget| match target.value {
        Ok(TargetValue::Cartesian(target)) => Some(target.pose()),
        _ => None,
    };
    let [Some(via), Some(to)] = [0, 1].map(|k| motion.targets.get(k).and_then(pose)) else {
        return shift > NEAR_MM;
    };
    if !mountings.of_motion(motion).is_ok_and(|mounted| mounted == start.mounted) {
        return shift > UNKNOWN_SHARE * gap(&via.translation.vector, &to.translation.vector);
    }
    if gap(&start.meant.translation.vector, &to.translation.vector) < CLOSED_MM {
        return shift > CLOSED_MM;
    }
    let meant = Curve::round(start.meant, &via, to, motion);
    // Points that make no circle stop the controller as the program is.
    meant.is_some() && is_another(meant, Curve::round(start.told, &via, to, motion), shift)
}

/// Whether a told circle is another one than was meant, where what is corrected moves by `shift` (mm).
fn is_another(meant: Option<Curve>, told: Option<Curve>, shift: f64) -> bool {
    let (Some(meant), Some(told)) = (meant, told) else { return true };
    let turn = |curve: &Curve| curve.arc().map_or(0.0, |arc| arc.sweep);
    let off = |k: u8| {
        let s = f64::from(k) / f64::from(SAMPLES);
        meant.distance(&told.at(s), s)
    };
    (turn(&meant) - turn(&told)).abs() > TURN_RAD || (1..SAMPLES).any(|k| off(k) > SHARE * shift + NEAR_MM)
}
