//! Rows of two arms in one file, or of one arm before and after its links changed: whether they split into two parts that two geometries
//! explain many times better than one.
//!
//! Method: with the fit of all rows linearised, row i of part k leaves r_i + J_i d_k. Alternately each row joins the part that explains it
//! better, and each part is fitted to its rows (classification EM of a mixture of two regressions: Celeux and Govaert 1992). Where both parts
//! are about as large, r_i ≈ ±J_i δ with the sign of the part, so that the leading eigenvectors of Σ (J_iᵀr_i)(J_iᵀr_i)ᵀ relative to the
//! normal matrix are directions of δ: they start the search, as rows with large residuals and random parts do.
//!
//! One arm has two populations too: sides of play, two nests, a sensor that was moved, a joint whose zero changed. These all have one
//! set of lengths and twists. Only parts that differ in these are told.

use nalgebra::{Cholesky, DMatrix, DVector, DVectorView, Dyn};

use super::calibration::{CalibrationProblem, Frames, Weight};
use super::fit::{Observations, Start, fit, frame_parameters};
use super::scaled_cholesky::factorise;
use super::solver::SOLVERS;
use super::tolerance::Tolerance;
use crate::measurement::row_list::row_list;
use crate::measurement::split::shuffled_by_angles;
use truegrind_arm::model::Model;
use truegrind_arm::parameter::{LinkCoordinate, Parameter, arm_parameters};
use truegrind_estimation::problem::Problem;
use truegrind_math::statistics::{ErrorSummary, median};
use truegrind_math::work::checkpoint;

/// Error of all rows together (mm RMS) below which they are not asked: mixed arms of one type differ by more.
const MIN_MM: f64 = 0.1;

/// How many times better the parts must fit by themselves than all rows do together.
const MIN_GAIN: f64 = 5.0;

/// How many times better they must fit than with common lengths and twists, each with its own set-up and joint zeros.
const MIN_GAIN_OF_LINKS: f64 = 3.0;

/// Independent readings of a part for each parameter: fewer could be fitted whatever they are.
const MIN_READINGS: usize = 2;

/// Rows that are searched for parts; of more a random subset is.
const MAX_SEARCHED: usize = 300;

/// Eigenvectors from which the search starts, and random parts.
const EIGENVECTORS: usize = 4;
const RANDOM_STARTS: u64 = 4;

/// Most rounds of a search.
const MAX_ROUNDS: usize = 40;

/// Least standard deviation of a reading (mm).
const MIN_SIGMA_MM: f64 = 1e-3;

/// Rows that two arms explain, the smaller part last.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct MixedRows {
    parts: [Part; 2],
    together_mm: f64,
}

#[derive(Debug, Clone, PartialEq)]
struct Part {
    /// The rows by their numbers in the file, ascending.
    numbers: Vec<usize>,
    /// Their error with an arm of their own (mm RMS, corrected for the parameters).
    rms_mm: f64,
}

impl MixedRows {
    /// The reason against a model, in a sentence.
    pub(crate) fn sentence(&self) -> String {
        let [larger, smaller] = &self.parts;
        format!(
            "rows of two arms, or of an arm before and after its links changed, seem to be mixed: {} rows fit one arm to {:.3} mm RMS, {} rows another \
             to {:.3} mm, all together fit none better than {:.3} mm. {}. Check which arm each row was measured on, and whether the joint log is \
             this arm's; put the rows of each into a file of its own",
            larger.numbers.len(),
            larger.rms_mm,
            smaller.numbers.len(),
            smaller.rms_mm,
            self.together_mm,
            self.places()
        )
    }

    /// Which rows the parts are.
    fn places(&self) -> String {
        let [larger, smaller] = [0, 1].map(|part| self.parts[part].numbers.as_slice());
        for (before, after) in [(larger, smaller), (smaller, larger)] {
            if let (Some(last), Some(first)) = (before.last(), after.first())
                && last < first
            {
                return format!("The one part ends at row {last}, the other begins at row {first}");
            }
        }
        format!("The smaller part are {}", row_list(smaller))
    }
}

