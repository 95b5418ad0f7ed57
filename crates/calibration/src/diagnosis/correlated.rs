//! Noise that is correlated from one row to the next, of the first order: how strongly, and columns that are freed of it.
//!
//! Source: Cochrane and Orcutt 1949.

use nalgebra::{DMatrix, DVector};

/// Correlation of neighbouring rows counts where it is this many standard deviations from none.
const CORRELATED: f64 = 4.0;

/// Correlation of the residuals of neighbouring rows at different poses, or 0 where it may be chance. Readings of one pose share what
/// the model gets wrong there, whatever the noise.
pub(super) fn correlation(left: &DVector<f64>, per: usize, numbers: &[usize], poses: &[usize]) -> f64 {
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
    if rho * (pairs as f64).sqrt() > CORRELATED { rho.min(0.95) } else { 0.0 }
}

/// Correlation of residuals some rows apart below which they no longer resemble each other.
const ALIKE: f64 = 0.1;

/// Share of all rows beyond which rows are not asked whether they resemble each other.
const FARTHEST: f64 = 0.04;

/// Over how many rows residuals resemble each other: the first distance at which their correlation is below [`ALIKE`], or chance.
pub(super) fn reach(left: &DVector<f64>, per: usize, poses: &[usize]) -> usize {
    let n = poses.len();
    let square = left.norm_squared() / left.len().max(1) as f64;
    let most = (FARTHEST * n as f64) as usize;
    let alike = |apart: usize| {
        let pairs = (0..n - apart).filter(|&i| poses[i] != poses[i + apart]);
        let scalars: Vec<usize> = pairs.flat_map(|i| i * per..(i + 1) * per).collect();
        let count = scalars.len().max(1) as f64;
        let shared: f64 = scalars.iter().map(|&s| left[s] * left[s + apart * per]).sum();
        // Where hardly any two rows so far apart are of different poses, nothing speaks against it.
        scalars.len() < n / 10 || shared / count > square * ALIKE.max(2.0 / count.sqrt())
    };
    (1..=most).find(|&apart| !alike(apart)).unwrap_or(most)
}

/// Columns under which neighbouring rows with correlation ρ are independent: (xᵢ − ρ^d xᵢ₋₁) / √(1 − ρ^2d), d the rows from one
/// to the next.
pub(super) fn filter(columns: &DMatrix<f64>, rho: f64, numbers: &[usize], per: usize) -> DMatrix<f64> {
    if rho == 0.0 {
        return columns.clone();
    }
    let mut out = columns.clone();
    for i in 1..numbers.len() {
        let power = rho.powi(numbers[i].abs_diff(numbers[i - 1]).clamp(1, 1000) as i32);
        let scale = (1.0 - power * power).sqrt().recip();
        for s in i * per..(i + 1) * per {
            for k in 0..columns.ncols() {
                out[(s, k)] = (columns[(s, k)] - power * columns[(s - per, k)]) * scale;
            }
        }
    }
    out
}
