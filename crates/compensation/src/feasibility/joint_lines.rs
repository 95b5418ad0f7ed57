//! Lines that cannot be written as joints: the controller would follow no line there, and where the motion starts is not known, so that no
//! targets between can be inserted.

use std::collections::BTreeMap;

use super::arc_feasibility::is_corrected;
use crate::options::{Emit, Options};
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
