//! Gram matrix of a tall matrix (AᵀA), which takes half of the time of a pass over a million rows.
//!
//! Method: tiles of 4 × 4 pairs of columns, whose sums are held in registers during the pass over the rows. Each sum consists
//! of eight partial sums of every eighth row, so that it does not depend on the number of rows in a register; they are added
//! in a fixed order at the end. Only here are product and sum fused (one rounding), on every machine: every instruction set
//! then gives the same bits, including processors without a fused instruction, which are slower.
//! Cost: for n rows and p columns n p (p + 1) operations with 8 to 16 per instruction, and half as many bytes from the
//! second-level cache as there are operations.
//! Checked against: nalgebra's products.

use super::lanes::{AnyWidth, Real, SinCos, WIDTH, widest};

/// Columns on either side of a tile: sixteen sums and their factors fit in the registers.
const TILE: usize = 4;

/// Adds the products of columns with each other (zero columns, such as those of a knot that no row reaches, cost nothing) to the lower triangle of `square`, which is column-major: entry (i, j) of it
/// gains Σₖ aₖᵢ aₖⱼ for i ≥ j.
///
/// ```
/// use truegrind_math::gram::add_products;
///
/// // Two columns of eight rows.
/// let columns: Vec<f64> = (0..8).map(f64::from).chain([1.0; 8]).collect();
/// let mut square = [0.0; 4];
/// add_products(&columns, 8, &mut square);
/// assert_eq!(square, [140.0, 28.0, 0.0, 8.0]);
/// ```
///
/// # Panics
/// If the number of rows is no multiple of [`WIDTH`], or `square` does not have the size of the columns' Gram matrix.
pub fn add_products(columns: &[f64], rows: usize, square: &mut [f64]) {
    let size = columns.len().checked_div(rows).unwrap_or(0);
    assert!(rows.is_multiple_of(WIDTH), "{rows} rows are not whole groups");
    assert!(columns.len() == size * rows && (rows == 0 || square.len() == size * size), "not a matrix");
    let all = Columns { columns, rows };
    let used: Vec<usize> = (0..size).filter(|&k| !all.is_zero(k)).collect();
    widest(Products { columns: all, used: &used, size, square });
}

/// Adds the products of the last column with every column to `out`, one entry each: the last row of what [`add_products`] adds, in the
/// same bits, for a share 2 / (p + 1) of its operations.
///
/// ```
/// use truegrind_math::gram::add_products_with_last;
///
/// let columns: Vec<f64> = (0..8).map(f64::from).chain([1.0; 8]).collect();
/// let mut out = [0.0; 2];
/// add_products_with_last(&columns, 8, &mut out);
/// assert_eq!(out, [28.0, 8.0]);
/// ```
///
/// # Panics
/// If the number of rows is no multiple of [`WIDTH`], or `out` does not have one entry for each column.
pub fn add_products_with_last(columns: &[f64], rows: usize, out: &mut [f64]) {
    let size = columns.len().checked_div(rows).unwrap_or(0);
    assert!(rows.is_multiple_of(WIDTH), "{rows} rows are not whole groups");
    assert!(columns.len() == size * rows && (rows == 0 || out.len() == size), "not a matrix");
    widest(LastRow { columns, rows, size, out });
}

struct LastRow<'a> {
    columns: &'a [f64],
    rows: usize,
    size: usize,
    out: &'a mut [f64],
}

impl AnyWidth for LastRow<'_> {
    type Output = ();

    #[inline(always)]
    fn run<R: SinCos>(self, like: R) {
        let columns = Columns { columns: self.columns, rows: self.rows };
        let last = self.size.saturating_sub(1);
        let whole = self.size - self.size % TILE;
        for j in (0..whole).step_by(TILE) {
            let sums = columns.tile::<R, 1, TILE>(like, &[last], &[j, j + 1, j + 2, j + 3]);
            self.out[j..j + TILE].iter_mut().zip(sums[0]).for_each(|(out, sum)| *out += sum);
        }
        for j in whole..self.size {
            self.out[j] += columns.tile::<R, 1, 1>(like, &[last], &[j])[0][0];
        }
    }
}

