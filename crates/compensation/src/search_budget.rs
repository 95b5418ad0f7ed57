//! Search budget of one program: evaluations of the arm for targets that are out of reach, near a singularity or in another
//! configuration, beyond the few evaluations that every target costs.
//!
//! The budget counts evaluations, not time, and is divided by the number of motions alone, so the result depends neither on
//! the machine nor on the number of threads. A few hundred unreachable targets are each diagnosed; in a program with many
//! thousands that would take minutes, so the remaining ones are refused with
//! [`InverseError::Abandoned`](truegrind_arm::inverse::InverseError::Abandoned).

use rayon::prelude::*;

use truegrind_arm::inverse::budget::SearchBudget;
use truegrind_math::work::checkpoint;

/// Motions per parallel work item.
pub(crate) const CHUNK: usize = 64;

/// Motions that are processed in less time than another thread takes to wake up.
pub(crate) const MANY_MOTIONS: usize = 4096;

/// Runs pieces in parallel, each with its share of the budget; pieces that ran out are repeated one after the other with the
/// budget that others left over.
pub(crate) fn shared_out<T: Send>(
    whole: SearchBudget,
    pieces: usize,
    work: impl Fn(usize, &mut SearchBudget) -> T + Sync,
) -> Vec<T> {
    shared_out_into(whole, &mut vec![(); pieces], |piece, (), budget| work(piece, budget))
}

/// As [`shared_out`], where each piece fills its own slot.
pub(crate) fn shared_out_into<P: Send, T: Send>(
    whole: SearchBudget,
    places: &mut [P],
    work: impl Fn(usize, &mut P, &mut SearchBudget) -> T + Sync,
) -> Vec<T> {
    let pieces = places.len();
    let one = |(piece, slot): (usize, &mut P)| {
        checkpoint();
        let mut budget = whole.share(piece, pieces);
        (work(piece, slot, &mut budget), budget)
    };
    let done: Vec<(T, SearchBudget)> = places.par_iter_mut().enumerate().map(one).collect();
    let mut rest = SearchBudget::of(done.iter().map(|(_, left)| left.evaluations).sum())
        .with_near_solves(done.iter().fold(0, |sum, (_, left)| sum.saturating_add(left.near_solves)));
    let again = |(piece, (done, left)): (usize, (T, SearchBudget))| {
        if left.ever_exhausted { work(piece, &mut places[piece], &mut rest) } else { done }
    };
    done.into_iter().enumerate().map(again).collect()
}

/// Joints of the original program.
pub(crate) const STARTS: u64 = 1_500_000;
/// Corrected targets.
pub(crate) const TARGETS: u64 = 1_000_000;
/// Segments near singularities.
pub(crate) const WAYS: u64 = 1_000_000;
/// Paths between targets.
pub(crate) const PATHS: u64 = 1_000_000;
/// Near solves along the paths between targets: a fixed number, plus some per motion for programs above about a megabyte.
pub(crate) fn path_steps(motions: usize) -> u64 {
    800_000 + 40 * motions.saturating_sub(300_000) as u64
}
/// Estimates for tools and work objects of unstated origin, all together.
pub(crate) const FRAMES: u64 = 300_000;
/// Backlash sides.
pub(crate) const SIDES: u64 = 500_000;
