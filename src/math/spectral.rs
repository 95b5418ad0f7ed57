//! Singular values of small matrices in a bounded number of steps, whatever the numbers are: the iteration of the library
//! never ends on one that is not finite unless it is told when.

use nalgebra::{Matrix6, SVD, U6, Vector6};

/// Steps after which an iteration is given up; a 6 × 6 matrix takes some twenty.
pub const MOST_STEPS: usize = 1_000;

/// What the library's own iterations stop at.
const PRECISION: f64 = 5.0 * f64::EPSILON;

/// Singular values, largest first; `None` for a matrix that is not finite.
pub fn singular_values(matrix: &Matrix6<f64>) -> Option<Vector6<f64>> {
    decomposed(matrix, false).map(|svd| svd.singular_values)
}

/// Singular values, largest first, and with `directions` the rows of Vᵀ; `None` for a matrix that is not finite.
pub fn decomposed(matrix: &Matrix6<f64>, directions: bool) -> Option<SVD<f64, U6, U6>> {
    if !matrix.iter().all(|v| v.is_finite()) {
        return None;
    }
    SVD::try_new(*matrix, false, directions, PRECISION, MOST_STEPS)
}
