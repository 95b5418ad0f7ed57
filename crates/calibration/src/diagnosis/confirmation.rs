//! Confirmation of accepted causes by model discrepancy and stability selection. Only a confirmed cause is called identified.
//!
//! 1. *Discrepancy.* The random functions of [`discrepancy`](super::discrepancy) get their most probable variances given the
//!    accepted causes. The least significant cause that is no longer significant is removed and the variances are estimated again,
//!    until all remaining causes are significant.
//! 2. *Stability selection.* In each half of [`halves`](super::halves) causes are selected again from scratch, by evidence and to
//!    first order. A cause is recovered if it is selected there with the same joints, or if it raises the evidence there (it can be
//!    too weak for selection) and no rival was selected in its place, or only rivals that explain less beside the others. The recovered interval of a shift must overlap by [`OVERLAP`].
//! 3. *Invariance.* Its size in a half must not differ from that in all rows by more than chance and [`CHANGED`] allow.
//!
//! Source: Meinshausen and Bühlmann 2010 and Shah and Samworth 2013 (stability selection); Peters, Bühlmann and Meinshausen 2016
//! (invariance of causes).

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::algebra::{lower_factor, picked_rows};
use super::candidates::Scored;
use super::catalogue::Candidate;
use super::cause::Cause;
use super::cause_kind::CauseKind;
use super::design::{Design, FullDesign, Linear, Projected, side_by_side};
use super::discrepancy::{Discrepancy, Functions};
use super::elimination::{Criteria, Eliminated, Significance, Tested, eliminate};
use super::extension::{Extended, Subject};
use super::halves::{HALVES, halves};
use super::intervals::ShiftScan;
use super::link_growth;
use super::lump_direction;
use super::odds;
use super::overturning_masses;
use super::pure_products::PureProducts;
use super::score::{Score, score_columns, score_from, score_projected};
use super::selection::{Accepted, Options, contains_cause};
use super::serial_correlation::prewhiten;
use crate::identification::tolerance::GROWTH_SIGMA;
use crate::measurement::sensor::disturbance::{Disturbance, Profile};
use truegrind_arm::effect::Effect;
use truegrind_math::work::checkpoint;

/// Confirmation of one cause.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Confirmation {
    /// Whether it is significant with the discrepancy in the model.
    pub significant: bool,
    /// Natural logarithm of its p-value there, corrected for trials.
    pub log_p: f64,
    /// Its merit less that of its best rival there.
    pub margin: f64,
    /// Number of halves in which it was recovered.
    pub recovered: usize,
    /// Number of halves that could detect it.
    pub testable: usize,
    /// Number of halves in which its size differed.
    pub changed: usize,
    /// Whether its size is physically plausible, and no other finding explains the same rows.
    pub plausible: bool,
    /// Whether another direction of gravity explains what it does.
    pub under_other_gravity: bool,
    /// What its sign says, if that is the wrong one.
    pub wrong_sign: Option<WrongSign>,
}

/// What a cause with a sign that it cannot have says of what was stated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum WrongSign {
    /// Loads would lift the arm, as they do one that hangs and is taken for one that stands.
    Lifts,
    /// A play would be negative: the logged sides of approach are reversed.
    SidesReversed,
}

impl WrongSign {
    /// What to do about it.
    fn doubt(self) -> String {
        match self {
            WrongSign::Lifts => {
                "negative: weight would lift the arm. If it hangs upside down, write its robot file (`truegrind robots NAME -o ARM.toml`), set \
                 gravity = [0.0, 0.0, 1.0] under [robot.mounting], and diagnose again with --robot ARM.toml"
            }
            WrongSign::SidesReversed => {
                "negative, which no play is: the sides of approach seem to be reversed. In approach1 to approach6, −1 is from below (the angle \
                 grew) and +1 from above; if the columns hold the direction of motion, change their signs and diagnose again"
            }
        }
        .to_owned()
    }
}

/// Number of halves in which a cause can fail and still be confirmed.
const ALLOWED_FAILURES: usize = 1;

