//! Bounds of the normalised innovations.

use truegrind_math::distribution::chi_square_quantile;

/// A pose beyond this share of χ² is an accident.
const ACCIDENT: f64 = 1e-9;

/// A window beyond so many standard deviations, 1 in 10⁵, raises the alarm.
const ALARM_DEVIATIONS: f64 = 4.265;

/// The NIS beyond which a pose of so many rows is an accident: the quantile, worked out once.
pub(super) fn accident_bound(rows: usize) -> f64 {
    use std::sync::OnceLock;
    static CUTS: OnceLock<[f64; 7]> = OnceLock::new();
    let cuts = CUTS
        .get_or_init(|| std::array::from_fn(|m| if m == 0 { 0.0 } else { chi_square_quantile(ACCIDENT, m) }));
    cuts[rows.min(6)]
}

/// The bound of a window with so many rows, by Wilson and Hilferty's cube (1931): good to a per cent out here, and
/// cheap enough for every pose.
pub(super) fn window_bound(rows: usize) -> f64 {
    let (n, z) = (rows as f64, ALARM_DEVIATIONS);
    let spread = 2.0 / (9.0 * n);
    n * (1.0 - spread + z * spread.sqrt()).powi(3)
}
