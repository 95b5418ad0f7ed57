//! Approaches to cuts that remain unmodified: they lead to where the first line of the cut begins, which from a corrected start would become a
//! wedge as high as the correction; and cuts whose approach is refused, which would become the same.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::cut::{CutsOf, Obstacle, may_cut, starts};
use crate::deviation::Status;
use crate::plan::reason::OutcomeReason;
use crate::search_budget::MANY;
use truegrind_programs::motion::{Listing, MotionKind};

/// The motions that must not be corrected because a cut that remains unmodified begins where they end, `shift_mm` by more than
/// `tolerance_mm`. Air moves, and a line from an air move to a stop; one that ends a longer cut belongs to that, and one that leads to a
/// corrected cut as well is needed there.
pub(crate) fn of_cuts_left(
    listing: &Listing,
    cuts: &CutsOf,
    blocking_reason: Obstacle<'_>,
    tolerance_mm: f64,
    shift_mm: &dyn Fn(u32) -> f64,
) -> Vec<(u32, OutcomeReason)> {
    let is_left = |index: u32| blocking_reason(index).is_some();
    let is_path = |index: u32| {
        let motion = &listing.motions[index as usize];
        may_cut(motion) && matches!(motion.kind, MotionKind::Linear | MotionKind::Circular)
    };
    let motions = (0..listing.motions.len() as u32).into_par_iter().with_min_len(MANY);
    let left: Vec<u32> = motions.filter(|index| is_path(*index) && is_left(*index)).collect();
    let mut found: BTreeMap<u32, OutcomeReason> = BTreeMap::new();
    for index in left {
        for start in starts(listing, index) {
            if !is_left(start) && !(shift_mm(start) <= tolerance_mm) {
                let line = listing.motions[index as usize].place.line;
                found.entry(start).or_insert(OutcomeReason::StartOfUnchangedCut { line });
            }
        }
    }
    if found.is_empty() {
        return Vec::new();
    }
    let mut motions_of_cut: BTreeMap<u32, usize> = BTreeMap::new();
    for index in 0..listing.motions.len() as u32 {
        if let Some(root) = cuts.root(index) {
            *motions_of_cut.entry(root).or_default() += 1;
        }
        if is_path(index) && !is_left(index) {
            starts(listing, index).iter().for_each(|start| {
                found.remove(start);
            });
        }
    }
    let is_approach = |index: u32| match cuts.root(index) {
        None => true,
        Some(root) => motions_of_cut[&root] == 1 && comes_by_air(listing, index),
    };
    found.into_iter().filter(|(index, _)| is_approach(*index)).collect()
}

/// Whether only air moves lead to where a motion begins.
fn comes_by_air(listing: &Listing, index: u32) -> bool {
    let starts = starts(listing, index);
    !starts.is_empty() && starts.iter().all(|start| !may_cut(&listing.motions[*start as usize]))
}

/// The lines and arcs that must not be corrected because the approach to where they begin is refused: from an uncorrected start the first line
/// of the cut would become a wedge. `shift_mm`: how far the correction would have moved the start; `None` where that is unknown.
pub(crate) fn of_starts_refused(
    listing: &Listing,
    blocking_reason: Obstacle<'_>,
    tolerance_mm: f64,
    shift_mm: &dyn Fn(u32) -> Option<f64>,
) -> Vec<(u32, OutcomeReason)> {
    let refused = |index: u32| match blocking_reason(index) {
        Some((status, reason))
            if status == Status::Refused || matches!(reason, OutcomeReason::Risk { .. }) =>
        {
            Some(reason)
        }
        _ => None,
    };
    let is_approach = |start: u32| !may_cut(&listing.motions[start as usize]) || comes_by_air(listing, start);
    let mut out = Vec::new();
    for (index, motion) in (0_u32..).zip(&listing.motions) {
        let is_path = matches!(motion.kind, MotionKind::Linear | MotionKind::Circular) && may_cut(motion);
        if !is_path || blocking_reason(index).is_some() {
            continue;
        }
        let wedge = starts(listing, index).into_iter().find_map(|start| {
            let reason = refused(start).filter(|_| is_approach(start))?;
            let line = listing.motions[start as usize].place.line;
            let moves = !shift_mm(start).is_some_and(|mm| mm <= tolerance_mm);
            moves.then_some(OutcomeReason::PartOfCut { line, because: reason.kind() })
        });
        out.extend(wedge.map(|reason| (index, reason)));
    }
    out
}
