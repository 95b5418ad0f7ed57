//! Held-out errors of a stage by refitting frames, links and causes in every fold.
//!
//! With few rows and parameters the refit is complete. With many, the rows of a fold are subtracted from the normal equations
//! of all rows at their optimum, and one Gauss–Newton step is the refit: links move by micrometres between folds, and the
//! error of the step is of second order in that. Checked against complete refits. Change points of shifts stay where all rows put them;
//! what they may be off by is added ([`change_points`](super::change_points)).

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::algebra::{back_and_forth, factored};
use super::change_points::added_squares;
use super::extension::{Extended, Freedom, SEARCH_STEPS, Subject};
use super::held_out::neither;
use super::newton;
use crate::identification::fit::{Observations, errors_on};
use crate::measurement::split::{self, Split};
use truegrind_estimation::least_squares::lm;
use truegrind_estimation::problem::{NormalEquations, Problem};
use truegrind_math::statistics::ErrorSummary;

/// Fitted and held-out errors of a stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageError {
    /// On the rows of the fit.
    pub fitted: ErrorSummary,
    /// Over five random folds, purged for serially correlated rows.
    pub random: ErrorSummary,
    /// Over contiguous blocks.
    pub blocks: ErrorSummary,
}

/// Scalar rows times squared parameters from which a fold is refitted by one step.
const MUCH_WORK: f64 = 1e9;

/// The folds of cross-validation.
#[derive(Debug, Clone)]
pub struct Validation {
    kept: Vec<usize>,
    rows: Observations,
    random: Vec<Split>,
    blocks: Vec<Split>,
}

impl Validation {
    /// Splits of the rows that are not set aside.
    pub fn of(subject: &Subject<'_>, set_aside: &[usize], seed: u64, blocks: usize) -> Self {
        Self::in_order(subject, set_aside, seed, blocks, 0)
    }

    /// The same with random folds purged for serial correlation over `reach` rows.
    pub fn in_order(
        subject: &Subject<'_>,
        set_aside: &[usize],
        seed: u64,
        blocks: usize,
        reach: usize,
    ) -> Self {
        let n = subject.observed.dataset.rows.len();
        let kept: Vec<usize> = (0..n).filter(|i| !set_aside.contains(i)).collect();
        let rows = subject.observed.subset(&kept);
        let random = split::purged(&rows.dataset, 5, reach, seed);
        let blocks = split::blocks(&rows.dataset, blocks);
        Self { kept, rows, random, blocks }
    }

    /// Number of validated rows.
    pub fn count(&self) -> usize {
        self.kept.len()
    }

    /// Fitted and held-out errors of the model of a fit.
    pub fn stage(&self, fit: &Extended) -> StageError {
        let fitted = ErrorSummary::of(errors_on(&self.rows, &fit.model, &fit.frames));
        let p = fit.parameters.len() as f64;
        if fit.problem.rows() as f64 * p * p > MUCH_WORK
            && let Some([random, blocks]) = self.by_steps(fit)
        {
            return StageError { fitted, random, blocks };
        }
        let [random, blocks] = self.by_refits(fit);
        StageError { fitted, random, blocks }
    }

    /// RMSE over the random folds alone, refitted in full.
    pub fn random_rmse(&self, fit: &Extended) -> f64 {
        self.held_out(fit, &self.random).rmse
    }

    /// Errors over random folds and blocks, every fold refitted in full.
    pub fn by_refits(&self, fit: &Extended) -> [ErrorSummary; 2] {
        rayon::join(|| self.held_out(fit, &self.random), || self.held_out(fit, &self.blocks)).into()
    }

