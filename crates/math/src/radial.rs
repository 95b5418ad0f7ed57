//! Radial basis functions of compact support over a few coordinates: exactly zero beyond a reach.
//!
//! φ(r) = (1 − r)⁴ (4r + 1) for r = |u − c| / reach below 1, 0 from there (Wendland 1995, ψ₃,₁: twice continuously
//! differentiable, positive definite in up to three dimensions). Its gradient is ∂φ/∂u = −20 (1 − r)³ (u − c) / reach². A
//! Gaussian has no bound: a correction with it would act, if only slightly, where nothing was measured.

use super::lanes::Real;

/// Value of the basis function around `centre` at `u`, for one point or several in lanes.
///
/// ```
/// use truegrind_math::radial::wendland;
///
/// let centre = [0.2, -0.1];
/// assert_eq!(wendland(&centre, &centre, 0.5), 1.0);
/// // Exactly zero beyond its reach.
/// assert_eq!(wendland(&[0.2, 0.41], &centre, 0.5), 0.0);
/// ```
#[cfg_attr(not(debug_assertions), inline(always))]
pub fn wendland<R: Real, const D: usize>(u: &[R; D], centre: &[f64; D], reach: f64) -> R {
    let (t, r) = inside(u, centre, reach);
    let square = t * t;
    square * square * (r.splat(4.0) * r + r.splat(1.0))
}

/// Derivative of [`wendland`] along `step`.
#[cfg_attr(not(debug_assertions), inline(always))]
pub fn wendland_slope<R: Real, const D: usize>(
    u: &[R; D],
    centre: &[f64; D],
    reach: f64,
    step: &[R; D],
) -> R {
    let (t, _) = inside(u, centre, reach);
    let mut along = t.splat(0.0);
    for k in 0..D {
        along += (u[k] - u[k].splat(centre[k])) * step[k];
    }
    t.splat(-20.0 / (reach * reach)) * t * t * t * along
}

/// 1 − r, not below 0, and r.
#[cfg_attr(not(debug_assertions), inline(always))]
fn inside<R: Real, const D: usize>(u: &[R; D], centre: &[f64; D], reach: f64) -> (R, R) {
    let mut square = u[0].splat(0.0);
    for k in 0..D {
        let d = u[k] - u[k].splat(centre[k]);
        square += d * d;
    }
    let r = square.sqrt() * square.splat(1.0 / reach);
    let t = r.splat(1.0) - r;
    (t * t.positive(), r)
}

/// Farthest-point sampling: up to `most` of `points`, each the one farthest from those chosen before, starting with the
/// first; and the fill distance, the largest distance of a point from its nearest centre. Ties are resolved in favour of
/// the earlier point, so the choice is reproducible.
///
/// ```
/// use truegrind_math::radial::farthest_point_sample;
///
/// // Two clusters: one centre in each, and no point farther than 1 from its centre.
/// let (centres, fill) = farthest_point_sample(&[[0.0], [1.0], [10.0], [9.0]], 2);
/// assert_eq!(centres, [[0.0], [10.0]]);
/// assert_eq!(fill, 1.0);
/// ```
pub fn farthest_point_sample<const D: usize>(points: &[[f64; D]], most: usize) -> (Vec<[f64; D]>, f64) {
    let mut nearest = vec![f64::INFINITY; points.len()];
    let mut centres: Vec<[f64; D]> = Vec::new();
    let mut next = points.iter().position(|p| p.iter().all(|v| v.is_finite()));
    while let Some(taken) = next.filter(|_| centres.len() < most) {
        centres.push(points[taken]);
        for (d, p) in nearest.iter_mut().zip(points) {
            *d = d.min(distance(p, &points[taken]));
        }
        next = (0..points.len())
            .filter(|&i| nearest[i].is_finite() && nearest[i] > 0.0)
            .reduce(|best, i| if nearest[i] > nearest[best] { i } else { best });
    }
    let fill = nearest.iter().copied().filter(|d| d.is_finite()).fold(0.0, f64::max);
    (centres, fill)
}

/// Euclidean distance.
pub fn distance<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}
