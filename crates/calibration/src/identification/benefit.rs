//! Posterior probability that the estimated arm corrects programs better than the nominal one: Bayesian model averaging
//! over prior widths, noise levels and a sensor scale error.
//!
//! A small held-out error proves nothing: a sensor scale error is the same in held-out rows, and a fit of few noisy rows
//! follows their noise. The estimate is therefore compared with alternative models of the same readings:
//!
//! - narrower priors and more noise: prior widths of lengths and angles and the sensor's σ run over grids, each grid point
//!   weighted by its evidence (marginal likelihood);
//! - each of these with a scale error of the sensor as a further parameter;
//! - and with a further error of the sensor ([`SensorLaw`]): a box of poses may not tell it from the arm's geometry.
//!
//! Let x̂ be the estimate and x the deviations of the actual arm. A point fixed to the flange is corrected by J x̂ where J x is
//! required. The reduction of its squared error relative to the nominal arm is
//!
//! |J x|² − |J (x − x̂)|² = 2 x̂ᵀM x − x̂ᵀM x̂,  M = mean of Jᵀ J over poses of the measured region.
//!
//! It is linear in x, hence normal under each model; the mixture gives the probability that it is positive. Rigid motions of
//! the base and of the point on the flange are projected out of J: the data do not determine them, and they are absorbed
//! when the part is placed.
//!
//! All models share one linearisation at the estimate: the normal equations with a column for the scale. Evidence of linear
//! models with normal priors: Bishop 2006, section 3.5.
//! Checked against: simulated arms at fresh poses (tests, and the sweep in `benches/verdict.rs`).

use std::fmt;
use std::ops::Range;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::{MatMut, MatRef, Par};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Vector3};
use rayon::prelude::*;
use serde::Serialize;

use crate::identification::beyond_noise::BeyondNoise;
use crate::identification::calibration::CalibrationProblem;
use crate::identification::fit::{Fitted, Observations};
use crate::identification::rounding;
use crate::identification::sensor_laws::{SensorErrors, SensorLaw, mean_reading};
use crate::identification::tolerance::Tolerance;
use crate::measurement::dataset::{Dataset, Sensor};
use crate::measurement::sensor::disturbance::{Kind, Profile};
use truegrind_arm::condition::Condition;
use truegrind_arm::estimated::{Estimated, StageErrors};
use truegrind_arm::jacobian::{BaseAndTool, parameter_jacobian};
use truegrind_arm::model::Joints;
use truegrind_arm::parameter::Parameter;
use truegrind_estimation::problem::Problem;
use truegrind_math::gram::add_products;
use truegrind_math::lanes::WIDTH;
use truegrind_math::se3::{Pose, vector_from_pose};
use truegrind_math::tail::normal_two_sided;
use truegrind_math::work::checkpoint;

/// Expected benefit of a model inside its measured region, rigid motions of base and flange excluded.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Benefit {
    /// Expected RMS position error of the data sheet's arm (mm).
    pub nominal_mm: f64,
    /// Expected RMS position error of the estimated arm (mm).
    pub estimated_mm: f64,
    /// The same if all that the readings still deviate is the arm's and not noise (mm).
    pub estimated_at_most_mm: f64,
    /// `estimated_mm` if the sensor has no scale error (mm).
    pub estimated_without_scale_mm: f64,
    /// Whether the uncertainty of the sensor's scale was stated; otherwise it is assumed.
    pub scale_stated: bool,
    /// Probability that the estimated arm is the better one.
    #[serde(rename = "chance")]
    pub probability: f64,
    /// The same under the models without a scale error.
    #[serde(rename = "chance_without_scale")]
    pub probability_without_scale: f64,
    /// The scale error under the models that have one; absent where the fit itself had a scale parameter.
    pub scale: Option<ScaleError>,
    /// The further error of the sensor that explains the readings best; absent where a sensor has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub law: Option<LawError>,
    /// Scalar readings.
    pub readings: usize,
    /// Parameters that the readings determine: Σ (1 − σ²/prior²).
    pub determined: f64,
    /// Parameters of the fit.
    pub parameters: usize,
    /// The error that the model leaves beyond the noise, where known part of `nominal_mm` and `estimated_mm`; absent for a fit that has
    /// not been compared with the noise.
    pub beyond_noise: Option<BeyondNoise>,
}