/// Fewest of the six halves that must be able to detect a cause: one half that finds it is no recurrence. With all but one of six asked, 4 of
/// 50 true effects between λ 40 and 80 would lose their name, and no false one.
const MIN_TESTABLE_HALVES: usize = 4;

/// Growth of the links during a measurement that no heat explains: aluminium by some 80 K.
const MAX_GROWTH: f64 = 2e-3;

/// Squared correlation of a joint's approach side with its last step from which the two are confounded.
const CONFOUNDED: f64 = 0.9;

/// Twice the log Bayes factor against its best rival that an identified cause needs, with and without the discrepancy in the model:
/// 20 to 1.
pub(super) const CLEAR_TWICE_LOG_BF: f64 = 6.0;

impl Confirmation {
    /// Whether it passes all criteria for an identified cause.
    pub(super) fn is_confirmed(&self) -> bool {
        self.is_significant()
            && self.margin >= CLEAR_TWICE_LOG_BF
            && self.is_stable()
            && self.changed <= ALLOWED_FAILURES
            && !self.under_other_gravity
    }

    /// Whether it is significant and plausible, confirmed or not.
    pub(super) fn is_significant(&self) -> bool {
        self.significant && self.plausible
    }

    /// Whether it was recovered in the halves that could detect it; not if these are few.
    fn is_stable(&self) -> bool {
        self.testable >= MIN_TESTABLE_HALVES && self.recovered + ALLOWED_FAILURES >= self.testable
    }

    /// Why it is not confirmed.
    pub(super) fn doubts(&self) -> Vec<String> {
        let mut out = Vec::new();
        if let Some(sign) = self.wrong_sign {
            out.push(sign.doubt());
        } else if !self.plausible {
            out.push("physically implausible size, or another finding explains the same rows".to_owned());
        }
        if self.under_other_gravity {
            out.push("gravity along another direction explains these rows as well or better: see the note on the mounting".to_owned());
        }
        if !self.significant {
            out.push(
                "not significant once smooth unmodelled trends in time and pose are allowed for".to_owned(),
            );
        } else if self.margin < CLEAR_TWICE_LOG_BF {
            let times = odds::times(self.margin);
            out.push(if self.margin >= 0.0 {
                format!("with smooth unmodelled trends allowed for, it is only {times} times as probable as a rival")
            } else {
                format!("with smooth unmodelled trends allowed for, a rival is {times} times as probable")
            });
        }
        if self.testable < MIN_TESTABLE_HALVES {
            out.push(format!(
                "too weak to be detected in {} of the {HALVES} halves of the rows that were tried, so repeating the search cannot confirm it",
                HALVES - self.testable
            ));
        } else if !self.is_stable() {
            out.push(format!(
                "the search finds it in only {} of {} halves of the rows in which it is detectable",
                self.recovered, self.testable
            ));
        }
        if self.changed > ALLOWED_FAILURES {
            out.push(format!("its size differs in {} of {} halves of the rows", self.changed, self.testable));
        }
        out
    }
}

/// Overlap of two shifts (shared rows over all rows of either) from which they are the same.
const OVERLAP: f64 = 0.8;

/// Relative change below which a size counts as the same.
const CHANGED: f64 = 0.5;

/// Fall of χ² in all rows, relative to geometry alone, that a candidate needs to take part in stability selection.
const MIN_GAIN: f64 = 15.0;

/// Non-centrality from which a half can detect a cause.
const DETECTABLE: f64 = 15.0;

/// Confirmations of all accepted causes.
pub(super) struct Confirmations {
    /// One for each cause.
    pub confirmations: Vec<Confirmation>,
    /// The discrepancy given the significant causes.
    pub discrepancy: Discrepancy,
}

