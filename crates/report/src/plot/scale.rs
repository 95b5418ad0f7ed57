//! Scales: range of an axis, ticks and labels.

use super::axis::Axis;
use truegrind_math::statistics::extent;

/// Smaller numbers are drawn as zero, since the powers of ten to scale them do not exist.
const MIN_DRAWN: f64 = 1e-290;

/// One axis of a frame.
#[derive(Debug, Clone)]
pub(super) struct Scale {
    pub(super) low: f64,
    pub(super) high: f64,
    log: bool,
    /// Ticks with their labels, ascending.
    pub(super) ticks: Vec<(f64, String)>,
    /// Minor ticks.
    pub(super) minor: Vec<f64>,
}

/// How the range of a scale follows from the data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ends {
    /// Exactly the data.
    Tight,
    /// The data with a margin.
    Loose,
    /// The data with a margin, and zero.
    Zero,
    /// From zero to exactly the largest value.
    Nought,
    /// The data with a margin on both sides, even across zero.
    Around,
}

impl Scale {
    /// Scale of an axis for the values on it, with at most about `ticks` ticks.
    pub(super) fn of(axis: &Axis, values: impl Iterator<Item = f64>, ends: Ends, ticks: usize) -> Self {
        let usable = |value: &f64| value.is_finite() && (!axis.log || *value > 0.0);
        let [mut low, mut high] = extent(values.filter(usable));
        if low > high {
            [low, high] = if axis.log { [0.1, 10.0] } else { [0.0, 1.0] };
        }
        if axis.log {
            let margin = if ends == Ends::Tight { 0.0 } else { 0.04 * (high / low).log10() };
            let margin = if high / low > 1.0 + 1e-9 { margin } else { 0.5 };
            low = (low * 10f64.powf(-margin)).max(f64::MIN_POSITIVE);
            high = (high * 10f64.powf(margin)).min(f64::MAX);
        } else {
            // Halved to avoid overflow.
            let span = 2.0 * (high / 2.0 - low / 2.0);
            let size = low.abs().max(high.abs());
            if span <= size * 1e-12 || size < MIN_DRAWN {
                // A constant: margins on both sides, so that its line is in the middle.
                let room = if size < MIN_DRAWN { 1.0 } else { size * 0.1 };
                [low, high] = [low - room, high + room];
            } else {
                let margin = if matches!(ends, Ends::Tight | Ends::Nought) { 0.0 } else { 0.05 * span };
                // Non-negative data start at zero rather than just below.
                let floor = if low >= 0.0 && ends != Ends::Around { 0.0 } else { f64::MIN };
                let ceiling = if high <= 0.0 && ends != Ends::Around { 0.0 } else { f64::MAX };
                [low, high] = [(low - margin).max(floor), (high + margin).min(ceiling)];
            }
            if matches!(ends, Ends::Zero | Ends::Nought) {
                [low, high] = [low.min(0.0), high.max(0.0)];
            }
        }
        if let Some([first, last]) = axis.range
            && first.is_finite()
            && last > first
            && last.abs().max(first.abs()) > MIN_DRAWN
            && last.is_finite()
            && (!axis.log || first > 0.0)
        {
            [low, high] = [first, last];
        }
        Self::between(low, high, axis.log, ticks)
    }

    /// Scale with a given range.
    pub(super) fn between(low: f64, high: f64, log: bool, ticks: usize) -> Self {
        if log {
            let positions = log_ticks(low, high, ticks);
            let decade = (high / low).log10() / ticks.max(1) as f64;
            let minor = if decade < 1.0 { minor_ticks(low, high, &positions) } else { Vec::new() };
            // Same style for all labels of an axis.
            let plain = positions.iter().all(|&position| (1e-3..1e5).contains(&position));
            let label = |position: f64| if plain { format!("{position}") } else { power(position) };
            Self {
                low,
                high,
                log,
                ticks: positions.iter().map(|&position| (position, label(position))).collect(),
                minor,
            }
        } else {
            let positions = linear_ticks(low, high, ticks);
            let labels = linear_labels(&positions);
            Self { low, high, log, ticks: positions.into_iter().zip(labels).collect(), minor: Vec::new() }
        }
    }

    /// Scale for categories at 0, 1, 2, …
    pub(super) fn named(names: &[String]) -> Self {
        let ticks =
            names.iter().enumerate().map(|(position, name)| (position as f64, name.clone())).collect();
        Self { low: -0.5, high: names.len().max(1) as f64 - 0.5, log: false, ticks, minor: Vec::new() }
    }

    /// Position of a value in the range, 0 to 1; `None` if not finite.
    pub(super) fn fraction(&self, value: f64) -> Option<f64> {
        let fraction = if self.log {
            (value / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value / 2.0 - self.low / 2.0) / (self.high / 2.0 - self.low / 2.0)
        };
        Some(fraction).filter(|fraction| fraction.is_finite() && value.is_finite())
    }
}