struct Products<'a> {
    columns: Columns<'a>,
    /// The columns that are not zero, in ascending order.
    used: &'a [usize],
    size: usize,
    square: &'a mut [f64],
}

impl AnyWidth for Products<'_> {
    type Output = ();

    #[inline(always)]
    fn run<R: SinCos>(mut self, like: R) {
        let size = self.used.len();
        for i in (0..size).step_by(TILE) {
            for j in (0..i).step_by(TILE) {
                match size - i {
                    1 => self.tile::<R, 1, TILE>(like, i, j),
                    2 => self.tile::<R, 2, TILE>(like, i, j),
                    3 => self.tile::<R, 3, TILE>(like, i, j),
                    _ => self.tile::<R, TILE, TILE>(like, i, j),
                }
            }
            match size - i {
                1 => self.tile::<R, 1, 1>(like, i, i),
                2 => self.tile::<R, 2, 2>(like, i, i),
                3 => self.tile::<R, 3, 3>(like, i, i),
                _ => self.tile::<R, TILE, TILE>(like, i, i),
            }
        }
    }
}

impl Products<'_> {
    /// Adds the products of I used columns from the `i`-th with J from the `j`-th.
    #[inline(always)]
    fn tile<R: Real, const I: usize, const J: usize>(&mut self, like: R, i: usize, j: usize) {
        let (left, right) = (&self.used[i..i + I], &self.used[j..j + J]);
        let sums = self.columns.tile::<R, I, J>(like, left, right);
        for k in 0..I {
            for l in 0..J {
                if i + k >= j + l {
                    self.square[right[l] * self.size + left[k]] += sums[k][l];
                }
            }
        }
    }
}

#[derive(Clone, Copy)]
struct Columns<'a> {
    columns: &'a [f64],
    rows: usize,
}

impl<'a> Columns<'a> {
    /// The products of I columns `left` with J columns `right`.
    #[inline(always)]
    fn tile<R: Real, const I: usize, const J: usize>(
        self,
        like: R,
        left: &[usize],
        right: &[usize],
    ) -> [[f64; J]; I] {
        let left = self.those::<I>(left);
        let right = self.those::<J>(right);
        let zero = like.splat(0.0);
        let mut eight = [[[0.0; WIDTH]; J]; I];
        for part in (0..WIDTH).step_by(R::ROWS) {
            let mut sums = [[zero; J]; I];
            let mut row = part;
            while row < self.rows {
                let (mut a, mut b) = ([zero; I], [zero; J]);
                for k in 0..I {
                    a[k] = like.whole(&left[k][row..]);
                }
                for k in 0..J {
                    b[k] = like.whole(&right[k][row..]);
                }
                for k in 0..I {
                    for l in 0..J {
                        sums[k][l] = a[k].times_plus(b[l], sums[k][l]);
                    }
                }
                row += WIDTH;
            }
            for k in 0..I {
                for l in 0..J {
                    sums[k][l].store(&mut eight[k][l], part);
                }
            }
        }
        eight.map(|row| row.map(|s| ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]))))
    }

    #[inline(always)]
    fn those<const N: usize>(self, which: &[usize]) -> [&'a [f64]; N] {
        let mut out = [&self.columns[..0]; N];
        for (column, &k) in out.iter_mut().zip(which) {
            *column = self.column(k);
        }
        out
    }

    #[inline(always)]
    fn column(self, k: usize) -> &'a [f64] {
        &self.columns[k * self.rows..][..self.rows]
    }

    fn is_zero(self, k: usize) -> bool {
        self.column(k).chunks(WIDTH).all(|part| part.iter().all(|v| *v == 0.0))
    }
}
