//! Tests of the extended model's residual: gross outliers, noise that grows with range, unexplained structure.
//!
//! - Outliers: Student's t is fitted to quantiles of the residual sizes, so that a heavy tail does not count as outliers; a row
//!   is an outlier if its size, under that tail, occurs once in a hundred data sets of this length, or if a gap as wide does that parts
//!   it from the others.
//! - Range: Spearman's rank correlation of size and distance; if significant, σ₀ and slope by least squares on the sizes.
//! - Structure: correlation of residuals of neighbours in joint space and of consecutive rows, with the exact variance under
//!   exchangeability (Moran 1950; von Neumann 1941).

use nalgebra::Vector3;

use super::cause::Cause;
use super::extension::{Extended, Subject};
use crate::measurement::dataset::{Reading, Sensor};
use truegrind_math::statistics::median;
use truegrind_math::tail::normal_two_sided;

/// Noise that grows with range: σ(d) = σ₀ + slope · d.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseModel {
    /// At range 0 (mm).
    pub sigma_mm: f64,
    /// Growth (mm per metre).
    pub per_metre_mm: f64,
    /// Rank correlation of size and range.
    pub correlation: f64,
    /// p-value.
    pub p_value: f64,
}

/// Correlations of residuals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Structure {
    /// Correlation with the residual of the nearest pose.
    pub neighbours: f64,
    /// Its z-score.
    pub neighbours_z: f64,
    /// Correlation with the residual of the previous row.
    pub order: f64,
    /// Its z-score.
    pub order_z: f64,
}

/// Smallest z-score of structure.
const STRUCTURE_Z: f64 = 5.5;

/// Smallest correlation of structure: in a large data set any trifle is significant.
const STRUCTURE_R: f64 = 0.15;

/// Whether a correlation of neighbours is structure.
pub fn is_structure(correlation: f64, z: f64) -> bool {
    z > STRUCTURE_Z && correlation > STRUCTURE_R
}

/// Whether the residual has structure.
pub fn has_structure(structure: &Structure) -> bool {
    is_structure(structure.neighbours, structure.neighbours_z)
        || is_structure(structure.order, structure.order_z)
}

/// Residual vectors (whitened, position part) of all rows.
fn vectors(subject: &Subject<'_>, fit: &Extended) -> Vec<Vector3<f64>> {
    let per = subject.observed.dataset.sensor.scalars();
    let plain = fit.problem.unweighted_residuals(&fit.x);
    fit.weights
        .iter()
        .enumerate()
        .map(|(i, w)| {
            Vector3::from_fn(|k, _| {
                if k < per.min(3) {
                    // Plain residuals are in mm, without Huber's weights.
                    plain[i * per + k] * w.per_mm
                } else {
                    0.0
                }
            })
        })
        .map(|v| v.map(|c| if c.is_finite() { c } else { 0.0 }))
        .collect()
}

/// Gross outliers with their sizes in standard deviations, largest first.
pub fn outliers(fit: &Extended) -> Vec<(usize, f64)> {
    let n = fit.sizes.len();
    if n < 12 {
        return Vec::new();
    }
    let mut sorted: Vec<f64> = fit.sizes.clone();
    sorted.sort_by(f64::total_cmp);
    // A heavy tail stretches the 95 % quantile against the median.
    let quantile = |p: f64| sorted[((n - 1) as f64 * p) as usize];
    let (middle, high) = (quantile(0.5).max(1e-12), quantile(0.95));
    // Sizes of vectors: their tail is approximated by that of one coordinate with the same quantile ratio.
    let stretch = high / middle;
    // Two quantiles of a few hundred sizes cannot exclude five degrees of freedom, so the tail is never assumed lighter.
    let nu = heaviness(stretch);
    // Where a fault's law is known by an expansion alone, readings where that is worst lie apart too.
    let exact = !fit.causes.iter().any(Cause::is_empirical);
    let gap = if exact { beyond_gap(&sorted, middle, nu) } else { f64::INFINITY };
    let limit = (middle * reach(nu, n)).min(gap);
    let mut rows: Vec<(usize, f64)> =
        fit.sizes.iter().copied().enumerate().filter(|(_, s)| !(*s <= limit)).collect();
    rows.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    rows
}