/// Round numbers in a range, with steps of 1, 2 or 5 times a power of ten, about `wanted` at most.
///
/// ```
/// use truegrind_report::plot::linear_ticks;
/// assert_eq!(linear_ticks(-0.31, 0.62, 5), [-0.2, 0.0, 0.2, 0.4, 0.6]);
/// ```
pub fn linear_ticks(low: f64, high: f64, wanted: usize) -> Vec<f64> {
    let span = 2.0 * (high / 2.0 - low / 2.0);
    if !(span > 0.0 && span.is_finite()) {
        return if low.is_finite() { vec![low] } else { Vec::new() };
    }
    let (factor, exponent) = step(span / wanted.max(1) as f64);
    // Ticks are exact: an integer times or divided by a power of ten, so that 0.3 is 0.3.
    let position = |count: f64| {
        if exponent < 0 {
            count * factor / 10f64.powi(-exponent)
        } else {
            count * factor * 10f64.powi(exponent)
        }
    };
    let width = position(1.0);
    let (first, last) = ((low / width - 1e-9).ceil(), (high / width + 1e-9).floor());
    if width == 0.0 || first.abs().max(last.abs()) > 1e15 {
        return vec![low, high];
    }
    if last < first {
        // The step is wider than the range.
        return linear_ticks(low, high, wanted + 1);
    }
    let count = (last - first) as usize;
    (0..=count).map(|i| position(first + i as f64) + 0.0).collect()
}

/// Powers of ten in a positive range, thinned if there are too many; with twos and fives if there are few, and round linear numbers
/// in a narrow range.
///
/// ```
/// use truegrind_report::plot::log_ticks;
/// assert_eq!(log_ticks(1e-9, 1e3, 5), [1e-9, 1e-6, 1e-3, 1.0, 1e3]);
/// assert_eq!(log_ticks(0.4, 3.0, 6), [0.5, 1.0, 2.0]);
/// ```
pub fn log_ticks(low: f64, high: f64, wanted: usize) -> Vec<f64> {
    if !(low > 0.0 && high > low && high.is_finite()) {
        return Vec::new();
    }
    let (bottom, top) = (low.log10(), high.log10());
    let (first, last) = ((bottom - 1e-9).ceil() as i32, (top + 1e-9).floor() as i32);
    let decades = last - first;
    if decades >= 3 {
        let stride = (decades as usize + 1).div_ceil(wanted.max(2)) as i32;
        return (first..=last).filter(|power| power.rem_euclid(stride) == 0).map(ten).collect();
    }
    let inside = |position: &f64| {
        position.is_finite() && *position >= low * (1.0 - 1e-9) && *position <= high * (1.0 + 1e-9)
    };
    let positions: Vec<f64> = (first - 1..=last)
        .flat_map(|power| [1.0, 2.0, 5.0].map(|factor| factor * ten(power)))
        .map(|position| format!("{position:.3e}").parse().unwrap_or(position))
        .filter(inside)
        .collect();
    if positions.len() >= 3 { positions } else { linear_ticks(low, high, wanted) }
}

/// 10^power; negative powers by division, which is more accurate.
fn ten(power: i32) -> f64 {
    if power < 0 && power > -308 { 1.0 / 10f64.powi(-power) } else { 10f64.powi(power) }
}

/// Multiples of two to nine in each decade, without the ticks.
fn minor_ticks(low: f64, high: f64, ticks: &[f64]) -> Vec<f64> {
    let (first, last) = (low.log10().floor() as i32, high.log10().ceil() as i32);
    (first..last)
        .flat_map(|power| (2..10).map(move |factor| f64::from(factor) * ten(power)))
        .filter(|position| (low..=high).contains(position))
        .filter(|position| ticks.iter().all(|tick| (tick / position - 1.0).abs() > 1e-6))
        .collect()
}

/// The smallest of 1, 2, 5 times a power of ten that is at least `size`.
fn step(size: f64) -> (f64, i32) {
    let exponent = size.log10().floor() as i32;
    let fraction = size / 10f64.powi(exponent);
    for factor in [1.0, 2.0, 5.0] {
        if fraction <= factor * (1.0 + 1e-9) {
            return (factor, exponent);
        }
    }
    (1.0, exponent + 1)
}

/// Labels with enough digits to distinguish the ticks; with exponents for very small or large numbers.
fn linear_labels(positions: &[f64]) -> Vec<String> {
    let size = positions.iter().fold(0.0f64, |size, position| size.max(position.abs()));
    let width = match positions {
        [first, second, ..] => (second - first).abs(),
        _ => size,
    };
    let exponent = |x: f64| if x > 0.0 { (x.log10() + 1e-9).floor() as i32 } else { 0 };
    if size >= 1e6 || (size > 0.0 && size < 1e-3) {
        let digits = usize::try_from(exponent(size) - exponent(width)).unwrap_or(0).min(15);
        let power = exponent(size);
        return positions
            .iter()
            .map(|position| match *position {
                0.0 => "0".to_owned(),
                position => format!("{:.digits$}·10{}", position / 10f64.powi(power), raised(power)),
            })
            .collect();
    }
    let decimals = usize::try_from(-exponent(width)).unwrap_or(0).min(15);
    positions.iter().map(|position| format!("{position:.decimals$}")).collect()
}

/// `10⁻⁶`, `2·10⁻⁶`.
fn power(position: f64) -> String {
    let text = format!("{position:.0e}");
    match text.split_once('e') {
        Some(("1", exponent)) => format!("10{}", raised(exponent.parse().unwrap_or(0))),
        Some((factor, exponent)) => format!("{factor}·10{}", raised(exponent.parse().unwrap_or(0))),
        None => text,
    }
}

fn raised(exponent: i32) -> String {
    exponent
        .to_string()
        .chars()
        .map(|digit| match digit {
            '-' => '⁻',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            '4' => '⁴',
            '5' => '⁵',
            '6' => '⁶',
            '7' => '⁷',
            '8' => '⁸',
            '9' => '⁹',
            _ => '⁰',
        })
        .collect()
}
