//! Linear combinations of columns: y ← y + Σ aₖ xₖ, one column after the other.
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
        let whole = n / R::ROWS * R::ROWS;
        for &(k, factor) in terms {
            let (column, factors) = (&columns[k * n..(k + 1) * n], like.splat(factor));
            for at in (0..whole).step_by(R::ROWS) {
                let more = like.load(sum, at) + factors * like.load(column, at);
                more.store(sum, at);
            }
            for at in whole..n {
                sum[at] += factor * column[at];
            }
        }
    }
}
