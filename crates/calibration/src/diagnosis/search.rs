//! What was found in the rows, and what of it holds: causes are searched, what does not carry over to rows that were held out is
//! dropped again, and what comes back in halves of the rows is confirmed.

use super::candidates::Scored;
use super::cause::Cause;
use super::confirmation::{Confirming, Outcome};
use super::design::{FullDesign, Linear};
use super::extension::{Extended, Freedom, Subject, fit};
use super::findings::told_short;
use super::options::Options;
use super::remaining::{self, Structure};
use super::rows::Prepared;
use super::selection::{self, Accepted, Selection};
use super::validation::{StageError, Validation};
use crate::identification::network::with_network;
use crate::measurement::dataset::Dataset;
use crate::measurement::sensor::disturbance::{Disturbance, Profile};

/// What is diagnosed, and how.
pub(super) struct Ground<'a> {
    /// The rows as they were read.
    pub(super) dataset: &'a Dataset,
    /// As they are fitted.
    pub(super) prepared: &'a Prepared,
    /// All of them.
    pub(super) subject: Subject<'a>,
    /// Those in which causes are looked for.
    pub(super) searched: Subject<'a>,
    pub(super) options: &'a Options,
    pub(super) tell: &'a (dyn Fn(&str) + Sync),
}

impl Ground<'_> {
    /// Whether causes are looked for in some of the rows alone.
    pub(super) fn thinned(&self) -> bool {
        !std::ptr::eq(self.subject.observed, self.searched.observed)
    }

    /// Rows of all the data for each one in which causes are looked for.
    fn stride(&self) -> usize {
        self.dataset.rows.len().div_ceil(self.searched.observed.dataset.rows.len().max(1))
    }
}

/// The causes that were found, with the fits and their errors.
pub(super) struct Search<'a> {
    pub(super) ground: &'a Ground<'a>,
    registered: Extended,
    pub(super) geometric: Extended,
    /// All causes, fitted to all rows.
    pub(super) extended: Extended,
    /// The same, fitted to the rows in which they were looked for.
    pub(super) found: Extended,
    pub(super) accepted: Vec<Accepted>,
    /// Every candidate beside them.
    pub(super) left: Vec<Scored>,
    families: f64,
    /// Gross outliers, by index, with how far they are off.
    pub(super) wild: Vec<(usize, f64)>,
    pub(super) set_aside: Vec<usize>,
    pub(super) validation: Validation,
    /// Errors of the registered data sheet, of geometry and of the whole.
    pub(super) stages: [StageError; 3],
    /// Over how many of the rows in which causes were looked for readings resemble each other; 0 where they do not.
    pub(super) reach: usize,
    pub(super) notes: Vec<String>,
}

/// What is confirmed, and what it was judged by.
pub(super) struct Confirmed {
    pub(super) linear: Linear,
    pub(super) whole: FullDesign,
    pub(super) outcome: Outcome,
}

impl<'a> Search<'a> {
    /// Looks for at most so many causes.
    pub(super) fn of(ground: &'a Ground<'a>, registered: Extended, most: usize) -> Self {
        let Ground { dataset, subject, searched, options, tell, .. } = ground;
        tell("looking for causes");
        let selection = selection::select(searched, &selection::Options { most, ..options.selection }, tell);
        let Selection { geometric, extended: found, accepted, left, families } = selection;
        let mut notes = Vec::new();
        let (geometric, extended) = if ground.thinned() {
            tell("fitting all rows");
            let rows = &searched.observed.dataset;
            notes.push(format!(
                "causes were looked for in {} of the {} rows, drawn at random; the fits and their errors are of all rows",
                rows.rows.len(),
                dataset.rows.len()
            ));
            let causes = to_the_end(&found.causes, rows, dataset);
            (
                fit(subject, &[], Freedom::All, Some(&geometric)),
                fit(subject, &causes, Freedom::All, Some(&found)),
            )
        } else {
            (geometric, found.clone())
        };
        let wild = remaining::outliers(&extended);
        let set_aside: Vec<usize> = wild.iter().map(|(i, _)| *i).collect();
        tell("holding rows out");
        let validation = Validation::of(subject, &set_aside, options.selection.seed, options.blocks);
        let stages = [&registered, &geometric, &extended].map(|fit| validation.stage(fit));
        Self {
            ground,
            registered,
            geometric,
            extended,
            found,
            accepted,
            left,
            families,
            wild,
            set_aside,
            validation,
            stages,
            reach: 0,
            notes,
        }
    }

    /// Drops what does not carry over to rows that were not seen together with it: it is no knowledge.
    pub(super) fn drop_what_does_not_carry_over(&mut self) {
        while self.stages[2].blocks.rmse > self.stages[1].blocks.rmse
            && let Some(weakest) = self.weakest()
        {
            self.notes.push(format!(
                "{} was dropped again: with it the error on held-out blocks was {:.4} mm, geometry alone has {:.4}",
                told_short(&self.found.causes[weakest]),
                self.stages[2].blocks.rmse,
                self.stages[1].blocks.rmse
            ));
            self.accepted.remove(weakest);
            let extended = self.without(&[weakest]);
            self.keep(extended, &[weakest]);
            self.stages[2] = self.validation.stage(&self.extended);
        }
    }

    /// The accepted cause of least merit that is not about rows.
    fn weakest(&self) -> Option<usize> {
        (0..self.accepted.len())
            .filter(|&k| self.found.causes[k].rows().is_none())
            .min_by(|&a, &b| self.accepted[a].own.merit.total_cmp(&self.accepted[b].own.merit))
    }

    /// The fit to all rows without some of its causes.
    fn without(&self, dropped: &[usize]) -> Extended {
        without(&self.ground.subject, &self.extended, dropped)
    }

