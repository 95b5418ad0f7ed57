//! Whether fitting causes of the measurement with the arm improves the arm.
//!
//! Such causes compete with the links for the same part of the readings. With x the arm fitted with them, C its covariance and x₀
//! the arm fitted without, the arm is worse with them if the true arm is nearer to x₀ in shape (up to motions of base and target).
//! With δ = x − x₀ and M as in `benefit`, the probability of that is
//!
//! Φ(−½ δᵀMδ / √(δᵀM C Mδ)),
//!
//! since the projection of the error on δ is normal. The same rule decides whether a cut is corrected (`truegrind-compensation`,
//! `probability`).

use super::extension::Extended;
use crate::identification::fit::Fitted;
use crate::identification::shape_metric::shape_metric;
use truegrind_arm::condition::Condition;
use truegrind_arm::region::Region;
use truegrind_math::tail::normal_cdf;

/// Largest probability of a worse arm up to which the written arm is fitted with the causes of the measurement.
pub(super) const MAX_PROBABILITY: f64 = 0.02;

/// How far an arm fitted with causes of the measurement is from the same one fitted without.
pub(super) struct Apart {
    /// The probability that the one without is nearer in shape to the true arm.
    pub(super) probability_worse: f64,
    /// How far their shapes are apart over the region: √(δᵀMδ) (mm RMS).
    pub(super) shape_mm: f64,
}

/// Compares the arm of `with` and that of `without`, which has the same parameters; `None` if that cannot be computed.
pub(super) fn apart(
    with: &Extended,
    without: &Extended,
    condition: &Condition,
    region: &Region,
) -> Option<Apart> {
    let weights = shape_metric(&Fitted::from(with), condition, region)?;
    let covariance = with.estimate.covariance.as_ref()?;
    let apart = nalgebra::DVector::from_fn(with.x.len(), |k, _| with.x[k] - without.x[k]);
    let along = &weights * &apart;
    let variance = along.dot(&(covariance * &along));
    let square = along.dot(&apart);
    let probability_worse = normal_cdf(-0.5 * square / variance.sqrt());
    probability_worse.is_finite().then(|| Apart { probability_worse, shape_mm: square.max(0.0).sqrt() })
}
