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
//! A joint about which the residual scatters (`joint_scatter`) is off by as much in programs, but by no known function of its angle. A harmonic
//! of that joint with size 0 stands for it, sine and cosine of the variance s² each, so that the joint is off by s at every pose.
//!
//! Source: Hoeting, Madigan, Raftery and Volinsky 1999, Bayesian model averaging: a tutorial (variance of a mixture of models).

use nalgebra::{DMatrix, DVector};

use super::extension::{Extended, filled};
use super::joint_scatter::JointScatter;
use super::selection::contains_cause;
use truegrind_arm::effect::Effect;
use truegrind_arm::effect::harmonic::Harmonic;
use truegrind_arm::estimated::{Estimated, EstimatedParameter};
use truegrind_arm::parameter::Parameter;

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

/// Adds a joint about which the residual scatters to an arm, for its covariance alone.
pub(super) fn add_joint_scatter(estimated: &mut Estimated, scatter: &JointScatter) {
    let (joint, sigma) = (scatter.joint, scatter.sigma_rad);
    let effect = Effect::GearEccentricity(Harmonic { joint, order: 1.0, sine_rad: 0.0, cosine_rad: 0.0 });
    let (index, first) = (estimated.model.effects.len(), estimated.order.len());
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
