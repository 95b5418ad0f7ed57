//! Every candidate against one fit, and against the same fit without some of its parameters.
//!
//! The expensive part (columns of all candidates, their products with the basis of everything free) is done once for a fit.
//! The model without one cause differs by a few directions of that basis, so scoring all candidates there takes only small
//! matrices. Candidates whose rows or orders are searched are searched again in every design.

use std::sync::{Arc, OnceLock};

use rayon::prelude::*;

use super::candidates::{Catalogue, Scored};
use super::catalogue::Candidate;
use super::cause::Cause;
use super::design::{Design, FullDesign, Linear, Projected};
use super::extension::{Extended, Subject};
use super::intervals::{self, ShiftScan};
use super::latency;
use super::nonlinear_springs;
use super::order_spectrum;
use super::score::{score_from, score_projected};
use crate::measurement::sensor::disturbance::{Disturbance, Kind, Profile};
use crate::measurement::sensor::empirical::EmpiricalFault;
use truegrind_arm::effect::Effect;
use truegrind_math::work::checkpoint;

/// A listed candidate and its projection on the whole design.
struct Entry {
    candidate: Arc<Candidate>,
    projected: Projected,
}

impl Entry {
    fn of(candidate: &Arc<Candidate>, design: &Design) -> Self {
        let projected = design.project(&candidate.columns(design));
        Self { candidate: Arc::clone(candidate), projected }
    }

    fn score(&self, design: &Design) -> Scored {
        let sizes = self.candidate.cause.sizes();
        let score =
            score_from(design.gradient_and_information(&self.projected), &sizes, self.candidate.tried);
        Scored { candidate: Arc::clone(&self.candidate), score, head_start: 0.0 }
    }
}

/// A kind of shift over all rows.
struct Shift {
    always: Arc<Candidate>,
    strip: Option<ShiftScan>,
}

/// Scores of all candidates against a fit; see the module documentation.
pub struct CandidateScores<'a> {
    /// The candidates.
    pub catalogue: &'a Catalogue,
    /// The rows and the nominal arm.
    pub subject: &'a Subject<'a>,
    /// The fit.
    pub fit: Arc<Extended>,
    /// The linearised fit.
    pub linear: Linear,
    /// Its design with all parameters free.
    pub whole: FullDesign,
    listed: Vec<Entry>,
    shifts: Vec<Shift>,
    fine: Vec<Vec<OnceLock<Entry>>>,
}

/// Head start of a variant of an accepted cause over other causes: odds of a hundred to one.
const HEAD_START: f64 = 10.0;

impl<'a> CandidateScores<'a> {
    /// Scores all candidates of `catalogue` against `fit`.
    pub fn of(catalogue: &'a Catalogue, subject: &'a Subject<'a>, fit: Arc<Extended>) -> Self {
        let linear = Linear::of(subject, &fit);
        let size = (linear.observations, linear.per);
        let columns = |c: &Arc<Candidate>| {
            checkpoint();
            c.columns_of(&linear.slopes, size)
        };
        let variants = variants(&catalogue.listed, subject, &fit);
        // Side by side, since each alone is partly in one thread.
        let (whole, columns) = rayon::join(
            || linear.whole(),
            || catalogue.listed.par_iter().chain(&variants).map(columns).collect::<Vec<_>>(),
        );
        let design = &whole.design;
        let (projected, shifts) =
            rayon::join(|| design.project_all(&columns), || shifts(catalogue, subject, &fit, design));
        let listed = catalogue.listed.iter().chain(&variants).cloned().zip(projected);
        let listed = listed.map(|(candidate, projected)| Entry { candidate, projected }).collect();
        let fine = catalogue.fine.iter().map(|f| f.iter().map(|_| OnceLock::new()).collect()).collect();
        Self { catalogue, subject, fit, linear, whole, listed, shifts, fine }
    }

    /// Scores against `design` (the full one or a reduction of it), best first. Without `searched` only of listed candidates.
    pub fn score_all(&self, design: &Design, searched: bool) -> Vec<Scored> {
        let mut out: Vec<Scored> = self.listed.par_iter().map(|entry| entry.score(design)).collect();
        if searched {
            self.add_searched(design, &mut out);
        }
        // Tilt deflection of joint 1 is a candidate only once another cause supports a tilt.
        if !Cause::tilt_is_supported(&self.fit.causes) {
            out.retain(|s| !s.candidate.cause.requires_tilt());
        }
        for scored in &mut out {
            if self.fit.causes.iter().any(|c| c.is_same_finding(&scored.candidate.cause)) {
                scored.head_start = HEAD_START;
            }
        }
        out.sort_by(|a, b| b.preference().total_cmp(&a.preference()));
        out
    }

