//! Stepwise selection of causes: forward by evidence and held-out error, backward elimination, exchanges, until nothing changes.

use std::cell::OnceCell;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::candidate_scores::CandidateScores;
use super::candidates::{Catalogue, Scored};
use super::catalogue::Candidate;
use super::cause::Cause;
use super::design::Design;
use super::extension::{Extended, FreeParameters, Subject, fit, warm_fit};
use super::held_out::FoldErrors;
use super::latency;
use super::levels;
use super::nonlinear_springs;
use super::score::{Score, score};
use crate::measurement::sensor::disturbance::Kind;
use crate::measurement::split::{self, Split};
use truegrind_arm::effect::Effect;

/// Criteria of selection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Probability of any false finding on data without causes (family-wise error rate).
    pub alpha: f64,
    /// Most accepted causes.
    pub most: usize,
    /// Seed of the random folds.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self { alpha: 0.01, most: 20, seed: 0 }
    }
}

/// An accepted cause, scored against the model without it.
#[derive(Debug, Clone)]
pub struct Accepted {
    /// Its score there.
    pub own: Score,
    /// See [`Scored::head_start`].
    pub head_start: f64,
    /// Natural logarithm of its corrected p-value.
    pub log_p: f64,
    /// Number of variants of it that were tried.
    pub tried: f64,
    /// Rivals (other findings), best first, with their scores there.
    pub rivals: Vec<Scored>,
    /// For a sensor's scale, the non-centrality if a common growth of all lengths is free without a prior.
    pub information_beside_growth: Option<f64>,
}

/// Result of the selection.
#[derive(Debug, Clone)]
pub struct Selection {
    /// Geometry alone.
    pub geometric: Extended,
    /// With all accepted causes.
    pub extended: Extended,
    /// One for each cause.
    pub accepted: Vec<Accepted>,
    /// All candidates scored against the extended model, best first.
    pub left: Vec<Scored>,
    /// Number of candidate families.
    pub families: f64,
}

/// Largest factor by which a cause other than a shift can raise the error on held-out blocks.
const BLOCK_SLACK: f64 = 1.005;

/// Contiguous blocks of the second validation.
pub const BLOCKS: usize = 10;

