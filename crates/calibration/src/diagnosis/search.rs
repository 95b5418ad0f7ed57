//! The search for causes and its validation: selects causes, drops those that raise the held-out error, and confirms the others by
//! stability selection.

use super::candidates::Scored;
use super::cause::Cause;
use super::confirmation::{ConfirmationContext, Confirmations};
use super::design::{FullDesign, Linear};
use super::elimination::CORRELATED_NOISE;
use super::extension::{Extended, FreeParameters, Subject, fit};
use super::findings::short_name;
use super::options::Options;
use super::other_gravity::OtherGravity;
use super::preparation::Prepared;
use super::residual_tests::{self, Structure};
use super::selection::{self, Accepted, Selection};
use super::validation::{ErrorsByStage, StageError, Validation};
use crate::identification::network::with_network;
use crate::identification::rounded_log::{Asked, spent};
use crate::measurement::dataset::Dataset;
use crate::measurement::noise_floor::NoiseFloor;
use crate::measurement::sensor::disturbance::{Disturbance, Profile};

/// The rows, the fits' subjects and the options of a search.
pub(super) struct SearchContext<'a> {
    /// The rows as read.
    pub(super) dataset: &'a Dataset,
    /// The rows as fitted.
    pub(super) prepared: &'a Prepared,
    /// All rows.
    pub(super) subject: Subject<'a>,
    /// The searched rows: all, or a random subset of very many.
    pub(super) searched: Subject<'a>,
    pub(super) options: &'a Options,
    pub(super) progress: &'a (dyn Fn(&str) + Sync),
}

impl SearchContext<'_> {
    /// Whether only a subset of the rows is searched.
    pub(super) fn is_thinned(&self) -> bool {
        !std::ptr::eq(self.subject.observed, self.searched.observed)
    }

    /// Number of rows for each searched row.
    fn stride(&self) -> usize {
        self.dataset.rows.len().div_ceil(self.searched.observed.dataset.rows.len().max(1))
    }
}

/// The selected causes, with the fits and their errors.
pub(super) struct Search<'a> {
    pub(super) context: &'a SearchContext<'a>,
    pub(super) registered: Extended,
    pub(super) geometric: Extended,
    /// All causes, fitted to all rows.
    pub(super) full_fit: Extended,
    /// All causes, fitted to the searched rows.
    pub(super) searched_fit: Extended,
    pub(super) accepted: Vec<Accepted>,
    /// All other candidates, scored against the extended model.
    pub(super) left: Vec<Scored>,
    families: f64,
    /// Gross outliers: index, and size in standard deviations.
    pub(super) outliers: Vec<(usize, f64)>,
    pub(super) set_aside: Vec<usize>,
    pub(super) validation: Validation,
    pub(super) errors: ErrorsByStage,
    /// Serial correlation range in searched rows; 0 for independent readings.
    pub(super) correlation_range: usize,
    pub(super) notes: Vec<String>,
}

/// The confirmations and the linearised fit that they are based on.
pub(super) struct Confirmed {
    pub(super) linear: Linear,
    pub(super) whole: FullDesign,
    pub(super) outcome: Confirmations,
    /// That gravity seems to act along another direction than the robot file states.
    pub(super) other_gravity: Option<OtherGravity>,
}

impl<'a> Search<'a> {
    /// Searches for at most `most` causes.
    pub(super) fn run(context: &'a SearchContext<'a>, registered: Extended, most: usize) -> Self {
        let SearchContext { dataset, subject, searched, options, progress, .. } = context;
        progress("searching for causes");
        let selection =
            selection::select(searched, &selection::Options { most, ..options.selection }, progress);
        let Selection { geometric, extended: searched_fit, accepted, left, families } = selection;
        let mut notes = Vec::new();
        let (geometric, full_fit) = if context.is_thinned() {
            progress("fitting all rows");
            let rows = &searched.observed.dataset;
            notes.push(format!(
                "causes were searched in {} of the {} rows, drawn at random; fits and errors use all rows",
                rows.rows.len(),
                dataset.rows.len()
            ));
            let causes = extend_to_last_row(&searched_fit.causes, rows, dataset);
            (
                fit(subject, &[], FreeParameters::All, Some(&geometric)),
                fit(subject, &causes, FreeParameters::All, Some(&searched_fit)),
            )
        } else {
            (geometric, searched_fit.clone())
        };
        let outliers = residual_tests::outliers(&full_fit);
        let set_aside: Vec<usize> = outliers.iter().map(|(i, _)| *i).collect();
        progress("cross-validating");
        let validation = Validation::of(subject, &set_aside, options.selection.seed, options.blocks);
        let [of_sheet, of_geometry, of_causes] =
            [&registered, &geometric, &full_fit].map(|fit| validation.stage(fit));
        let errors = ErrorsByStage { registered: of_sheet, geometric: of_geometry, with_causes: of_causes };
        Self {
            context,
            registered,
            geometric,
            full_fit,
            searched_fit,
            accepted,
            left,
            families,
            outliers,
            set_aside,
            validation,
            errors,
            correlation_range: 0,
            notes,
        }
    }

