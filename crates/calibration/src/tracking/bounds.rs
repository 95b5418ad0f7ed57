//! Bounds of the normalised innovations.

use truegrind_math::distribution::{chi_square_quantile, wilson_hilferty};

/// Tail probability beyond which a pose is an outlier.
const ACCIDENT: f64 = 1e-9;

/// Normal quantile of the window's bound: 1 in 10⁵.
const ALARM_DEVIATIONS: f64 = 4.265;

/// The NIS beyond which a pose of `rows` rows is an outlier: the χ² quantile, computed once.
pub(super) fn outlier_bound(rows: usize) -> f64 {
    use std::sync::OnceLock;
    static CUTS: OnceLock<[f64; 7]> = OnceLock::new();
    let cuts = CUTS
        .get_or_init(|| std::array::from_fn(|m| if m == 0 { 0.0 } else { chi_square_quantile(ACCIDENT, m) }));
    cuts[rows.min(6)]
}

/// Bound of the NIS sum of `rows` rows by an approximation that is cheap enough for every pose.
pub(super) fn window_bound(rows: usize) -> f64 {
    let n = rows as f64;
    n * wilson_hilferty(n, ALARM_DEVIATIONS)
}
