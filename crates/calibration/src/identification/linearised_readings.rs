//! The normal equations of all readings at a fit, with columns for errors of the sensor that the fit does not have.

use std::ops::Range;

use nalgebra::{DMatrix, DVector, Vector3};
use rayon::prelude::*;

use crate::identification::fit::Fitted;
use crate::identification::scaled_cholesky::{MANY_COLUMNS, factorise, gram};
use crate::identification::sensor_laws::{SensorErrors, SensorLaw, mean_reading};
use crate::identification::tolerance::Tolerance;
use crate::measurement::dataset::{Dataset, Sensor};
use crate::measurement::sensor::disturbance::{Kind, Profile};
use truegrind_arm::parameter::Parameter;
use truegrind_estimation::problem::Problem;
use truegrind_math::gram::add_products;
use truegrind_math::lanes::WIDTH;
use truegrind_math::work::checkpoint;

/// Normal equations of the readings in the parameters of the fit, a scale error of the sensor and its further errors.
pub(super) struct LinearisedReadings {
    /// JᵀJ, the scale error after the parameters, the further errors last.
    pub(super) matrix: DMatrix<f64>,
    /// Columns of each further error.
    pub(super) laws: Vec<(SensorLaw, Range<usize>)>,
    /// Jᵀy.
    pub(super) right: DVector<f64>,
    /// yᵀy.
    pub(super) square: f64,
    pub(super) count: usize,
}

/// Normal equations of the linear model J x = y, y = J x̂ − r, in one pass over the rows at the estimate x̂.
pub(super) fn linearise_readings(
    fitted: &Fitted,
    dataset: &Dataset,
    laws: &[SensorLaw],
) -> LinearisedReadings {
    let problem = &fitted.problem;
    let (p, per) = (problem.parameters(), problem.rows_per_observation());
    let x = &fitted.estimate.x;
    let rotation = fitted.frames.base_from_sensor.rotation;
    // A scale about the mean reading does not move the sensor frame. Free frames absorb the common shift of a scale error; stated frames cannot.
    let centre = if has_stated_frames(fitted) { Vector3::zeros() } else { mean_reading(dataset) };
    let errors: Vec<SensorErrors<'_>> =
        laws.iter().map(|&law| SensorErrors::of(law, fitted, dataset)).collect();
    let all = p + 1 + errors.iter().map(|errors| errors.count).sum::<usize>();
    let part = |rows: Range<usize>| {
        let mut out = LinearisedReadings::none(all);
        for from in rows.clone().step_by(ROWS) {
            checkpoint();
            let to = (from + ROWS).min(rows.end);
            let n = (to - from) * per;
            let (mut residuals, mut jacobian) = (vec![0.0; n], vec![0.0; n * all]);
            problem.jacobian(x, from * per..to * per, &mut residuals, &mut jacobian[..n * p]);
            for (i, row) in dataset.rows.iter().skip(from).take(to - from).enumerate() {
                let weight = problem.per_mm(from + i);
                let offset = row.reading.place_mm() - centre;
                match dataset.sensor {
                    Sensor::Cable => jacobian[n * p + i] = weight * offset.x,
                    Sensor::Position | Sensor::Pose => {
                        let slope = -weight * (rotation * offset);
                        let first = n * p + i * per;
                        jacobian[first..first + 3].copy_from_slice(slope.as_slice());
                    }
                }
            }
            for i in 0..if errors.is_empty() { 0 } else { to - from } {
                let weight = problem.per_mm(from + i);
                let here = errors.iter().flat_map(|errors| errors.at(from + i));
                for (error, column) in here.zip(jacobian[n * (p + 1)..].chunks_exact_mut(n)) {
                    let read = per.min(3);
                    column[i * per..i * per + read].copy_from_slice(&(weight * error).as_slice()[..read]);
                }
            }
            let jacobian = DMatrix::from_vec(n, all, jacobian);
            let y = jacobian.columns(0, p) * DVector::from_column_slice(x) - DVector::from_vec(residuals);
            add_gram(&jacobian, &mut out.matrix);
            out.right += jacobian.tr_mul(&y);
            out.square += y.norm_squared();
            out.count += n;
        }
        out.matrix.fill_upper_triangle_with_lower_triangle();
        out
    };
    let rows = dataset.rows.len();
    let starts: Vec<usize> = (0..rows).step_by(PART).collect();
    let parts: Vec<LinearisedReadings> =
        starts.into_par_iter().map(|from| part(from..(from + PART).min(rows))).collect();
    let sum = parts.into_iter().reduce(LinearisedReadings::plus);
    let mut first = p + 1;
    let places = errors.iter().map(|errors| {
        first += errors.count;
        (errors.law, first - errors.count..first)
    });
    LinearisedReadings { laws: places.collect(), ..sum.unwrap_or_else(|| LinearisedReadings::none(all)) }
}

impl LinearisedReadings {
    /// No readings of a model with `all` columns.
    fn none(all: usize) -> Self {
        Self {
            matrix: DMatrix::zeros(all, all),
            laws: Vec::new(),
            right: DVector::zeros(all),
            square: 0.0,
            count: 0,
        }
    }

