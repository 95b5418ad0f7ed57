//! Covariance of the written arm that accounts for uncertain causes.
//!
//! Uncertain causes move no program (`written_model`), but they are probably real: the links fitted without them have absorbed part of
//! them, and the rest is missing. With x₀ the written parameters, these causes at size 0, and x₁, C₁ those of the fit with them, the
//! error of the written arm has the second moment
//!
//! E (x − x₀)(x − x₀)ᵀ = C₁ + (x₁ − x₀)(x₁ − x₀)ᵀ.
//!
//! This is model averaging about x₀ with all weight on the fit with the causes: each was accepted because the data reject an arm
//! without it; only its name is uncertain. The difference x₁ − x₀ includes the compensating changes of links and causes, so that at
//! the measured poses it is no more than the causes explain there.
//!
//! Most empirical faults of the arm are effects that a model file has. Of an axis that wobbles the best rival that a file can carry represents
//! it: it explains nearly the same of the rows.
//!
//! What that rival leaves is missing too: without a rival, all that the links have not absorbed. It is known from the fit that has it, but
//! not as a function that a file can carry. A harmonic of its joint with size 0 stands for it, sine and cosine of the variance s² each, so
//! that the joint is off by s at every pose. s is such that, beside the frames, the readings of the rows differ by as much as they do by
//! the missing part, root mean square.
//!
//! A joint about which the residual scatters (`joint_scatter`) is off by as much in programs; the same harmonic stands for it.
//!
//! Source: Hoeting, Madigan, Raftery and Volinsky 1999, Bayesian model averaging: a tutorial (variance of a mixture of models).

use nalgebra::{DMatrix, DVector};

use super::catalogue::Candidate;
use super::cause::Cause;
use super::design::Linear;
use super::extension::{Extended, Subject, filled};
use super::joint_scatter::JointScatter;
use super::selection::{Accepted, contains_cause};
use super::written_model::has_no_model_representation;
use truegrind_arm::effect::Effect;
use truegrind_arm::effect::harmonic::Harmonic;
use truegrind_arm::estimated::{Estimated, EstimatedParameter};
use truegrind_arm::parameter::Parameter;

/// All causes that a model file can represent, and those of the measurement; empirical faults of the arm are replaced by their best
/// representable rivals. `accepted` are the scores of the causes.
pub(super) fn representable_causes(causes: &[Cause], accepted: &[Accepted]) -> Vec<Cause> {
    let mut out: Vec<Cause> =
        causes.iter().filter(|cause| !has_no_model_representation(cause)).cloned().collect();
    for (cause, judged) in causes.iter().zip(accepted) {
        if !has_no_model_representation(cause) {
            continue;
        }
        if let Some(stand_in) = cause.stand_in() {
            out.extend(Some(stand_in).filter(|stand_in| !contains_cause(&out, stand_in)));
            continue;
        }
        let rivals = judged.rivals.iter().filter(|rival| rival.score.merit > 0.0);
        let mut carried = rivals.map(|rival| &rival.candidate.cause).filter(|c| matches!(c, Cause::Arm(_)));
        out.extend(carried.find(|rival| !contains_cause(&out, rival)).cloned());
    }
    out
}

/// The arm of `written_model` extended by the further causes of `with` at size 0, with the covariance of the module documentation.
pub(super) fn with_zero_causes(written: &Extended, with: Extended) -> Extended {
    let stations = written.frames.further_stations();
    let is_of_cause = |p: &Parameter| match *p {
        Parameter::Disturbance { index, .. } => index >= stations,
        _ => p.is_of_cause(),
    };
    let mut from: Vec<Option<usize>> = with
        .parameters
        .iter()
        .map(|p| written.parameters.iter().position(|q| q == p).filter(|_| !is_of_cause(p)))
        .collect();
    for (k, cause) in with.causes.iter().enumerate() {
        let same = written.causes.iter().position(|other| contains_cause(std::slice::from_ref(other), cause));
        let there = same.map(|same| written.parameter_indices(same)).unwrap_or_default();
        for (place, there) in with.parameter_indices(k).into_iter().zip(there) {
            from[place] = Some(there);
        }
    }
    let x: Vec<f64> = from.iter().map(|from| from.map_or(0.0, |k| written.x[k])).collect();
    let missing = DVector::from_fn(x.len(), |k, _| with.x[k] - x[k]);
    let (model, frames) = with.problem.apply(&x);
    let mut estimate = with.estimate.clone();
    estimate.covariance = estimate.covariance.map(|own| own + &missing * missing.transpose());
    estimate.x.clone_from(&x);
    Extended { causes: filled(&with.causes, &model, &frames), x, model, frames, estimate, ..with }
}