/// The final fit, linearised, with its causes and all candidates.
pub(super) struct ConfirmationContext<'a> {
    /// The rows.
    pub subject: &'a Subject<'a>,
    /// The fit.
    pub fit: &'a Extended,
    /// The linearised fit.
    pub linear: &'a Linear,
    /// The accepted causes.
    pub accepted: &'a [Accepted],
    /// All candidates.
    pub pool: &'a [Scored],
    /// Options of the search.
    pub options: &'a Options,
    /// Number of candidate families.
    pub families: f64,
    /// Whether approach sides were inferred from the order of the rows.
    pub sides_from_order: bool,
    /// The design of the fit, for the columns of candidates.
    pub raw: &'a Design,
}

/// Whitens columns of all rows as the fit beside the discrepancy.
type Whiten<'a> = &'a (dyn Fn(&DMatrix<f64>) -> DMatrix<f64> + Sync);

/// A candidate with its columns over all rows, whitened as in the fit.
struct WithColumns {
    candidate: Arc<Candidate>,
    columns: DMatrix<f64>,
}

impl ConfirmationContext<'_> {
    /// Tests all causes.
    pub(super) fn outcome(&self) -> Confirmations {
        let numbers: Vec<usize> = self.subject.observed.dataset.rows.iter().map(|r| r.number).collect();
        let functions = Functions::of(self.subject, self.linear);
        let own: Vec<WithColumns> = self
            .fit
            .causes
            .par_iter()
            .map(|cause| {
                let candidate = Candidate::of(cause, self.subject);
                WithColumns { columns: candidate.columns(self.raw), candidate: Arc::new(candidate) }
            })
            .collect();
        let tested: Vec<Tested<'_>> = own
            .iter()
            .zip(self.accepted)
            .enumerate()
            .map(|(k, (own, accepted))| Tested {
                columns: &own.columns,
                sizes: own.candidate.cause.sizes(),
                tried: accepted.tried,
                parameters: self.fit.parameter_indices(k).to_vec(),
                is_shift: own.candidate.cause.rows().is_some(),
            })
            .collect();
        let criteria = Criteria { families: self.families, alpha: self.options.alpha };
        let eliminated = eliminate(self.linear, &functions, &tested, &numbers, criteria);
        let mut confirmations = Vec::new();
        if !own.is_empty() {
            let Discrepancy { correlation: rho, noise, .. } = eliminated.discrepancy;
            let beside = self.linear.with_random_effects(&eliminated.discrepancy.columns);
            let whole = beside.prewhitened(rho, &numbers, noise).whole();
            let whiten = |columns: &DMatrix<f64>| prewhiten(columns, rho, &numbers, self.linear.per) / noise;
            confirmations = self.confirmations(&own, &eliminated, &whole, &whiten);
            let Eliminated { removed, discrepancy, .. } = &eliminated;
            let pool = self.pool(&whole, &whiten);
            let halves = halves(&self.subject.observed.dataset, self.options.seed);
            let tested: Vec<Vec<Option<(bool, bool)>>> = halves
                .par_iter()
                .map(|half| Half::of(self, half, discrepancy, &numbers).test(&own, &pool, removed))
                .collect();
            for in_half in tested {
                for (confirmation, tested) in confirmations.iter_mut().zip(in_half) {
                    if let Some((recovered, changed)) = tested {
                        confirmation.testable += 1;
                        confirmation.recovered += usize::from(recovered);
                        confirmation.changed += usize::from(changed);
                    }
                }
            }
        }
        Confirmations { confirmations, discrepancy: eliminated.discrepancy }
    }

    /// Candidates for stability selection: those with enough gain relative to geometry alone. `whole` is the design of the fit beside
    /// the discrepancy, `whiten` makes columns its own.
    fn pool(&self, whole: &FullDesign, whiten: Whiten<'_>) -> Vec<WithColumns> {
        let all: Vec<WithColumns> = self
            .pool
            .par_iter()
            .filter(|s| s.candidate.cause.rows().is_none())
            .map(|s| WithColumns {
                columns: s.candidate.columns(self.raw),
                candidate: Arc::clone(&s.candidate),
            })
            .collect();
        let every: Vec<usize> = (0..self.fit.causes.len()).collect();
        let design = whole.without(&self.parameter_indices(&every));
        let columns: Vec<DMatrix<f64>> = all.par_iter().map(|t| whiten(&t.columns)).collect();
        let projected = design.project_all(&columns);
        all.into_iter()
            .zip(projected)
            .filter(|(t, p)| {
                let candidate = &t.candidate;
                score_projected(p, &candidate.cause.sizes(), candidate.tried).gain > MIN_GAIN
            })
            .map(|(t, _)| t)
            .collect()
    }

    /// Whether backlash is confounded with unsettled or late readings: approach sides were inferred from the row order, and either such
    /// a cause was found, or the joint's steps have one size, so that side and step are proportional.
    fn is_confounded_with_lag(&self, cause: &Cause) -> bool {
        let Cause::Arm(Effect::Backlash(backlash)) = cause else { return false };
        let lags =
            self.fit.causes.iter().any(|c| [CauseKind::Unsettled, CauseKind::Latency].contains(&c.kind()));
        self.sides_from_order && (lags || self.has_uniform_steps(backlash.joint))
    }

    /// Whether the nonzero steps of a joint are nearly of one size.
    fn has_uniform_steps(&self, joint: usize) -> bool {
        let rows = self.subject.observed.dataset.rows.iter();
        let steps = rows.filter_map(|row| Some(row.motion()?.step[joint].abs()));
        let (mut count, mut sum, mut square) = (0.0, 0.0, 0.0);
        for step in steps.filter(|step| *step > 1e-6) {
            (count, sum, square) = (count + 1.0, sum + step, square + step * step);
        }
        sum * sum > CONFOUNDED * count * square
    }

    /// What the sign of a cause says, if that is the wrong one.
    fn wrong_sign(&self, cause: &Cause) -> Option<WrongSign> {
        match cause {
            _ if cause.has_plausible_sign() => None,
            Cause::Arm(Effect::JointCompliance(_)) => Some(WrongSign::Lifts),
            // Sides from the order of the rows have the right sign.
            Cause::Arm(Effect::Backlash(_)) if !self.sides_from_order => Some(WrongSign::SidesReversed),
            _ => None,
        }
    }

    /// Whether loads can be what bends a joint or tilts the base: those of one direction of gravity, and of positive masses.
    fn is_under_weight(&self, index: usize) -> bool {
        let Some(covariance) = &self.fit.estimate.covariance else { return true };
        let own = self.fit.parameter_indices(index);
        let values: Vec<f64> = own.iter().map(|&k| self.fit.x[k]).collect();
        let covariance = covariance.select_rows(&own).select_columns(&own);
        let cause = &self.fit.causes[index];
        match cause {
            Cause::Arm(Effect::LumpedCompliance(load)) => {
                lump_direction::is_one_direction(load, &values, &covariance)
            }
            _ => overturning_masses::are_weights(cause, &values, &covariance),
        }
    }

    /// Whether the links grew by more in these rows than heat does.
    fn grows_beyond_heat(&self) -> bool {
        let rows = self.subject.observed.dataset.rows.iter();
        let growth = rows.map(|row| self.fit.model.effects.iter().map(|e| e.growth(&row.condition)).sum());
        let [low, high] = growth.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], grown: f64| {
            [low.min(grown), high.max(grown)]
        });
        high - low > MAX_GROWTH
    }

    fn parameter_indices(&self, causes: &[usize]) -> Vec<usize> {
        causes.iter().flat_map(|&k| self.fit.parameter_indices(k)).collect()
    }

    /// The causes beside the discrepancy and beside their rivals there, not yet repeated in halves.
    fn confirmations(
        &self,
        own: &[WithColumns],
        eliminated: &Eliminated,
        whole: &FullDesign,
        whiten: Whiten<'_>,
    ) -> Vec<Confirmation> {
        let Eliminated { significance, removed, .. } = eliminated;
        let mut out: Vec<Confirmation> = significance
            .par_iter()
            .enumerate()
            .map(|(k, judged)| {
                let dropped: Vec<usize> = removed.iter().copied().filter(|o| *o != k).chain([k]).collect();
                let design = whole.without(&self.parameter_indices(&dropped));
                self.beside_rivals(k, &own[k], *judged, &design, whiten)
            })
            .collect();
        removed.iter().for_each(|&k| out[k].significant = false);
        // A tilt that only joint 1 shows, which bears no weight in an upright arm, or that other joints contradict.
        let causes = &self.fit.causes;
        let is_supported =
            (0..out.len()).any(|k| causes[k].is_tilt() && !causes[k].requires_tilt() && out[k].plausible);
        if !is_supported {
            let alone = (0..out.len()).filter(|&k| causes[k].requires_tilt());
            alone.for_each(|k| out[k].plausible = false);
        }
        out
    }

    /// The merit of growth of each link with the course of `cause`, if that is a drift of the sensor; else 0. Beside growth that the fit
    /// has already, `confounding` compares the two.
    fn growth_of_links(&self, cause: &Cause, tried: f64, design: &Design, whiten: Whiten<'_>) -> f64 {
        if self.fit.causes.iter().any(Cause::is_growth_of_arm) {
            return 0.0;
        }
        let links = link_growth::columns(cause, self.subject, &self.linear.slopes, self.linear.per);
        links.map_or(0.0, |links| {
            score_columns(design, &whiten(&links), &vec![GROWTH_SIGMA; links.ncols()], tried).merit
        })
    }

    /// The confirmation of a cause with the margin to its best rival in `design`, which has it not.
    fn beside_rivals(
        &self,
        index: usize,
        own: &WithColumns,
        judged: Significance,
        design: &Design,
        whiten: Whiten<'_>,
    ) -> Confirmation {
        checkpoint();
        let accepted = &self.accepted[index];
        let best = accepted
            .rivals
            .iter()
            .map(|rival| {
                let columns = whiten(&rival.candidate.columns(self.raw));
                score_columns(design, &columns, &rival.candidate.cause.sizes(), rival.candidate.tried).merit
            })
            .fold(0.0, f64::max);
        let best = best.max(self.growth_of_links(&own.candidate.cause, accepted.tried, design, whiten));
        Confirmation {
            significant: judged.is_significant,
            log_p: judged.log_p,
            margin: judged.merit - best,
            recovered: 0,
            testable: 0,
            changed: 0,
            under_other_gravity: false,
            plausible: own.candidate.cause.has_plausible_sign()
                && self.is_under_weight(index)
                && !self.is_confounded_with_lag(&own.candidate.cause)
                && !(own.candidate.cause.is_growth_of_arm() && self.grows_beyond_heat()),
            wrong_sign: self.wrong_sign(&own.candidate.cause),
        }
    }
}

