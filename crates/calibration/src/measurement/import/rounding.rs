//! Detects the step to which a column of numbers is rounded.

/// Rounding steps of loggers and teach pendants, coarsest first.
const STEPS: [f64; 10] = [0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.000_5, 0.000_2, 0.000_1];

/// Steps of readings that no one commands (mm).
const COARSE: [f64; 2] = [1.0, 0.5];

/// Finds the step of numbers that come one by one.
#[derive(Debug, Clone)]
pub(super) struct StepSearch {
    are_integers: bool,
    /// Whether all numbers are multiples of each of the steps.
    are_multiples: [bool; STEPS.len()],
}

impl Default for StepSearch {
    fn default() -> Self {
        Self { are_integers: true, are_multiples: [true; STEPS.len()] }
    }
}

impl StepSearch {
    /// Takes a number into account.
    pub(super) fn add(&mut self, value: f64) {
        self.are_integers &= is_multiple(value, 1.0);
        for (still, step) in self.are_multiples.iter_mut().zip(STEPS) {
            *still &= is_multiple(value, step);
        }
    }

    /// The largest step of which all numbers are multiples. `None` for finer numbers, and for integers only: those were commanded, not
    /// rounded.
    pub(super) fn found(&self) -> Option<f64> {
        if self.are_integers {
            return None;
        }
        STEPS.into_iter().zip(self.are_multiples).find_map(|(step, holds)| holds.then_some(step))
    }
}

/// The same of a sensor's readings, which may be whole millimetres.
pub(super) fn step_of_readings(values: impl Iterator<Item = f64> + Clone) -> Option<f64> {
    COARSE.into_iter().chain(STEPS).find(|step| are_multiples(&values, *step))
}

fn are_multiples(values: &(impl Iterator<Item = f64> + Clone), step: f64) -> bool {
    values.clone().all(|value| is_multiple(value, step))
}

fn is_multiple(value: f64, step: f64) -> bool {
    let turns = value / step;
    (turns - turns.round()).abs() <= 1e-6 + 1e-9 * turns.abs()
}