impl Benefit {
    /// The benefit of an arm that has a further error, corrected or not.
    pub fn with(self, beyond_noise: BeyondNoise) -> Self {
        let further_mm = beyond_noise.known_mm().unwrap_or(0.0);
        Self {
            nominal_mm: self.nominal_mm.hypot(further_mm),
            estimated_mm: self.estimated_mm.hypot(further_mm),
            estimated_at_most_mm: self.estimated_mm.hypot(beyond_noise.most_mm()),
            estimated_without_scale_mm: self.estimated_without_scale_mm.hypot(further_mm),
            beyond_noise: Some(beyond_noise),
            ..self
        }
    }
}

/// Why no benefit for programs is stated.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum NoBenefit {
    /// The normal equations are singular.
    Singular,
    /// No held-out error shows by how much the fit understates its uncertainty.
    UnknownInflation,
    /// Of too few poses it would be the benefit of the priors; the sentence says how many are needed.
    FewPoses(String),
}

impl fmt::Display for NoBenefit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            NoBenefit::Singular => {
                "the benefit for programs cannot be computed: the normal equations are singular"
            }
            NoBenefit::UnknownInflation => {
                "the benefit for programs cannot be computed: without a held-out error nothing shows whether the stated uncertainties are right"
            }
            NoBenefit::FewPoses(sentence) => sentence,
        })
    }
}

/// A scale error of the sensor as an alternative explanation of the readings.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ScaleError {
    /// Posterior probability of the models with a scale error.
    pub probability: f64,
    /// Relative scale error: positive where readings are too long.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
    /// Share of the squared correction still attributed to the arm's geometry once the scale error is modelled.
    #[serde(rename = "left")]
    pub geometry_share: f64,
    /// Expected RMS error (mm) of the estimated arm if there is such a scale.
    pub estimated_mm: f64,
    /// Expected RMS error (mm) of the data sheet's arm if there is such a scale.
    pub nominal_mm: f64,
}

/// A further error of the sensor as an alternative explanation of the readings.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LawError {
    /// The likeliest one.
    pub kind: SensorLaw,
    /// Posterior probability of the models with any.
    pub probability: f64,
    /// Probability that the estimated arm is the better one if the sensor has no such error; absent where that is out of the question.
    pub benefit_without: Option<f64>,
    /// The same if it has one.
    pub benefit_with: Option<f64>,
}

/// Grid of prior widths, as multiples of the tolerance.
const LENGTH_WIDTHS: [f64; 6] = [0.0625, 0.125, 0.25, 0.5, 1.0, 2.0];
const ANGLE_WIDTHS: [f64; 7] = [0.0625, 0.125, 0.25, 0.5, 1.0, 2.0, 4.0];
/// Grid of the sensor's σ, as a multiple of the fit's.
const NOISE_FACTORS: [f64; 4] = [0.71, 1.0, 1.41, 2.0];
/// Beside a further error of the sensor, which the fit may have counted as noise, it may be far smaller.
const NOISE_FACTORS_BESIDE_LAW: [f64; 8] = [0.0625, 0.125, 0.25, 0.5, 0.71, 1.0, 1.41, 2.0];
/// Above this number of parameters every second width is skipped and products run in blocks.
const MANY: usize = 90;

/// Prior over the sensor's scale error where nothing is stated. A good instrument is accurate to parts in a million; these are faults (atmosphere
/// and drift, a wrong measuring wheel or calibration, a wrong unit), assumed in a fifth of the cases.
const UNSTATED_SCALE: [ScalePrior; 4] = [
    ScalePrior { sigma: None, probability: 0.8 },
    ScalePrior { sigma: Some(1e-3), probability: 0.05 },
    ScalePrior { sigma: Some(4e-3), probability: 0.1 },
    ScalePrior { sigma: Some(1e-2), probability: 0.05 },
];

#[derive(Debug, Clone, Copy)]
struct ScalePrior {
    /// Standard deviation of the sensor's relative scale error; `None` for no scale error.
    sigma: Option<f64>,
    probability: f64,
}

/// What the sensor may have beside its noise.
struct Alternative {
    /// Standard deviation of its relative scale error; `None` for none.
    scale: Option<f64>,
    /// Its further error.
    law: Option<SensorLaw>,
    probability: f64,
    /// Columns of the linearised readings that it has, beside those of the fit's parameters.
    columns: Vec<usize>,
}