    /// The same with every fold refitted by one step; `None` if a fold leaves parameters undetermined.
    pub fn by_steps(&self, fit: &Extended) -> Option<[ErrorSummary; 2]> {
        let p = fit.parameters.len();
        let rows_of = |rows: &[usize]| -> Option<NormalEquations> {
            let observations: Vec<usize> = rows.iter().map(|&k| self.kept[k]).collect();
            Some(fit.problem.subsample(&observations)?.normal_equations(&fit.x))
        };
        // The random folds partition all rows.
        let parts = self
            .random
            .par_iter()
            .map(|split| rows_of(&split.test))
            .collect::<Option<Vec<NormalEquations>>>()?;
        let added = added_squares(&self.rows, &fit.model, &fit.frames);
        let mut all = NormalEquations::zeros(p);
        parts.iter().for_each(|part| all.add(part));
        all.add_priors(&fit.priors, &fit.x);
        let refitted = |split: &Split, part: &NormalEquations| -> Option<Vec<f64>> {
            let mut normal: DMatrix<f64> = &all.matrix - &part.matrix;
            let gradient: DVector<f64> = &all.gradient - &part.gradient;
            factored(&mut normal).then_some(())?;
            let step = back_and_forth(&normal, &gradient)?;
            let x: Vec<f64> = fit.x.iter().zip(step.iter()).map(|(x, s)| x - s).collect();
            let (model, frames) = fit.problem.apply(&x);
            let errors = errors_on(&self.rows.subset(&split.test), &model, &frames);
            Some(with_uncertain_sides(errors, &split.test, &added))
        };
        let random = self
            .random
            .par_iter()
            .zip(&parts)
            .map(|(split, part)| {
                let purged = neither(split, self.kept.len());
                if purged.is_empty() {
                    return refitted(split, part);
                }
                let mut out = rows_of(&purged)?;
                out.add(part);
                refitted(split, &out)
            })
            .collect::<Option<Vec<_>>>()?;
        let blocks = self
            .blocks
            .par_iter()
            .map(|split| {
                let mut out = split.test.clone();
                out.extend(neither(split, self.kept.len()));
                refitted(split, &rows_of(&out)?)
            })
            .collect::<Option<Vec<_>>>()?;
        Some([random, blocks].map(|errors| ErrorSummary::of(errors.concat())))
    }

    fn held_out(&self, fit: &Extended, splits: &[Split]) -> ErrorSummary {
        let added = added_squares(&self.rows, &fit.model, &fit.frames);
        let errors: Vec<Vec<f64>> = splits
            .par_iter()
            .map(|split| {
                let train: Vec<usize> = split.train.iter().map(|&i| self.kept[i]).collect();
                // A part of the fit's own problem: the regressors of its causes are known there.
                let Some(problem) = fit.problem.subsample(&train) else { return Vec::new() };
                let mut x = fit.x.clone();
                if !newton::descend(&*problem, &mut x) {
                    // As near to the optimum as the other folds: a promise is compared with the cost, half the rows.
                    let near = lm::Options {
                        cost_tolerance: 2.0 * newton::CONVERGED,
                        max_iterations: SEARCH_STEPS,
                        ..lm::Options::default()
                    };
                    x = lm::solve(&*problem, &x, &near).x;
                }
                let (model, frames) = fit.problem.apply(&x);
                let errors = errors_on(&self.rows.subset(&split.test), &model, &frames);
                with_uncertain_sides(errors, &split.test, &added)
            })
            .collect();
        ErrorSummary::of(errors.concat())
    }
}

/// Held-out errors of some rows, with what uncertain change points add to the squares of all rows (none without shifts).
fn with_uncertain_sides(mut errors: Vec<f64>, rows: &[usize], added: &[f64]) -> Vec<f64> {
    if !added.is_empty() {
        for (error, &row) in errors.iter_mut().zip(rows) {
            *error = error.signum() * (*error * *error + added[row]).max(0.0).sqrt();
        }
    }
    errors
}

/// The fit of frames alone, with the links of the data sheet: the stage `nominal` of a diagnosis.
pub fn nominal(subject: &Subject<'_>) -> Extended {
    super::extension::fit(subject, &[], Freedom::Frames, None)
}
