//! The probability that a correction increases the deviation that it is meant to remove.
//!
//! Let d be the deviation (all coordinates of the assessed points in one vector, mm) and P the covariance of its estimate. The
//! correction does harm where the error along d exceeds half of d: with c = |d| and s² = dᵀ P d / c², the probability is
//! Φ(−c / 2s). P = J Σ Jᵀ follows from the covariance Σ of the arm's parameters, so s² needs only the vector Jᵀ d.

use nalgebra::DVector;

use truegrind_arm::estimated::Estimated;
use truegrind_math::tail::normal_two_sided;

/// Deviations below this are zero as far as a program can express them (mm).
const ZERO_DEVIATION_MM: f64 = 5e-4;

/// Probability that correcting a deviation does harm: `square` = |d|² (mm², summed over `points` points), `toward` = Jᵀ d.
pub(crate) fn probability_of_harm(
    square: f64,
    toward: &DVector<f64>,
    knowledge: &Estimated,
    points: usize,
) -> f64 {
    if square <= ZERO_DEVIATION_MM * ZERO_DEVIATION_MM * points as f64 {
        return 0.0;
    }
    let variance = toward.dot(&(&knowledge.covariance * toward));
    if !variance.is_finite() {
        return 1.0;
    }
    if variance <= 0.0 {
        return 0.0;
    }
    // c / 2s = |d|² / (2 √(dᵀ P d)).
    0.5 * normal_two_sided(0.5 * square / variance.sqrt())
}
