//! Number formatting: fixed decimals, significant digits, value ± σ.

/// Printed in place of a missing value.
pub const MISSING: &str = "–";

/// Number of digits shown. CSV and JSON always contain all digits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// Digits after the decimal point, for columns aligned at the point.
    Decimals(usize),
    /// Significant digits, with an exponent for very small or large numbers. With a σ, σ gets that many digits and the value ends at
    /// the same digit (GUM 7.2.6).
    Significant(usize),
}

impl Precision {
    /// The number as text. NaN counts as missing (`–`); infinities are `∞` and `-∞`; zero has no sign.
    ///
    /// ```
    /// use truegrind_report::number::Precision::{Decimals, Significant};
    /// assert_eq!(Decimals(3).format(-0.0001), "0.000");
    /// assert_eq!(Significant(3).format(0.012345), "0.0123");
    /// assert_eq!(Significant(2).format(1.27e-9), "1.3e-9");
    /// assert_eq!(Decimals(2).format(f64::NAN), "–");
    /// ```
    pub fn format(self, value: f64) -> String {
        if value.is_nan() {
            return MISSING.to_owned();
        }
        if value.is_infinite() {
            return if value > 0.0 { "∞".to_owned() } else { "-∞".to_owned() };
        }
        match self {
            Precision::Decimals(decimals) => fixed(value, decimals),
            Precision::Significant(digits) => significant(value, digits.max(1)),
        }
    }

    /// Value and standard uncertainty as `1.270 ± 0.021`. An unknown or infinite σ is shown as `–`.
    ///
    /// ```
    /// use truegrind_report::number::Precision::{Decimals, Significant};
    /// assert_eq!(Significant(2).format_with_sigma(1.27042, 0.0213), "1.270 ± 0.021");
    /// assert_eq!(Significant(2).format_with_sigma(3.1e-9, 4.0e-10), "(3.10 ± 0.40)e-9");
    /// assert_eq!(Decimals(1).format_with_sigma(5.04, f64::NAN), "5.0 ± –");
    /// ```
    pub fn format_with_sigma(self, value: f64, sigma: f64) -> String {
        match self {
            Precision::Significant(digits) if value.is_finite() && sigma.is_finite() && sigma > 0.0 => {
                let digits = digits.max(1);
                let exponent = exponent_of(value.abs().max(sigma), digits);
                let scale = if (-4..7).contains(&exponent) { 0 } else { exponent };
                // 10^-scale in two steps, since 10^308 is the largest power of ten.
                let shift = |x: f64| x * 10f64.powi(-(scale / 2)) * 10f64.powi(-(scale - scale / 2));
                let decimals = digits as i32 - 1 - exponent_of(shift(sigma), digits);
                let decimals = usize::try_from(decimals).unwrap_or(0).min(15);
                let pair = format!("{} ± {}", fixed(shift(value), decimals), fixed(shift(sigma), decimals));
                if scale == 0 { pair } else { format!("({pair})e{scale}") }
            }
            Precision::Significant(digits) => {
                let precision = Precision::Significant(digits + 2);
                format!("{} ± {}", precision.format(value), Precision::Significant(digits).format(sigma))
            }
            Precision::Decimals(_) => format!("{} ± {}", self.format(value), self.format(sigma)),
        }
    }
}

/// The shortest text that parses to the same number, with an exponent if that is shorter.
pub(super) fn exact(value: f64) -> String {
    let size = value.abs();
    if size != 0.0 && !(1e-5..1e16).contains(&size) && value.is_finite() {
        format!("{value:e}")
    } else {
        format!("{value}")
    }
}

fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(size) if size.bytes().all(|b| matches!(b, b'0' | b'.')) => size.to_owned(),
        _ => text,
    }
}

fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let exponent = exponent_of(value.abs(), digits);
    if !(-4..7.max(digits as i32)).contains(&exponent) {
        return format!("{value:.*e}", digits - 1);
    }
    fixed(value, usize::try_from(digits as i32 - 1 - exponent).unwrap_or(0))
}

/// Decimal exponent of a positive number after rounding: 9.99 with two digits has exponent 1.
fn exponent_of(size: f64, digits: usize) -> i32 {
    let text = format!("{size:.*e}", digits - 1);
    text.split_once('e').and_then(|(_, exponent)| exponent.parse().ok()).unwrap_or(0)
}

/// A list of numbers for a sentence: runs as `7 to 16`, at most 20 items.
///
/// ```
/// use truegrind_report::number::listed;
///
/// assert_eq!(listed(&[1, 2, 7, 8, 9, 12]), "1, 2, 7 to 9, 12");
/// let odd: Vec<usize> = (0..25).map(|n| 2 * n).collect();
/// assert!(listed(&odd).ends_with("36, 38 and 5 more"));
/// ```
pub fn listed(numbers: &[usize]) -> String {
    let runs: Vec<String> = numbers
        .chunk_by(|one, next| one + 1 == *next)
        .flat_map(|run| match run {
            [first, _, .., last] => vec![format!("{first} to {last}")],
            few => few.iter().map(usize::to_string).collect(),
        })
        .collect();
    let rest = runs.len().saturating_sub(20);
    let shown = runs[..runs.len() - rest].join(", ");
    if rest > 0 { format!("{shown} and {rest} more") } else { shown }
}