/// The rows (numbers) of the other shifts of the kind of cause `index` that were not removed.
fn others_of_kind(index: usize, own: &[WithColumns], removed: &[usize]) -> Vec<[usize; 2]> {
    let kind = |of: &WithColumns| match &of.candidate.cause {
        Cause::Measurement(disturbance) => Some(disturbance.kind.clone()),
        Cause::Arm(_) => None,
    };
    let others = own.iter().enumerate().filter(|(k, _)| *k != index && !removed.contains(k));
    others
        .filter(|(_, other)| kind(other) == kind(&own[index]))
        .filter_map(|(_, other)| other.candidate.cause.rows())
        .collect()
}

/// The rows of one half.
struct Half<'a> {
    confirming: &'a ConfirmationContext<'a>,
    rows: &'a [usize],
    numbers: Vec<usize>,
    rho: f64,
    noise: f64,
    linear: Linear,
}

impl<'a> Half<'a> {
    fn of(
        confirming: &'a ConfirmationContext<'a>,
        rows: &'a [usize],
        discrepancy: &Discrepancy,
        numbers: &[usize],
    ) -> Self {
        let numbers: Vec<usize> = rows.iter().map(|&i| numbers[i]).collect();
        let (rho, noise) = (discrepancy.correlation, discrepancy.noise);
        let part = confirming.linear.part(rows);
        let columns = picked_rows(&discrepancy.columns, rows, confirming.linear.per);
        let linear = part.with_random_effects(&columns).prewhitened(rho, &numbers, noise);
        Self { confirming, rows, numbers, rho, noise, linear }
    }

