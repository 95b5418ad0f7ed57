//! The models that explain the readings, with their priors, their evidence and what each says of a correction.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::identification::fit::Fitted;
use crate::identification::linearised_readings::{LinearisedReadings, fits_scale};
use crate::identification::scaled_cholesky::{MANY_COLUMNS, ScaledCholesky, factorise};
use crate::identification::sensor_laws::SensorLaw;
use crate::identification::tolerance::Tolerance;
use truegrind_arm::parameter::Parameter;
use truegrind_math::tail::normal_cdf;
use truegrind_math::work::checkpoint;

/// Grid of prior widths, as multiples of the tolerance.
const LENGTH_WIDTHS: [f64; 6] = [0.0625, 0.125, 0.25, 0.5, 1.0, 2.0];
const ANGLE_WIDTHS: [f64; 7] = [0.0625, 0.125, 0.25, 0.5, 1.0, 2.0, 4.0];
/// Grid of the sensor's σ, as a multiple of the fit's.
const NOISE_FACTORS: [f64; 4] = [0.71, 1.0, 1.41, 2.0];
/// Beside a further error of the sensor, which the fit may have counted as noise, it may be far smaller.
const NOISE_FACTORS_BESIDE_LAW: [f64; 8] = [0.0625, 0.125, 0.25, 0.5, 0.71, 1.0, 1.41, 2.0];

