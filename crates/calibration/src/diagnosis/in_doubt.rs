//! What a written arm owes to causes that were found and are not certain.
//!
//! Such causes move no program (`written`), and yet they may well be there: the links that were fitted without them have taken up
//! what they could of them, and the rest is missing. With x₀ the parameters that are written, these causes at size 0, and x₁, C₁ those
//! of the fit that has them, the error of what is written has the second moment
//!
//! E (x − x₀)(x − x₀)ᵀ = C₁ + (x₁ − x₀)(x₁ − x₀)ᵀ.
//!
//! It is that of an average over both fits about a mean that is not its own, all weight on the one that has the causes: each was
//! accepted because the rows speak against an arm without it, and what is in doubt is its name. What links and causes move
//! together stands in the difference, so that at the measured poses it comes to no more than what the causes explain there.
//!
//! Errors of the arm that no model of it carries (a spring that is not linear, an error of two joints) are told as such, but the arm has
//! no place for them. There the best rival that an arm can carry stands for them: it says the same of the rows, nearly.
//!
//! Source: Hoeting, Madigan, Raftery and Volinsky 1999, Bayesian model averaging: a tutorial (variance of a mixture of models).

use nalgebra::DVector;

use super::cause::Cause;
use super::extension::{Extended, filled};
use super::selection::{Accepted, already};
use super::written::is_beyond_an_arm;

/// All that was found and that an arm can carry, with what the measurement suffered. `accepted` are the judgements of the causes, as far
/// as they were searched.
pub(super) fn all(causes: &[Cause], accepted: &[Accepted]) -> Vec<Cause> {
    let mut out: Vec<Cause> = causes.iter().filter(|cause| !is_beyond_an_arm(cause)).cloned().collect();
    for (cause, judged) in causes.iter().zip(accepted) {
        if !is_beyond_an_arm(cause) {
            continue;
        }
        let rivals = judged.rivals.iter().filter(|rival| rival.score.merit > 0.0);
        let mut carried = rivals.map(|rival| &rival.candidate.cause).filter(|c| matches!(c, Cause::Arm(_)));
        out.extend(carried.find(|rival| !already(&out, rival)).cloned());
    }
    out
}

/// The arm of `written` beside the causes that `with` has more, at size 0, under the covariance of the module page.
pub(super) fn beside(written: &Extended, with: Extended) -> Extended {
    let mut from: Vec<Option<usize>> = with
        .parameters
        .iter()
        .map(|p| written.parameters.iter().position(|q| q == p).filter(|_| !p.is_of_cause()))
        .collect();
    for (k, cause) in with.causes.iter().enumerate() {
        let same = written.causes.iter().position(|other| already(std::slice::from_ref(other), cause));
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
