//! The probability that a correction increases the deviation that it is meant to remove.
//!
//! Let d be the correction: the estimated deviation, all coordinates of the assessed points in one vector (mm). It does harm where the
//! true deviation δ is nearer to 0 than to d: d·δ < |d|²/2. The posterior of the arm's parameters is a mixture of normal distributions
//! (`PosteriorComponent`): given one of them, with covariance Σ and mean shifted by μ, d·δ is normal with mean |d|² + (Jᵀd)·μ and
//! variance (Jᵀd)ᵀ Σ (Jᵀd), so that only the vector Jᵀd is needed. Errors that the model does not contain add their own variance along d
//! (`beyond_noise`).

use nalgebra::DVector;

use truegrind_arm::estimated::PosteriorComponent;
use truegrind_math::tail::normal_two_sided;

/// Deviations below this are zero as far as a program can express them (mm).
const ZERO_DEVIATION_MM: f64 = 5e-4;

/// Probability that correcting a deviation does harm: `square` = |d|² (mm², summed over `points` points), `toward` = Jᵀ d,
/// `beyond` the variance of d·e by the errors e beyond the noise (mm⁴).
pub(crate) fn probability_of_harm(
    square: f64,
    toward: &DVector<f64>,
    beyond: f64,
    posterior: &[PosteriorComponent],
    points: usize,
) -> f64 {
    if square <= ZERO_DEVIATION_MM * ZERO_DEVIATION_MM * points as f64 {
        return 0.0;
    }
    let given = |component: &PosteriorComponent| {
        let variance = toward.dot(&(&component.covariance * toward)) + beyond;
        let margin = 0.5 * square + toward.dot(&component.shift);
        if !variance.is_finite() || !margin.is_finite() {
            return 1.0;
        }
        if variance <= 0.0 {
            return if margin < 0.0 { 1.0 } else { 0.0 };
        }
        let tail = 0.5 * normal_two_sided(margin.abs() / variance.sqrt());
        if margin < 0.0 { 1.0 - tail } else { tail }
    };
    posterior.iter().map(|component| component.weight * given(component)).sum()
}
