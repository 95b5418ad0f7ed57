//! Rank, condition and null space of a least-squares problem, from its triangular factor.
//!
//! **Method.** The singular value decomposition R = U Σ Vᵀ gives rank, condition number and, as the last columns of V,
//! the combinations of parameters that the data do not determine. It acts on R (p × p), since R and the Jacobian have the
//! same singular values and right singular vectors.
//!
//! **Shapes.** R is p × p; `right_vectors` holds one direction in each column, strongest first.
//!
//! **Source.** Golub and Van Loan, *Matrix Computations*, 4th ed., §2.4 and §5.5. The scaling of the columns
//! determines which singular values are small: scale by prior sigmas or by column norms first, so that the result does
//! not depend on units.
//!
//! **Checked against** matrices made with a known null space, and a regression with a duplicated column.

use faer::Mat;
use nalgebra::DMatrix;

/// Identifiability of the parameters of a triangular factor.
#[derive(Debug, Clone, PartialEq)]
pub struct RankAnalysis {
    /// Number of singular values above the threshold.
    pub rank: usize,
    /// Largest singular value over the smallest; infinite for an exactly singular matrix.
    pub condition: f64,
    /// Singular values, largest first, p entries.
    pub singular_values: Vec<f64>,
    /// Right singular vectors, p × p, one column for each singular value.
    pub right_vectors: DMatrix<f64>,
}

impl RankAnalysis {
    /// Null space (unit columns, p × (p − rank)): directions in which the parameters can change without changing the residuals.
    pub fn null_space(&self) -> DMatrix<f64> {
        let p = self.right_vectors.ncols();
        self.right_vectors.columns(self.rank, p - self.rank).into_owned()
    }
}

/// Rank analysis of an upper triangular (or any) factor with p columns and at most p rows. Singular values
/// below `tolerance` times the largest count as zero; without a tolerance p·ε is used, which finds exact dependence
/// only. `None` if the factor is not finite.
pub fn analyse(r: &DMatrix<f64>, tolerance: Option<f64>) -> Option<RankAnalysis> {
    let p = r.ncols();
    if p == 0 || !r.iter().all(|v| v.is_finite()) {
        return None;
    }
    // Rows of zeros make a wide factor square without changing its null space.
    let entry = |i: usize, j: usize| if i < r.nrows() { r[(i, j)] } else { 0.0 };
    let matrix = Mat::<f64>::from_fn(p.max(r.nrows()), p, entry);
    let svd = matrix.thin_svd().ok()?;
    let singular_values: Vec<f64> = (0..p).map(|k| svd.S().column_vector()[k]).collect();
    let right_vectors = DMatrix::from_fn(p, p, |i, j| svd.V()[(i, j)]);
    let (largest, smallest) = (singular_values[0], singular_values[p - 1]);
    let threshold = tolerance.unwrap_or(p as f64 * f64::EPSILON) * largest;
    let rank = singular_values.iter().filter(|s| **s > threshold).count();
    let condition = if smallest > 0.0 { largest / smallest } else { f64::INFINITY };
    Some(RankAnalysis { rank, condition, singular_values, right_vectors })
}
