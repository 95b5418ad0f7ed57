//! Detects the step to which a column of numbers is rounded.

/// Rounding steps of loggers and teach pendants.
const STEPS: [f64; 4] = [0.1, 0.01, 0.001, 0.000_1];

/// The largest step of which all values are multiples. `None` for finer numbers, and for integers only: those were
/// commanded, not rounded.
pub(super) fn step(values: impl Iterator<Item = f64> + Clone) -> Option<f64> {
    let multiples = |step: f64| {
        values.clone().all(|v| {
            let turns = v / step;
            (turns - turns.round()).abs() <= 1e-6 + 1e-9 * turns.abs()
        })
    };
    if multiples(1.0) {
        return None;
    }
    STEPS.into_iter().find(|s| multiples(*s))
}
