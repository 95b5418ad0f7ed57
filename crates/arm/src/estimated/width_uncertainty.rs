//! Uncertain widths of the manufacturing tolerances, and the components of the mixture that follows from them (`posterior`).

use nalgebra::{DMatrix, DVector, Matrix3, SymmetricEigen, Vector3};
use serde::{Deserialize, Serialize};

/// How uncertain the widths of the manufacturing tolerances are: ln (width / assumed width) ~ N(mean, covariance), for lengths,
/// twists and joint zeros.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WidthUncertainty {
    /// Mean of the logarithms.
    pub log_mean: [f64; 3],
    /// Their covariance, row by row.
    pub log_covariance: [[f64; 3]; 3],
}

/// A normal distribution of the arm's parameters, one of a mixture.
#[derive(Debug, Clone, PartialEq)]
pub struct PosteriorComponent {
    /// Its share of the mixture; the shares add up to 1.
    pub weight: f64,
    /// Its mean less the estimate, in the order of the covariance (mm, rad).
    pub shift: DVector<f64>,
    /// Its covariance (mm, rad).
    pub covariance: DMatrix<f64>,
}

impl WidthUncertainty {
    /// Points and equal weights that stand for N(mean, covariance).
    pub(super) fn points(&self) -> [Vector3<f64>; 6] {
        let covariance = Matrix3::from_fn(|i, j| self.log_covariance[i][j]);
        let axes = SymmetricEigen::new(covariance);
        let mean = Vector3::from(self.log_mean);
        std::array::from_fn(|k| {
            let reach = (3.0 * axes.eigenvalues[k / 2].max(0.0)).sqrt();
            mean + axes.eigenvectors.column(k / 2) * if k % 2 == 0 { reach } else { -reach }
        })
    }
}