/// Each scale error alone, and beside each further error.
fn alternatives(fitted: &Fitted, tolerance: &Tolerance, readings: &LinearisedReadings) -> Vec<Alternative> {
    let scale = fitted.parameters.len();
    let scale_priors = scale_priors(fitted, tolerance);
    let any: f64 = readings.laws.iter().map(|(law, _)| law.probability()).sum();
    let alone = scale_priors.iter().map(|prior| Alternative {
        scale: prior.sigma,
        law: None,
        probability: (1.0 - any) * prior.probability,
        columns: prior.sigma.map(|_| scale).into_iter().collect(),
    });
    let priors = &scale_priors[..];
    let beside = readings.laws.iter().flat_map(|(law, columns)| {
        priors.iter().map(move |prior| Alternative {
            scale: prior.sigma,
            law: Some(*law),
            probability: law.probability() * prior.probability,
            columns: prior.sigma.map(|_| scale).into_iter().chain(columns.clone()).collect(),
        })
    });
    alone.chain(beside).collect()
}

/// Prior over the scale error: as stated, or none beside a scale that the fit has itself.
fn scale_priors(fitted: &Fitted, tolerance: &Tolerance) -> Vec<ScalePrior> {
    let certain = |sigma: Option<f64>| vec![ScalePrior { sigma, probability: 1.0 }];
    match tolerance.scale {
        _ if fits_scale(fitted) => certain(None),
        Some(stated) => certain(Some(stated).filter(|sigma| *sigma > 0.0)),
        None => UNSTATED_SCALE.to_vec(),
    }
}

/// Normal equations of the readings in the parameters of the fit, a scale error of the sensor and its further errors.
struct LinearisedReadings {
    /// JᵀJ, the scale error after the parameters, the further errors last.
    matrix: DMatrix<f64>,
    /// Columns of each further error.
    laws: Vec<(SensorLaw, Range<usize>)>,
    /// Jᵀy.
    right: DVector<f64>,
    /// yᵀy.
    square: f64,
    count: usize,
}

/// Expected benefit of the fit `fitted` to `dataset`. `tolerance` holds plausible deviations of an arm;
/// `variance_inflation` ([`inflation_from_rows`], [`inflation_from_errors`]) multiplies every posterior variance.
///
/// # Errors
/// [`NoBenefit::Singular`] also where no parameter of the arm was fitted, or a number is not finite.
pub fn benefit(
    fitted: &Fitted,
    dataset: &Dataset,
    estimated: &Estimated,
    tolerance: &Tolerance,
    variance_inflation: Option<f64>,
) -> Result<Benefit, NoBenefit> {
    let variance_inflation = variance_inflation.ok_or(NoBenefit::UnknownInflation)?;
    expected_benefit(fitted, dataset, estimated, tolerance, variance_inflation).ok_or(NoBenefit::Singular)
}

fn expected_benefit(
    fitted: &Fitted,
    dataset: &Dataset,
    estimated: &Estimated,
    tolerance: &Tolerance,
    variance_inflation: f64,
) -> Option<Benefit> {
    let metric = shape_metric(fitted, &estimated.condition, &estimated.region.samples_deg)?;
    let mut readings = linearise_readings(fitted, dataset, SensorLaw::of(dataset.sensor));
    readings.project_scale_onto_arm(fitted, tolerance)?;
    let x = DVector::from_column_slice(&fitted.estimate.x);
    let gradient = &metric * &x;
    let square = x.dot(&gradient);
    let correction = Correction { metric: &metric, x: &x, gradient: &gradient, square, variance_inflation };
    let alternatives = alternatives(fitted, tolerance, &readings);
    let hypotheses = hypotheses(fitted, tolerance, &alternatives);
    let posteriors = weighted_posteriors(&hypotheses, &alternatives, &readings, &correction)?;
    let total: f64 = posteriors.iter().map(|(w, _)| w).sum();
    let mean = |of: &dyn Fn(&Posterior) -> f64, only: &dyn Fn(&Posterior) -> bool| {
        let (mut sum, mut weight) = (0.0, 0.0);
        for (w, posterior) in posteriors.iter().filter(|(_, v)| only(v)) {
            sum += w * of(posterior);
            weight += w;
        }
        if weight > 0.0 { sum / weight } else { f64::NAN }
    };
    let any = &|_: &Posterior| true;
    let without_scale = &|v: &Posterior| v.scale.is_none() && v.law.is_none();
    let with_scale = |v: &Posterior| v.scale.is_some() && v.law.is_none();
    let without_law = |v: &Posterior| v.law.is_none();
    let share = |only: &dyn Fn(&Posterior) -> bool| {
        posteriors.iter().filter(|(_, v)| only(v)).map(|(w, _)| w).sum::<f64>() / total
    };
    let scale = (!fits_scale(fitted)).then(|| {
        let value = mean(&|v| v.scale.map_or(0.0, |s| s.0), &with_scale);
        let variance = mean(&|v| v.scale.map_or(0.0, |s| s.1 + (s.0 - value).powi(2)), &with_scale);
        ScaleError {
            probability: share(&with_scale),
            value,
            sigma: variance.sqrt(),
            geometry_share: mean(&|v| v.geometry_share, &with_scale),
            estimated_mm: mean(&|v| v.estimated, &with_scale).max(0.0).sqrt(),
            nominal_mm: mean(&|v| v.nominal, &with_scale).max(0.0).sqrt(),
        }
    });
    let share_of = |law: SensorLaw| share(&|v| v.law == Some(law));
    let likeliest =
        readings.laws.iter().map(|(law, _)| *law).max_by(|a, b| share_of(*a).total_cmp(&share_of(*b)));
    let law = likeliest.map(|kind| LawError {
        kind,
        probability: share(&|v| v.law.is_some()),
        benefit_without: known(mean(&|v| v.probability, &without_law)),
        benefit_with: known(mean(&|v| v.probability, &|v| v.law.is_some())),
    });
    let shares = fitted.sigmas().into_iter().zip(&fitted.priors);
    let estimated_mm = mean(&|v| v.estimated, any).max(0.0).sqrt();
    Some(Benefit {
        nominal_mm: mean(&|v| v.nominal, any).max(0.0).sqrt(),
        estimated_mm,
        estimated_at_most_mm: estimated_mm,
        estimated_without_scale_mm: known_or(
            mean(&|v| v.estimated, without_scale),
            mean(&|v| v.estimated, any),
        )
        .max(0.0)
        .sqrt(),
        probability: mean(&|v| v.probability, any),
        probability_without_scale: known_or(
            mean(&|v| v.probability, without_scale),
            mean(&|v| v.probability, any),
        ),
        scale_stated: tolerance.scale.is_some(),
        scale: scale.filter(|s| s.value.is_finite()),
        law,
        readings: readings.count,
        determined: shares.map(|(s, p)| (1.0 - (s / p.sigma).powi(2)).clamp(0.0, 1.0)).sum(),
        parameters: x.len(),
        beyond_noise: None,
    })
}

