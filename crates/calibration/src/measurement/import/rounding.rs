//! Detects the step to which a column of numbers is rounded.

/// Rounding steps of loggers and teach pendants, coarsest first.
const STEPS: [f64; 10] = [0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.000_5, 0.000_2, 0.000_1];

/// Steps of readings that no one commands (mm).
const COARSE: [f64; 2] = [1.0, 0.5];

/// The largest step of which all values are multiples. `None` for finer numbers, and for integers only: those were
/// commanded, not rounded.
pub(super) fn step(values: impl Iterator<Item = f64> + Clone) -> Option<f64> {
    if are_multiples(&values, 1.0) {
        return None;
    }
    STEPS.into_iter().find(|step| are_multiples(&values, *step))
}

/// The same of a sensor's readings, which may be whole millimetres.
pub(super) fn step_of_readings(values: impl Iterator<Item = f64> + Clone) -> Option<f64> {
    COARSE.into_iter().chain(STEPS).find(|step| are_multiples(&values, *step))
}

fn are_multiples(values: &(impl Iterator<Item = f64> + Clone), step: f64) -> bool {
    values.clone().all(|value| {
        let turns = value / step;
        (turns - turns.round()).abs() <= 1e-6 + 1e-9 * turns.abs()
    })
}