/// Sizes from this many medians on may lie beyond a gap.
const GAP_FROM: f64 = 5.0;

/// Largest share of rows beyond a gap, and their largest number: more are a pattern.
const BEYOND_GAP: (f64, usize) = (0.05, 10);

/// Smallest width of a gap, as a ratio.
const GAP: f64 = 2.0;

/// The size above which sizes lie apart from all others; infinite if none do.
///
/// In a tail that falls as the power ν, the ratio of the k-th largest size to the next exceeds r with probability r^(−kν) (Rényi 1953): several
/// rows just as far off are no tail, even where one of them alone could be.
fn beyond_gap(sorted: &[f64], middle: f64, nu: f64) -> f64 {
    let n = sorted.len();
    let most = ((BEYOND_GAP.0 * n as f64) as usize).clamp(1, BEYOND_GAP.1);
    let apart = |k: &usize| {
        let (size, next) = (sorted[n - k], sorted[n - k - 1]);
        let chance = (size / next).powf(-(*k as f64) * nu) * most as f64;
        size > GAP_FROM * middle && size > GAP * next && chance < 1e-2
    };
    let furthest = (1..=most.min(n - 1)).rfind(apart);
    furthest.map_or(f64::INFINITY, |k| sorted[n - k - 1])
}

/// Degrees of freedom of Student's t, 2 to 5, by the ratio of the 95 % quantile of |t| to its median.
fn heaviness(stretch: f64) -> f64 {
    // ν and t(0.975)/t(0.75), from the tables of Student's distribution.
    const TABLE: [(f64, f64); 4] =
        [(2.0, 4.303 / 0.8165), (3.0, 3.182 / 0.7649), (4.0, 2.776 / 0.7407), (5.0, 2.571 / 0.7267)];
    for pair in TABLE.windows(2) {
        let ((low, a), (high, b)) = (pair[0], pair[1]);
        if stretch >= b {
            let share = ((a - stretch) / (a - b)).clamp(0.0, 1.0);
            return 1.0 / (1.0 / low + share * (1.0 / high - 1.0 / low));
        }
    }
    5.0
}

/// Size over median that one of n rows exceeds once in a hundred data sets, for Student's t with ν degrees of freedom: its
/// tail falls as the power ν, matched at the 97.5 % quantile.
fn reach(nu: f64, n: usize) -> f64 {
    let p = 1e-2 / n as f64;
    let quantile = 1.96 + 2.0 / nu + 5.4 / (nu * nu);
    let median = 0.6745 + 0.26 / nu;
    (3.0 * 0.05 * quantile.powf(nu) / p).powf(1.0 / nu) / median
}

