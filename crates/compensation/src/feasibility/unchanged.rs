//! Which motions remain unmodified, and why: for a reason of their own, or because another one does.

use std::collections::BTreeMap;

use crate::arms::Arms;
use crate::cut::{self, Cuts, CutsOf};
use crate::deviation::MotionStatus;
use crate::feasibility::approaches::{Shift, Starts};
use crate::feasibility::arc_feasibility::infeasible_arcs;
use crate::feasibility::half_turns::half_turns;
use crate::feasibility::joint_lines::lines_without_start;
use crate::feasibility::segment_checker::forbid_segments;
use crate::frames::frame_table::FrameTable;
use crate::options::Options;
use crate::plan::reason::OutcomeReason;
use crate::search_budget;
use crate::target::solved_target::{SolvedTarget, SolvedTargets};
use truegrind_arm::inverse::InverseError;
use truegrind_arm::inverse::budget::SearchBudget;
use truegrind_programs::motion::{Listing, MotionKind, Reason};

/// The motions that remain unmodified although their targets could be corrected, with reasons: refused by the writer, arcs
/// that would change, lines that would become none, and the rest of a cut with an unmodified motion; segments near a singularity are forbidden among the
/// targets. An unmodified motion moves the start of the next one, so this repeats until no motion is added.
pub(crate) fn unchanged_motions(
    listing: &Listing,
    solved: &mut SolvedTargets<'_>,
    frame_table: &FrameTable,
    arms: &Arms<'_>,
    options: &Options,
    cuts: &CutsOf,
    refused: &BTreeMap<u32, OutcomeReason>,
) -> BTreeMap<u32, OutcomeReason> {
    let mut out = refused.clone();
    // For segments that start where another motion remains unmodified, over all rounds.
    let mut budget = SearchBudget::of(search_budget::WAYS);
    let mut forbidden = forbid_segments(listing, solved, frame_table, arms, options, None, &mut budget);
    let mut rounds = (MAX_VISITS / listing.motions.len().max(1)).clamp(MIN_ROUNDS, MAX_ROUNDS);
    let has_starts = options.cuts != Cuts::Single;
    let starts = has_starts.then(|| Starts::of(listing, cuts, options.cuts == Cuts::Whole));
    loop {
        let before = out.len();
        out.extend(infeasible_arcs(listing, solved, frame_table, options, &out));
        out.extend(half_turns(listing, solved, options, &out));
        out.extend(lines_without_start(listing, solved, options, &out));
        let solved_so_far = &*solved;
        let kept = |motion: u32| blocking_reason(motion, listing, solved_so_far, options, &out);
        let shift_mm = |motion: u32| {
            let end = solved_so_far.of(motion as usize).last().and_then(|to| to.as_ref().ok());
            end.map_or(0.0, SolvedTarget::shift_mm)
        };
        let more = match options.cuts {
            Cuts::Whole => cut::rest_of_cuts(listing, cuts, &kept),
            Cuts::Partial => cut::steps(listing, cuts, &kept, options.tolerance_mm, &shift_mm),
            Cuts::Single => Vec::new(),
        };
        let known_mm = |motion: u32| {
            let end = solved_so_far.of(motion as usize).last().and_then(|to| to.as_ref().ok());
            end.map(SolvedTarget::shift_mm)
        };
        let shift = Shift { mm: &known_mm, tolerance_mm: options.tolerance_mm };
        let of_starts: Vec<(u32, OutcomeReason)> = starts
            .iter()
            .filter(|starts| starts.any_left(&kept))
            .flat_map(|starts| {
                // Air moves of NC programs are judged once they are written.
                let [approaches, departures] = if listing.numbered {
                    [Vec::new(), Vec::new()]
                } else {
                    [starts.of_cuts_left(&kept, &shift), starts.of_departures(&kept, &shift)]
                };
                [approaches, starts.of_starts_uncorrected(&kept, &shift), departures].concat()
            })
            .collect();
        for (motion, reason) in of_starts {
            out.entry(motion).or_insert(reason);
        }
        out.extend(more);
        if out.len() == before && !forbidden {
            return out;
        }
        rounds -= 1;
        if rounds == 0 {
            // No fixpoint was reached: every round pinned more motions, so the whole program remains
            // unmodified.
            let all = 0..listing.motions.len() as u32;
            out.extend(all.filter(|m| !out.contains_key(m)).map(|m| (m, ABANDONED)).collect::<Vec<_>>());
            return out;
        }
        forbidden = forbid_segments(listing, solved, frame_table, arms, options, Some(&out), &mut budget);
    }
}

/// Motions visited over all rounds.
const MAX_VISITS: usize = 4_000_000;
/// Smallest number of rounds.
const MIN_ROUNDS: usize = 16;
/// Largest number of rounds: otherwise cut after cut could be pinned, each by the previous one.
const MAX_ROUNDS: usize = 1000;
const ABANDONED: OutcomeReason = OutcomeReason::Inverse(InverseError::Abandoned);

/// Why a motion remains unmodified: first what the text leaves open, then what no arm reaches; `None` where it is corrected.
pub(crate) fn blocking_reason(
    index: u32,
    listing: &Listing,
    solved: &SolvedTargets<'_>,
    options: &Options,
    unchanged_motions: &BTreeMap<u32, OutcomeReason>,
) -> Option<(MotionStatus, OutcomeReason)> {
    let motion = &listing.motions[index as usize];
    if let Some(reason) = motion.own_reason.map(OutcomeReason::Program) {
        return Some((unchanged(reason), reason));
    }
    let targets = solved.of(index as usize);
    let errors = || targets.iter().filter_map(|target| target.as_ref().err().copied());
    let unknown = errors().find(|reason| matches!(reason, OutcomeReason::Program(_)));
    if let Some(reason) = unknown.or_else(|| errors().next()) {
        return Some((unchanged(reason), reason));
    }
    if targets.is_empty() {
        return Some((MotionStatus::Left, OutcomeReason::Program(Reason::ExternalOnly)));
    }
    if motion.kind == MotionKind::AbsoluteJoint && !options.joint_targets {
        return Some((MotionStatus::Left, OutcomeReason::JointTarget));
    }
    let forbidden = targets.iter().find_map(|target| target.as_ref().ok()?.forbidden.as_deref().copied());
    let reason = forbidden.or_else(|| unchanged_motions.get(&index).copied())?;
    Some((
        if matches!(reason, OutcomeReason::Risk { .. }) { MotionStatus::Left } else { MotionStatus::Refused },
        reason,
    ))
}

/// Status of an unmodified motion: left where the text states too little, refused where what it states is impossible.
fn unchanged(reason: OutcomeReason) -> MotionStatus {
    match reason {
        OutcomeReason::Program(Reason::BeyondReach | Reason::NumberRange) => MotionStatus::Refused,
        OutcomeReason::Program(_) => MotionStatus::Left,
        _ => MotionStatus::Refused,
    }
}