/// A mean, unless there was nothing to average.
fn known(mean: f64) -> Option<f64> {
    (!mean.is_nan()).then_some(mean)
}

/// A mean, or another where there was nothing to average: all models have the stated scale error.
fn known_or(mean: f64, other: f64) -> f64 {
    if mean.is_nan() { other } else { mean }
}

/// Posteriors of all hypotheses of non-negligible evidence, with their weights relative to the largest.
fn weighted_posteriors(
    hypotheses: &[Hypothesis],
    alternatives: &[Alternative],
    readings: &LinearisedReadings,
    correction: &Correction<'_>,
) -> Option<Vec<(f64, Posterior)>> {
    let arm = correction.x.len();
    let equations: Vec<Equations> =
        alternatives.iter().map(|alternative| alternative.normal_equations(readings, arm)).collect();
    let equations_of = |hypothesis: &Hypothesis| &equations[hypothesis.alternative];
    let evidences: Vec<Option<f64>> = hypotheses
        .par_iter()
        .map(|hypothesis| {
            checkpoint();
            hypothesis.log_evidence(equations_of(hypothesis), readings)
        })
        .collect();
    let best = evidences.iter().flatten().copied().fold(f64::NEG_INFINITY, f64::max);
    let posteriors = hypotheses
        .par_iter()
        .zip(&evidences)
        .filter_map(|(hypothesis, evidence)| {
            checkpoint();
            let log = (*evidence)? - best;
            (log > NEGLIGIBLE).then(|| {
                let alternative = &alternatives[hypothesis.alternative];
                let equations = equations_of(hypothesis);
                Some((log.exp(), hypothesis.posterior(equations, alternative, correction)?))
            })?
        })
        .collect::<Vec<_>>();
    (!posteriors.is_empty()).then_some(posteriors)
}