/// Fits noise that grows with range; `None` if insignificant.
pub fn noise_model(subject: &Subject<'_>, fit: &Extended, set_aside: &[usize]) -> Option<NoiseModel> {
    let dataset = &subject.observed.dataset;
    let plain = fit.problem.errors_mm(&fit.x);
    let coordinates = (dataset.sensor.axes() as f64).sqrt();
    let pairs: Vec<(f64, f64)> = dataset
        .rows
        .iter()
        .enumerate()
        .filter(|(i, _)| !set_aside.contains(i))
        .map(|(i, row)| {
            let range = match &row.reading {
                Reading::Cable(_) => {
                    let at = (fit.model.forward(&row.joints, &row.condition)
                        * nalgebra::Point3::from(fit.frames.flange_from_target.translation.vector))
                    .coords;
                    (at - fit.frames.outlets_mm[row.anchor]).norm()
                }
                Reading::Position(p) => p.norm(),
                Reading::Pose(pose) => pose.translation.vector.norm(),
            };
            (range * 1e-3, plain[i].abs() / coordinates)
        })
        .filter(|(a, b)| a.is_finite() && b.is_finite())
        .collect();
    let n = pairs.len();
    if n < 30 {
        return None;
    }
    let ranks = |values: Vec<f64>| {
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
        let mut out = vec![0.0; n];
        order.iter().enumerate().for_each(|(rank, &i)| out[i] = rank as f64);
        out
    };
    let (a, b) = (ranks(pairs.iter().map(|p| p.0).collect()), ranks(pairs.iter().map(|p| p.1).collect()));
    let middle = 0.5 * (n as f64 - 1.0);
    let (mut shared, mut square) = (0.0, 0.0);
    for (x, y) in a.iter().zip(&b) {
        shared += (x - middle) * (y - middle);
        square += (x - middle) * (x - middle);
    }
    let correlation = shared / square.max(1e-300);
    let p_value = normal_two_sided(correlation * (n as f64 - 1.0).sqrt());
    if !(p_value < 1e-5) || correlation < 0.0 {
        return None;
    }
    // Mean of |normal| is 0.798 σ; that of three coordinates 1.596 σ.
    let consistency = if dataset.sensor == Sensor::Cable { 0.7979 } else { 1.5958 / 3.0_f64.sqrt() };
    let mean = |f: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(f).sum::<f64>() / n as f64;
    let (mx, my) = (mean(&|p| p.0), mean(&|p| p.1));
    let slope = mean(&|p| (p.0 - mx) * (p.1 - my)) / mean(&|p| (p.0 - mx).powi(2)).max(1e-12);
    let at_zero = my - slope * mx;
    Some(NoiseModel {
        sigma_mm: (at_zero / consistency).max(0.0),
        per_metre_mm: slope / consistency,
        correlation,
        p_value,
    })
}

/// Correlations of neighbouring residuals.
pub fn structure(subject: &Subject<'_>, fit: &Extended, set_aside: &[usize]) -> Structure {
    let dataset = &subject.observed.dataset;
    let all = vectors(subject, fit);
    let kept: Vec<usize> = (0..all.len()).filter(|i| !set_aside.contains(i)).collect();
    // Clamped, so that no single row dominates.
    let values: Vec<Vector3<f64>> = kept.iter().map(|&i| all[i].map(|c| c.clamp(-3.0, 3.0))).collect();
    let power = values.iter().map(Vector3::norm_squared).sum::<f64>() / values.len().max(1) as f64;
    let dimensions = dataset.sensor.axes() as f64;
    let correlation = |pairs: &[(usize, usize)]| {
        let count = pairs.len().max(1) as f64;
        let r =
            pairs.iter().map(|&(a, b)| values[a].dot(&values[b])).sum::<f64>() / count / power.max(1e-300);
        (r, r * (count * dimensions).sqrt())
    };
    // Nearest poses by joint angles; a window of rows is enough for the statistic.
    let mut pairs: Vec<(usize, usize)> = Vec::new();
    let joints: Vec<_> = kept.iter().map(|&i| dataset.rows[i].joints).collect();
    let window = 4000.min(joints.len());
    for (a, q) in joints.iter().enumerate().take(window) {
        let nearest = joints
            .iter()
            .enumerate()
            .take(window)
            .filter(|(b, _)| *b != a)
            .map(|(b, r)| ((q - r).norm_squared(), b))
            // Repetitions of one pose share its error: they belong to the noise floor, not to structure.
            .filter(|(d, _)| *d > 1e-6)
            .min_by(|x, y| x.0.total_cmp(&y.0));
        if let Some((_, b)) = nearest {
            pairs.push((a.min(b), a.max(b)));
        }
    }
    pairs.sort_unstable();
    pairs.dedup();
    let (neighbours, neighbours_z) = correlation(&pairs);
    let consecutive: Vec<(usize, usize)> = (1..values.len()).map(|i| (i - 1, i)).collect();
    let (order, order_z) = correlation(&consecutive);
    Structure { neighbours, neighbours_z, order, order_z }
}

/// Median error of the rows (mm); NaN without rows.
pub fn median_error_mm(fit: &Extended) -> f64 {
    median(&fit.problem.errors_mm(&fit.x).iter().map(|e| e.abs()).collect::<Vec<_>>()).unwrap_or(f64::NAN)
}