    /// Goes on from a fit without some causes.
    fn keep(&mut self, extended: Extended, dropped: &[usize]) {
        self.found = if self.ground.thinned() {
            without(&self.ground.searched, &self.found, dropped)
        } else {
            extended.clone()
        };
        self.extended = extended;
    }

    /// Looks which causes come back in halves of the rows, and what stands beside them.
    pub(super) fn confirm(&self) -> Confirmed {
        let Ground { searched, prepared, options, .. } = self.ground;
        let linear = Linear::of(searched, &self.found);
        let whole = linear.whole();
        let confirming = Confirming {
            subject: searched,
            found: &self.found,
            linear: &linear,
            accepted: &self.accepted,
            pool: &self.left,
            options: &options.selection,
            families: self.families,
            sides_from_order: prepared.sides_from_order,
            raw: &whole.design,
        };
        let outcome = confirming.outcome();
        Confirmed { linear, whole, outcome }
    }

    /// Where readings resemble those before them, holds out stretches of rows, and drops shifts that do not come back.
    pub(super) fn hold_out_stretches(&mut self, confirmed: &mut Confirmed) {
        let Ground { subject, options, tell, .. } = self.ground;
        self.reach = confirmed.outcome.discrepancy.reach;
        let reach = self.reach * self.ground.stride();
        if reach == 0 {
            return;
        }
        tell("holding out stretches of rows, as they resemble those before them");
        self.notes.push(format!(
            "readings resemble those up to {reach} rows before them: rows are held out in stretches, with that many rows on either side left out \
             of the fit"
        ));
        let seed = options.selection.seed;
        self.validation = Validation::in_order(subject, &self.set_aside, seed, options.blocks, reach);
        self.stages =
            [&self.registered, &self.geometric, &self.extended].map(|fit| self.validation.stage(fit));
        let passing: Vec<usize> = (0..self.found.causes.len())
            .filter(|&k| {
                self.found.causes[k].rows().is_some() && !confirmed.outcome.confirmations[k].is_confirmed()
            })
            .collect();
        if passing.is_empty() {
            return;
        }
        let lasting = self.without(&passing);
        let stage = self.validation.stage(&lasting);
        let excursions = confirmed.outcome.discrepancy.correlation > NOISE_ITSELF;
        if excursions || stage.random.rmse < self.stages[2].random.rmse * PASSING {
            self.stages[2] = stage;
            self.keep(lasting, &passing);
            let mut place = 0..;
            self.accepted.retain(|_| !place.next().is_some_and(|k| passing.contains(&k)));
            *confirmed = self.confirm();
        }
    }

    /// Fits a smooth correction to what is left, where it carries over; hands back the held-out error without it (mm).
    pub(super) fn smooth(&mut self, structure: &Structure) -> Option<f64> {
        let Ground { subject, options, tell, .. } = self.ground;
        if !options.smooth || !remaining::patterned(structure) {
            return None;
        }
        tell("fitting a smooth correction to what is left");
        let smooth = smooth_correction(subject, &self.extended);
        let stage = self.validation.stage(&smooth);
        let before = &self.stages[2];
        if stage.random.rmse < before.random.rmse && stage.blocks.rmse < before.blocks.rmse {
            let without = before.random.rmse;
            (self.extended, self.stages[2]) = (smooth, stage);
            return Some(without);
        }
        self.notes.push(format!(
            "a smooth correction would not carry over: held out {:.4} mm against {:.4} without it, on blocks {:.4} against {:.4}",
            stage.random.rmse, before.random.rmse, stage.blocks.rmse, before.blocks.rmse
        ));
        None
    }
}

/// Shifts that do not come back are fitted noise where readings resemble those before them, unless the error on rows that were
/// held out with their neighbours is larger without them by this factor.
const PASSING: f64 = 1.1;

/// Correlation with the row before, beside smooth courses, from which the noise itself is correlated, and shifts that do not come
/// back are its excursions whatever the held-out error says: their rows were chosen to hold them.
const NOISE_ITSELF: f64 = 0.3;

/// A fit without some of its causes.
fn without(subject: &Subject<'_>, fitted: &Extended, dropped: &[usize]) -> Extended {
    let kept = fitted.causes.iter().enumerate().filter(|(k, _)| !dropped.contains(k));
    let causes: Vec<Cause> = kept.map(|(_, cause)| cause.clone()).collect();
    fit(subject, &causes, Freedom::All, Some(fitted))
}

/// The extended model with a smooth correction spread over its poses: a network of bumps on the first three joints.
fn smooth_correction(subject: &Subject<'_>, extended: &Extended) -> Extended {
    // Ten poses for each centre, so that the weights are seen.
    let centres = (subject.observed.dataset.rows.len() / 10).clamp(12, 60);
    let options = truegrind_estimation::network::rbf::Options { centres, ..Default::default() };
    let mut causes = extended.causes.clone();
    let spread = with_network(subject.nominal, &subject.observed.dataset, &options);
    causes.extend(spread.effects.last().cloned().map(Cause::Arm));
    fit(subject, &causes, Freedom::All, Some(extended))
}

/// Intervals that reach the last of the rows that were searched reach the last row there is.
fn to_the_end(causes: &[Cause], searched: &Dataset, dataset: &Dataset) -> Vec<Cause> {
    let last = |d: &Dataset| d.rows.last().map_or(0, |r| r.number);
    causes
        .iter()
        .map(|cause| match cause {
            Cause::Measurement(Disturbance { kind, profile: Profile::Rows { from, to }, values })
                if *to == last(searched) =>
            {
                Cause::Measurement(Disturbance {
                    kind: kind.clone(),
                    profile: Profile::Rows { from: *from, to: last(dataset) },
                    values: values.clone(),
                })
            }
            other => other.clone(),
        })
        .collect()
}
