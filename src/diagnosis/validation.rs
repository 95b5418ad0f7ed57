//! Held-out errors by full refits: every fold is fitted anew, frames, links and causes, and judged on rows it never saw.

use rayon::prelude::*;

use super::design::Design;
use super::extension::{Extended, Freedom, Subject};
use super::selection::Folds;
use crate::estimation::problem::Problem;
use crate::identification::calibration::{Calibration, Weight};
use crate::identification::fit::{Observed, errors_on};
use crate::identification::solver::SOLVERS;
use crate::math::statistics::ErrorSummary;
use crate::measurement::split::{self, Split};

/// Errors of a stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageError {
    /// On the rows of the fit.
    pub fitted: ErrorSummary,
    /// Over five random folds.
    pub random: ErrorSummary,
    /// Over contiguous blocks.
    pub blocks: ErrorSummary,
}

/// Scalar rows times squared parameters from which folds are refitted to first order.
const MOST_WORK: f64 = 1e9;

/// How a stage is held out.
#[derive(Debug, Clone)]
pub struct Validation {
    kept: Vec<usize>,
    seed: u64,
    rows: Observed,
    random: Vec<Split>,
    blocks: Vec<Split>,
}

impl Validation {
    /// Splits of the rows that are not set aside.
    pub fn of(subject: &Subject<'_>, set_aside: &[usize], seed: u64, blocks: usize) -> Self {
        let n = subject.observed.dataset.rows.len();
        let kept: Vec<usize> = (0..n).filter(|i| !set_aside.contains(i)).collect();
        let rows = subject.observed.subset(&kept);
        let random = split::folds(&rows.dataset, 5, seed);
        let blocks = split::blocks(&rows.dataset, blocks);
        Self { kept, seed, rows, random, blocks }
    }

    /// Rows that are judged.
    pub fn count(&self) -> usize {
        self.kept.len()
    }

    /// Errors of a fit's kind of model. Where full refits would take minutes, the folds are refitted to first order, which
    /// differs by less than a thousandth: links move by micrometres between folds.
    pub fn stage(&self, subject: &Subject<'_>, fit: &Extended) -> StageError {
        let fitted = ErrorSummary::of(errors_on(&self.rows, &fit.model, &fit.frames));
        let p = fit.parameters.len() as f64;
        if fit.task.rows() as f64 * p * p > MOST_WORK {
            let design = Design::of(subject, fit);
            let dataset = &subject.observed.dataset;
            let aside: Vec<usize> =
                (0..dataset.rows.len()).filter(|i| self.kept.binary_search(i).is_err()).collect();
            let held = |splits: &[Split]| {
                ErrorSummary::of(Folds::of(&design, splits).errors_mm(&design, None, &aside))
            };
            return StageError {
                fitted,
                random: held(&split::folds(dataset, 5, self.seed)),
                blocks: held(&split::blocks(dataset, self.blocks.len())),
            };
        }
        StageError {
            fitted,
            random: self.held_out(fit, &self.random),
            blocks: self.held_out(fit, &self.blocks),
        }
    }

    /// RMSE over the random folds alone.
    pub fn random_rmse(&self, fit: &Extended) -> f64 {
        self.held_out(fit, &self.random).rmse
    }

    fn held_out(&self, fit: &Extended, splits: &[Split]) -> ErrorSummary {
        let start_weights: Vec<Weight> = self
            .kept
            .iter()
            .map(|&i| {
                let (w, t) = (fit.weights[i], fit.trust[i].sqrt());
                Weight { per_mm: w.per_mm * t, per_rad: w.per_rad * t }
            })
            .collect();
        let errors: Vec<Vec<f64>> = splits
            .par_iter()
            .map(|split| {
                let train = self.rows.subset(&split.train);
                let weights: Vec<Weight> = split.train.iter().map(|&i| start_weights[i]).collect();
                let task = Calibration::new(
                    &train.dataset,
                    fit.task.start(),
                    fit.task.starting_frames(),
                    &fit.parameters,
                    &fit.priors,
                    &weights,
                );
                let estimate = SOLVERS[0].solve(&task, &fit.x, 0);
                let (model, frames) = task.apply(&estimate.x);
                errors_on(&self.rows.subset(&split.test), &model, &frames)
            })
            .collect();
        ErrorSummary::of(errors.concat())
    }
}

/// The fit without its links freed: what the word `nominal` means in a diagnosis.
pub fn nominal(subject: &Subject<'_>) -> Extended {
    super::extension::fit(subject, &[], Freedom::Frames, None)
}
