//! Cholesky factors of matrices whose rows have different units, in blocks where they are large.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::{MatMut, MatRef, Par};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Above this number of columns products and factors run in blocks.
pub(super) const MANY_COLUMNS: usize = 90;

/// A Cholesky factor of a matrix that was scaled to a unit diagonal.
pub(super) struct ScaledCholesky {
    factor: Cholesky<f64, Dyn>,
    size: DVector<f64>,
}

impl ScaledCholesky {
    pub(super) fn solve(&self, right: &DVector<f64>) -> DVector<f64> {
        self.factor.solve(&right.component_mul(&self.size)).component_mul(&self.size)
    }

    pub(super) fn inverse(&self) -> DMatrix<f64> {
        let n = self.size.len();
        let unit = if n > MANY_COLUMNS { blocked_inverse(&self.factor) } else { self.factor.inverse() };
        DMatrix::from_fn(unit.nrows(), unit.ncols(), |i, j| unit[(i, j)] * self.size[i] * self.size[j])
    }
}

/// Cholesky factor and log determinant, of the matrix scaled to a unit diagonal since mm and rad differ by orders of
/// magnitude.
pub(super) fn factorise(matrix: &DMatrix<f64>) -> Option<(ScaledCholesky, f64)> {
    let size = DVector::from_fn(matrix.nrows(), |k, _| matrix[(k, k)].sqrt().recip());
    if size.iter().any(|s| !s.is_finite()) {
        return None;
    }
    let mut unit =
        DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)] * size[i] * size[j]);
    let factor = if unit.nrows() > MANY_COLUMNS {
        cholesky_in_place(&mut unit).then(|| Cholesky::pack_dirty(unit))?
    } else {
        Cholesky::new(unit)?
    };
    let determinant: f64 = factor.l_dirty().diagonal().iter().map(|v| 2.0 * v.ln()).sum();
    let scaling: f64 = size.iter().map(|s| 2.0 * s.ln()).sum();
    Some((ScaledCholesky { factor, size }, determinant - scaling))
}

/// AᵀA, in blocks for many columns.
pub(super) fn gram(a: &DMatrix<f64>) -> DMatrix<f64> {
    if a.ncols() > MANY_COLUMNS { a.transpose() * a } else { a.tr_mul(a) }
}

/// Replaces the lower triangle by its Cholesky factor, in blocks; `false` where the matrix has none.
pub(crate) fn cholesky_in_place(matrix: &mut DMatrix<f64>) -> bool {
    let n = matrix.nrows();
    let request = llt::factor::cholesky_in_place_scratch::<f64>(n, Par::Seq, Default::default());
    let mut memory = MemBuffer::new(request);
    let place = MatMut::from_column_major_slice_mut(matrix.as_mut_slice(), n, n);
    let stack = MemStack::new(&mut memory);
    llt::factor::cholesky_in_place(place, Default::default(), Par::Seq, stack, Default::default()).is_ok()
}

/// (L Lᵀ)⁻¹ of a large factor, in blocks: XᵀX with X = L⁻¹.
fn blocked_inverse(factor: &Cholesky<f64, Dyn>) -> DMatrix<f64> {
    let lower = factor.l_dirty();
    let n = lower.nrows();
    let mut x = DMatrix::identity(n, n);
    let lower = MatRef::from_column_major_slice(lower.as_slice(), n, n);
    let place = MatMut::from_column_major_slice_mut(x.as_mut_slice(), n, n);
    faer::linalg::triangular_solve::solve_lower_triangular_in_place(lower, place, Par::Seq);
    gram(&x)
}
