//! Whether an accepted cause is confirmed, without which it is not called identified: it must win beside what no cause describes, come back in halves of the
//! rows, and be of the same size there.
//!
//! 1. *Beside the discrepancy.* The functions of [`discrepancy`](super::discrepancy) get their most probable variances beside the
//!    accepted causes. A cause that then no longer carries itself is taken out, the variances are found anew without it, and so
//!    on, until all that are left carry themselves.
//! 2. *In halves.* In each half of [`halves`](super::halves) causes are selected again from nothing, by evidence and to first order.
//!    A cause has come back if it is selected there with the same joints. One that is too weak for half of the rows has come
//!    back if it raises the evidence there beside the others and no rival was selected in its place. Rows of a shift must share
//!    [`OVERLAP`] of theirs with those that are found again.
//! 3. *Of one size.* Its size in a half must not differ from that in all rows by more than both chance and [`CHANGED`] allow.
//!
//! Source: Meinshausen and Bühlmann 2010 and Shah and Samworth 2013 (selection in halves); Peters, Bühlmann and Meinshausen 2016
//! (a cause has the same size wherever it acts).

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::algebra::{lower_factor, product, solved};
use super::candidates::Scored;
use super::catalogue::Candidate;
use super::cause::Cause;
use super::design::{Design, Linear};
use super::discrepancy::{Discrepancy, Functions};
use super::extension::{Extended, Subject};
use super::halves::halves;
use super::intervals::ShiftScan;
use super::score::{Score, log_p_of, score_columns, score_from, score_projected};
use super::selection::{Accepted, Options, already};
use super::serial_correlation::prewhiten;
use crate::measurement::sensor::disturbance::{Disturbance, Profile};
use truegrind_arm::effect::Effect;
use truegrind_math::work::checkpoint;

/// How a cause came out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Confirmation {
    /// Whether it carries itself beside what no cause describes.
    pub beside: bool,
    /// Natural logarithm of its p-value there, corrected for trials.
    pub log_p: f64,
    /// By how much its merit exceeds that of its best rival there.
    pub ahead: f64,
    /// Halves in which it came back.
    pub came_back: usize,
    /// Halves that could tell.
    pub asked: usize,
    /// Halves in which it had another size.
    pub changed: usize,
    /// Whether nature has such a size, and nothing else that was found says the same of the same rows.
    pub plausible: bool,
}

/// Halves in which a cause may fail to come back.
const MISSED: usize = 1;

/// Squared correlation of a joint's side with its last step from which they are the same.
const ALIKE: f64 = 0.9;

/// Twice the log Bayes factor by which a cause must be ahead of its rivals beside what no cause describes.
const AHEAD: f64 = 6.0;

impl Confirmation {
    /// Whether it may be called identified, as far as this goes.
    pub(super) fn is_confirmed(&self) -> bool {
        self.beside && self.plausible && self.ahead >= AHEAD && self.recurs() && self.changed <= MISSED
    }

    /// Whether it carries itself and has a size that nature has, sure or not.
    pub(super) fn is_there(&self) -> bool {
        self.beside && self.plausible
    }

    /// Whether it comes back in the halves that could tell; where none could, nobody has seen it come back.
    fn recurs(&self) -> bool {
        self.came_back > 0 && self.came_back + MISSED >= self.asked
    }

    /// Why it may not be called identified.
    pub(super) fn doubts(&self) -> Vec<String> {
        let mut out = Vec::new();
        if !self.plausible {
            out.push(
                "nature has no such size, or something else that was found says the same of these rows"
                    .to_owned(),
            );
        }
        if !self.beside {
            out.push(
                "it does not carry itself beside smooth functions of time and pose that nobody has named"
                    .to_owned(),
            );
        } else if self.ahead < AHEAD {
            out.push(format!(
                "beside what nobody has named a rival comes near: twice the log Bayes factor {:.1}",
                self.ahead
            ));
        }
        if self.asked == 0 {
            out.push(
                "it is too weak to be seen in half of the rows, so it could not be found again".to_owned(),
            );
        } else if !self.recurs() {
            out.push(format!(
                "searched again, it came back in {} of {} halves of the rows that could tell",
                self.came_back, self.asked
            ));
        }
        if self.changed > MISSED {
            out.push(format!("it had another size in {} of {} halves of the rows", self.changed, self.asked));
        }
        out
    }
}