    /// Columns of all rows, in the rows of this half.
    fn columns(&self, of_all: &DMatrix<f64>) -> DMatrix<f64> {
        let per = self.linear.per;
        prewhiten(&picked_rows(of_all, self.rows, per), self.rho, &self.numbers, per) / self.noise
    }

    /// For each cause, whether it is recovered and whether its size differs; `None` if undetectable in this half.
    fn test(
        &self,
        own: &[WithColumns],
        pool: &[WithColumns],
        removed: &[usize],
    ) -> Vec<Option<(bool, bool)>> {
        let all: Vec<usize> = (0..own.len()).collect();
        let whole = self.linear.whole();
        let without_causes = whole.without(&self.confirming.parameter_indices(&all));
        let selected = self.selected(own, pool, &without_causes);
        let columns: Vec<DMatrix<f64>> = own.iter().map(|tried| self.columns(&tried.columns)).collect();
        let projected = whole.design.project_all(&columns);
        own.iter()
            .zip(&projected)
            .enumerate()
            .map(|(k, (tried, projected))| {
                let accepted = &self.confirming.accepted;
                // Terms of one finding share what it explains, and may each be too weak: they are asked together.
                let terms = terms_of(k, own, removed);
                let together = (terms.len() > 1).then(|| {
                    let columns: Vec<DMatrix<f64>> = terms.iter().map(|&j| columns[j].clone()).collect();
                    whole.design.project_all(&[side_by_side(&columns, self.linear.residual.len())])
                });
                let projected = together.as_ref().and_then(|all| all.first()).unwrap_or(projected);
                let sizes: Vec<f64> = terms.iter().flat_map(|&j| own[j].candidate.cause.sizes()).collect();
                let before = terms
                    .iter()
                    .flat_map(|&j| accepted[j].own.estimate.iter().copied())
                    .collect::<Vec<f64>>();
                let before = &DVector::from_vec(before);
                let accepted = &accepted[k];
                let dropped: Vec<usize> = removed
                    .iter()
                    .copied()
                    .filter(|o| !terms.contains(o))
                    .chain(terms.iter().copied())
                    .collect();
                let design = whole.without(&self.confirming.parameter_indices(&dropped));
                let score = score_from(design.gradient_and_information(projected), &sizes, accepted.tried);
                let lambda = |v: &DVector<f64>| (v.transpose() * &score.information * v)[0].max(0.0);
                if lambda(before) < DETECTABLE {
                    return None;
                }
                let apart = lambda(&(&score.estimate - before));
                let chance = 16.0 + 3.0 * before.len() as f64;
                let changed = apart > chance && apart > CHANGED * CHANGED * lambda(before);
                let cause = &tried.candidate.cause;
                let recovered = if cause.rows().is_some() {
                    self.recovers_shift(tried, &others_of_kind(k, own, removed), &design, &score)
                } else {
                    let is_of = |s: &WithColumns, cause: &Cause| s.candidate.cause.is_same_finding(cause);
                    let same = selected.iter().any(|s| is_of(s, cause));
                    let rivals = accepted.rivals.iter().map(|r| &r.candidate.cause);
                    let foreign: Vec<&Cause> = rivals.filter(|r| !own.iter().any(|o| is_of(o, r))).collect();
                    let (rivals, others): (Vec<&WithColumns>, Vec<&WithColumns>) =
                        selected.iter().partition(|s| foreign.iter().any(|rival| is_of(s, rival)));
                    let displaced =
                        || !rivals.is_empty() && !self.beats(tried, &rivals, &others, &without_causes);
                    same || (score.evidence > 0.0 && !displaced())
                };
                Some((recovered, changed))
            })
            .collect()
    }