/// Selects causes. `progress` is called at every step.
pub fn select(subject: &Subject<'_>, options: &Options, progress: &(dyn Fn(&str) + Sync)) -> Selection {
    let dataset = &subject.observed.dataset;
    let catalogue = Catalogue::of(subject);
    let registered = fit(subject, &[], FreeParameters::Frames, None);
    let geometric = fit(subject, &[], FreeParameters::All, Some(&registered));
    let random = split::folds(dataset, 5, options.seed);
    let blocks = split::blocks(dataset, BLOCKS);
    let mut current = Arc::new(geometric.clone());
    // Scores of the current fit, if already computed.
    let mut known: Option<CandidateScores<'_>> = None;
    let mut banned: Vec<Cause> = Vec::new();
    // Causes that were accepted with close rivals, and these rivals: reviewed when one of the rivals is accepted too.
    let mut close_calls: Vec<(Cause, Vec<Cause>)> = Vec::new();
    let (mut levels_tried, mut margin, mut removed_once) = (false, EXCHANGE_MARGIN, Vec::new());
    for _ in 0..4 * options.most.max(1) {
        let scores =
            known.take().unwrap_or_else(|| CandidateScores::of(&catalogue, subject, Arc::clone(&current)));
        let left = scores.score_all(&scores.whole.design, true);
        let best = (current.causes.len() < options.most)
            .then(|| next_candidate(&scores, &left, &banned, options, [&random, &blocks]))
            .flatten();
        let Some(best) = best else {
            let all: Vec<usize> = (0..current.causes.len()).collect();
            match review(&scores, options, &all, &ReviewOptions { listed_only: false, margin }) {
                Review::Changed(settled) => {
                    // A cause removed twice is banned; the margin of an exchange grows, so the loop ends.
                    ban_repeated_removals(&current, &settled, &mut removed_once, &mut banned);
                    margin *= MARGIN_GROWTH;
                    current = Arc::new(*settled);
                    continue;
                }
                Review::Settled(accepted) => {
                    if !levels_tried && let Some(causes) = levels::piecewise_levels(&current.causes) {
                        levels_tried = true;
                        let levelled = warm_fit(subject, &causes, FreeParameters::All, Some(&current));
                        if levels::is_as_good(&levelled, &current) {
                            current = Arc::new(levelled);
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
        let cause = best.candidate.cause.clone();
        progress(&format!("searching for causes: {}. {}", current.causes.len() + 1, cause.kind().words()));
        let to_review = causes_to_review(best, &left, &mut close_calls);
        let mut causes = current.causes.clone();
        causes.push(cause.clone());
        let count = current.causes.len();
        let with = Arc::new(warm_fit(subject, &causes, FreeParameters::All, Some(&current)));
        (current, known) = reviewed(&catalogue, subject, Arc::clone(&with), options, &to_review);
        // Two causes that push each other out would otherwise return in turn until the last step.
        ban_repeated_removals(&with, &current, &mut removed_once, &mut banned);
        if current.causes.len() <= count && !contains_cause(&current.causes, &cause) {
            // The new cause did not survive the review: it is banned.
            banned.push(cause);
        }
    }
    final_selection(&catalogue, subject, geometric, current)
}

/// The fit after reviews of some causes until they settle, with the scores of the last review.
fn reviewed<'a>(
    catalogue: &'a Catalogue,
    subject: &'a Subject<'a>,
    mut current: Arc<Extended>,
    options: &Options,
    to_review: &[Cause],
) -> (Arc<Extended>, Option<CandidateScores<'a>>) {
    let listed = ReviewOptions { listed_only: true, margin: EXCHANGE_MARGIN };
    for _ in 0..options.most {
        let causes = current.causes.iter().enumerate();
        let unsure: Vec<usize> =
            causes.filter(|(_, cause)| contains_cause(to_review, cause)).map(|(k, _)| k).collect();
        if unsure.is_empty() {
            break;
        }
        let scores = CandidateScores::of(catalogue, subject, Arc::clone(&current));
        match review(&scores, options, &unsure, &listed) {
            Review::Changed(settled) => current = Arc::new(*settled),
            Review::Settled(_) => return (current, Some(scores)),
        }
    }
    (current, None)
}

/// The final result if the iteration limit is reached: the current state without further changes.
fn final_selection(
    catalogue: &Catalogue,
    subject: &Subject<'_>,
    geometric: Extended,
    current: Arc<Extended>,
) -> Selection {
    let scores = CandidateScores::of(catalogue, subject, Arc::clone(&current));
    let left = scores.score_all(&scores.whole.design, true);
    let accepted = (0..current.causes.len()).map(|index| score_without(&scores, index, true).0).collect();
    drop(scores);
    let families = catalogue.families;
    Selection { geometric, extended: Arc::unwrap_or_clone(current).refine(), accepted, left, families }
}

/// Adds the causes that a review removed to `removed_once`, or to `banned` if they were removed before.
fn ban_repeated_removals(
    current: &Extended,
    settled: &Extended,
    removed_once: &mut Vec<Cause>,
    banned: &mut Vec<Cause>,
) {
    for gone in current.causes.iter().filter(|c| !contains_cause(&settled.causes, c)) {
        let list = if contains_cause(removed_once, gone) { &mut *banned } else { &mut *removed_once };
        list.push(gone.clone());
    }
}

/// Accepted causes for which the new cause was a close rival. If the new cause has close rivals itself, it is added to
/// `close_calls` with them.
fn causes_to_review(
    best: &Scored,
    left: &[Scored],
    close_calls: &mut Vec<(Cause, Vec<Cause>)>,
) -> Vec<Cause> {
    let cause = &best.candidate.cause;
    let near: Vec<Cause> = left
        .iter()
        .filter(|s| {
            !s.candidate.cause.is_same_finding(cause) && s.preference() > best.preference() - DOUBT_MARGIN
        })
        .map(|s| s.candidate.cause.clone())
        .collect();
    let asked = close_calls
        .iter()
        .filter(|(_, rivals)| rivals.iter().any(|r| r.is_same_finding(cause)))
        .map(|(doubted, _)| doubted.clone())
        .collect();
    if !near.is_empty() {
        close_calls.push((cause.clone(), near));
    }
    asked
}

/// The best candidate that is significant, lowers the error on random folds, and hardly raises that on blocks.
fn next_candidate<'a>(
    scores: &CandidateScores<'_>,
    left: &'a [Scored],
    banned: &[Cause],
    options: &Options,
    splits: [&[Split]; 2],
) -> Option<&'a Scored> {
    let design = &scores.whole.design;
    let mut significant = left
        .iter()
        .take_while(|s| s.preference() > 0.0)
        .filter(|s| {
            !contains_cause(banned, &s.candidate.cause)
                && !contains_cause(&scores.fit.causes, &s.candidate.cause)
                && !has_law_of(&scores.fit.causes, &s.candidate.cause)
        })
        .filter(|s| scores.catalogue.is_significant(design, s, options.alpha))
        .peekable();
    significant.peek()?;
    let held = FoldErrors::of(&scores.linear, splits[0]);
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
                let blocks = in_blocks.get_or_init(|| FoldErrors::of(&scores.linear, splits[1])).without(&[]);
                let before = blocks.squares(None);
                (blocks, before)
            });
            blocks.squares(added) < before * BLOCK_SLACK
        };
        random.squares(added) < before && (local || on_blocks())
    })
}

