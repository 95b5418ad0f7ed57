//! Error statistics of calibration reports.

use serde::{Deserialize, Serialize};

/// Summary of errors, in the unit of the input.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ErrorSummary {
    /// Number of values.
    pub count: usize,
    /// Root mean square.
    pub rmse: f64,
    /// Mean of the absolute values. The papers call it "STD" (ltlm-2024 eq. 20, ukf-vslm-2023 eq. 28).
    pub mean_absolute: f64,
    /// Mean of the signed values.
    pub mean: f64,
    /// Standard deviation of the signed values with n − 1; 0 for fewer than two values.
    pub standard_deviation: f64,
    /// Largest absolute value.
    pub max: f64,
}

impl ErrorSummary {
    /// Of no errors.
    pub const UNKNOWN: Self = Self {
        count: 0,
        rmse: f64::NAN,
        mean_absolute: f64::NAN,
        mean: f64::NAN,
        standard_deviation: f64::NAN,
        max: f64::NAN,
    };

    /// Summary of signed errors; NaN without any.
    ///
    /// ```
    /// use truegrind_math::statistics::ErrorSummary;
    ///
    /// let errors = ErrorSummary::of([0.3, -0.4]);
    /// assert!((errors.rmse - 0.125_f64.sqrt()).abs() < 1e-15);
    /// assert!((errors.mean_absolute - 0.35).abs() < 1e-15 && (errors.mean + 0.05).abs() < 1e-15);
    /// assert_eq!((errors.count, errors.max), (2, 0.4));
    /// // An error that is not known is not 0.
    /// assert!(ErrorSummary::of([0.3, f64::NAN]).max.is_nan());
    /// let none = ErrorSummary::of([]);
    /// assert!(none.count == 0 && none.rmse.is_nan() && none.max.is_nan());
    /// ```
    pub fn of(errors: impl IntoIterator<Item = f64>) -> Self {
        let values: Vec<f64> = errors.into_iter().collect();
        let n = values.len() as f64;
        if values.is_empty() {
            return Self::UNKNOWN;
        }
        let mean = values.iter().sum::<f64>() / n;
        let square = values.iter().map(|e| e * e).sum::<f64>();
        let spread = values.iter().map(|e| (e - mean).powi(2)).sum::<f64>();
        Self {
            count: values.len(),
            rmse: (square / n).sqrt(),
            mean_absolute: values.iter().map(|e| e.abs()).sum::<f64>() / n,
            mean,
            standard_deviation: if values.len() > 1 { (spread / (n - 1.0)).sqrt() } else { 0.0 },
            max: largest(values.iter().map(|e| e.abs())),
        }
    }
}

/// The smallest and the largest of some values, NaN left out; +∞ and −∞ without any.
///
/// ```
/// use truegrind_math::statistics::extent;
///
/// assert_eq!(extent([3.0, f64::NAN, -1.0]), [-1.0, 3.0]);
/// assert_eq!(extent([]), [f64::INFINITY, f64::NEG_INFINITY]);
/// ```
pub fn extent(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    values.into_iter().fold(none, |[low, high], value| [low.min(value), high.max(value)])
}

/// The largest of some values; 0 without any, NaN if one of them is NaN: an unknown error is not 0.
pub fn largest(sizes: impl IntoIterator<Item = f64>) -> f64 {
    sizes.into_iter().fold(0.0, |most: f64, size| if size.is_nan() || size > most { size } else { most })
}

/// Mean and standard deviation (n − 1) of a list; NaN for an empty one.
pub fn mean_and_deviation(values: &[f64]) -> (f64, f64) {
    let summary = ErrorSummary::of(values.iter().copied());
    (summary.mean, summary.standard_deviation)
}

/// Root mean square; `None` for an empty list.
///
/// ```
/// use truegrind_math::statistics::rms;
///
/// assert_eq!(rms(&[3.0, -4.0]), Some(12.5_f64.sqrt()));
/// assert_eq!(rms(&[]), None);
/// ```
pub fn rms(values: &[f64]) -> Option<f64> {
    let square = values.iter().map(|v| v * v).sum::<f64>();
    (!values.is_empty()).then(|| (square / values.len() as f64).sqrt())
}

/// Median; `None` for an empty list. Non-finite values are sorted last.
///
/// ```
/// use truegrind_math::statistics::median;
///
/// assert_eq!(median(&[0.4, 9.0, 0.2]), Some(0.4));
/// assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), Some(2.5));
/// assert_eq!(median(&[]), None);
/// ```
pub fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    (n > 0).then(|| if n % 2 == 1 { sorted[n / 2] } else { 0.5 * (sorted[n / 2 - 1] + sorted[n / 2]) })
}