/// Whether two arms explain the rows, of which the best model of one arm leaves `left_mm` (RMS of all rows). `frames` is where the fit of the
/// measurement's parameters starts.
pub(crate) fn mixed_rows(
    observed: &Observations,
    nominal: &Model,
    frames: &Frames,
    tolerance: &Tolerance,
    left_mm: f64,
) -> Option<MixedRows> {
    let parameters: Vec<Parameter> =
        arm_parameters(nominal).into_iter().chain(frame_parameters(&observed.dataset)).collect();
    let per = observed.dataset.sensor.scalars().min(3);
    let min_rows = (MIN_READINGS * parameters.len()).div_ceil(per);
    if !(left_mm > MIN_MM) || observed.dataset.rows.len() < 2 * min_rows {
        return None;
    }
    let searched = searched(observed);
    let few = searched.as_ref().unwrap_or(observed);
    let start = Start { model: nominal, frames };
    let together = fit(few, start, &parameters, tolerance, &SOLVERS[0], 0);
    let (priors, x) = (&together.priors, &together.estimate.x);
    let sigmas: Vec<f64> = priors.iter().map(|prior| prior.sigma).collect();
    let problem = |rows: &Observations| {
        let weights = vec![Weight { per_mm: 1.0, per_rad: 1.0 }; rows.dataset.rows.len()];
        CalibrationProblem::new(&rows.dataset, nominal, frames, &parameters, priors, &weights)
    };
    let linear = Linear::of(&problem(few), x, &sigmas, per);
    // A part of the searched rows must be as large a share of them.
    let split = linear.best_split(few, min_rows, left_mm)?;
    let moved = |d: &DVector<f64>| -> Vec<f64> { x.iter().zip(d.iter()).map(|(x, d)| x + d).collect() };
    let all = problem(observed);
    let [first, second] = [&split.steps[0], &split.steps[1]].map(|step| all.errors_mm(&moved(step)));
    let is_second: Vec<bool> = first.iter().zip(&second).map(|(a, b)| b.abs() < a.abs()).collect();
    let part = |of_second: bool, errors: &[f64], determined: f64| {
        let rows: Vec<usize> = (0..errors.len()).filter(|&row| is_second[row] == of_second).collect();
        let freedom = 1.0 - determined / (rows.len() * per) as f64;
        let rms_mm = ErrorSummary::of(rows.iter().map(|&row| errors[row])).rmse / freedom.max(0.1).sqrt();
        let numbers = rows.iter().map(|&row| observed.dataset.rows[row].number).collect();
        Part { numbers, rms_mm }
    };
    let mut parts = [part(false, &first, split.determined[0]), part(true, &second, split.determined[1])];
    parts.sort_by_key(|part| std::cmp::Reverse(part.numbers.len()));
    let worst_mm = parts[0].rms_mm.max(parts[1].rms_mm);
    let is_split = parts.iter().all(|part| part.numbers.len() >= min_rows) && left_mm > MIN_GAIN * worst_mm;
    let common_mm = || linear.with_common_links(&split, &parameters);
    (is_split && common_mm()? > MIN_GAIN_OF_LINKS * split.rms_mm)
        .then_some(MixedRows { parts, together_mm: left_mm })
}

/// A random subset of many rows, drawn by their angles; `None` of few.
fn searched(observed: &Observations) -> Option<Observations> {
    let count = observed.dataset.rows.len();
    (count > MAX_SEARCHED).then(|| {
        let all = (0..count).map(|row| vec![row]).collect();
        let mut rows = shuffled_by_angles(&observed.dataset, all, 0).concat();
        rows.truncate(MAX_SEARCHED);
        rows.sort_unstable();
        observed.subset(&rows)
    })
}

/// The fit of all rows, linearised.
struct Linear {
    /// Derivatives of the readings by the parameters in units of their priors' σ.
    jacobian: DMatrix<f64>,
    residual: DVector<f64>,
    /// The estimate in the same units.
    x: DVector<f64>,
    /// σ of the priors.
    sigmas: DVector<f64>,
    /// Scalars of a row.
    per: usize,
}

fn add_to_diagonal(matrix: &mut DMatrix<f64>, value: f64) {
    (0..matrix.nrows()).for_each(|k| matrix[(k, k)] += value);
}

