//! First-order serial correlation of the noise: estimate, range, and prewhitening.
//!
//! Source: Cochrane and Orcutt 1949.

use nalgebra::{DMatrix, DVector};

/// z-score from which a lag-one correlation is significant.
const SIGNIFICANT_Z: f64 = 4.0;

/// Lag-one correlation of the residuals, or 0 if insignificant. Only rows at different poses count: readings of one pose share its
/// model error, whatever the noise.
pub(super) fn lag_one_correlation(
    left: &DVector<f64>,
    per: usize,
    numbers: &[usize],
    poses: &[usize],
) -> f64 {
    let (mut shared, mut square, mut pairs) = (0.0, 0.0, 0_usize);
    for i in 1..numbers.len() {
        if numbers[i] != numbers[i - 1] + 1 || poses[i] == poses[i - 1] {
            continue;
        }
        for c in 0..per {
            let (a, b) = (left[(i - 1) * per + c], left[i * per + c]);
            shared += a * b;
            square += 0.5 * (a * a + b * b);
            pairs += 1;
        }
    }
    let rho = if square > 0.0 { shared / square } else { 0.0 };
    if rho * (pairs as f64).sqrt() > SIGNIFICANT_Z { rho.min(0.95) } else { 0.0 }
}

/// Correlation below which residuals count as independent.
pub(super) const NEGLIGIBLE: f64 = 0.1;

/// Largest lag that is tested, as a share of all rows.
const MAX_LAG_SHARE: f64 = 0.04;

/// Range of the serial correlation in rows: the first lag at which it is below [`NEGLIGIBLE`] or insignificant.
pub(super) fn correlation_range(left: &DVector<f64>, per: usize, poses: &[usize]) -> usize {
    let n = poses.len();
    let square = left.norm_squared() / left.len().max(1) as f64;
    let most = (MAX_LAG_SHARE * n as f64) as usize;
    let alike = |apart: usize| {
        let pairs = (0..n - apart).filter(|&i| poses[i] != poses[i + apart]);
        let scalars: Vec<usize> = pairs.flat_map(|i| i * per..(i + 1) * per).collect();
        let count = scalars.len().max(1) as f64;
        let shared: f64 = scalars.iter().map(|&s| left[s] * left[s + apart * per]).sum();
        // With hardly any pairs of different poses at this lag, it counts as correlated.
        scalars.len() < n / 10 || shared / count > square * NEGLIGIBLE.max(2.0 / count.sqrt())
    };
    (1..=most).find(|&apart| !alike(apart)).unwrap_or(most)
}

/// Prewhitened columns, for lag-one correlation ρ: (xᵢ − ρ^d xᵢ₋₁) / √(1 − ρ^2d), d the difference of row numbers.
pub(super) fn prewhiten(columns: &DMatrix<f64>, rho: f64, numbers: &[usize], per: usize) -> DMatrix<f64> {
    let mut out = columns.clone();
    if rho != 0.0 {
        let filter = filter(rho, numbers);
        for mut column in out.column_iter_mut() {
            // Backwards, so that the row before is still as it was.
            for (i, (power, scale)) in filter.iter().enumerate().rev() {
                for s in (i + 1) * per..(i + 2) * per {
                    column[s] = (column[s] - power * column[s - per]) * scale;
                }
            }
        }
    }
    out
}

/// The same for the transposed matrix, in place.
pub(super) fn prewhiten_transposed(columns: &mut DMatrix<f64>, rho: f64, numbers: &[usize], per: usize) {
    let (size, filter) = (columns.nrows() * per, filter(rho, numbers));
    let all = columns.as_mut_slice();
    for (i, (power, scale)) in filter.iter().enumerate().rev() {
        let (before, own) = all[i * size..(i + 2) * size].split_at_mut(size);
        own.iter_mut().zip(before).for_each(|(own, before)| *own = (*own - power * *before) * scale);
    }
}

/// ρ^d and 1 / √(1 − ρ^2d) of every row but the first.
fn filter(rho: f64, numbers: &[usize]) -> Vec<(f64, f64)> {
    numbers
        .windows(2)
        .map(|pair| {
            let power = rho.powi(pair[1].abs_diff(pair[0]).clamp(1, 1000) as i32);
            (power, (1.0 - power * power).sqrt().recip())
        })
        .collect()
}
