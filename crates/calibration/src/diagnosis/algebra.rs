//! Parallel products and factors of large matrices, bitwise reproducible for any number of threads: work is divided into parts of
//! fixed size, each of them done by one thread.

use crate::identification::scaled_cholesky::cholesky_in_place;
use faer::{Accum, MatMut, MatRef, Par};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use truegrind_math::work::checkpoint;

/// Columns of a result per thread.
const PART: usize = 64;

/// Right-hand sides per thread.
const SIDES: usize = 256;

/// Multiplications below which parallel work is not worthwhile.
const SMALL: usize = 2_000_000;

/// AᵀA.
pub(super) fn gram(a: &DMatrix<f64>) -> DMatrix<f64> {
    squared(shown(a).transpose())
}

/// B − AᵀA, of which only the lower triangle counts: the upper one is not kept up.
pub(super) fn without_lower_gram(mut b: DMatrix<f64>, a: &DMatrix<f64>) -> DMatrix<f64> {
    lower_product(shown(a).transpose(), &mut b, Accum::Add, -1.0);
    b
}

/// A Aᵀ.
pub(super) fn outer(a: &DMatrix<f64>) -> DMatrix<f64> {
    squared(shown(a))
}

/// A B.
pub(super) fn product(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    multiplied(shown(a), shown(b))
}

/// Aᵀ B.
pub(super) fn product_of_transposed(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    multiplied(shown(a).transpose(), shown(b))
}

fn shown(a: &DMatrix<f64>) -> MatRef<'_, f64> {
    MatRef::from_column_major_slice(a.as_slice(), a.nrows(), a.ncols())
}

/// Fills the columns of a result in parts: `fill` gets the index of the first column and the memory of a part.
fn in_parts(
    out: &mut DMatrix<f64>,
    width: usize,
    small: bool,
    fill: impl Fn(usize, MatMut<'_, f64>) + Sync + Send,
) {
    let rows = out.nrows();
    if rows == 0 {
        return;
    }
    let part = |(k, place): (usize, &mut [f64])| {
        checkpoint();
        let columns = place.len() / rows;
        fill(k * width, MatMut::from_column_major_slice_mut(place, rows, columns));
    };
    let size = rows * width;
    if small {
        out.as_mut_slice().chunks_mut(size).enumerate().for_each(part);
    } else {
        out.as_mut_slice().par_chunks_mut(size).enumerate().for_each(part);
    }
}

fn multiplied(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(a.nrows(), b.ncols());
    // Few rows need wider parts to be worthwhile.
    let width = if a.nrows() < PART { SIDES } else { PART };
    let small = a.nrows() * a.ncols() * b.ncols() < SMALL;
    in_parts(&mut out, width, small, |first, place| {
        let columns = place.ncols();
        faer::linalg::matmul::matmul(place, Accum::Replace, a, b.subcols(first, columns), 1.0, Par::Seq);
    });
    out
}

/// A Aᵀ: its lower triangle, mirrored.
fn squared(a: MatRef<'_, f64>) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(a.nrows(), a.nrows());
    lower_product(a, &mut out, Accum::Replace, 1.0);
    out.fill_upper_triangle_with_lower_triangle();
    out
}

/// Puts a multiple of A Aᵀ in the lower triangle of a matrix, or adds it.
fn lower_product(a: MatRef<'_, f64>, out: &mut DMatrix<f64>, how: Accum, factor: f64) {
    let n = a.nrows();
    in_parts(out, PART, n * n * a.ncols() < 2 * SMALL, |first, place| {
        let columns = place.ncols();
        let lower = place.subrows_mut(first, n - first);
        let (left, right) = (a.subrows(first, n - first), a.subrows(first, columns).transpose());
        faer::linalg::matmul::matmul(lower, how, left, right, factor, Par::Seq);
    });
}

/// Replaces a positive definite matrix by its lower Cholesky factor; `false` if it is not positive definite.
pub(super) fn factored(a: &mut DMatrix<f64>) -> bool {
    let done = cholesky_in_place(a);
    a.fill_upper_triangle(0.0, 1);
    done && a.diagonal().iter().all(|d| *d > 0.0)
}

/// Solves L Lᵀ x = b.
pub(super) fn back_and_forth(lower: &DMatrix<f64>, b: &DVector<f64>) -> Option<DVector<f64>> {
    lower.tr_solve_lower_triangular(&lower.solve_lower_triangular(b)?)
}

/// L⁻¹ B.
pub(super) fn solved(lower: &DMatrix<f64>, mut b: DMatrix<f64>) -> DMatrix<f64> {
    let small = b.nrows() * b.nrows() * b.ncols() < 2 * SMALL;
    in_parts(&mut b, SIDES, small, |_, place| {
        faer::linalg::triangular_solve::solve_lower_triangular_in_place(shown(lower), place, Par::Seq);
    });
    b.apply(|v| *v = finite(*v));
    b
}

/// The number, or 0 for a non-finite one.
pub(super) fn finite(v: f64) -> f64 {
    if v.is_finite() { v } else { 0.0 }
}

/// Lower Cholesky factor; a matrix that is not positive definite gets a growing ridge.
pub(super) fn lower_factor(normal: DMatrix<f64>) -> DMatrix<f64> {
    let n = normal.nrows();
    let mut ridge = 0.0;
    for _ in 0..12 {
        let mut shifted = normal.clone();
        for k in 0..n {
            shifted[(k, k)] += ridge * normal[(k, k)].abs().max(f64::MIN_POSITIVE);
        }
        if factored(&mut shifted) {
            return shifted;
        }
        ridge = if ridge == 0.0 { 1e-14 } else { ridge * 10.0 };
    }
    DMatrix::identity(n, n)
}

/// Eigenvalues and eigenvectors of a symmetric matrix; `None` for non-finite entries. Single-threaded: faer is built without
/// threads.
pub(super) fn eigen(a: &DMatrix<f64>) -> Option<(Vec<f64>, DMatrix<f64>)> {
    let n = a.nrows();
    let found = shown(a).self_adjoint_eigen(faer::Side::Lower).ok()?;
    let values: Vec<f64> = found.S().column_vector().iter().copied().collect();
    let vectors = DMatrix::from_fn(n, n, |i, k| found.U()[(i, k)]);
    values.iter().all(|v| v.is_finite()).then_some((values, vectors))
}

/// The scalar rows of some observations, `per` each.
pub(super) fn picked_rows(columns: &DMatrix<f64>, observations: &[usize], per: usize) -> DMatrix<f64> {
    let scalars: Vec<usize> = observations.iter().flat_map(|&i| i * per..(i + 1) * per).collect();
    columns.select_rows(&scalars)
}