/// Prior over the sensor's scale error where nothing is stated. A good instrument is accurate to parts in a million; these are faults (atmosphere
/// and drift, a wrong measuring wheel or calibration, a wrong unit), assumed in a fifth of the cases.
const SCALE_PRIOR: [ScalePrior; 4] = [
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
pub(super) struct Alternative {
    /// Standard deviation of its relative scale error; `None` for none.
    scale: Option<f64>,
    /// Its further error.
    law: Option<SensorLaw>,
    probability: f64,
    /// Columns of the linearised readings that it has, beside those of the fit's parameters.
    columns: Vec<usize>,
}

/// Each scale error alone, and beside each further error; with or without those that are objections only.
pub(super) fn alternatives(
    fitted: &Fitted,
    tolerance: &Tolerance,
    readings: &LinearisedReadings,
    with_objections: bool,
) -> Vec<Alternative> {
    let scale = fitted.parameters.len();
    let scale_priors = scale_priors(fitted, tolerance);
    let laws = || readings.laws.iter().filter(|(law, _)| with_objections || !law.is_objection());
    let any: f64 = laws().map(|(law, _)| law.probability()).sum();
    let alone = scale_priors.iter().map(|prior| Alternative {
        scale: prior.sigma,
        law: None,
        probability: (1.0 - any) * prior.probability,
        columns: prior.sigma.map(|_| scale).into_iter().collect(),
    });
    let priors = &scale_priors[..];
    let beside = laws().flat_map(|(law, columns)| {
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
        None => SCALE_PRIOR.to_vec(),
    }
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

/// A point of the grid: what the sensor has, prior widths and noise.
pub(super) struct Hypothesis {
    /// Index of what the sensor has.
    alternative: usize,
    /// Logarithm of its probability.
    log_probability: f64,
    /// Prior precision 1/σ² of each parameter, those of the sensor's errors last.
    precision: Vec<f64>,
    /// The sensor's σ as a multiple of the fit's.
    noise: f64,
}

pub(super) fn hypotheses(
    fitted: &Fitted,
    tolerance: &Tolerance,
    alternatives: &[Alternative],
) -> Vec<Hypothesis> {
    let step = if fitted.parameters.len() > MANY_COLUMNS { 2 } else { 1 };
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

/// Normal equations, priors not included.
struct Equations {
    matrix: DMatrix<f64>,
    right: DVector<f64>,
}

/// The correction that is judged.
pub(super) struct Correction<'a> {
    /// M (mm² per unit of parameters squared).
    pub(super) metric: &'a DMatrix<f64>,
    /// x̂.
    pub(super) x: &'a DVector<f64>,
    /// M x̂.
    pub(super) gradient: &'a DVector<f64>,
    /// x̂ᵀ M x̂ (mm²).
    pub(super) square: f64,
    /// Factor on every posterior variance.
    pub(super) variance_inflation: f64,
}

/// Posterior expectations under one hypothesis.
pub(super) struct Posterior {
    /// Probability that the correction reduces the squared error.
    pub(super) probability: f64,
    /// Expected squared error of the nominal arm (mm²).
    pub(super) nominal: f64,
    /// The same of the estimated arm (mm²).
    pub(super) estimated: f64,
    /// Mean and variance of the scale error.
    pub(super) scale: Option<(f64, f64)>,
    /// The sensor's further error.
    pub(super) law: Option<SensorLaw>,
    /// Share of the squared correction attributed to geometry.
    pub(super) geometry_share: f64,
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

    /// Squared residual that its posterior mean leaves, per degree of freedom.
    fn residual_variance(&self, equations: &Equations, readings: &LinearisedReadings) -> Option<f64> {
        let (.., mean) = self.solve(equations)?;
        let square =
            readings.square - 2.0 * equations.right.dot(&mean) + mean.dot(&(&equations.matrix * &mean));
        let freedom = readings.count.checked_sub(mean.len()).filter(|freedom| *freedom > 0)?;
        Some(square / freedom as f64)
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

/// Posteriors of all hypotheses of non-negligible evidence, with their weights relative to the largest.
pub(super) fn weighted_posteriors(
    hypotheses: &[Hypothesis],
    alternatives: &[Alternative],
    readings: &LinearisedReadings,
    correction: &Correction<'_>,
) -> Option<Vec<(f64, Posterior)>> {
    let arm = correction.x.len();
    let equations: Vec<Equations> =
        alternatives.iter().map(|alternative| alternative.normal_equations(readings, arm)).collect();
    let equations_of = |hypothesis: &Hypothesis| &equations[hypothesis.alternative];
    let mut evidences: Vec<Option<f64>> = hypotheses
        .par_iter()
        .map(|hypothesis| {
            checkpoint();
            hypothesis.log_evidence(equations_of(hypothesis), readings)
        })
        .collect();
    drop_idle_objections(hypotheses, alternatives, &equations, readings, &mut evidences);
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

/// Takes the evidence from objections that explain hardly any of what is left without them: thousands of rows turn any rest that an arm
/// leaves into evidence of whatever follows it a little, and few rows leave it to chance.
fn drop_idle_objections(
    hypotheses: &[Hypothesis],
    alternatives: &[Alternative],
    equations: &[Equations],
    readings: &LinearisedReadings,
    evidences: &mut [Option<f64>],
) {
    let is_objection = |hypothesis: &Hypothesis| {
        alternatives[hypothesis.alternative].law.is_some_and(SensorLaw::is_objection)
    };
    let left = |with: bool| {
        let own =
            hypotheses.iter().zip(&*evidences).filter(|(hypothesis, _)| is_objection(hypothesis) == with);
        let (best, _) = own
            .filter_map(|(hypothesis, evidence)| Some((hypothesis, (*evidence)?)))
            .max_by(|a, b| a.1.total_cmp(&b.1))?;
        best.residual_variance(&equations[best.alternative], readings)
    };
    let (Some(with), Some(without)) = (left(true), left(false)) else { return };
    if with > EXPLAINED * without {
        for (_, evidence) in
            hypotheses.iter().zip(evidences).filter(|(hypothesis, _)| is_objection(hypothesis))
        {
            *evidence = None;
        }
    }
}

/// Share of the variance of the residuals that an objection must leave at most.
const EXPLAINED: f64 = 0.85;

/// Log evidence relative to the best hypothesis below which a hypothesis is dropped.
const NEGLIGIBLE: f64 = -14.0;