    /// Whether a shift is recovered in the same rows, or at the rows where it alone changes the level: beside `others_of_kind`, the rows of shifts
    /// of its kind that are free, of three levels each two of the three intervals say the same.
    fn recovers_shift(
        &self,
        tried: &WithColumns,
        others_of_kind: &[[usize; 2]],
        design: &Design,
        score: &Score,
    ) -> bool {
        let Some([from, to]) = tried.candidate.cause.rows() else { return false };
        let Cause::Measurement(disturbance) = &tried.candidate.cause else { return false };
        if !(score.evidence > 0.0) {
            return false;
        }
        // The same kind of shift over all rows.
        let always = Cause::Measurement(Disturbance::new(disturbance.kind.clone(), Profile::Constant));
        let everywhere = Candidate::of(&always, self.confirming.subject).columns(self.confirming.raw);
        let everywhere = self.columns(&everywhere);
        let Some(strip) = ShiftScan::of(design, &everywhere, &tried.candidate.cause.sizes()) else {
            return true;
        };
        let rows = &self.confirming.subject.observed.dataset;
        let stations: Vec<usize> = self.rows.iter().map(|&i| rows.station_of(i)).collect();
        let best = strip.of_stations(&stations).scan(design, 1);
        let inside = |i: usize| (from..=to).contains(&self.numbers[i]);
        best.first().is_some_and(|best| {
            let mine = (0..self.numbers.len()).filter(|&i| inside(i)).count();
            let shared = (best.from..=best.to).filter(|&i| inside(i)).count();
            let both = mine + (best.to + 1 - best.from) - shared;
            // A shift in rows a to b is equivalent to one in all other rows.
            let n = self.numbers.len();
            let (outside, rest) = (n - mine, best.to + 1 - best.from - shared);
            let complement = rest as f64 / (outside + (best.to + 1 - best.from) - rest).max(1) as f64;
            let is_found = self.changes_level_alike([from, to], [best.from, best.to], others_of_kind, mine);
            shared as f64 / both.max(1) as f64 >= OVERLAP || complement >= OVERLAP || is_found
        })
    }

