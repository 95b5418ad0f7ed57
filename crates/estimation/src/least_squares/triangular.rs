//! The triangular factor of a tall Jacobian, computed without storing the Jacobian.
//!
//! **Method.** Tall-skinny QR: each block of rows [J | r] is reduced to a triangle by Householder reflections,
//! and the triangles are stacked and reduced again, in order. The last triangle [R c; 0 ρ] has RᵀR = JᵀJ, Rᵀc =
//! Jᵀr and ‖c‖² + ρ² = ‖r‖². Unlike the normal equations it preserves all digits of J, so that the rank can be
//! determined from it.
//!
//! **Shapes.** J is n × p, R is p × p upper triangular (diagonal of either sign), c has p entries. Memory is
//! one triangle for each block of some 1500 rows.
//!
//! **Source.** Demmel, Grigori, Hoemmen, Langou, "Communication-optimal parallel and sequential QR and LU
//! factorizations", SIAM J. Sci. Comput. 34 (2012). The factorisation of a block is faer's.
//!
//! **Checked against** the normal equations and the singular values of the whole Jacobian, for any number of
//! threads.

use faer::Mat;
use nalgebra::{DMatrix, DVector};

use crate::objective::Objective;
use crate::problem::{Problem, map_chunks};

/// R, c and ρ of a linearised problem: ‖J h + r‖² = ‖R h + c‖² + ρ².
#[derive(Debug, Clone, PartialEq)]
pub struct TriangularFactor {
    /// R, p × p, upper triangular.
    pub r: DMatrix<f64>,
    /// c = Qᵀ r, p entries.
    pub rhs: DVector<f64>,
    /// ρ: length of the part of the residual vector that no step can change, to first order.
    pub remainder: f64,
}

impl TriangularFactor {
    /// ½ ‖r‖².
    pub fn cost(&self) -> f64 {
        0.5 * (self.rhs.norm_squared() + self.remainder * self.remainder)
    }

    /// Whether every entry is a finite number.
    pub fn is_finite(&self) -> bool {
        self.remainder.is_finite() && self.r.iter().chain(self.rhs.iter()).all(|v| v.is_finite())
    }

    /// (RᵀR)⁻¹, or `None` where R is singular to working precision.
    pub fn covariance(&self) -> Option<DMatrix<f64>> {
        let p = self.r.ncols();
        let threshold = 64.0 * p as f64 * f64::EPSILON;
        let regular = |(k, column): (usize, nalgebra::DVectorView<'_, f64>)| {
            column[k].abs() > threshold * column.norm()
        };
        if !self.r.column_iter().enumerate().all(regular) {
            return None;
        }
        let inverse = self.r.clone().try_inverse()?;
        let covariance = &inverse * inverse.transpose();
        covariance.iter().all(|v| v.is_finite()).then_some(covariance)
    }

    pub(crate) fn of_objective(objective: &mut Objective<'_>, x: &[f64]) -> Self {
        objective.evaluations.jacobians += objective.problem.rows() as u64;
        let rows = triangle_of_rows(objective.problem, x);
        let p = x.len();
        let with_prior =
            objective.priors.iter().zip(x).enumerate().filter(|(_, (prior, _))| prior.sigma.is_finite());
        let prior_rows: Vec<(usize, f64, f64)> = with_prior
            .map(|(k, (prior, x))| (k, 1.0 / prior.sigma, (x - prior.mean) / prior.sigma))
            .collect();
        let mut stacked = DMatrix::zeros(rows.nrows() + prior_rows.len(), p + 1);
        stacked.rows_mut(0, rows.nrows()).copy_from(&rows);
        for (i, (k, weight, residual)) in prior_rows.into_iter().enumerate() {
            stacked[(rows.nrows() + i, k)] = weight;
            stacked[(rows.nrows() + i, p)] = residual;
        }
        Self::from_triangle(&triangle(stacked), p)
    }

    fn from_triangle(triangle: &DMatrix<f64>, p: usize) -> Self {
        let mut full = DMatrix::zeros(p + 1, p + 1);
        full.rows_mut(0, triangle.nrows()).copy_from(triangle);
        Self {
            r: full.view((0, 0), (p, p)).into_owned(),
            rhs: full.view((0, p), (p, 1)).column(0).into_owned(),
            remainder: full[(p, p)],
        }
    }
}

/// The triangular factor of the Jacobian at `x` with column k multiplied by `scale[k]` (priors not included): pass prior
/// sigmas to compare the information of the data with that of the priors, or ones for the plain factor.
///
/// # Panics
/// If `x` or `scale` does not have one entry for each parameter.
pub fn triangular_factor(problem: &dyn Problem, x: &[f64], scale: &[f64]) -> TriangularFactor {
    let p = problem.parameters();
    assert!(x.len() == p && scale.len() == p, "x and scale must have one entry for each parameter");
    let mut factor = TriangularFactor::from_triangle(&triangle_of_rows(problem, x), p);
    for (mut column, s) in factor.r.column_iter_mut().zip(scale) {
        column *= *s;
    }
    factor
}

/// The triangle of [J | r] over all rows, at most (p + 1) × (p + 1).
fn triangle_of_rows(problem: &dyn Problem, x: &[f64]) -> DMatrix<f64> {
    let p = x.len();
    let parts = map_chunks(problem, |rows| {
        let n = rows.len();
        let mut block = DMatrix::zeros(n, p + 1);
        let (jacobian, residuals) = block.as_mut_slice().split_at_mut(n * p);
        problem.jacobian(x, rows, residuals, jacobian);
        triangle(block)
    });
    let mut parts = parts.into_iter();
    let Some(first) = parts.next() else { return DMatrix::zeros(0, p + 1) };
    parts.fold(first, |above, below| {
        let mut stacked = DMatrix::zeros(above.nrows() + below.nrows(), p + 1);
        stacked.rows_mut(0, above.nrows()).copy_from(&above);
        stacked.rows_mut(above.nrows(), below.nrows()).copy_from(&below);
        triangle(stacked)
    })
}

/// Upper triangle (min(n, p) × p) of a QR factorisation.
fn triangle(block: DMatrix<f64>) -> DMatrix<f64> {
    let (n, p) = block.shape();
    let size = n.min(p);
    let matrix = Mat::<f64>::from_fn(n, p, |i, j| block[(i, j)]);
    let qr = matrix.qr();
    let r = qr.thin_R();
    DMatrix::from_fn(size, p, |i, j| if i <= j { r[(i, j)] } else { 0.0 })
}
