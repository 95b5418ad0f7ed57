//! Covariance of the written arm that accounts for uncertain causes.
//!
//! Uncertain causes move no program (`written`), but they are probably real: the links fitted without them have absorbed part of
//! them, and the rest is missing. With x₀ the written parameters, these causes at size 0, and x₁, C₁ those of the fit with them, the
//! error of the written arm has the second moment
//!
//! E (x − x₀)(x − x₀)ᵀ = C₁ + (x₁ − x₀)(x₁ − x₀)ᵀ.
//!
//! This is model averaging about x₀ with all weight on the fit with the causes: each was accepted because the data reject an arm
//! without it; only its name is uncertain. The difference x₁ − x₀ includes the compensating changes of links and causes, so that at
//! the measured poses it is no more than the causes explain there.
//!
//! Empirical faults of the arm (nonlinear stiffness, two-joint gear errors) have no representation in a model file. The best rival
//! that has one represents them: it explains nearly the same of the rows.
//!
//! Source: Hoeting, Madigan, Raftery and Volinsky 1999, Bayesian model averaging: a tutorial (variance of a mixture of models).

use nalgebra::DVector;

use super::cause::Cause;
use super::extension::{Extended, filled};
use super::selection::{Accepted, contains_cause};
use super::written::has_no_model_representation;

/// All causes that a model file can represent, and those of the measurement; empirical faults of the arm are replaced by their best
/// representable rivals. `accepted` are the scores of the causes.
pub(super) fn representable_causes(causes: &[Cause], accepted: &[Accepted]) -> Vec<Cause> {
    let mut out: Vec<Cause> =
        causes.iter().filter(|cause| !has_no_model_representation(cause)).cloned().collect();
    for (cause, judged) in causes.iter().zip(accepted) {
        if !has_no_model_representation(cause) {
            continue;
        }
        let rivals = judged.rivals.iter().filter(|rival| rival.score.merit > 0.0);
        let mut carried = rivals.map(|rival| &rival.candidate.cause).filter(|c| matches!(c, Cause::Arm(_)));
        out.extend(carried.find(|rival| !contains_cause(&out, rival)).cloned());
    }
    out
}

/// The arm of `written` extended by the further causes of `with` at size 0, with the covariance of the module documentation.
pub(super) fn with_zero_causes(written: &Extended, with: Extended) -> Extended {
    let mut from: Vec<Option<usize>> = with
        .parameters
        .iter()
        .map(|p| written.parameters.iter().position(|q| q == p).filter(|_| !p.is_of_cause()))
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