/// Rows that two shifts share, of all that either has, from which they are the same.
const OVERLAP: f64 = 0.8;

/// A size that differs by less than this share is the same.
const CHANGED: f64 = 0.5;

/// Fall of χ² in all rows, beside geometry alone, below which a candidate is selected in no half.
const SOME: f64 = 15.0;

/// Non-centrality in a half from which the half can tell of a cause.
const TELLING: f64 = 15.0;

/// What confirming all accepted causes came to.
pub(super) struct Outcome {
    /// One for each cause.
    pub confirmations: Vec<Confirmation>,
    /// What no cause describes, beside those that are confirmed.
    pub discrepancy: Discrepancy,
}

/// The final fit, linearised, with its causes and every candidate: what is to be confirmed.
pub(super) struct Confirming<'a> {
    /// The rows.
    pub subject: &'a Subject<'a>,
    /// The fit.
    pub found: &'a Extended,
    /// The fit linearised.
    pub linear: &'a Linear,
    /// The causes of the fit, as accepted.
    pub accepted: &'a [Accepted],
    /// Every candidate.
    pub pool: &'a [Scored],
    /// As the search had them.
    pub options: &'a Options,
    /// Kinds of candidates.
    pub families: f64,
    /// Whether the sides from which joints came were taken from the order of the rows.
    pub sides_from_order: bool,
    /// The design of the fit: what candidates are made of.
    pub raw: &'a Design,
}

/// A candidate with its columns for all rows, whitened as in the fit.
struct WithColumns {
    candidate: Arc<Candidate>,
    columns: DMatrix<f64>,
}

