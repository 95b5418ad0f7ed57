//! Which causes go into the model: forward by evidence and held-out error, backward, exchanged, until nothing helps.

use std::cell::OnceCell;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::candidate_scores::CandidateScores;
use super::candidates::{Catalogue, Scored};
use super::catalogue::Candidate;
use super::cause::Cause;
use super::design::Design;
use super::extension::{Extended, Freedom, Subject, fit, warm_fit};
use super::held::FoldErrors;
use super::levels;
use super::score::{Score, score};
use crate::measurement::split::{self, Split};
use truegrind_arm::effect::Effect;

/// When a cause is accepted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Chance of any false finding on data with nothing hidden.
    pub alpha: f64,
    /// Most causes that are accepted.
    pub most: usize,
    /// Seed of the random folds.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self { alpha: 0.01, most: 20, seed: 0 }
    }
}

/// An accepted cause, judged against the model without it.
#[derive(Debug, Clone)]
pub struct Accepted {
    /// Its score there.
    pub own: Score,
    /// Corrected p-value, its natural logarithm.
    pub log_p: f64,
    /// Variants of it that were tried.
    pub tried: f64,
    /// Other stories, best first, with their scores there.
    pub rivals: Vec<Scored>,
    /// Non-centrality that is left when all lengths may grow together without a prior; for a sensor's scale.
    pub beside_growth: Option<f64>,
}

/// What the selection came to.
#[derive(Debug, Clone)]
pub struct Selection {
    /// Geometry alone.
    pub geometric: Extended,
    /// With all accepted causes.
    pub extended: Extended,
    /// One for each cause.
    pub accepted: Vec<Accepted>,
    /// Every candidate against the extended model, best first: what is left to find, and what could not be seen.
    pub left: Vec<Scored>,
    /// Kinds of candidates that were tried.
    pub families: f64,
}

/// A finding may raise the error on held-out blocks by this share at most, where it is not about rows.
const BLOCK_SLACK: f64 = 1.005;

/// Contiguous blocks of the second validation.
pub const BLOCKS: usize = 10;

/// Selects causes. `tell` hears of every step.
pub fn select(subject: &Subject<'_>, options: &Options, tell: &(dyn Fn(&str) + Sync)) -> Selection {
    let dataset = &subject.observed.dataset;
    let catalogue = Catalogue::of(subject);
    let registered = fit(subject, &[], Freedom::Frames, None);
    let geometric = fit(subject, &[], Freedom::All, Some(&registered));
    let random = split::folds(dataset, 5, options.seed);
    let blocks = split::blocks(dataset, BLOCKS);
    let mut current = Arc::new(geometric.clone());
    // The board of the current fit, where one was made already.
    let mut known: Option<CandidateScores<'_>> = None;
    let mut refused: Vec<Cause> = Vec::new();
    // Causes that were not far ahead of others when they came in, with those: they are looked at again when one of them
    // comes in too.
    let mut doubtful: Vec<(Cause, Vec<Cause>)> = Vec::new();
    let (mut told_again, mut ahead, mut turned_out) = (false, EXCHANGE, Vec::new());
    for _ in 0..4 * options.most.max(1) {
        let board =
            known.take().unwrap_or_else(|| CandidateScores::of(&catalogue, subject, Arc::clone(&current)));
        let left = board.score_all(&board.whole.design, true);
        let taken = (current.causes.len() < options.most)
            .then(|| next(&board, &left, &refused, options, [&random, &blocks]))
            .flatten();
        let Some(taken) = taken else {
            let all: Vec<usize> = (0..current.causes.len()).collect();
            match review(&board, options, &all, &How { quick: false, ahead }) {
                Review::Changed(settled) => {
                    // A cause that was turned out twice does not come back, and it gets harder to turn one out.
                    note_gone(&current, &settled, &mut turned_out, &mut refused);
                    ahead *= HARDER;
                    current = Arc::new(*settled);
                    continue;
                }
                Review::Settled(accepted) => {
                    if !told_again && let Some(causes) = levels::piecewise_levels(&current.causes) {
                        told_again = true;
                        let told = warm_fit(subject, &causes, Freedom::All, Some(&current));
                        if levels::is_as_good(&told, &current) {
                            current = Arc::new(told);
                            continue;
                        }
                    }
                    return Selection {
                        geometric,
                        extended: Arc::unwrap_or_clone(current).refine(),
                        accepted,
                        left,
                        families: catalogue.families,
                    };
                }
            }
        };
        let cause = taken.candidate.cause.clone();
        tell(&format!("{}. {}", current.causes.len() + 1, cause.name()));
        let asked = asked_again(taken, &left, &mut doubtful);
        let mut causes = current.causes.clone();
        causes.push(cause.clone());
        let count = current.causes.len();
        current = Arc::new(warm_fit(subject, &causes, Freedom::All, Some(&current)));
        for _ in 0..options.most {
            let unsure: Vec<usize> =
                (0..current.causes.len()).filter(|&k| already(&asked, &current.causes[k])).collect();
            if unsure.is_empty() {
                break;
            }
            let board = CandidateScores::of(&catalogue, subject, Arc::clone(&current));
            match review(&board, options, &unsure, &How { quick: true, ahead: EXCHANGE }) {
                Review::Changed(settled) => current = Arc::new(*settled),
                Review::Settled(_) => {
                    known = Some(board);
                    break;
                }
            }
        }
        if current.causes.len() <= count && !already(&current.causes, &cause) {
            // The newcomer did not survive beside the others: not to be tried again.
            refused.push(cause);
        }
    }
    as_it_stands(&catalogue, subject, geometric, current)
}