/// Log evidence relative to the best hypothesis below which a hypothesis is dropped.
const NEGLIGIBLE: f64 = -14.0;

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
    fn project_scale_onto_arm(&mut self, fitted: &Fitted, tolerance: &Tolerance) -> Option<()> {
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

/// Whether the fit itself has a scale parameter for all rows.
fn fits_scale(fitted: &Fitted) -> bool {
    fitted.frames.disturbances.iter().any(|d| d.kind == Kind::Scale && d.profile == Profile::Constant)
}

/// A point of the grid: what the sensor has, prior widths and noise.
struct Hypothesis {
    /// Index of what the sensor has.
    alternative: usize,
    /// Logarithm of its probability.
    log_probability: f64,
    /// Prior precision 1/σ² of each parameter, those of the sensor's errors last.
    precision: Vec<f64>,
    /// The sensor's σ as a multiple of the fit's.
    noise: f64,
}

fn hypotheses(fitted: &Fitted, tolerance: &Tolerance, alternatives: &[Alternative]) -> Vec<Hypothesis> {
    let step = if fitted.parameters.len() > MANY { 2 } else { 1 };
    let mut out = Vec::new();
    for (k, alternative) in alternatives.iter().enumerate() {
        let of_law = alternative.columns.len() - usize::from(alternative.scale.is_some());
        let noises: &[f64] =
            if alternative.law.is_some() { &NOISE_FACTORS_BESIDE_LAW } else { &NOISE_FACTORS };
        let noises = noises.iter().step_by(if alternative.law.is_some() { step } else { 1 });
        let mut log_probability = alternative.probability.ln();
        if alternative.law.is_some() {
            // As probable as all noises of the other grid together, however many there are.
            log_probability -= (noises.len() as f64 / NOISE_FACTORS.len() as f64).ln();
        }
        for length in LENGTH_WIDTHS.iter().step_by(step) {
            for angle in ANGLE_WIDTHS.iter().step_by(step) {
                let links =
                    fitted.parameters.iter().zip(&fitted.priors).map(|(parameter, prior)| match parameter {
                        Parameter::Link { coordinate, .. } if coordinate.is_length() => {
                            length * tolerance.length_mm
                        }
                        Parameter::Link { .. } => angle * tolerance.angle_rad,
                        _ => prior.sigma,
                    });
                let of_sensor = alternative.scale.into_iter().chain(std::iter::repeat_n(1.0, of_law));
                let precision: Vec<f64> = links.chain(of_sensor).map(|s| 1.0 / (s * s)).collect();
                out.extend(noises.clone().map(|&noise| Hypothesis {
                    alternative: k,
                    log_probability,
                    precision: precision.clone(),
                    noise,
                }));
            }
        }
    }
    out
}

impl Alternative {
    /// The readings' normal equations, with the errors that the sensor has.
    fn normal_equations(&self, readings: &LinearisedReadings, arm: usize) -> Equations {
        let kept: Vec<usize> = (0..arm).chain(self.columns.iter().copied()).collect();
        Equations {
            matrix: readings.matrix.select_rows(&kept).select_columns(&kept),
            right: readings.right.select_rows(&kept),
        }
    }
}

/// Normal equations, priors not included.
struct Equations {
    matrix: DMatrix<f64>,
    right: DVector<f64>,
}

/// The correction that is judged.
struct Correction<'a> {
    /// M (mm² per unit of parameters squared).
    metric: &'a DMatrix<f64>,
    /// x̂.
    x: &'a DVector<f64>,
    /// M x̂.
    gradient: &'a DVector<f64>,
    /// x̂ᵀ M x̂ (mm²).
    square: f64,
    /// Factor on every posterior variance.
    variance_inflation: f64,
}

/// Posterior expectations under one hypothesis.
struct Posterior {
    /// Probability that the correction reduces the squared error.
    probability: f64,
    /// Expected squared error of the nominal arm (mm²).
    nominal: f64,
    /// The same of the estimated arm (mm²).
    estimated: f64,
    /// Mean and variance of the scale error.
    scale: Option<(f64, f64)>,
    /// The sensor's further error.
    law: Option<SensorLaw>,
    /// Share of the squared correction attributed to geometry.
    geometry_share: f64,
}

impl Hypothesis {
    /// Cholesky factor of the posterior precision, its log determinant, and the posterior mean.
    fn solve(&self, equations: &Equations) -> Option<(ScaledCholesky, f64, DVector<f64>)> {
        let weight = 1.0 / (self.noise * self.noise);
        let mut matrix = &equations.matrix * weight;
        for (k, precision) in self.precision.iter().enumerate() {
            matrix[(k, k)] += precision;
        }
        let (factor, log_determinant) = factorise(&matrix)?;
        let mean = factor.solve(&(&equations.right * weight));
        Some((factor, log_determinant, mean))
    }

    /// Log of prior probability times evidence, up to a constant.
    fn log_evidence(&self, equations: &Equations, readings: &LinearisedReadings) -> Option<f64> {
        let (_, log_determinant, mean) = self.solve(equations)?;
        let misfit = (readings.square - equations.right.dot(&mean)) / (self.noise * self.noise);
        let log_prior: f64 = self.precision.iter().map(|p| p.ln()).sum();
        let log_noise = 2.0 * readings.count as f64 * self.noise.ln();
        let log = self.log_probability - 0.5 * (log_noise + log_determinant - log_prior + misfit);
        log.is_finite().then_some(log)
    }

