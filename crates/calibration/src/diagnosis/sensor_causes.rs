//! Whether the causes of the measurement that were fitted beside an arm make a better arm.
//!
//! Such causes are found in readings, and what they explain there is theirs or the links'. With x the arm fitted beside them, C its
//! covariance and x₀ the arm fitted without, the shape (apart from motions of base and target) is worse beside them than without where the
//! true arm lies nearer to x₀. With δ = x − x₀ and M as in `benefit`, the probability of that is
//!
//! Φ(−½ δᵀMδ / √(δᵀM C Mδ)),
//!
//! since the projection of the error on δ is normal. It is the rule by which a cut is corrected or left (`truegrind-compensation`,
//! `probability`), here for the arm itself.

use super::extension::Extended;
use crate::identification::benefit::{normal_cdf, shape_metric};
use crate::identification::fit::Fitted;
use truegrind_arm::condition::Condition;

/// The largest probability of a worse arm with which causes of the measurement stand beside the arm that is written.
pub(super) const MOST: f64 = 0.02;

/// The probability that the arm of `without` is nearer in shape to the true one than that of `with`, which has the same parameters;
/// `None` where nothing says so.
pub(super) fn chance_worse(
    with: &Extended,
    without: &Extended,
    condition: &Condition,
    samples_deg: &[[f64; 6]],
) -> Option<f64> {
    let weights = shape_metric(&Fitted::from(with), condition, samples_deg)?;
    let covariance = with.estimate.covariance.as_ref()?;
    let apart = nalgebra::DVector::from_fn(with.x.len(), |k, _| with.x[k] - without.x[k]);
    let along = &weights * &apart;
    let variance = along.dot(&(covariance * &along));
    let chance = normal_cdf(-0.5 * along.dot(&apart) / variance.sqrt());
    chance.is_finite().then_some(chance)
}