impl Confirming<'_> {
    /// Confirms each cause or not.
    pub(super) fn outcome(&self) -> Outcome {
        let numbers: Vec<usize> = self.subject.observed.dataset.rows.iter().map(|r| r.number).collect();
        let functions = Functions::of(self.subject, self.linear);
        let own: Vec<WithColumns> = self
            .found
            .causes
            .par_iter()
            .map(|cause| {
                let candidate = Candidate::of(cause, self.subject);
                WithColumns { columns: candidate.columns(self.raw), candidate: Arc::new(candidate) }
            })
            .collect();
        let (mut confirmations, out, discrepancy) = self.beside(&functions, &own, &numbers);
        if !own.is_empty() {
            let pool = self.pool(&discrepancy, &numbers);
            let halves = halves(&self.subject.observed.dataset, self.options.seed);
            let told: Vec<Vec<Option<(bool, bool)>>> = halves
                .par_iter()
                .map(|half| Half::of(self, half, &discrepancy, &numbers).told(&own, &pool, &out))
                .collect();
            for in_half in told {
                for (confirmation, told) in confirmations.iter_mut().zip(in_half) {
                    if let Some((came_back, changed)) = told {
                        confirmation.asked += 1;
                        confirmation.came_back += usize::from(came_back);
                        confirmation.changed += usize::from(changed);
                    }
                }
            }
        }
        Outcome { confirmations, discrepancy }
    }

    /// Candidates that explain anything of what geometry leaves; the others are selected in no half.
    fn pool(&self, discrepancy: &Discrepancy, numbers: &[usize]) -> Vec<WithColumns> {
        let all: Vec<WithColumns> = self
            .pool
            .par_iter()
            .filter(|s| s.candidate.cause.rows().is_none())
            .map(|s| WithColumns {
                columns: s.candidate.columns(self.raw),
                candidate: Arc::clone(&s.candidate),
            })
            .collect();
        let (rho, noise) = (discrepancy.correlation, discrepancy.noise);
        let every: Vec<usize> = (0..self.found.causes.len()).collect();
        let linear = self.linear.beside(&discrepancy.columns).filtered(rho, numbers, noise);
        let design = linear.design(&self.parameter_indices(&every));
        let columns: Vec<DMatrix<f64>> =
            all.par_iter().map(|t| prewhiten(&t.columns, rho, numbers, linear.per) / noise).collect();
        let projected = design.project_all(&columns);
        all.into_iter()
            .zip(projected)
            .filter(|(t, p)| {
                let candidate = &t.candidate;
                score_projected(p, &candidate.cause.sizes(), candidate.tried).gain > SOME
            })
            .map(|(t, _)| t)
            .collect()
    }

    /// Sides that were taken from the order of the rows say nothing that a reading before rest, or one that is late, does not say
    /// too: where that was found, or where the joint went by steps of one size, so that side and step are the same.
    fn told_otherwise(&self, cause: &Cause) -> bool {
        let Cause::Arm(Effect::Backlash(backlash)) = cause else { return false };
        let lags = self.found.causes.iter().any(|c| ["unsettled", "latency"].contains(&c.name()));
        self.sides_from_order && (lags || self.steps_alike(backlash.joint))
    }

    /// Whether the steps of a joint, where it moved, are nearly of one size.
    fn steps_alike(&self, joint: usize) -> bool {
        let rows = self.subject.observed.dataset.rows.iter();
        let steps = rows.filter_map(|row| Some(row.motion()?.step[joint].abs()));
        let (mut count, mut sum, mut square) = (0.0, 0.0, 0.0);
        for step in steps.filter(|step| *step > 1e-6) {
            (count, sum, square) = (count + 1.0, sum + step, square + step * step);
        }
        sum * sum > ALIKE * count * square
    }

    fn parameter_indices(&self, causes: &[usize]) -> Vec<usize> {
        causes.iter().flat_map(|&k| self.found.parameter_indices(k)).collect()
    }

    /// Takes out causes that do not carry themselves beside the functions, one after the other.
    fn beside(
        &self,
        functions: &Functions,
        own: &[WithColumns],
        numbers: &[usize],
    ) -> (Vec<Confirmation>, Vec<usize>, Discrepancy) {
        let mut out: Vec<usize> = Vec::new();
        let mut discrepancy = Discrepancy::of(functions, self.linear, &[], numbers, None);
        let mut confirmations = loop {
            let (rho, noise) = (discrepancy.correlation, discrepancy.noise);
            let whole = self.linear.beside(&discrepancy.columns).filtered(rho, numbers, noise).whole();
            let whiten = |columns: &DMatrix<f64>| prewhiten(columns, rho, numbers, self.linear.per) / noise;
            let judged: Vec<Confirmation> = (0..own.len())
                .into_par_iter()
                .map(|k| {
                    checkpoint();
                    let mut dropped = out.clone();
                    if !out.contains(&k) {
                        dropped.push(k);
                    }
                    let design = whole.without(&self.parameter_indices(&dropped));
                    self.judged(k, &own[k], &design, &whiten)
                })
                .collect();
            let worst = (0..own.len())
                .filter(|k| !out.contains(k) && !judged[*k].beside)
                .max_by(|&a, &b| judged[a].log_p.total_cmp(&judged[b].log_p).then(b.cmp(&a)));
            let Some(worst) = worst else { break judged };
            out.push(worst);
            discrepancy = Discrepancy::of(
                functions,
                self.linear,
                &self.parameter_indices(&out),
                numbers,
                Some(&discrepancy),
            );
        };
        for k in &out {
            confirmations[*k].beside = false;
        }
        (confirmations, out, discrepancy)
    }

    fn judged(
        &self,
        index: usize,
        own: &WithColumns,
        design: &Design,
        whiten: &dyn Fn(&DMatrix<f64>) -> DMatrix<f64>,
    ) -> Confirmation {
        let accepted = &self.accepted[index];
        let sizes = own.candidate.cause.sizes();
        let columns = whiten(&own.columns);
        let score = score_columns(design, &columns, &sizes, accepted.tried);
        let trials = (accepted.tried * self.families).ln();
        let log_p = (log_p_of(design, || columns.clone(), &sizes, &score) + trials).min(0.0);
        let best = accepted
            .rivals
            .iter()
            .map(|rival| {
                let columns = whiten(&rival.candidate.columns(self.raw));
                score_columns(design, &columns, &rival.candidate.cause.sizes(), rival.candidate.tried).merit
            })
            .fold(0.0, f64::max);
        Confirmation {
            beside: score.merit > 0.0 && log_p <= self.options.alpha.ln(),
            log_p,
            ahead: score.merit - best,
            came_back: 0,
            asked: 0,
            changed: 0,
            plausible: own.candidate.cause.has_plausible_sign() && !self.told_otherwise(&own.candidate.cause),
        }
    }
}

