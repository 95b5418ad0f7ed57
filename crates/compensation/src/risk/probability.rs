//! The probability that a correction makes what it corrects worse.
//!
//! What is off by d (all coordinates of some points in one vector, mm) is corrected by the estimate of d. With P its error
//! covariance, it gets worse where the error along d exceeds half of it: with c = |d| and s² = dᵀ P d / c² the probability is
//! Φ(−c / 2s). P = J Σ Jᵀ follows from the covariance Σ of the arm's parameters, so s² needs the one vector Jᵀ d alone.

use nalgebra::DVector;

use truegrind_arm::estimated::Estimated;
use truegrind_math::tail::normal_two_sided;

/// What is off by less is not made worse by what is written (mm).
const NOTHING_MM: f64 = 5e-4;

/// Probability that what is off by `square` = |d|² (mm², of `points` points) gets worse, with `toward` = Jᵀ d.
pub(crate) fn chance(square: f64, toward: &DVector<f64>, knowledge: &Estimated, points: usize) -> f64 {
    if square <= NOTHING_MM * NOTHING_MM * points as f64 {
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
