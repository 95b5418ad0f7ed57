//! Bayes factors in words: how many times as probable one explanation makes the readings as another.

/// Factor from which its size no longer matters: the logarithms come from sums over thousands of readings.
const MANY: f64 = 1000.0;

/// "12.3" or "over 1000", from twice the natural logarithm of the factor. Its sign is not told: a factor below 1 is the other's above it.
pub(super) fn times(twice_log: f64) -> String {
    match (0.5 * twice_log.abs()).exp() {
        times if times < MANY => format!("{times:.1}"),
        _ => "over 1000".to_owned(),
    }
}

/// The readings with an explanation beside those without it, in a sentence part, with the figure of a statistician in brackets.
pub(super) fn readings_with_it(twice_log: f64) -> String {
    let times = times(twice_log);
    let which = if twice_log >= 0.0 { "with it than without" } else { "without it than with" };
    format!("the readings are {times} times more probable {which} (2 ln Bayes factor {twice_log:.0})")
}
