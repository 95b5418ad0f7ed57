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

mod hypotheses;

use std::fmt;

use nalgebra::DVector;
use serde::Serialize;

use self::hypotheses::{Correction, Posterior, alternatives, hypotheses, weighted_posteriors};
use crate::identification::beyond_noise::BeyondNoise;
use crate::identification::fit::Fitted;
use crate::identification::linearised_readings::{LinearisedReadings, fits_scale, linearise_readings};
use crate::identification::sensor_laws::SensorLaw;
use crate::identification::shape_metric::shape_metric;
use crate::identification::tolerance::Tolerance;
use crate::measurement::dataset::Dataset;
use truegrind_arm::estimated::Estimated;

/// Smallest probability of a benefit at which a model is not doubtful.
pub const MIN_PROBABILITY: f64 = 0.96;

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
    pub fn with_unmodelled(self, beyond_noise: BeyondNoise) -> Self {
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

    /// The benefit of an arm that is likely to be off by `shift_mm` (RMS) in shape, since it was fitted without a cause of the measurement.
    pub(crate) fn with_shift(self, shift_mm: f64) -> Self {
        Self {
            estimated_mm: self.estimated_mm.hypot(shift_mm),
            estimated_at_most_mm: self.estimated_at_most_mm.hypot(shift_mm),
            estimated_without_scale_mm: self.estimated_without_scale_mm.hypot(shift_mm),
            ..self
        }
    }

    /// `estimated_at_most_mm` where that counts: what may be noise or the arm's is more than all that is expected of the arm.
    pub fn counting_at_most_mm(&self) -> Option<f64> {
        let (expected, most) = (self.estimated_mm, self.estimated_at_most_mm);
        (most.powi(2) > 2.0 * expected.powi(2)).then_some(most)
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

/// Expected benefit of the fit `fitted` to `dataset`. `tolerance` holds plausible deviations of an arm;
/// `variance_inflation` ([`inflation`](crate::identification::inflation)) multiplies every posterior variance.
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
    let metric = shape_metric(fitted, &estimated.condition, &estimated.region)?;
    let mut readings = linearise_readings(fitted, dataset, SensorLaw::of(dataset.sensor));
    readings.project_scale_onto_arm(fitted, tolerance)?;
    let x = DVector::from_column_slice(&fitted.estimate.x);
    let gradient = &metric * &x;
    let square = x.dot(&gradient);
    let correction = Correction { metric: &metric, x: &x, gradient: &gradient, square, variance_inflation };
    let judged_under = |tolerance: &Tolerance, with_objections: bool| {
        let alternatives = alternatives(fitted, tolerance, &readings, with_objections);
        let hypotheses = hypotheses(fitted, tolerance, &alternatives);
        let posteriors = weighted_posteriors(&hypotheses, &alternatives, &readings, &correction)?;
        averaged(&posteriors, fitted, tolerance, &readings)
    };
    let judged = |with_objections: bool| judged_under(tolerance, with_objections);
    let judged_exactly = || judged_under(&Tolerance { scale: Some(0.0), ..*tolerance }, false);
    let plain = with_exact_scale(judged(false)?, tolerance, &judged_exactly);
    if !readings.laws.iter().any(|(law, _)| law.is_objection()) {
        return Some(plain);
    }
    let objected = judged(true).filter(|objected| is_raised(objected, &plain));
    Some(objected.unwrap_or(plain))
}

/// Whether the further errors that are objections count: where they make doubtful what would not be, or are likelier than not in what is
/// doubtful anyway. Elsewhere they would only shift the expected errors by what is said of a sensor on the strength of an arm's rest. A scale
/// error, which a field contains, is the simpler explanation where it is one.
fn is_raised(objected: &Benefit, plain: &Benefit) -> bool {
    let scale = plain.scale.map_or(0.0, |scale| scale.probability);
    let is_likely = objected.law.is_some_and(|law| law.probability > 0.5);
    let raises_doubt = plain.probability >= MIN_PROBABILITY && scale <= 0.95;
    objected.probability < MIN_PROBABILITY && (raises_doubt || (is_likely && scale <= 0.5))
}

/// Adds to a doubtful benefit under a stated uncertainty of the scale, which all of its models have, what it were if the scale were exact: that
/// tells whether a known length would help, or only more poses.
fn with_exact_scale(
    plain: Benefit,
    tolerance: &Tolerance,
    judged_exactly: &dyn Fn() -> Option<Benefit>,
) -> Benefit {
    let is_asked = plain.probability < MIN_PROBABILITY && tolerance.scale.is_some_and(|sigma| sigma > 0.0);
    match is_asked.then(judged_exactly).flatten() {
        Some(exact) => Benefit {
            probability_without_scale: exact.probability,
            estimated_without_scale_mm: exact.estimated_mm,
            ..plain
        },
        None => plain,
    }
}

/// The benefit under all models together.
fn averaged(
    posteriors: &[(f64, Posterior)],
    fitted: &Fitted,
    tolerance: &Tolerance,
    readings: &LinearisedReadings,
) -> Option<Benefit> {
    let total: f64 = posteriors.iter().map(|(w, _)| w).sum();
    // Absent where there is nothing to average, such as models without a scale error where one is stated.
    let mean = |of: &dyn Fn(&Posterior) -> f64, only: &dyn Fn(&Posterior) -> bool| {
        let (mut sum, mut weight) = (0.0, 0.0);
        for (w, posterior) in posteriors.iter().filter(|(_, v)| only(v)) {
            sum += w * of(posterior);
            weight += w;
        }
        (weight > 0.0).then_some(sum / weight).filter(|mean| !mean.is_nan())
    };
    let size = |square: f64| square.max(0.0).sqrt();
    let any = &|_: &Posterior| true;
    let without_scale = &|v: &Posterior| v.scale.is_none() && v.law.is_none();
    let with_scale = |v: &Posterior| v.scale.is_some() && v.law.is_none();
    let without_law = |v: &Posterior| v.law.is_none();
    let share = |only: &dyn Fn(&Posterior) -> bool| {
        posteriors.iter().filter(|(_, v)| only(v)).map(|(w, _)| w).sum::<f64>() / total
    };
    let scale_error = || {
        let value = mean(&|v| v.scale.map_or(0.0, |s| s.0), &with_scale)?;
        let variance = mean(&|v| v.scale.map_or(0.0, |s| s.1 + (s.0 - value).powi(2)), &with_scale)?;
        Some(ScaleError {
            probability: share(&with_scale),
            value,
            sigma: variance.sqrt(),
            geometry_share: mean(&|v| v.geometry_share, &with_scale)?,
            estimated_mm: size(mean(&|v| v.estimated, &with_scale)?),
            nominal_mm: size(mean(&|v| v.nominal, &with_scale)?),
        })
    };
    let share_of = |law: SensorLaw| share(&|v| v.law == Some(law));
    let likeliest = (readings.laws.iter().map(|(law, _)| *law))
        .filter(|law| !law.is_objection() || share_of(*law) > 0.0)
        .max_by(|a, b| share_of(*a).total_cmp(&share_of(*b)));
    let law = likeliest.map(|kind| LawError {
        kind,
        probability: share(&|v| v.law.is_some()),
        benefit_without: mean(&|v| v.probability, &without_law),
        benefit_with: mean(&|v| v.probability, &|v| v.law.is_some()),
    });
    let shares = fitted.sigmas().into_iter().zip(&fitted.priors);
    let (estimated, probability) = (mean(&|v| v.estimated, any)?, mean(&|v| v.probability, any)?);
    let estimated_mm = size(estimated);
    Some(Benefit {
        nominal_mm: size(mean(&|v| v.nominal, any)?),
        estimated_mm,
        estimated_at_most_mm: estimated_mm,
        estimated_without_scale_mm: size(mean(&|v| v.estimated, without_scale).unwrap_or(estimated)),
        probability,
        probability_without_scale: mean(&|v| v.probability, without_scale).unwrap_or(probability),
        scale_stated: tolerance.scale.is_some(),
        scale: (!fits_scale(fitted)).then(scale_error).flatten().filter(|s| s.value.is_finite()),
        law,
        readings: readings.count,
        determined: shares.map(|(sigma, prior)| prior.determined_share(sigma * sigma)).sum(),
        parameters: fitted.parameters.len(),
        beyond_noise: None,
    })
}