    fn posterior(
        &self,
        equations: &Equations,
        alternative: &Alternative,
        correction: &Correction<'_>,
    ) -> Option<Posterior> {
        let (factor, _, all) = self.solve(equations)?;
        let Correction { metric, x, gradient, square, variance_inflation } = *correction;
        let arm = x.len();
        let along = DVector::from_fn(all.len(), |k, _| if k < arm { gradient[k] } else { 0.0 });
        let variance = 4.0 * variance_inflation * along.dot(&factor.solve(&along));
        let mean = all.rows(0, arm).into_owned();
        let reduction = 2.0 * mean.dot(gradient) - square;
        let covariance = factor.inverse();
        let unknown = variance_inflation * metric.component_mul(&covariance.view((0, 0), (arm, arm))).sum();
        let remaining = x - &mean;
        let explained = mean.dot(&(metric * &mean));
        let scale = alternative.scale.map(|_| (all[arm], covariance[(arm, arm)]));
        Some(Posterior {
            probability: if variance > 0.0 { normal_cdf(reduction / variance.sqrt()) } else { 0.5 },
            nominal: explained + unknown,
            estimated: remaining.dot(&(metric * &remaining)) + unknown,
            scale,
            law: alternative.law,
            geometry_share: if square > 0.0 { explained / square } else { f64::NAN },
        })
    }
}

/// Φ(`value`), the standard normal distribution function.
pub(crate) fn normal_cdf(value: f64) -> f64 {
    let tail = 0.5 * normal_two_sided(value);
    if value < 0.0 { tail } else { 1.0 - tail }
}

/// Cholesky factor and log determinant, of the matrix scaled to a unit diagonal since mm and rad differ by orders of
/// magnitude.
fn factorise(matrix: &DMatrix<f64>) -> Option<(ScaledCholesky, f64)> {
    let size = DVector::from_fn(matrix.nrows(), |k, _| matrix[(k, k)].sqrt().recip());
    if size.iter().any(|s| !s.is_finite()) {
        return None;
    }
    let unit = DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)] * size[i] * size[j]);
    let factor = if unit.nrows() > MANY { blocked_cholesky(unit)? } else { Cholesky::new(unit)? };
    let determinant: f64 = factor.l_dirty().diagonal().iter().map(|v| 2.0 * v.ln()).sum();
    let scaling: f64 = size.iter().map(|s| 2.0 * s.ln()).sum();
    Some((ScaledCholesky { factor, size }, determinant - scaling))
}

/// AᵀA, in blocks for many columns.
fn gram(a: &DMatrix<f64>) -> DMatrix<f64> {
    if a.ncols() > MANY { a.transpose() * a } else { a.tr_mul(a) }
}

/// Adds AᵀA of readings to the lower triangle of `sum`. Many columns are mostly knots of error maps, of which a block of rows reaches few; the
/// kernel skips the others, but takes whole groups of rows.
fn add_gram(a: &DMatrix<f64>, sum: &mut DMatrix<f64>) {
    if a.ncols() > MANY && a.nrows().is_multiple_of(WIDTH) {
        add_products(a.as_slice(), a.nrows(), sum.as_mut_slice());
    } else {
        *sum += gram(a);
    }
}

/// Cholesky factor of a large matrix, in blocks.
fn blocked_cholesky(mut matrix: DMatrix<f64>) -> Option<Cholesky<f64, Dyn>> {
    let n = matrix.nrows();
    let request = llt::factor::cholesky_in_place_scratch::<f64>(n, Par::Seq, Default::default());
    let mut memory = MemBuffer::new(request);
    let place = MatMut::from_column_major_slice_mut(matrix.as_mut_slice(), n, n);
    let stack = MemStack::new(&mut memory);
    llt::factor::cholesky_in_place(place, Default::default(), Par::Seq, stack, Default::default()).ok()?;
    Some(Cholesky::pack_dirty(matrix))
}

/// (L Lᵀ)⁻¹ of a large factor, in blocks: XᵀX with X = L⁻¹.
fn blocked_inverse(factor: &Cholesky<f64, Dyn>) -> DMatrix<f64> {
    let lower = factor.l_dirty();
    let n = lower.nrows();
    let mut x = DMatrix::identity(n, n);
    let lower = MatRef::from_column_major_slice(lower.as_slice(), n, n);
    let place = MatMut::from_column_major_slice_mut(x.as_mut_slice(), n, n);
    faer::linalg::triangular_solve::solve_lower_triangular_in_place(lower, place, Par::Seq);
    gram(&x)
}