/// Causes that take turns without end: the last state is judged as it stands.
fn as_it_stands(
    catalogue: &Catalogue,
    subject: &Subject<'_>,
    geometric: Extended,
    current: Arc<Extended>,
) -> Selection {
    let board = CandidateScores::of(catalogue, subject, Arc::clone(&current));
    let left = board.score_all(&board.whole.design, true);
    let accepted = (0..current.causes.len()).map(|index| looked_at(&board, index, true).0).collect();
    drop(board);
    let families = catalogue.families;
    Selection { geometric, extended: Arc::unwrap_or_clone(current).refine(), accepted, left, families }
}

/// Notes the causes that a review turned out, in `refused` those that were turned out before.
fn note_gone(current: &Extended, settled: &Extended, turned_out: &mut Vec<Cause>, refused: &mut Vec<Cause>) {
    for gone in current.causes.iter().filter(|c| !already(&settled.causes, c)) {
        let list = if already(turned_out, gone) { &mut *refused } else { &mut *turned_out };
        list.push(gone.clone());
    }
}

/// Accepted causes that were not far ahead of the one that comes in; where that is not far ahead of others either it is noted with
/// them.
fn asked_again(taken: &Scored, left: &[Scored], doubtful: &mut Vec<(Cause, Vec<Cause>)>) -> Vec<Cause> {
    let cause = &taken.candidate.cause;
    let near: Vec<Cause> = left
        .iter()
        .filter(|s| !s.candidate.cause.is_same_finding(cause) && s.score.merit > taken.score.merit - DOUBT)
        .map(|s| s.candidate.cause.clone())
        .collect();
    let asked = doubtful
        .iter()
        .filter(|(_, rivals)| rivals.iter().any(|r| r.is_same_finding(cause)))
        .map(|(doubted, _)| doubted.clone())
        .collect();
    if !near.is_empty() {
        doubtful.push((cause.clone(), near));
    }
    asked
}

/// The best candidate that is significant and lowers the error on random folds, and hardly raises that on blocks.
fn next<'a>(
    board: &CandidateScores<'_>,
    left: &'a [Scored],
    refused: &[Cause],
    options: &Options,
    splits: [&[Split]; 2],
) -> Option<&'a Scored> {
    let design = &board.whole.design;
    let mut significant = left
        .iter()
        .take_while(|s| s.score.merit > 0.0)
        .filter(|s| !already(refused, &s.candidate.cause) && !already(&board.fit.causes, &s.candidate.cause))
        .filter(|s| board.catalogue.is_significant(design, s, options.alpha))
        .peekable();
    significant.peek()?;
    let held = FoldErrors::of(&board.linear, splits[0]);
    let random = held.without(&[]);
    let before = random.squares(None);
    let (in_blocks, blocks) = (OnceCell::new(), OnceCell::new());
    significant.find(|scored| {
        let columns = scored.candidate.columns(design);
        let sizes = scored.candidate.cause.sizes();
        let added = Some((&columns, sizes.as_slice()));
        let local = scored.candidate.cause.rows().is_some();
        let on_blocks = || {
            let (blocks, before) = blocks.get_or_init(|| {
                let blocks = in_blocks.get_or_init(|| FoldErrors::of(&board.linear, splits[1])).without(&[]);
                let before = blocks.squares(None);
                (blocks, before)
            });
            blocks.squares(added) < before * BLOCK_SLACK
        };
        random.squares(added) < before && (local || on_blocks())
    })
}

/// A cause is in doubt beside rivals that have less merit by no more than this.
const DOUBT: f64 = 30.0;

/// Whether a cause with the same parameters is in the model.
pub(super) fn already(causes: &[Cause], candidate: &Cause) -> bool {
    causes.iter().any(|c| match (c, candidate) {
        (Cause::Arm(a), Cause::Arm(b)) => {
            let still = |e: &Effect| {
                let mut e = e.clone();
                (0..e.parameters().len()).for_each(|k| e.set(k, 0.0));
                e
            };
            still(a) == still(b)
        }
        (Cause::Measurement(a), Cause::Measurement(b)) => a.kind == b.kind && a.profile == b.profile,
        _ => false,
    })
}

/// A cause must be better than another by this much merit to take its place.
const EXCHANGE: f64 = 2.0;

/// By how much that grows with every change of a whole review.
const HARDER: f64 = 1.5;