    /// Drops causes while they raise the held-out error above that of geometry alone: on blocks, or, where geometry alone is so much worse
    /// on blocks that these leave out whole parts of the workspace, in random folds. A cause is not false because a block asks it for what
    /// no other row shows.
    pub(super) fn drop_unvalidated_causes(&mut self) {
        let ErrorsByStage { geometric: geometry, with_causes: before, .. } = self.errors;
        let extrapolates = geometry.blocks.rmse > EXTRAPOLATION * geometry.random.rmse;
        let (of, which): (fn(&StageError) -> f64, _) = if extrapolates {
            (|stage| stage.random.rmse, "in random folds")
        } else {
            (|stage| stage.blocks.rmse, "on held-out blocks")
        };
        let mut dropped = Vec::new();
        while of(&self.errors.with_causes) > of(&geometry)
            && let Some(weakest) = self.weakest()
        {
            dropped.push(short_name(&self.searched_fit.causes[weakest]));
            self.accepted.remove(weakest);
            let without = self.without(&[weakest]);
            self.replace_fit(without, &[weakest]);
            self.errors.with_causes = self.validation.stage(&self.full_fit);
        }
        if !dropped.is_empty() {
            self.notes.push(format!(
                "dropped, since with {} the error {which} was {:.4} mm, with geometry alone {:.4} mm: {}",
                if dropped.len() == 1 { "it" } else { "them" },
                of(&before),
                of(&geometry),
                dropped.join(", ")
            ));
        }
    }

    /// The accepted cause with the least merit, except shifts.
    fn weakest(&self) -> Option<usize> {
        (0..self.accepted.len())
            .filter(|&k| self.searched_fit.causes[k].rows().is_none())
            .min_by(|&a, &b| self.accepted[a].own.merit.total_cmp(&self.accepted[b].own.merit))
    }

    /// The fit to all rows without some of its causes.
    fn without(&self, dropped: &[usize]) -> Extended {
        without(&self.context.subject, &self.full_fit, dropped)
    }

    /// Continues with a fit without some causes.
    fn replace_fit(&mut self, full_fit: Extended, dropped: &[usize]) {
        self.searched_fit = if self.context.is_thinned() {
            without(&self.context.searched, &self.searched_fit, dropped)
        } else {
            full_fit.clone()
        };
        self.full_fit = full_fit;
    }

    /// Confirms the causes by stability selection, and estimates the discrepancy.
    pub(super) fn confirm(&self) -> Confirmed {
        let SearchContext { searched, prepared, options, .. } = self.context;
        let linear = Linear::of(searched, &self.searched_fit);
        let whole = linear.whole();
        let confirming = ConfirmationContext {
            subject: searched,
            fit: &self.searched_fit,
            linear: &linear,
            accepted: &self.accepted,
            pool: &self.left,
            options: &options.selection,
            families: self.families,
            sides_from_order: prepared.sides_from_order,
            raw: &whole.design,
        };
        let mut outcome = confirming.outcome();
        let tried: Vec<f64> = self.accepted.iter().map(|accepted| accepted.tried).collect();
        let is_plausible: Vec<bool> = outcome.confirmations.iter().map(|of| of.plausible).collect();
        let other_gravity = OtherGravity::find(searched, &self.searched_fit, (&tried, &is_plausible), &whole);
        for (confirmation, cause) in outcome.confirmations.iter_mut().zip(&self.searched_fit.causes) {
            confirmation.under_other_gravity =
                other_gravity.as_ref().is_some_and(|other| other.contradicts(cause));
        }
        Confirmed { linear, whole, outcome, other_gravity }
    }

