//! Linear combinations of columns: y ← y + Σ aₖ xₖ, one column after the other; for one y or for many.
//!
//! Method: vector registers of the machine's full width. Each element of y is summed separately, so every width gives the same
//! bits.
//! Cost: two operations and 8 bytes for each element of each column, if y fits in the first-level cache.
//! Checked against: the plain loop, to the bit.

use super::lanes::{AnyWidth, SinCos, widest};

/// Adds columns of a column-major matrix, each times its factor, to `sum`, in the order of `terms`: (column, factor).
///
/// ```
/// use truegrind_math::axpy::add_scaled;
///
/// // Two columns of three rows.
/// let columns = [1.0, 0.0, 1.0, 0.0, 1.0, 0.0];
/// let mut sum = [1.0, 2.0, 3.0];
/// add_scaled(&[(0, 2.0), (1, -1.0)], &columns, &mut sum);
/// assert_eq!(sum, [3.0, 1.0, 5.0]);
/// ```
///
/// # Panics
/// If a column does not exist.
pub fn add_scaled(terms: &[(usize, f64)], columns: &[f64], sum: &mut [f64]) {
    widest(Scaled { terms, columns, sum });
}

struct Scaled<'a> {
    terms: &'a [(usize, f64)],
    columns: &'a [f64],
    sum: &'a mut [f64],
}

impl AnyWidth for Scaled<'_> {
    type Output = ();

    #[inline(always)]
    fn run<R: SinCos>(self, like: R) {
        let Self { terms, columns, sum } = self;
        let n = sum.len();
        for &(k, factor) in terms {
            add(like, &columns[k * n..(k + 1) * n], factor, sum);
        }
    }
}

/// A factor of a sparse matrix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Entry {
    /// The column that it multiplies.
    pub from: usize,
    /// The column to which that is added.
    pub to: usize,
    /// The factor.
    pub factor: f64,
}

/// Adds columns of a column-major matrix of `n` rows, each times a factor, to columns of `sums`, in the order of `entries`. In the order
/// of `from` the matrix is read once, however many columns of `sums` each of its columns goes to.
///
/// ```
/// use truegrind_math::axpy::{Entry, add_sparse_product};
///
/// let columns = [1.0, 2.0, 10.0, 20.0];
/// let mut sums = [0.0; 4];
/// let entries = [(0, 0, 2.0), (0, 1, 1.0), (1, 1, 0.5)];
/// add_sparse_product(2, &entries.map(|(from, to, factor)| Entry { from, to, factor }), &columns, &mut sums);
/// assert_eq!(sums, [2.0, 4.0, 6.0, 12.0]);
/// ```
///
/// # Panics
/// If a column does not exist.
pub fn add_sparse_product(n: usize, entries: &[Entry], columns: &[f64], sums: &mut [f64]) {
    widest(Sparse { n, entries, columns, sums });
}

struct Sparse<'a> {
    n: usize,
    entries: &'a [Entry],
    columns: &'a [f64],
    sums: &'a mut [f64],
}

impl AnyWidth for Sparse<'_> {
    type Output = ();

    #[inline(always)]
    fn run<R: SinCos>(self, like: R) {
        let Self { n, entries, columns, sums } = self;
        for &Entry { from, to, factor } in entries {
            add(like, &columns[from * n..(from + 1) * n], factor, &mut sums[to * n..(to + 1) * n]);
        }
    }
}

/// Adds a column times a factor.
#[inline(always)]
fn add<R: SinCos>(like: R, column: &[f64], factor: f64, sum: &mut [f64]) {
    let (n, factors) = (sum.len(), like.splat(factor));
    let whole = n / R::ROWS * R::ROWS;
    for at in (0..whole).step_by(R::ROWS) {
        let more = like.load(sum, at) + factors * like.load(column, at);
        more.store(sum, at);
    }
    for at in whole..n {
        sum[at] += factor * column[at];
    }
}
