//! Singular values and eigenvalues with a bounded number of iterations: without a limit nalgebra's iteration does not
//! terminate for non-finite numbers.

use nalgebra::{DMatrix, Dyn, Matrix6, SVD, SymmetricEigen, U6, Vector6};

/// Iteration limit per row; some two or three are needed.
const MAX_STEPS: usize = 200;

/// Tolerance of nalgebra's own iterations.
const PRECISION: f64 = 5.0 * f64::EPSILON;

/// Singular values, largest first; `None` for a matrix that is not finite.
///
/// ```
/// use nalgebra::{Matrix6, Vector6};
/// use truegrind_math::spectral::singular_values;
///
/// let lengths = Vector6::new(3.0, -7.0, 1.0, 0.5, 2.0, 4.0);
/// let found = singular_values(&Matrix6::from_diagonal(&lengths)).ok_or("finite")?;
/// assert!((found.max() - 7.0).abs() < 1e-12 && (found.min() - 0.5).abs() < 1e-12);
/// assert!(singular_values(&Matrix6::from_diagonal(&lengths).map(|_| f64::NAN)).is_none());
/// # Ok::<(), &str>(())
/// ```
pub fn singular_values(matrix: &Matrix6<f64>) -> Option<Vector6<f64>> {
    svd(matrix, false).map(|found| found.singular_values)
}

/// Singular values, largest first, and with `directions` the rows of Vᵀ; `None` for a matrix that is not finite.
pub fn svd(matrix: &Matrix6<f64>, directions: bool) -> Option<SVD<f64, U6, U6>> {
    if !matrix.iter().all(|v| v.is_finite()) {
        return None;
    }
    SVD::try_new(*matrix, false, directions, PRECISION, 6 * MAX_STEPS)
}

/// Eigenvalues and eigenvectors of a symmetric matrix; `None` for one that is not finite.
pub fn symmetric_eigen(matrix: DMatrix<f64>) -> Option<SymmetricEigen<f64, Dyn>> {
    if !matrix.iter().all(|v| v.is_finite()) {
        return None;
    }
    let most = MAX_STEPS * matrix.nrows().max(1);
    SymmetricEigen::try_new(matrix, f64::EPSILON, most)
}