/// A joint error without a representation in a model file: the harmonic of size 0 that stands for it, and the standard deviation of its
/// sine and cosine (rad).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct MissingError {
    harmonic: Harmonic,
    sigma: f64,
}

impl MissingError {
    /// Of a joint about which the residual scatters.
    pub(super) fn scatter(scatter: &JointScatter) -> Self {
        let harmonic = Harmonic { joint: scatter.joint, order: 1.0, sine_rad: 0.0, cosine_rad: 0.0 };
        Self { harmonic, sigma: scatter.sigma_rad }
    }

    /// The joint (0-based).
    pub(super) fn joint(&self) -> usize {
        self.harmonic.joint
    }
}

/// The joint errors of `extended` that the arm of `handed` lacks and its covariance does not contain yet.
pub(super) fn missing_errors(
    subject: &Subject<'_>,
    extended: &Extended,
    handed: &Extended,
) -> Vec<MissingError> {
    let causes: Vec<(&Cause, usize)> =
        extended.causes.iter().filter_map(|cause| Some((cause, joint_without_file(cause)?))).collect();
    if causes.is_empty() {
        return Vec::new();
    }
    let linear = Linear::of(subject, handed);
    let left = |cause: &Cause| {
        let columns =
            Candidate::of(cause, subject).columns_of(&linear.slopes, (linear.observations, linear.per));
        linear.unabsorbed(&(columns * DVector::from_vec(cause.values())))
    };
    let left: Vec<DVector<f64>> = causes.iter().map(|(cause, _)| left(cause)).collect();
    // Several can be one error: what they add up to is shared out.
    let alone: f64 = left.iter().map(DVector::norm_squared).sum();
    let together =
        left.iter().fold(DVector::zeros(linear.residual.len()), |sum, one| sum + one).norm_squared();
    let of_the_arm: Vec<usize> =
        (0..handed.parameters.len()).filter(|&k| handed.parameters[k].is_of_arm()).collect();
    let frames = linear.design(&of_the_arm);
    let of_one = |(left, (_, joint)): (&DVector<f64>, &(&Cause, usize))| {
        let harmonics = ORDERS.map(|order| {
            let harmonic = Harmonic { joint: *joint, order, sine_rad: 0.0, cosine_rad: 0.0 };
            let cause = Cause::Arm(Effect::GearEccentricity(harmonic.clone()));
            let columns = Candidate::of(&cause, subject).columns(&frames);
            (harmonic, frames.project(&columns).information.trace())
        });
        // That which the frames absorb least.
        let (harmonic, size) = harmonics.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        let sigma = (left.norm_squared() / size * together / alone).sqrt();
        sigma.is_finite().then_some(MissingError { harmonic, sigma })
    };
    left.iter().zip(&causes).filter_map(of_one).collect()
}

/// Orders of a harmonic that stands for a missing error: the orders of the errors themselves.
const ORDERS: [f64; 2] = [1.0, 2.0];

/// The joint (0-based) of a cause of the arm that no model file can represent, or of what stands in for it.
fn joint_without_file(cause: &Cause) -> Option<usize> {
    if !has_no_model_representation(cause) || cause.effect().is_some() {
        return None;
    }
    match cause.stand_in() {
        Some(stand_in) => stand_in.joints().first().copied(),
        None => cause.joints().first().copied(),
    }
}

/// Adds missing joint errors to an arm, for its covariance alone.
pub(super) fn add_missing_errors(estimated: &mut Estimated, missing: Vec<MissingError>) {
    for MissingError { harmonic, sigma } in missing {
        let index = estimated.model.effects.len();
        let effect = Effect::GearEccentricity(harmonic);
        let first = estimated.order.len();
        for (parameter, named) in effect.parameters().into_iter().enumerate() {
            let of_effect = Parameter::Effect { index, parameter };
            estimated.order.push(of_effect);
            estimated.parameters.push(EstimatedParameter {
                name: of_effect.to_string(),
                unit: named.unit.to_owned(),
                nominal: 0.0,
                value: 0.0,
                sigma,
                prior_sigma: None,
                determined: 0.0,
            });
        }
        let all = estimated.order.len();
        let own = std::mem::replace(&mut estimated.covariance, DMatrix::zeros(0, 0));
        estimated.covariance = own.resize(all, all, 0.0);
        (first..all).for_each(|k| estimated.covariance[(k, k)] = sigma * sigma);
        estimated.model.effects.push(effect);
    }
}