/// Difference of merit up to which a rival is close.
const DOUBT_MARGIN: f64 = 30.0;

/// Whether `causes` contains one with the same parameters (of any value).
pub(super) fn contains_cause(causes: &[Cause], candidate: &Cause) -> bool {
    causes.iter().any(|c| match (c, candidate) {
        (Cause::Arm(a), Cause::Arm(b)) => is_same_effect(a, b),
        (Cause::Measurement(a), Cause::Measurement(b)) => a.kind == b.kind && a.profile == b.profile,
        _ => false,
    })
}

/// Whether `causes` contains the law of a spring, a play or a latency with any constants: two that differ in these alone would be the law of neither.
fn has_law_of(causes: &[Cause], candidate: &Cause) -> bool {
    causes.iter().any(|c| match (c, candidate) {
        (Cause::Measurement(a), Cause::Measurement(b)) => match (&a.kind, &b.kind) {
            (Kind::Empirical(a), Kind::Empirical(b)) => {
                nonlinear_springs::is_one_law(*a, *b) || latency::is_one_law(*a, *b)
            }
            _ => false,
        },
        _ => false,
    })
}

/// Whether two effects differ in nothing but their size.
pub(super) fn is_same_effect(a: &Effect, b: &Effect) -> bool {
    let still = |effect: &Effect| {
        let mut effect = effect.clone();
        (0..effect.parameters().len()).for_each(|k| effect.set(k, 0.0));
        effect
    };
    still(a) == still(b)
}

/// Merit by which a cause must exceed another to replace it.
const EXCHANGE_MARGIN: f64 = 2.0;

/// Growth factor of that margin with every change by a full review.
const MARGIN_GROWTH: f64 = 1.5;

/// Options of a review of accepted causes.
struct ReviewOptions {
    /// Whether listed causes are compared with listed candidates only.
    listed_only: bool,
    /// Merit by which another cause must exceed an accepted one.
    margin: f64,
}

/// Number of causes that are scored in parallel before the model can change.
const PARALLEL_REVIEWS: usize = 2;

/// Result of a review.
enum Review {
    /// A cause was dropped or exchanged.
    Changed(Box<Extended>),
    /// All causes remain.
    Settled(Vec<Accepted>),
}