/// The rows of one half.
struct Half<'a> {
    confirming: &'a Confirming<'a>,
    rows: &'a [usize],
    numbers: Vec<usize>,
    rho: f64,
    noise: f64,
    linear: Linear,
}

impl<'a> Half<'a> {
    fn of(
        confirming: &'a Confirming<'a>,
        rows: &'a [usize],
        discrepancy: &Discrepancy,
        numbers: &[usize],
    ) -> Self {
        let numbers: Vec<usize> = rows.iter().map(|&i| numbers[i]).collect();
        let (rho, noise) = (discrepancy.correlation, discrepancy.noise);
        let part = confirming.linear.part(rows);
        let columns = picked(&discrepancy.columns, rows, confirming.linear.per);
        let linear = part.beside(&columns).filtered(rho, &numbers, noise);
        Self { confirming, rows, numbers, rho, noise, linear }
    }

    /// Columns of all rows, in the rows of this half.
    fn columns(&self, of_all: &DMatrix<f64>) -> DMatrix<f64> {
        let per = self.linear.per;
        prewhiten(&picked(of_all, self.rows, per), self.rho, &self.numbers, per) / self.noise
    }

    /// For each cause whether it came back and whether it had another size; `None` where this half cannot tell.
    fn told(&self, own: &[WithColumns], pool: &[WithColumns], out: &[usize]) -> Vec<Option<(bool, bool)>> {
        let all: Vec<usize> = (0..own.len()).collect();
        let selected = self.selected(own, pool, &self.confirming.parameter_indices(&all));
        let whole = self.linear.whole();
        let columns: Vec<DMatrix<f64>> = own.iter().map(|tried| self.columns(&tried.columns)).collect();
        let projected = whole.design.project_all(&columns);
        own.iter()
            .zip(&projected)
            .enumerate()
            .map(|(k, (tried, projected))| {
                let dropped: Vec<usize> = out.iter().copied().filter(|o| *o != k).chain([k]).collect();
                let design = whole.without(&self.confirming.parameter_indices(&dropped));
                let accepted = &self.confirming.accepted[k];
                let sizes = tried.candidate.cause.sizes();
                let score = score_from(design.gradient_and_information(projected), &sizes, accepted.tried);
                let before = &accepted.own.estimate;
                let lambda = |v: &DVector<f64>| (v.transpose() * &score.information * v)[0].max(0.0);
                if lambda(before) < TELLING {
                    return None;
                }
                let apart = lambda(&(&score.estimate - before));
                let chance = 16.0 + 3.0 * before.len() as f64;
                let changed = apart > chance && apart > CHANGED * CHANGED * lambda(before);
                let cause = &tried.candidate.cause;
                let came_back = if cause.rows().is_some() {
                    self.found_again(tried, &design, &score)
                } else {
                    let same = selected.iter().any(|s| s.is_same_finding(cause));
                    let displaced = accepted.rivals.iter().any(|r| {
                        let rival = &r.candidate.cause;
                        selected.iter().any(|s| s.is_same_finding(rival))
                            && !own.iter().any(|o| o.candidate.cause.is_same_finding(rival))
                    });
                    same || (score.evidence > 0.0 && !displaced)
                };
                Some((came_back, changed))
            })
            .collect()
    }

    /// Whether a shift is found again where it was.
    fn found_again(&self, tried: &WithColumns, design: &Design, score: &Score) -> bool {
        let Some([from, to]) = tried.candidate.cause.rows() else { return false };
        let Cause::Measurement(disturbance) = &tried.candidate.cause else { return false };
        if !(score.evidence > 0.0) {
            return false;
        }
        // The kind in all rows, not only in its own.
        let always = Cause::Measurement(Disturbance::new(disturbance.kind.clone(), Profile::Constant));
        let everywhere = Candidate::of(&always, self.confirming.subject).columns(self.confirming.raw);
        let everywhere = self.columns(&everywhere);
        let Some(strip) = ShiftScan::of(design, &everywhere, &tried.candidate.cause.sizes()) else {
            return true;
        };
        let best = strip.scan(design, 1);
        let inside = |i: usize| (from..=to).contains(&self.numbers[i]);
        best.first().is_some_and(|best| {
            let mine = (0..self.numbers.len()).filter(|&i| inside(i)).count();
            let shared = (best.from..=best.to).filter(|&i| inside(i)).count();
            let both = mine + (best.to + 1 - best.from) - shared;
            // What happened in rows a to b is the same story as what happened in all others.
            let n = self.numbers.len();
            let (others, rest) = (n - mine, best.to + 1 - best.from - shared);
            let complement = rest as f64 / (others + (best.to + 1 - best.from) - rest).max(1) as f64;
            shared as f64 / both.max(1) as f64 >= OVERLAP || complement >= OVERLAP
        })
    }