/// Two parts, with the step of each from the fit of all rows.
struct Parts {
    is_second: Vec<bool>,
    steps: [DVector<f64>; 2],
    /// Parameters that each part determines.
    determined: [f64; 2],
    /// Error of all rows, each with its part (mm RMS).
    rms_mm: f64,
}

impl Linear {
    /// `problem` without weights, linearised at `x`; only positions count of a pose.
    fn of(problem: &CalibrationProblem, x: &[f64], sigmas: &[f64], per: usize) -> Self {
        let (n, p, scalars) = (problem.rows(), x.len(), problem.rows_per_observation());
        let (mut r, mut j) = (vec![0.0; n], vec![0.0; n * p]);
        problem.jacobian(x, 0..n, &mut r, &mut j);
        let kept: Vec<usize> = (0..n).filter(|row| row % scalars < per).collect();
        Self {
            jacobian: DMatrix::from_fn(kept.len(), p, |row, k| j[k * n + kept[row]] * sigmas[k]),
            residual: DVector::from_fn(kept.len(), |row, _| r[kept[row]]),
            x: DVector::from_fn(p, |k, _| x[k] / sigmas[k]),
            sigmas: DVector::from_column_slice(sigmas),
            per,
        }
    }

    fn rows(&self) -> usize {
        self.residual.len() / self.per
    }

    /// JᵀJ and Jᵀr of the rows of a part.
    fn normal(&self, is_second: &[bool], of_second: bool) -> (DMatrix<f64>, DVector<f64>) {
        let rows: Vec<usize> =
            (0..self.residual.len()).filter(|row| is_second[row / self.per] == of_second).collect();
        let (j, r) = (self.jacobian.select_rows(&rows), self.residual.select_rows(&rows));
        (j.tr_mul(&j), j.tr_mul(&r))
    }

    /// The size of each row's error after a step in units of the priors.
    fn errors_mm(&self, step: &DVector<f64>) -> Vec<f64> {
        let left = &self.residual + &self.jacobian * step;
        left.as_slice()
            .chunks_exact(self.per)
            .map(|row| DVectorView::from_slice(row, row.len()).norm())
            .collect()
    }

    /// The step of a part from the fit of all rows, and how many parameters the part determines.
    fn step(&self, is_second: &[bool], of_second: bool, sigma_mm: f64) -> Option<(DVector<f64>, f64)> {
        let (mut matrix, gradient) = self.normal(is_second, of_second);
        let square = sigma_mm * sigma_mm;
        add_to_diagonal(&mut matrix, square);
        let (factor, _) = factorise(&matrix)?;
        let step = -factor.solve(&(gradient + &self.x * square));
        let determined = self.x.len() as f64 - square * factor.inverse().trace();
        Some((step, determined))
    }

    /// Two parts from these on; `None` where one becomes too small.
    fn split_from(&self, mut is_second: Vec<bool>, min_rows: usize, left_mm: f64) -> Option<Parts> {
        let mut sigma_mm = left_mm;
        for round in 1.. {
            checkpoint();
            let second = is_second.iter().filter(|second| **second).count();
            if second.min(is_second.len() - second) < min_rows {
                return None;
            }
            let (first_step, first_determined) = self.step(&is_second, false, sigma_mm)?;
            let (second_step, second_determined) = self.step(&is_second, true, sigma_mm)?;
            let (first, second) = (self.errors_mm(&first_step), self.errors_mm(&second_step));
            let joined: Vec<bool> = first.iter().zip(&second).map(|(a, b)| b < a).collect();
            let rms_mm = ErrorSummary::of(first.iter().zip(&second).map(|(a, b)| a.min(*b))).rmse;
            let next_mm = rms_mm.max(MIN_SIGMA_MM);
            if round == MAX_ROUNDS || joined == is_second && next_mm > 0.99 * sigma_mm {
                let determined = [first_determined, second_determined];
                return Some(Parts { is_second, steps: [first_step, second_step], determined, rms_mm });
            }
            (is_second, sigma_mm) = (joined, next_mm);
        }
        None
    }