struct ScaledCholesky {
    factor: Cholesky<f64, Dyn>,
    size: DVector<f64>,
}

impl ScaledCholesky {
    fn solve(&self, right: &DVector<f64>) -> DVector<f64> {
        self.factor.solve(&right.component_mul(&self.size)).component_mul(&self.size)
    }

    fn inverse(&self) -> DMatrix<f64> {
        let n = self.size.len();
        let unit = if n > MANY { blocked_inverse(&self.factor) } else { self.factor.inverse() };
        DMatrix::from_fn(unit.nrows(), unit.ncols(), |i, j| unit[(i, j)] * self.size[i] * self.size[j])
    }
}

/// Mean square of the held-out residuals, each divided by the σ that the training fit predicts for it, and at least 1.
/// It is 1 where the predicted uncertainty is right, and where the fit predicts none. `None` without held-out rows or
/// finite residuals.
pub fn inflation_from_rows(training: &Fitted, held: &Observations) -> Option<f64> {
    let (Some(covariance), x) = (&training.estimate.covariance, &training.estimate.x) else {
        return Some(1.0);
    };
    if held.dataset.rows.is_empty() {
        return None;
    }
    if x.is_empty() {
        return Some(1.0);
    }
    let subsample = held.subsample();
    let held = subsample.as_ref().unwrap_or(held);
    let (sigma_mm, sigma_rad) = (training.sigma_mm, training.sigma_rad);
    let weights = rounding::weights(
        &held.dataset,
        &training.model,
        &training.frames,
        &held.angles,
        sigma_mm,
        sigma_rad,
    );
    let problem = CalibrationProblem::new(
        &held.dataset,
        training.problem.start(),
        training.problem.starting_frames(),
        &training.parameters,
        &[],
        &weights,
    );
    let (residuals, transposed) = problem.linearise(x);
    let mut sum = 0.0;
    // In pieces: there can be a million rows.
    for from in (0..residuals.len()).step_by(ROWS) {
        let slopes = transposed.columns(from, ROWS.min(residuals.len() - from));
        let known = covariance * slopes;
        for (k, r) in residuals.iter().skip(from).take(slopes.ncols()).enumerate() {
            sum += r * r / (1.0 + slopes.column(k).dot(&known.column(k)).max(0.0));
        }
    }
    at_least_1(sum / residuals.len() as f64)
}

/// Squared held-out error relative to its expectation, and at least 1: with k parameters determined by n readings it is
/// (n + k) / (n − k) times that of the fit. `None` where the errors do not tell.
pub fn inflation_from_errors(fitted: &Fitted, dataset: &Dataset, errors: &StageErrors) -> Option<f64> {
    let per = fitted.problem.rows_per_observation();
    let n = (dataset.rows.len() * per) as f64;
    let shares = fitted.sigmas().into_iter().zip(&fitted.priors);
    let spent: f64 = shares.map(|(s, p)| (1.0 - (s / p.sigma).powi(2)).clamp(0.0, 1.0)).sum();
    let expected = (n + spent) / (n - spent).max(0.05 * n).max(1.0);
    at_least_1((errors.held_out.rmse / errors.fitted.rmse).powi(2) / expected)
}

/// An unknown inflation is not the least one.
fn at_least_1(inflation: f64) -> Option<f64> {
    inflation.is_finite().then(|| inflation.max(1.0))
}

/// Adds to the covariance of a fit what an unknown scale error of the sensor, of standard deviation `sigma`, makes of its parameters: all
/// readings that are too long by one share look like a larger arm. A fit that has a scale itself is left as it is.
pub(crate) fn widen_by_scale(fitted: &mut Fitted, dataset: &Dataset, sigma: f64) {
    if fits_scale(fitted) {
        return;
    }
    let readings = linearise_readings(fitted, dataset, &[]);
    let Some(covariance) = &mut fitted.estimate.covariance else { return };
    let arm = covariance.nrows();
    let scale = readings.matrix.view((0, arm), (arm, 1)).into_owned();
    let moved = &*covariance * scale * sigma;
    *covariance += &moved * moved.transpose();
}

