//! Tails of the normal and the χ² distribution, for p-values down to 1e-300.
//!
//! Method: erfc by its Taylor series below 2.5 and by Lentz's evaluation of the continued fraction above; χ² with k degrees
//! of freedom by the recurrence Q(a+1, y) = Q(a, y) + yᵃ e⁻ʸ / Γ(a+1) from a = ½ or 1.
//! Source: Abramowitz and Stegun, Handbook of Mathematical Functions, 7.1.5, 7.1.14 and 6.5.21.
//! Checked against: their tables, in the tests.

use std::f64::consts::PI;

/// Complementary error function of x ≥ 0 times e^(x²), so that it does not underflow.
fn scaled_erfc(x: f64) -> f64 {
    if x < 2.5 {
        let (mut term, mut sum, mut n) = (x, x, 0.0);
        while f64::abs(term) > 1e-17 * sum.abs() && n < 200.0 {
            n += 1.0;
            term *= -x * x / n;
            sum += term / (2.0 * n + 1.0);
        }
        (1.0 - 2.0 / PI.sqrt() * sum) * (x * x).exp()
    } else {
        // 1/(x + (1/2)/(x + 1/(x + (3/2)/(x + …)))), evaluated from a sufficient depth.
        let mut inner = x;
        for k in (1..=80).rev() {
            inner = x + 0.5 * f64::from(k) / inner;
        }
        1.0 / (PI.sqrt() * inner)
    }
}

/// Natural logarithm of the probability that χ² with `freedom` degrees of freedom exceeds `value`; 0 for values that are
/// not positive, NaN for NaN.
pub fn log_chi_square_tail(value: f64, freedom: usize) -> f64 {
    if value.is_nan() {
        return f64::NAN;
    }
    if value <= 0.0 || freedom == 0 {
        return 0.0;
    }
    let y = 0.5 * value;
    // Everything times e^y.
    let (mut a, mut sum) = if freedom % 2 == 1 { (0.5, scaled_erfc(y.sqrt())) } else { (1.0, 1.0) };
    // yᵃ / Γ(a + 1)
    let mut term = if freedom % 2 == 1 { 2.0 * (y / PI).sqrt() } else { y };
    let mut log_scale = 0.0;
    while a + 0.25 < 0.5 * freedom as f64 {
        sum += term;
        a += 1.0;
        term *= y / a;
        // e^y overflows for values above 1400.
        if sum > LARGE {
            (sum, term) = (sum / LARGE, term / LARGE);
            log_scale += LARGE.ln();
        }
    }
    (sum.ln() + log_scale - y).min(0.0)
}

/// Sum from which it is scaled down.
const LARGE: f64 = 1e200;

/// Probability that χ² with `freedom` degrees of freedom exceeds `value`.
pub fn chi_square_tail(value: f64, freedom: usize) -> f64 {
    log_chi_square_tail(value, freedom).exp()
}

/// Probability that a standard normal number exceeds `value` in magnitude.
///
/// ```
/// use truegrind_math::tail::{log_chi_square_tail, normal_two_sided};
///
/// assert!((normal_two_sided(1.959_964) - 0.05).abs() < 1e-7);
/// // The probability itself would underflow: with two degrees of freedom its logarithm is −x / 2.
/// assert!((log_chi_square_tail(5_000.0, 2) + 2_500.0).abs() < 1e-9);
/// ```
pub fn normal_two_sided(value: f64) -> f64 {
    chi_square_tail(value * value, 1)
}

/// Φ(`value`), the standard normal distribution function.
pub fn normal_cdf(value: f64) -> f64 {
    let tail = 0.5 * normal_two_sided(value);
    if value < 0.0 { tail } else { 1.0 - tail }
}
