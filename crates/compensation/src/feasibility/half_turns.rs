//! Lines along which the tool turns by about half a turn: a correction of a tenth of a degree can make the other way round the shorter one,
//! which the controller then takes.

use std::collections::BTreeMap;

use nalgebra::UnitQuaternion;
use rayon::prelude::*;

use super::arc_feasibility::is_corrected;
use crate::options::Options;
use crate::plan::reason::OutcomeReason;
use crate::search_budget::MANY_MOTIONS;
use crate::target::solved_target::SolvedTargets;
use truegrind_programs::motion::{Listing, MotionKind, Switch};

/// Of half a turn, what decides between the two ways lies below the written decimals and the controller's single precision (rad).
const UNDECIDED_RAD: f64 = 1e-4;

/// |cos(θ/2)| below which a turn θ is looked at: above 160°.
const LARGE_TURN: f64 = 0.174;

/// The corrected motions, by index, at either end of a line whose tool might turn the other way than in the original.
/// `unchanged_motions`: motions that remain unmodified.
pub(crate) fn half_turns(
    listing: &Listing,
    solved: &SolvedTargets<'_>,
    options: &Options,
    unchanged_motions: &BTreeMap<u32, OutcomeReason>,
) -> BTreeMap<u32, OutcomeReason> {
    let turned: Vec<(u32, Vec<u32>)> = (0..listing.motions.len() as u32)
        .into_par_iter()
        .with_min_len(MANY_MOTIONS)
        .map(|index| (index, turned_ends(index, listing, solved, options, unchanged_motions)))
        .filter(|(_, ends)| !ends.is_empty())
        .collect();
    let mut out = BTreeMap::new();
    for (index, ends) in turned {
        let line = listing.motions[index as usize].place.line;
        out.extend(ends.into_iter().map(|end| (end, OutcomeReason::HalfTurn { line })));
    }
    out
}

/// The corrected ends of one such line, empty for any other motion.
fn turned_ends(
    index: u32,
    listing: &Listing,
    solved: &SolvedTargets<'_>,
    options: &Options,
    unchanged_motions: &BTreeMap<u32, OutcomeReason>,
) -> Vec<u32> {
    let motion = &listing.motions[index as usize];
    let (MotionKind::Linear, Some(previous)) = (motion.kind, motion.previous) else { return Vec::new() };
    if motion.modal.wrist_interpolation == Switch::On {
        return Vec::new();
    }
    // Nearly every motion turns the tool by little.
    let ends = [previous, index].map(|end| solved.of(end as usize).last().and_then(|to| to.as_ref().ok()));
    if let [Some(from), Some(to)] = ends
        && from.frames_index == to.frames_index
        && from.intended.pose().rotation.coords.dot(&to.intended.pose().rotation.coords).abs() > LARGE_TURN
    {
        return Vec::new();
    }
    let originals = [previous, index].map(|end| solved.original_end(end as usize));
    let [Some(from), Some(to)] = originals else { return Vec::new() };
    if from.frames_index != to.frames_index {
        return Vec::new();
    }
    let corrected =
        [previous, index].map(|end| is_corrected(end, listing, solved, options, unchanged_motions));
    let commanded = |k: usize, original: &UnitQuaternion<f64>| match ends[k] {
        Some(end) if corrected[k] => end.commanded.rotation,
        _ => *original,
    };
    let intended = [from.intended.pose().rotation, to.intended.pose().rotation];
    let written = [commanded(0, &intended[0]), commanded(1, &intended[1])];
    if !corrected.contains(&true) || !turns_the_other_way(&intended, &written) {
        return Vec::new();
    }
    [previous, index]
        .into_iter()
        .zip(corrected)
        .filter_map(|(end, corrected)| corrected.then_some(end))
        .collect()
}

/// Whether the shortest turn between two orientations has, or may have, the opposite sense of that between two others.
fn turns_the_other_way(intended: &[UnitQuaternion<f64>; 2], written: &[UnitQuaternion<f64>; 2]) -> bool {
    let [intended, written] = [intended, written].map(|[from, to]| (from.inverse() * to).scaled_axis());
    let undecided = |turn: f64| turn > std::f64::consts::PI - UNDECIDED_RAD;
    intended.dot(&written) < 0.0 && intended.norm() > 1.0
        || undecided(intended.norm())
        || undecided(written.norm())
}