/// Scores causes against the model without them: drops one that is no longer significant, or exchanges one for a better rival.
fn review(scores: &CandidateScores<'_>, options: &Options, which: &[usize], how: &ReviewOptions) -> Review {
    let (subject, catalogue, current) = (scores.subject, scores.catalogue, &*scores.fit);
    let mut accepted = Vec::new();
    for some in which.chunks(PARALLEL_REVIEWS) {
        let looked: Vec<_> = some
            .par_iter()
            .map(|&index| {
                score_without(scores, index, !how.listed_only || is_searched(&current.causes[index]))
            })
            .collect();
        for (&index, (judged, design, scored)) in some.iter().zip(looked) {
            let mut others = current.causes.clone();
            others.remove(index);
            let own = judged.own.merit + judged.head_start;
            let enough = own + how.margin;
            let best = scored.iter().take_while(|s| s.preference() > enough).find(|s| {
                !contains_cause(&others, &s.candidate.cause)
                    && !has_law_of(&others, &s.candidate.cause)
                    && catalogue.is_significant(&design, s, options.alpha)
            });
            let better = best.filter(|best| {
                !contains_cause(std::slice::from_ref(&current.causes[index]), &best.candidate.cause)
            });
            let supported = !current.causes[index].requires_tilt() || Cause::tilt_is_supported(&others);
            let remains = supported && own > 0.0 && judged.log_p <= options.alpha.ln();
            if better.is_some() || !remains {
                let reduced = warm_fit(subject, &others, FreeParameters::All, Some(current));
                let Some(better) = better else { return Review::Changed(Box::new(reduced)) };
                others.push(better.candidate.cause.clone());
                let settled = warm_fit(subject, &others, FreeParameters::All, Some(&reduced));
                return Review::Changed(Box::new(settled));
            }
            accepted.push(judged);
        }
    }
    Review::Settled(accepted)
}

/// Whether a cause's rows or order were searched, not listed.
fn is_searched(cause: &Cause) -> bool {
    let is_order = matches!(cause, Cause::Arm(Effect::GearTransmission(_) | Effect::GearMap(_)));
    cause.rows().is_some() || is_order
}

/// The score of a cause itself: from the list if it is there, else computed (for searched rows or orders).
fn own_score(subject: &Subject<'_>, design: &Design, scored: &[Scored], cause: &Cause) -> Scored {
    if let Some(found) =
        scored.iter().find(|s| contains_cause(std::slice::from_ref(cause), &s.candidate.cause))
    {
        return found.clone();
    }
    let candidate = Candidate::of(cause, subject);
    let tried = scored
        .iter()
        .filter(|s| {
            s.candidate.cause.kind() == cause.kind()
                && s.candidate.cause.rows().is_some() == cause.rows().is_some()
        })
        .map(|s| s.candidate.tried)
        .fold(1.0, f64::max);
    let candidate = Arc::new(Candidate { tried, ..candidate });
    let score = score(design, &candidate);
    Scored { candidate, score, head_start: 0.0 }
}

/// Scores a cause against the model without it. Returns the result, the design of that model, and the scores of all candidates in it.
fn score_without(scores: &CandidateScores<'_>, index: usize, open: bool) -> (Accepted, Design, Vec<Scored>) {
    let current = &*scores.fit;
    let cause = &current.causes[index];
    let design = scores.whole.without(&current.parameter_indices(index));
    let scored = scores.score_all(&design, open);
    let own = own_score(scores.subject, &design, &scored, cause);
    let mut rivals: Vec<Scored> = Vec::new();
    for other in &scored {
        let same = other.candidate.cause.is_same_finding(cause)
            || contains_cause(&current.causes, &other.candidate.cause);
        let listed = rivals.iter().any(|r| r.candidate.cause.is_same_finding(&other.candidate.cause));
        if !same && !listed && other.preference() > 0.25 * own.preference().max(0.0) {
            rivals.push(other.clone());
        }
        if rivals.len() >= 5 {
            break;
        }
    }
    let information_beside_growth =
        cause.is_constant_scale().then(|| scale_information_beside_growth(&design, &own.score.estimate));
    let log_p = scores.catalogue.corrected_log_p(&design, &own);
    let tried = own.candidate.tried;
    let (own, head_start) = (own.score, own.head_start);
    (Accepted { own, head_start, log_p, tried, rivals, information_beside_growth }, design, scored)
}

/// Non-centrality of a sensor scale error of that size if a common growth of all lengths of the arm is free without a prior.
pub fn scale_information_beside_growth(design: &Design, estimate: &DVector<f64>) -> f64 {
    let columns = DMatrix::from_columns(&[design.slopes.by_scale.clone(), design.slopes.by_growth.clone()]);
    let s = design.project(&columns).information;
    let own = s[(0, 0)] - s[(0, 1)].powi(2) / s[(1, 1)].max(1e-300);
    own.max(0.0) * estimate.get(0).copied().unwrap_or(0.0).powi(2)
}
