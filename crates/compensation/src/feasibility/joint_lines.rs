//! Lines that cannot be written as joints: the controller would follow no line there, and no targets between can be inserted, since where
//! the motion starts is not known or since the program forbids it.

use std::collections::BTreeMap;

use super::arc_feasibility::is_corrected;
use crate::options::{Emit, Options};
use crate::plan::Plan;
use crate::plan::reason::OutcomeReason;
use crate::target::solved_target::SolvedTargets;
use truegrind_programs::motion::{Listing, MotionKind};

/// The lines whose start is unknown or not corrected, by index, if targets are written as joints. `unchanged_motions`: motions that
/// remain unmodified.
pub(crate) fn lines_without_start(
    listing: &Listing,
    solved: &SolvedTargets<'_>,
    options: &Options,
    unchanged_motions: &BTreeMap<u32, OutcomeReason>,
) -> BTreeMap<u32, OutcomeReason> {
    if options.emit != Emit::Joints {
        return BTreeMap::new();
    }
    let corrected = |index: u32| is_corrected(index, listing, solved, options, unchanged_motions);
    (0_u32..)
        .zip(&listing.motions)
        .filter(|(index, motion)| {
            motion.kind == MotionKind::Linear && corrected(*index) && !motion.previous.is_some_and(corrected)
        })
        .map(|(index, _)| (index, OutcomeReason::LineWithoutStart))
        .collect()
}

/// The lines that a plan writes as joints although the path between its targets leaves the line by more than the tolerance: one joint
/// motion instead of a long line is off by centimetres.
pub(crate) fn lines_off_as_joints(
    listing: &Listing,
    plan: &Plan,
    options: &Options,
) -> BTreeMap<u32, OutcomeReason> {
    if options.emit != Emit::Joints {
        return BTreeMap::new();
    }
    let is_line = |motion: u32| listing.motions[motion as usize].kind == MotionKind::Linear;
    let lines = plan.changes.iter().map(|change| change.motion).filter(|motion| is_line(*motion));
    let off = lines.filter_map(|motion| {
        let reason = match plan.outcomes[motion as usize].path_deviation_mm.get() {
            Some(mm) if mm <= options.tolerance_mm => return None,
            Some(mm) => OutcomeReason::LineAsJoints { mm },
            None => OutcomeReason::LineWithoutStart,
        };
        Some((motion, reason))
    });
    off.collect()
}