/// Normal equations of the linear model J x = y, y = J x̂ − r, in one pass over the rows at the estimate x̂.
fn linearise_readings(fitted: &Fitted, dataset: &Dataset, laws: &[SensorLaw]) -> LinearisedReadings {
    let problem = &fitted.problem;
    let (p, per) = (problem.parameters(), problem.rows_per_observation());
    let x = &fitted.estimate.x;
    let rotation = fitted.frames.base_from_sensor.rotation;
    // A scale about the mean reading does not move the sensor frame. Free frames take up where a scale error moves everything; stated ones do not.
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

/// Rows that are processed together.
const ROWS: usize = 512;

/// Rows of one thread's sum: the same for any number of threads.
const PART: usize = 4 * ROWS;

/// Whether the prior of a frame is narrower than any free one's.
fn has_stated_frames(fitted: &Fitted) -> bool {
    let of_frames = |parameter: &Parameter| {
        matches!(parameter, Parameter::SensorFrame(0..3) | Parameter::Outlet { .. } | Parameter::Zero { .. })
    };
    fitted.parameters.iter().zip(&fitted.priors).any(|(p, prior)| of_frames(p) && prior.sigma < STATED_MM)
}

/// Standard deviation of a frame below which it was stated (mm).
const STATED_MM: f64 = 100.0;

/// M at `condition` over the region spanned by the poses `samples_deg` (°). δᵀ M δ is the mean square displacement (mm²) of the
/// target by a change δ of the fit's parameters, rigid motions of base and target projected out. Rows and columns of
/// measurement parameters are zero.
pub(crate) fn shape_metric(
    fitted: &Fitted,
    condition: &Condition,
    samples_deg: &[[f64; 6]],
) -> Option<DMatrix<f64>> {
    let indices: Vec<usize> =
        fitted.parameters.iter().enumerate().filter(|(_, p)| p.is_of_arm()).map(|(k, _)| k).collect();
    let mut list: Vec<Parameter> = indices.iter().map(|&k| fitted.parameters[k]).collect();
    let own = list.len();
    if own == 0 {
        return None;
    }
    list.extend((0..6).map(Parameter::SensorFrame).chain((0..3).map(Parameter::Target)));
    let posed = fitted.model.at_condition(condition);
    let target =
        Pose::from_parts(fitted.frames.flange_from_target.translation, nalgebra::UnitQuaternion::identity());
    let ends = BaseAndTool { world_from_base: [0.0; 6], flange_from_tool: vector_from_pose(&target) };
    let poses = judged_poses(samples_deg);
    let mut stack = DMatrix::zeros(3 * poses.len(), list.len());
    for (k, q) in poses.iter().enumerate() {
        let twists = parameter_jacobian(&ends, &posed, q, &list);
        stack.rows_mut(3 * k, 3).copy_from(&twists.rows(0, 3));
    }
    let (arm, rigid) = (stack.columns(0, own).into_owned(), stack.columns(own, 9).into_owned());
    // Rotations move by hundreds of millimetres per radian: columns of equal length, then an orthonormal basis.
    let svd =
        DMatrix::from_columns(&rigid.column_iter().map(|c| c / c.norm().max(1e-12)).collect::<Vec<_>>())
            .svd(true, false);
    let basis = svd.u?;
    let rigid: Vec<DVector<f64>> = basis
        .column_iter()
        .zip(svd.singular_values.iter())
        .filter(|(_, value)| **value > 1e-6)
        .map(|(column, _)| column.into_owned())
        .collect();
    let shape = if rigid.is_empty() {
        arm
    } else {
        let basis = DMatrix::from_columns(&rigid);
        &arm - &basis * basis.tr_mul(&arm)
    };
    let mut out = DMatrix::zeros(fitted.parameters.len(), fitted.parameters.len());
    let square = gram(&shape) / poses.len().max(1) as f64;
    for (i, &a) in indices.iter().enumerate() {
        for (j, &b) in indices.iter().enumerate() {
            out[(a, b)] = square[(i, j)];
        }
    }
    out.iter().all(|v| v.is_finite()).then_some(out)
}

/// Poses of the measured region: its samples and the midpoints of pairs of them, so that a fit of few rows is not judged only
/// at the poses that it was fitted to.
fn judged_poses(samples_deg: &[[f64; 6]]) -> Vec<Joints> {
    let n = samples_deg.len();
    let radians = |q: [f64; 6]| Joints::from_fn(|i, _| q[i].to_radians());
    let mut out: Vec<Joints> = samples_deg.iter().map(|q| radians(*q)).collect();
    for (k, a) in samples_deg.iter().enumerate() {
        let b = &samples_deg[(k + n / 3 + 1) % n];
        out.push(radians(std::array::from_fn(|i| 0.5 * (a[i] + b[i]))));
    }
    out
}
