//! Distributions for significance tests, besides those of [`tail`](crate::tail): Student's t and quantiles of χ².
//!
//! **Method.** Regularised incomplete beta by Lentz' continued fraction; ln Γ by Lanczos' sum (g = 7, nine terms), good
//! to 1e-14. Quantiles by bisection, which always converges for a monotonic function.
//!
//! **Source.** DLMF 8.17 (dlmf.nist.gov); Lanczos 1964. **Checked against** tabulated values.

use std::f64::consts::PI;

use crate::tail::chi_square_tail;

/// ln Γ(x) for x > 0.
///
/// ```
/// use truegrind_math::distribution::ln_gamma;
///
/// // Γ(5) = 4!, Γ(½) = √π.
/// assert!((ln_gamma(5.0) - 24.0_f64.ln()).abs() < 1e-13);
/// assert!((ln_gamma(0.5) - std::f64::consts::PI.sqrt().ln()).abs() < 1e-13);
/// ```
pub fn ln_gamma(x: f64) -> f64 {
    const G: f64 = 7.0;
    const C: [f64; 9] = [
        0.999_999_999_999_809_9,
        676.520_368_121_885_1,
        -1_259.139_216_722_402_8,
        771.323_428_777_653_1,
        -176.615_029_162_140_6,
        12.507_343_278_686_905,
        -0.138_571_095_265_720_12,
        9.984_369_578_019_572e-6,
        1.505_632_735_149_311_6e-7,
    ];
    if x < 0.5 {
        return (PI / (PI * x).sin()).ln() - ln_gamma(1.0 - x);
    }
    let x = x - 1.0;
    let sum: f64 = C[0] + (1..9).map(|i| C[i] / (x + i as f64)).sum::<f64>();
    let t = x + G + 0.5;
    0.5 * (2.0 * PI).ln() + (x + 0.5) * t.ln() - t + sum.ln()
}

/// The quantile of χ² with `freedom` degrees of freedom over its mean, at the normal quantile `z`: the approximation of Wilson and
/// Hilferty (1931), cheap and accurate to a per cent.
///
/// ```
/// use truegrind_math::distribution::{chi_square_quantile, wilson_hilferty};
///
/// let median = 3.0 * wilson_hilferty(3.0, 0.0);
/// assert!((median / chi_square_quantile(0.5, 3) - 1.0).abs() < 0.01);
/// ```
pub fn wilson_hilferty(freedom: f64, z: f64) -> f64 {
    let spread = 2.0 / (9.0 * freedom);
    (1.0 - spread + z * spread.sqrt()).powi(3)
}

/// The value that a χ² variable with `freedom` degrees of freedom exceeds with probability `above`.
///
/// ```
/// use truegrind_math::distribution::chi_square_quantile;
/// use truegrind_math::tail::chi_square_tail;
///
/// // The squared norm of three normal variates exceeds this value in one case of twenty.
/// let bound = chi_square_quantile(0.05, 3);
/// assert!((bound - 7.8147).abs() < 1e-4);
/// assert!((chi_square_tail(bound, 3) - 0.05).abs() < 1e-12);
/// // Of very many degrees of freedom it is nearly normal.
/// assert!((chi_square_quantile(0.5, 30_000) - 29_999.333).abs() < 1e-2);
/// ```
pub fn chi_square_quantile(above: f64, freedom: usize) -> f64 {
    let (mut low, mut high) = (0.0, freedom as f64 + 1.0);
    while chi_square_tail(high, freedom) > above && high < 1e9 {
        high *= 2.0;
    }
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if chi_square_tail(middle, freedom) > above { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Share of Student's t with `freedom` degrees of freedom beyond ±|t|.
///
/// ```
/// use truegrind_math::distribution::student_two_sided;
///
/// // The usual table: 2.228 at ten degrees of freedom is the 5 % point, 1.960 at very many.
/// assert!((student_two_sided(2.228, 10.0) - 0.05).abs() < 1e-4);
/// assert!((student_two_sided(1.960, 1e6) - 0.05).abs() < 1e-4);
/// ```
pub fn student_two_sided(t: f64, freedom: f64) -> f64 {
    if t.is_infinite() {
        return 0.0;
    }
    incomplete_beta(freedom / (freedom + t * t), 0.5 * freedom, 0.5)
}

/// The t of Student's distribution with `freedom` degrees of freedom beyond ±t of which lies the share `outside`.
///
/// ```
/// use truegrind_math::distribution::student_quantile;
///
/// // Table G.2 of the GUM: 95.45 % lie within 13.97 standard deviations at one degree of freedom, 3.31 at three, 2.28 at ten.
/// for (freedom, t) in [(1.0, 13.97), (3.0, 3.31), (10.0, 2.28), (1e7, 2.0)] {
///     assert!((student_quantile(0.0455, freedom) - t).abs() < 6e-3);
/// }
/// ```
pub fn student_quantile(outside: f64, freedom: f64) -> f64 {
    let (mut low, mut high) = (0.0, 2.0);
    while student_two_sided(high, freedom) > outside && high < 1e9 {
        high *= 2.0;
    }
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if student_two_sided(middle, freedom) > outside { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// I_x(a, b).
fn incomplete_beta(x: f64, a: f64, b: f64) -> f64 {
    if x.is_nan() {
        return f64::NAN;
    }
    if x <= 0.0 {
        return 0.0;
    }
    if x >= 1.0 {
        return 1.0;
    }
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - incomplete_beta(1.0 - x, b, a);
    }
    let front = (ln_gamma(a + b) - ln_gamma(a) - ln_gamma(b) + a * x.ln() + b * (1.0 - x).ln()).exp() / a;
    let tiny = 1e-300;
    let (mut c, mut d) = (1.0, 1.0 / guarded(1.0 - (a + b) * x / (a + 1.0), tiny));
    let mut h = d;
    for m in 1..1_000 {
        let m = f64::from(m);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        d = 1.0 / guarded(1.0 + even * d, tiny);
        c = guarded(1.0 + even / c, tiny);
        h *= d * c;
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        d = 1.0 / guarded(1.0 + odd * d, tiny);
        c = guarded(1.0 + odd / c, tiny);
        h *= d * c;
        if (d * c - 1.0).abs() < 1e-16 {
            break;
        }
    }
    (front * h).clamp(0.0, 1.0)
}

fn guarded(value: f64, tiny: f64) -> f64 {
    if value.abs() < tiny { tiny } else { value }
}