    /// For serially correlated readings: purges the cross-validation, and drops shifts that are not confirmed.
    pub(super) fn purge_validation(&mut self, confirmed: &mut Confirmed) {
        let SearchContext { subject, options, progress, .. } = self.context;
        self.correlation_range = confirmed.outcome.discrepancy.correlation_range;
        let reach = self.correlation_range * self.context.stride();
        if reach == 0 {
            return;
        }
        progress("cross-validating in blocks, since readings are serially correlated");
        self.notes.push(format!(
            "readings are correlated over {reach} rows: blocks of rows are held out, and as many rows on either side are excluded from the fit"
        ));
        let seed = options.selection.seed;
        self.validation = Validation::in_order(subject, &self.set_aside, seed, options.blocks, reach);
        let stage = |fit: &Extended| self.validation.stage(fit);
        let passing: Vec<usize> = (0..self.searched_fit.causes.len())
            .filter(|&k| {
                self.searched_fit.causes[k].rows().is_some()
                    && !confirmed.outcome.confirmations[k].is_confirmed()
            })
            .collect();
        let [registered, geometric] = [&self.registered, &self.geometric].map(stage);
        // Whatever the held-out error is: their rows were selected for it.
        let excursions = confirmed.outcome.discrepancy.correlation > CORRELATED_NOISE;
        let kept = || stage(&self.full_fit);
        let lasting = (!passing.is_empty()).then(|| {
            let fit = self.without(&passing);
            let errors = stage(&fit);
            (fit, errors)
        });
        let (lasting, with_causes) = match lasting {
            None => (None, kept()),
            Some((fit, errors)) if excursions => (Some(fit), errors),
            Some((fit, errors)) => {
                let whole = kept();
                let generalises = errors.random.rmse < whole.random.rmse * SHIFT_GAIN;
                if generalises { (Some(fit), errors) } else { (None, whole) }
            }
        };
        self.errors = ErrorsByStage { registered, geometric, with_causes };
        if let Some(fit) = lasting {
            self.replace_fit(fit, &passing);
            let mut place = 0..;
            self.accepted.retain(|_| !place.next().is_some_and(|k| passing.contains(&k)));
            *confirmed = self.confirm();
        }
    }

    /// A fit to all rows, to be asked whether the log rounds; `repeats` is the scatter of repeated poses.
    pub(super) fn asked_of_rounding<'s>(
        &'s self,
        fit: &'s Extended,
        repeats: Option<&'s NoiseFloor>,
    ) -> Asked<'s> {
        Asked {
            observed: self.context.subject.observed,
            model: &fit.model,
            frames: &fit.frames,
            spent: spent(fit.estimate.covariance.as_ref(), &fit.priors),
            set_aside: &self.set_aside,
            repeats,
        }
    }

    /// Fits a smooth correction to a structured residual, and keeps it if it lowers the held-out error. Returns the held-out error
    /// without it (mm).
    pub(super) fn fit_smooth_correction(&mut self, structure: &Structure) -> Option<f64> {
        let SearchContext { subject, options, progress, .. } = self.context;
        if !options.smooth || !residual_tests::has_structure(structure) {
            return None;
        }
        progress("fitting a smooth correction to the residual");
        let smooth = smooth_correction(subject, &self.full_fit);
        let stage = self.validation.stage(&smooth);
        let before = &self.errors.with_causes;
        if stage.random.rmse < before.random.rmse && stage.blocks.rmse < before.blocks.rmse {
            let without = before.random.rmse;
            (self.full_fit, self.errors.with_causes) = (smooth, stage);
            return Some(without);
        }
        self.notes.push(format!(
            "a smooth correction does not generalise: held-out error {:.4} mm, without it {:.4} mm; on blocks {:.4} mm, without it {:.4} mm",
            stage.random.rmse, before.random.rmse, stage.blocks.rmse, before.blocks.rmse
        ));
        None
    }
}

/// Error of geometry alone on blocks, relative to random folds, from which blocks extrapolate.
const EXTRAPOLATION: f64 = 1.5;

/// With serially correlated readings, unconfirmed shifts are fitted noise unless the purged held-out error rises by this factor
/// without them.
const SHIFT_GAIN: f64 = 1.1;

/// A fit without some of its causes.
fn without(subject: &Subject<'_>, fitted: &Extended, dropped: &[usize]) -> Extended {
    let kept = fitted.causes.iter().enumerate().filter(|(k, _)| !dropped.contains(k));
    let causes: Vec<Cause> = kept.map(|(_, cause)| cause.clone()).collect();
    fit(subject, &causes, FreeParameters::All, Some(fitted))
}

/// The extended model with a smooth correction: a radial basis function network on the first three joints.
fn smooth_correction(subject: &Subject<'_>, extended: &Extended) -> Extended {
    // Ten poses for each centre, so that its weight is identifiable.
    let centres = (subject.observed.dataset.rows.len() / 10).clamp(12, 60);
    let options = truegrind_estimation::network::rbf::Options { centres, ..Default::default() };
    let mut causes = extended.causes.clone();
    let spread = with_network(subject.nominal, &subject.observed.dataset, &options);
    causes.extend(spread.effects.last().cloned().map(Cause::Arm));
    fit(subject, &causes, FreeParameters::All, Some(extended))
}

/// Extends intervals that end at the last searched row to the last row.
fn extend_to_last_row(causes: &[Cause], searched: &Dataset, dataset: &Dataset) -> Vec<Cause> {
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