    /// Causes selected from nothing, best first, each step to first order.
    fn selected(&self, own: &[WithColumns], pool: &[WithColumns], places: &[usize]) -> Vec<Cause> {
        let design = self.linear.design(places);
        let all: Vec<&WithColumns> = pool.iter().chain(own.iter().filter(|o| fresh(o, pool))).collect();
        let columns: Vec<DMatrix<f64>> = all.iter().map(|t| self.columns(&t.columns)).collect();
        let mut projected = design.project_all(&columns);
        let ranges = ranges(&columns);
        let beside = side_by_side(&columns, design.rows());
        let mut extra = DMatrix::zeros(0, design.rows());
        let mut chosen: Vec<usize> = Vec::new();
        let options = self.confirming.options;
        while chosen.len() < own.len() + 4 {
            let best = (0..all.len())
                .filter(|j| !chosen.contains(j))
                .map(|j| {
                    let candidate = &all[j].candidate;
                    let sizes = candidate.cause.sizes();
                    (j, score_projected(&projected[j], &sizes, candidate.tried))
                })
                .filter(|(j, score)| {
                    let candidate = &all[*j].candidate;
                    let trials = (candidate.tried * self.confirming.families).ln();
                    score.merit > 0.0
                        && score.plain_log_p(&candidate.cause.sizes()) + trials <= options.alpha.ln()
                })
                .max_by(|a, b| a.1.merit.total_cmp(&b.1.merit).then(b.0.cmp(&a.0)));
            let Some((j, _)) = best else { break };
            chosen.push(j);
            // Everything is projected off what was chosen.
            let mut pure = design.pure(&columns[j], &projected[j]);
            pure -= extra.transpose() * product(&extra, &columns[j]);
            let mut normal = projected[j].information.clone();
            for (k, size) in all[j].candidate.cause.sizes().iter().enumerate() {
                normal[(k, k)] += size.powi(-2);
            }
            let lower = lower_factor(normal);
            let rows = solved(&lower, pure.transpose());
            let Some(pull) = lower.solve_lower_triangular(&projected[j].gradient) else { break };
            let shared = product(&rows, &beside);
            for (p, range) in projected.iter_mut().zip(&ranges) {
                let t = shared.columns(range.start, range.len());
                p.information -= t.transpose() * t;
                p.gradient -= t.tr_mul(&pull);
            }
            let first = extra.nrows();
            extra = extra.insert_rows(first, rows.nrows(), 0.0);
            extra.rows_mut(first, rows.nrows()).copy_from(&rows);
        }
        chosen.into_iter().map(|j| all[j].candidate.cause.clone()).collect()
    }
}

/// Whether a cause is not among the pool's.
fn fresh(own: &WithColumns, pool: &[WithColumns]) -> bool {
    let cause = &own.candidate.cause;
    cause.rows().is_some() || !pool.iter().any(|p| already(std::slice::from_ref(cause), &p.candidate.cause))
}

fn ranges(columns: &[DMatrix<f64>]) -> Vec<std::ops::Range<usize>> {
    let mut first = 0;
    columns
        .iter()
        .map(|c| {
            first += c.ncols();
            first - c.ncols()..first
        })
        .collect()
}

fn side_by_side(columns: &[DMatrix<f64>], rows: usize) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(rows, columns.iter().map(DMatrix::ncols).sum());
    for (c, range) in columns.iter().zip(ranges(columns)) {
        out.columns_mut(range.start, range.len()).copy_from(c);
    }
    out
}

fn picked(columns: &DMatrix<f64>, observations: &[usize], per: usize) -> DMatrix<f64> {
    let scalars: Vec<usize> = observations.iter().flat_map(|&i| i * per..(i + 1) * per).collect();
    columns.select_rows(&scalars)
}