    fn plus(mut self, more: Self) -> Self {
        self.matrix += more.matrix;
        self.right += more.right;
        Self { square: self.square + more.square, count: self.count + more.count, ..self }
    }

    /// Projects the scale column onto the columns of the fit's parameters. The orthogonal remainder would fit any
    /// non-geometric error of the arm, and thousands of rows would turn that into evidence of a scale; an actual scale error
    /// has almost no such remainder, since it is equivalent to a larger arm. The tolerances alone then decide between two
    /// explanations of the same readings.
    pub(super) fn project_scale_onto_arm(&mut self, fitted: &Fitted, tolerance: &Tolerance) -> Option<()> {
        let arm = fitted.parameters.len();
        let own = self.matrix.view((0, 0), (arm, arm)).into_owned();
        let beyond = arm + 1..self.matrix.ncols();
        let mut matrix = own.clone();
        for (k, (parameter, prior)) in fitted.parameters.iter().zip(&fitted.priors).enumerate() {
            let sigma = match parameter {
                Parameter::Link { .. } => WIDE * tolerance.prior(parameter, &fitted.model).sigma,
                _ => prior.sigma,
            };
            matrix[(k, k)] += 1.0 / (sigma * sigma);
        }
        let (factor, _) = factorise(&matrix)?;
        let scale = self.matrix.view((0, arm), (arm, 1)).column(0).into_owned();
        let coefficients = factor.solve(&scale);
        let projected = own * &coefficients;
        self.right[arm] = coefficients.dot(&self.right.rows(0, arm));
        self.matrix[(arm, arm)] = coefficients.dot(&projected);
        for k in 0..arm {
            self.matrix[(k, arm)] = projected[k];
            self.matrix[(arm, k)] = projected[k];
        }
        for law in beyond {
            let along = coefficients.dot(&self.matrix.view((0, law), (arm, 1)).column(0));
            self.matrix[(law, arm)] = along;
            self.matrix[(arm, law)] = along;
        }
        Some(())
    }
}

/// Prior width of the links in that projection, in tolerances.
const WIDE: f64 = 10.0;

/// Rows that are processed together.
pub(super) const ROWS: usize = 512;

/// Rows of one thread's sum: the same for any number of threads.
const PART: usize = 4 * ROWS;

/// Adds AᵀA of readings to the lower triangle of `sum`. Many columns are mostly knots of error maps, of which a block of rows reaches few; the
/// kernel skips the others, but takes whole groups of rows.
fn add_gram(a: &DMatrix<f64>, sum: &mut DMatrix<f64>) {
    if a.ncols() > MANY_COLUMNS && a.nrows().is_multiple_of(WIDTH) {
        add_products(a.as_slice(), a.nrows(), sum.as_mut_slice());
    } else {
        *sum += gram(a);
    }
}

/// Adds to the covariance of a fit what an unknown scale error of the sensor, of standard deviation `sigma`, makes of its parameters: all
/// readings that are too long by one share look like a larger arm. A fit that has a scale itself is left as it is.
///
/// With J the whitened Jacobian, Λ the prior precisions and s the derivatives of the readings by the scale, the estimate moves by
/// (JᵀJ + Λ)⁻¹ Jᵀs for a scale of 1. That is not the covariance times Jᵀs: this may contain more, as what the arm lacks of uncertain causes.
pub(crate) fn widen_by_scale(fitted: &mut Fitted, dataset: &Dataset, sigma: f64) {
    if fits_scale(fitted) {
        return;
    }
    let readings = linearise_readings(fitted, dataset, &[]);
    let Some(covariance) = &mut fitted.estimate.covariance else { return };
    let arm = covariance.nrows();
    let mut normal = readings.matrix.view((0, 0), (arm, arm)).into_owned();
    for (k, prior) in fitted.priors.iter().enumerate() {
        normal[(k, k)] += prior.sigma.powi(-2);
    }
    let Some((factor, _)) = factorise(&normal) else { return };
    let moved = factor.solve(&readings.matrix.view((0, arm), (arm, 1)).column(0).into_owned()) * sigma;
    *covariance += &moved * moved.transpose();
}

/// Whether the fit itself has a scale parameter for all rows.
pub(super) fn fits_scale(fitted: &Fitted) -> bool {
    fitted.frames.disturbances.iter().any(|d| d.kind == Kind::Scale && d.profile == Profile::Constant)
}

/// Whether the prior of a frame is narrower than any free one's.
fn has_stated_frames(fitted: &Fitted) -> bool {
    let of_frames = |parameter: &Parameter| {
        matches!(parameter, Parameter::SensorFrame(0..3) | Parameter::Outlet { .. } | Parameter::Zero { .. })
    };
    fitted.parameters.iter().zip(&fitted.priors).any(|(p, prior)| of_frames(p) && prior.sigma < STATED_MM)
}

/// Standard deviation of a frame below which it was stated (mm).
const STATED_MM: f64 = 100.0;