    /// Whether an interval, by indices, changes the level at the rows (numbers) where a shift of `mine` rows does and no other of its kind.
    fn changes_level_alike(
        &self,
        [from, to]: [usize; 2],
        best: [usize; 2],
        others_of_kind: &[[usize; 2]],
        mine: usize,
    ) -> bool {
        let row = |number: usize| self.numbers.partition_point(|n| *n < number);
        let changes = |[from, to]: [usize; 2]| [row(from), row(to + 1)];
        let of_others: Vec<usize> = others_of_kind.iter().copied().flat_map(changes).collect();
        let alone = |at: &usize| (1..self.numbers.len()).contains(at) && !of_others.contains(at);
        let alone: Vec<usize> = changes([from, to]).into_iter().filter(alone).collect();
        let near = |at: usize, row: usize| 2.0 * at.abs_diff(row) as f64 <= (1.0 - OVERLAP) * mine as f64;
        !of_others.is_empty()
            && !alone.is_empty()
            && alone.iter().all(|&at| near(at, best[0]) || near(at, best[1] + 1))
    }

    /// Forward selection from scratch, each step to first order; best first. `design` has none of the causes.
    fn selected<'c>(
        &self,
        own: &'c [WithColumns],
        pool: &'c [WithColumns],
        design: &Design,
    ) -> Vec<&'c WithColumns> {
        let all: Vec<&WithColumns> = pool.iter().chain(own.iter().filter(|o| fresh(o, pool))).collect();
        let mut left = Remaining::of(self, design, &all);
        let mut chosen: Vec<usize> = Vec::new();
        let options = self.confirming.options;
        while chosen.len() < own.len() + 4 {
            let mut scored: Vec<(usize, Score)> = (0..all.len())
                .filter(|j| !chosen.contains(j))
                .map(|j| (j, left.score(j)))
                .filter(|(_, score)| score.merit > 0.0)
                .collect();
            scored.sort_by(|a, b| b.1.merit.total_cmp(&a.1.merit).then(a.0.cmp(&b.0)));
            // The p-value takes eigenvalues: only until one is significant.
            let best = scored.into_iter().find(|(j, score)| {
                let candidate = &all[*j].candidate;
                let trials = (candidate.tried * self.confirming.families).ln();
                score.plain_log_p(&candidate.cause.sizes()) + trials <= options.alpha.ln()
            });
            let Some((j, _)) = best else { break };
            chosen.push(j);
            if !left.project_off(j) {
                break;
            }
        }
        chosen.into_iter().map(|j| all[j]).collect()
    }

    /// Whether a cause explains these rows better than all selected `rivals` together, given the `others` that are selected. Forward selection
    /// begins with what explains most alone, and that can be a rival which explains parts of two causes.
    fn beats(
        &self,
        own: &WithColumns,
        rivals: &[&WithColumns],
        others: &[&WithColumns],
        design: &Design,
    ) -> bool {
        let all: Vec<&WithColumns> = others.iter().chain(&[own]).chain(rivals).copied().collect();
        let mut left = Remaining::of(self, design, &all);
        if !(0..others.len()).all(|j| left.project_off(j)) {
            return false;
        }
        let own_merit = left.score(others.len()).merit;
        let mut of_rivals = 0.0;
        for j in others.len() + 1..all.len() {
            of_rivals += left.score(j).merit;
            left.project_off(j);
        }
        own_merit > of_rivals
    }
}

