//! Work budget of one path: counted, so that the same file ends the same way on every machine.
//!
//! An evaluation of the surface costs as much as its equation has terms, or as many triangles as a vertical ray can meet in a
//! mesh. Without a budget, a file of a few lines could require hours: a chord error of a nanometre, a wave of a thousand
//! periods, triangles stacked on each other.

use std::cell::Cell;

use crate::error::SurfaceError;
use crate::surface::Surface;

/// Terms of equations evaluated for one path: some seconds.
const MAX_TERMS: f64 = 2e8;
/// Candidate steps tested while equal steps are searched for; after that each step is as long as the bounds allow.
const MAX_TRIALS: usize = 20_000_000;

/// The remaining budget of one path.
#[derive(Debug)]
pub(crate) struct Budget {
    terms: Cell<f64>,
    trials: Cell<usize>,
    /// Cost of one evaluation.
    cost: f64,
}

impl Budget {
    pub(crate) fn of(surface: &Surface) -> Self {
        Self { terms: Cell::new(MAX_TERMS), trials: Cell::new(MAX_TRIALS), cost: surface.evaluation_cost() }
    }

    /// Charges `evaluations` evaluations of the surface.
    ///
    /// # Errors
    /// [`SurfaceError::TooMuchWork`] where the budget is exhausted.
    pub(crate) fn charge(&self, evaluations: usize) -> Result<(), SurfaceError> {
        self.terms.set(self.terms.get() - self.cost * evaluations as f64);
        if self.terms.get() >= 0.0 { Ok(()) } else { Err(SurfaceError::TooMuchWork { terms: MAX_TERMS }) }
    }

    /// Charges one candidate step; `false` where none is left.
    pub(crate) fn charge_step(&self) -> bool {
        let left = self.trials.get();
        self.trials.set(left.saturating_sub(1));
        left > 0
    }
}