/// How accepted causes are looked at again.
struct How {
    /// Causes whose rows or order are listed are compared with their like only.
    quick: bool,
    /// Merit by which another cause must be better.
    ahead: f64,
}

/// Causes that are looked at beside each other, before one of them may change the model.
const BESIDE: usize = 4;

/// What looking again at accepted causes came to.
enum Review {
    /// One was dropped or exchanged.
    Changed(Box<Extended>),
    /// All stand.
    Settled(Vec<Accepted>),
}

/// Looks at causes against the model without them: drops one that no longer carries itself, or exchanges one that another
/// explains better.
fn review(board: &CandidateScores<'_>, options: &Options, which: &[usize], how: &How) -> Review {
    let (subject, catalogue, current) = (board.subject, board.catalogue, &*board.fit);
    let mut accepted = Vec::new();
    for some in which.chunks(BESIDE) {
        let looked: Vec<_> = some
            .par_iter()
            .map(|&index| looked_at(board, index, !how.quick || is_open(&current.causes[index])))
            .collect();
        for (&index, (judged, design, scored)) in some.iter().zip(looked) {
            let mut others = current.causes.clone();
            others.remove(index);
            let enough = judged.own.merit + how.ahead;
            let best = scored.iter().take_while(|s| s.score.merit > enough).find(|s| {
                !already(&others, &s.candidate.cause) && catalogue.is_significant(&design, s, options.alpha)
            });
            let better = best
                .filter(|best| !already(std::slice::from_ref(&current.causes[index]), &best.candidate.cause));
            let stands = !current.causes[index].requires_tilt() || Cause::tilt_is_supported(&others);
            let carries = stands && judged.own.merit > 0.0 && judged.log_p <= options.alpha.ln();
            if better.is_some() || !carries {
                let reduced = warm_fit(subject, &others, Freedom::All, Some(current));
                let Some(better) = better else { return Review::Changed(Box::new(reduced)) };
                others.push(better.candidate.cause.clone());
                let settled = warm_fit(subject, &others, Freedom::All, Some(&reduced));
                return Review::Changed(Box::new(settled));
            }
            accepted.push(judged);
        }
    }
    Review::Settled(accepted)
}

/// Whether a cause's rows or order were looked for.
fn is_open(cause: &Cause) -> bool {
    cause.rows().is_some() || cause.name() == "gear-transmission"
}

/// The score of a cause itself, from the list where it is there, computed otherwise (its own rows or order).
fn own_score(subject: &Subject<'_>, design: &Design, scored: &[Scored], cause: &Cause) -> Scored {
    if let Some(found) = scored.iter().find(|s| already(std::slice::from_ref(cause), &s.candidate.cause)) {
        return found.clone();
    }
    let candidate = Candidate::of(cause, subject);
    let tried = scored
        .iter()
        .filter(|s| {
            s.candidate.cause.name() == cause.name()
                && s.candidate.cause.rows().is_some() == cause.rows().is_some()
        })
        .map(|s| s.candidate.tried)
        .fold(1.0, f64::max);
    let candidate = Arc::new(Candidate { tried, ..candidate });
    let score = score(design, &candidate);
    Scored { candidate, score }
}

/// A cause against the model without it: the judgement, the design there, and every candidate's score in it.
fn looked_at(board: &CandidateScores<'_>, index: usize, open: bool) -> (Accepted, Design, Vec<Scored>) {
    let current = &*board.fit;
    let cause = &current.causes[index];
    let design = board.whole.without(&current.parameter_indices(index));
    let scored = board.score_all(&design, open);
    let own = own_score(board.subject, &design, &scored, cause);
    let mut rivals: Vec<Scored> = Vec::new();
    for other in &scored {
        let same =
            other.candidate.cause.is_same_finding(cause) || already(&current.causes, &other.candidate.cause);
        let told = rivals.iter().any(|r| r.candidate.cause.is_same_finding(&other.candidate.cause));
        if !same && !told && other.score.merit > 0.25 * own.score.merit.max(0.0) {
            rivals.push(other.clone());
        }
        if rivals.len() >= 5 {
            break;
        }
    }
    let beside_growth =
        (cause.name() == "sensor-scale").then(|| scale_beside_growth(&design, &own.score.estimate));
    let log_p = board.catalogue.corrected_log_p(&design, &own);
    let tried = own.candidate.tried;
    (Accepted { own: own.score, log_p, tried, rivals, beside_growth }, design, scored)
}

/// Non-centrality of a sensor's scale of that size when all lengths of the arm may grow together freely.
pub fn scale_beside_growth(design: &Design, estimate: &DVector<f64>) -> f64 {
    let columns = DMatrix::from_columns(&[design.slopes.by_scale.clone(), design.slopes.by_growth.clone()]);
    let s = design.project(&columns).information;
    let own = s[(0, 0)] - s[(0, 1)].powi(2) / s[(1, 1)].max(1e-300);
    own.max(0.0) * estimate.get(0).copied().unwrap_or(0.0).powi(2)
}
