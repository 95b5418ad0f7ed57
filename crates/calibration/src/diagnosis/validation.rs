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
use super::extension::{Extended, FreeParameters, SEARCH_STEPS, Subject};
use super::held_out::neither;
use super::newton;
use crate::identification::fit::{Observations, errors_on};
use crate::measurement::split::{self, Split};
use crate::measurement::stations;
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

/// Errors of the stages of a diagnosis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ErrorsByStage {
    /// Of the data sheet with registered frames.
    pub(super) registered: StageError,
    /// Of geometry alone.
    pub(super) geometric: StageError,
    /// Of the fit with causes: with all of them, or, of a written arm, with its own.
    pub(super) with_causes: StageError,
}

/// Scalar rows times squared parameters from which a fold is refitted by one step.
const MUCH_WORK: f64 = 1e9;

/// Regions of joint space that are held out.
const REGIONS: usize = 8;

fn is_much_work(fit: &Extended) -> bool {
    let p = fit.parameters.len() as f64;
    fit.problem.rows() as f64 * p * p > MUCH_WORK
}

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
        if is_much_work(fit)
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
        let steps = Steps::of(self, fit)?;
        let random = self.random.par_iter().zip(&steps.parts);
        let random = random.map(|(split, part)| steps.refitted(split, Some(part)));
        Some([summary_of(random.collect())?, steps.held_out(&self.blocks)?])
    }

    /// Error over regions of joint space, each held out whole.
    pub fn over_regions(&self, fit: &Extended) -> ErrorSummary {
        let steps = if is_much_work(fit) { self.over_regions_by_steps(fit) } else { None };
        steps.unwrap_or_else(|| self.over_regions_by_refits(fit))
    }

    /// The same with every region refitted in full.
    pub fn over_regions_by_refits(&self, fit: &Extended) -> ErrorSummary {
        self.held_out(fit, &split::regions(&self.rows.dataset, REGIONS))
    }

    /// The same with every region refitted by one step; `None` if a region leaves parameters undetermined.
    pub fn over_regions_by_steps(&self, fit: &Extended) -> Option<ErrorSummary> {
        Steps::of(self, fit)?.held_out(&split::regions(&self.rows.dataset, REGIONS))
    }

    /// Errors of the test rows without what the frames of small stations make of them; those that it makes alone are left out.
    fn without_frames(&self, split: &Split, errors: Vec<f64>) -> Vec<f64> {
        let [train, test] = [&split.train, &split.test].map(|rows| self.rows.dataset.subset(rows));
        stations::without_frames(&train, &test, errors).into_iter().flatten().collect()
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
                self.without_frames(split, with_uncertain_sides(errors, &split.test, &added))
            })
            .collect();
        ErrorSummary::of(errors.concat())
    }
}

/// Refits of a fit without some of its rows, by one step from the normal equations of all.
struct Steps<'a> {
    validation: &'a Validation,
    fit: &'a Extended,
    all: NormalEquations,
    /// Those of the random folds, which partition all rows.
    parts: Vec<NormalEquations>,
    added: Vec<f64>,
}

impl<'a> Steps<'a> {
    fn of(validation: &'a Validation, fit: &'a Extended) -> Option<Self> {
        let added = added_squares(&validation.rows, &fit.model, &fit.frames);
        let all = NormalEquations::zeros(fit.parameters.len());
        let mut steps = Self { validation, fit, all, parts: Vec::new(), added };
        let tests = validation.random.par_iter().map(|split| steps.rows_of(&split.test));
        steps.parts = tests.collect::<Option<Vec<_>>>()?;
        steps.parts.iter().for_each(|part| steps.all.add(part));
        steps.all.add_priors(&fit.priors, &fit.x);
        Some(steps)
    }

    /// The normal equations of some validated rows.
    fn rows_of(&self, rows: &[usize]) -> Option<NormalEquations> {
        let observations: Vec<usize> = rows.iter().map(|&k| self.validation.kept[k]).collect();
        Some(self.fit.problem.subsample(&observations)?.normal_equations(&self.fit.x))
    }

    fn held_out(&self, splits: &[Split]) -> Option<ErrorSummary> {
        summary_of(splits.par_iter().map(|split| self.refitted(split, None)).collect())
    }

    /// Errors of the rows of a fold that its refit has not seen; `part` are the normal equations of these rows, where known.
    fn refitted(&self, split: &Split, part: Option<&NormalEquations>) -> Option<Vec<f64>> {
        let Validation { kept, rows, .. } = self.validation;
        let purged = neither(split, kept.len());
        let unseen = match part {
            Some(part) if purged.is_empty() => part.clone(),
            Some(part) => {
                let mut unseen = self.rows_of(&purged)?;
                unseen.add(part);
                unseen
            }
            None => self.rows_of(&[split.test.as_slice(), &purged].concat())?,
        };
        let mut normal: DMatrix<f64> = &self.all.matrix - &unseen.matrix;
        let gradient: DVector<f64> = &self.all.gradient - &unseen.gradient;
        factored(&mut normal).then_some(())?;
        let step = back_and_forth(&normal, &gradient)?;
        let x: Vec<f64> = self.fit.x.iter().zip(step.iter()).map(|(x, s)| x - s).collect();
        let (model, frames) = self.fit.problem.apply(&x);
        let errors = errors_on(&rows.subset(&split.test), &model, &frames);
        Some(self.validation.without_frames(split, with_uncertain_sides(errors, &split.test, &self.added)))
    }
}

fn summary_of(errors: Option<Vec<Vec<f64>>>) -> Option<ErrorSummary> {
    Some(ErrorSummary::of(errors?.concat()))
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
    super::extension::fit(subject, &[], FreeParameters::Frames, None)
}
