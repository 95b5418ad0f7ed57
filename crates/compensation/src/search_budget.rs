//! How many evaluations of the arm one program may cost beyond those that every target costs: what is sought for targets out
//! of reach, beside singularities and in configurations that are not theirs.
//!
//! Counted, not timed, and shared out by the number of motions alone, so that the result depends neither on the machine nor on
//! the number of threads. Some hundred targets that cannot be reached are told one by one; a program of many thousand
//! would take minutes for it, and those that are left are refused for that
//! ([`InverseError::Abandoned`](truegrind_arm::inverse::InverseError::Abandoned)).

use rayon::prelude::*;

use truegrind_arm::inverse::budget::SearchBudget;
use truegrind_math::work::checkpoint;

/// Works through pieces in parallel, each with its part of the whole; those that fell short are done again, one after the
/// other, with what the others left.
pub(crate) fn shared_out<T: Send>(
    whole: SearchBudget,
    pieces: usize,
    work: impl Fn(usize, &mut SearchBudget) -> T + Sync,
) -> Vec<T> {
    shared_out_into(whole, &mut vec![(); pieces], |piece, (), budget| work(piece, budget))
}

/// The same where each piece has a place of its own that its work fills.
pub(crate) fn shared_out_into<P: Send, T: Send>(
    whole: SearchBudget,
    places: &mut [P],
    work: impl Fn(usize, &mut P, &mut SearchBudget) -> T + Sync,
) -> Vec<T> {
    let pieces = places.len();
    let one = |(piece, place): (usize, &mut P)| {
        checkpoint();
        let mut budget = whole.share(piece, pieces);
        (work(piece, place, &mut budget), budget)
    };
    let done: Vec<(T, SearchBudget)> = places.par_iter_mut().enumerate().map(one).collect();
    let mut rest = SearchBudget::of(done.iter().map(|(_, left)| left.evaluations).sum())
        .with_near_solves(done.iter().fold(0, |sum, (_, left)| sum.saturating_add(left.near_solves)));
    let again = |(piece, (done, left)): (usize, (T, SearchBudget))| {
        if left.ever_exhausted { work(piece, &mut places[piece], &mut rest) } else { done }
    };
    done.into_iter().enumerate().map(again).collect()
}

/// For the joints of the program as it is.
pub(crate) const STARTS: u64 = 1_500_000;
/// For the corrected targets.
pub(crate) const TARGETS: u64 = 1_000_000;
/// For ways past singularities.
pub(crate) const WAYS: u64 = 1_000_000;
/// For the paths between targets.
pub(crate) const PATHS: u64 = 1_000_000;
/// Steps along the paths between targets: so many, and beyond what goes into a megabyte so many for each motion.
pub(crate) fn path_steps(motions: usize) -> u64 {
    800_000 + 40 * motions.saturating_sub(300_000) as u64
}
/// For what is said of tools and work objects whose origin is not stated, all together.
pub(crate) const FRAMES: u64 = 300_000;
/// For the sides from which joints with play come.
pub(crate) const SIDES: u64 = 500_000;