    /// The best parts from all starts, with steps in the units of the parameters.
    fn best_split(&self, rows: &Observations, min_rows: usize, left_mm: f64) -> Option<Parts> {
        let mut starts = self.along_eigenvectors(left_mm);
        let sizes = self.errors_mm(&DVector::zeros(self.x.len()));
        let middle = median(&sizes)?;
        starts.push(sizes.iter().map(|size| *size > middle).collect());
        starts.push(sizes.iter().map(|size| *size > 2.0 * middle).collect());
        starts.extend((0..RANDOM_STARTS).map(|seed| {
            let all = (0..self.rows()).map(|row| vec![row]).collect();
            let mut is_second = vec![false; self.rows()];
            let drawn = shuffled_by_angles(&rows.dataset, all, seed + 1).concat();
            drawn.iter().take(self.rows() / 2).for_each(|&row| is_second[row] = true);
            is_second
        }));
        let found = starts.into_iter().filter_map(|start| self.split_from(start, min_rows, left_mm));
        let best = found.min_by(|a, b| a.rms_mm.total_cmp(&b.rms_mm))?;
        Some(Parts { steps: best.steps.map(|step| step.component_mul(&self.sigmas)), ..best })
    }

    /// Parts on the two sides of the directions in which the residuals of single rows point most.
    fn along_eigenvectors(&self, left_mm: f64) -> Vec<Vec<bool>> {
        let mut matrix = self.jacobian.tr_mul(&self.jacobian);
        add_to_diagonal(&mut matrix, left_mm * left_mm);
        let Some(lower) = Cholesky::<f64, Dyn>::new(matrix).map(|factor| factor.l()) else {
            return Vec::new();
        };
        // Jᵀr of each row, a column each.
        let gradients = DMatrix::from_columns(
            &(0..self.rows())
                .map(|row| {
                    let (first, per) = (row * self.per, self.per);
                    self.jacobian.rows(first, per).tr_mul(&self.residual.rows(first, per))
                })
                .collect::<Vec<_>>(),
        );
        let Some(whitened) = lower.solve_lower_triangular(&gradients) else { return Vec::new() };
        let eigen = (&whitened * whitened.transpose()).symmetric_eigen();
        let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let sides = |&k: &usize| {
            let along = whitened.tr_mul(&eigen.eigenvectors.column(k));
            along.iter().map(|value| *value > 0.0).collect()
        };
        order.iter().take(EIGENVECTORS).map(sides).collect()
    }

    /// The error (mm RMS) of the same parts with common lengths and twists, each with its own set-up and joint zeros.
    fn with_common_links(&self, parts: &Parts, parameters: &[Parameter]) -> Option<f64> {
        let is_common = |parameter: &Parameter| matches!(parameter, Parameter::Link { coordinate, .. } if *coordinate != LinkCoordinate::Theta);
        let own: Vec<usize> = (0..parameters.len()).filter(|&k| !is_common(&parameters[k])).collect();
        let (p, q) = (parameters.len(), own.len());
        let [(first, first_gradient), (second, second_gradient)] =
            [false, true].map(|of_second| self.normal(&parts.is_second, of_second));
        let square = parts.rms_mm.max(MIN_SIGMA_MM).powi(2);
        let mut matrix = DMatrix::identity(p + q, p + q) * square;
        let mut block = matrix.view_mut((0, 0), (p, p));
        block += &first + &second;
        let beside = second.select_columns(&own);
        matrix.view_mut((0, p), (p, q)).copy_from(&beside);
        matrix.view_mut((p, 0), (q, p)).copy_from(&beside.transpose());
        let mut block = matrix.view_mut((p, p), (q, q));
        block += beside.select_rows(&own);
        let mut gradient = DVector::zeros(p + q);
        gradient.rows_mut(0, p).copy_from(&(first_gradient + &second_gradient + &self.x * square));
        gradient.rows_mut(p, q).copy_from(&second_gradient.select_rows(&own));
        let (factor, _) = factorise(&matrix)?;
        let step = -factor.solve(&gradient);
        let first_step = step.rows(0, p).into_owned();
        let mut second_step = first_step.clone();
        own.iter().zip(step.rows(p, q).iter()).for_each(|(&k, value)| second_step[k] += value);
        let (first, second) = (self.errors_mm(&first_step), self.errors_mm(&second_step));
        let errors = parts.is_second.iter().zip(first.iter().zip(&second));
        Some(ErrorSummary::of(errors.map(|(is_second, (a, b))| if *is_second { *b } else { *a })).rmse)
    }
}