    /// Adds shifts over searched intervals, harmonics of searched orders, and maps where the order spectrum has peaks.
    fn add_searched(&self, design: &Design, out: &mut Vec<Scored>) {
        let dataset = &self.subject.observed.dataset;
        let tried = intervals::tried(dataset.rows.len() as f64);
        let found: Vec<Candidate> = self
            .shifts
            .par_iter()
            .flat_map_iter(|shift| {
                let found = shift.strip.as_ref().map_or_else(Vec::new, |s| s.scan(design, 2));
                found.into_iter().map(|interval| {
                    let rows = [interval.from, interval.to].map(|i| dataset.rows[i].number);
                    let tried = tried * shift.always.tried;
                    Candidate { tried, ..shift.always.over_rows(dataset, rows) }
                })
            })
            .collect();
        let (spectral, mapped) = order_spectrum::candidates(self.subject, &self.catalogue.turns, design);
        let open: Vec<Arc<Candidate>> = found.into_iter().map(Arc::new).chain(spectral).collect();
        let fine: Vec<&Entry> = mapped
            .into_par_iter()
            .filter_map(|(joint, level)| {
                let candidate = self.catalogue.fine[joint].get(level)?;
                let place = &self.fine[joint][level];
                // Not under the lock: the products spawn parallel work, and a waiting thread can re-enter here.
                if place.get().is_none() {
                    let _ = place.set(Entry::of(candidate, &self.whole.design));
                }
                place.get()
            })
            .collect();
        let columns: Vec<_> = open.par_iter().map(|c| c.columns(design)).collect();
        let projected = design.project_all(&columns);
        out.par_extend(open.into_par_iter().zip(projected).map(|(candidate, projected)| {
            let score = score_projected(&projected, &candidate.cause.sizes(), candidate.tried);
            Scored { candidate, score, head_start: 0.0 }
        }));
        out.par_extend(fine.par_iter().map(|entry| entry.score(design)));
    }
}

/// The springs, plays and latencies of a fit with other constants than the catalogue's.
fn variants(listed: &[Arc<Candidate>], subject: &Subject<'_>, fit: &Extended) -> Vec<Arc<Candidate>> {
    let of = |cause: &Cause| {
        let Cause::Measurement(Disturbance { kind: Kind::Empirical(fault), profile, values }) = cause else {
            return Vec::new();
        };
        let same = listed.iter().filter(|c| c.cause.is_same_finding(cause));
        let tried = same.map(|c| c.tried).fold(1.0, f64::max);
        let candidate = |fault: EmpiricalFault| {
            let variant = Disturbance::new(Kind::Empirical(fault), *profile);
            let candidate = Candidate::measurement(
                variant,
                &subject.observed.dataset,
                subject.nominal,
                subject.evaluated_at,
            );
            Arc::new(Candidate { tried, ..candidate })
        };
        let delay_s = values.first().copied().unwrap_or(0.0);
        let laws = nonlinear_springs::variants(*fault, subject).into_iter().chain(latency::variants(
            *fault,
            delay_s,
            &subject.observed.dataset,
        ));
        laws.collect::<Vec<_>>().into_par_iter().map(candidate).collect::<Vec<_>>()
    };
    fit.causes.iter().flat_map(of).collect()
}

/// The kinds of shifts, to be scanned beside a fit with the design `design`.
fn shifts(catalogue: &Catalogue, subject: &Subject<'_>, fit: &Extended, design: &Design) -> Vec<Shift> {
    let known = known_load(fit).map(|kind| {
        let always = Disturbance::new(kind, Profile::Constant);
        Candidate::measurement(always, &subject.observed.dataset, subject.nominal, subject.evaluated_at)
    });
    let known = known.map(Arc::new);
    let shifts: Vec<&Arc<Candidate>> = catalogue.shifts.iter().chain(&known).collect();
    let dataset = &subject.observed.dataset;
    let stations: Vec<usize> = (0..dataset.rows.len()).map(|row| dataset.station_of(row)).collect();
    shifts
        .into_par_iter()
        .map(|candidate| {
            let strip = ShiftScan::of(design, &candidate.columns(design), &candidate.cause.sizes());
            let strip = strip.map(|strip| strip.of_stations(&stations));
            Shift { always: Arc::clone(candidate), strip }
        })
        .collect()
}

/// An unlogged payload, with the compliances found so far.
fn known_load(fit: &Extended) -> Option<Kind> {
    let found: Vec<(usize, f64)> = fit
        .causes
        .iter()
        .filter_map(|c| match c {
            Cause::Arm(Effect::JointCompliance(c)) => Some((c.joint, c.compliance_rad_per_nm)),
            _ => None,
        })
        .collect();
    (!found.is_empty()).then(|| Kind::Load {
        joints: found.iter().map(|f| f.0).collect(),
        compliance: Some(found.iter().map(|f| f.1).collect()),
    })
}