/// Candidates in the rows of a half, with what is free and what was selected projected off.
struct Remaining<'c> {
    all: Vec<&'c WithColumns>,
    columns: Vec<DMatrix<f64>>,
    projected: Vec<Projected>,
    products: PureProducts,
}

impl<'c> Remaining<'c> {
    /// Nothing is selected yet.
    fn of(half: &Half<'_>, design: &Design, all: &[&'c WithColumns]) -> Self {
        let columns: Vec<DMatrix<f64>> = all.iter().map(|t| half.columns(&t.columns)).collect();
        let projected = design.project_all(&columns);
        let products = PureProducts::of(design, &columns, &projected);
        Self { all: all.to_vec(), columns, projected, products }
    }

    fn score(&self, j: usize) -> Score {
        let candidate = &self.all[j].candidate;
        score_projected(&self.projected[j], &candidate.cause.sizes(), candidate.tried)
    }

    /// Projects a candidate, with its prior, off all; whether that is possible.
    fn project_off(&mut self, j: usize) -> bool {
        let mut normal = self.projected[j].information.clone();
        for (k, size) in self.all[j].candidate.cause.sizes().iter().enumerate() {
            normal[(k, k)] += size.powi(-2);
        }
        let lower = lower_factor(normal);
        let Some(pull) = lower.solve_lower_triangular(&self.projected[j].gradient) else { return false };
        let shared = self.products.project_off(j, &self.columns[j], &lower);
        for (p, range) in self.projected.iter_mut().zip(&self.products.ranges) {
            let t = shared.columns(range.start, range.len());
            p.information -= t.transpose() * t;
            p.gradient -= t.tr_mul(&pull);
        }
        true
    }
}

/// The causes of the finding of cause `k`; a shift is judged by itself.
fn terms_of(k: usize, own: &[WithColumns], removed: &[usize]) -> Vec<usize> {
    let cause = |j: usize| &own[j].candidate.cause;
    let is_term = |&j: &usize| {
        j == k || cause(k).rows().is_none() && cause(j).is_same_finding(cause(k)) && !removed.contains(&j)
    };
    (0..own.len()).filter(is_term).collect()
}

/// Whether a cause is not in the pool.
fn fresh(own: &WithColumns, pool: &[WithColumns]) -> bool {
    let cause = &own.candidate.cause;
    cause.rows().is_some()
        || !pool.iter().any(|p| contains_cause(std::slice::from_ref(cause), &p.candidate.cause))
}
