//! How much work a path may take: counted, so that the same file ends the same way on every machine.
//!
//! A look at a surface costs what its equation has in terms, or what a vertical ray may meet of a mesh. A file of a few
//! lines could otherwise ask for hours: a chord error of a nanometre, a wave of a thousand periods, triangles all over each
//! other.

use std::cell::Cell;

use crate::error::SurfaceError;
use crate::surface::Surface;

/// Terms of equations that are evaluated for one path: some seconds.
const MOST_TERMS: f64 = 2e8;
/// Steps that are looked at while equal ones are sought; then each step is as long as the bounds allow.
const MOST_TRIALS: usize = 20_000_000;

/// What is left for one path.
#[derive(Debug)]
pub(crate) struct Budget {
    terms: Cell<f64>,
    trials: Cell<usize>,
    /// Of one look.
    cost: f64,
}

impl Budget {
    pub(crate) fn of(surface: &Surface) -> Self {
        Self { terms: Cell::new(MOST_TERMS), trials: Cell::new(MOST_TRIALS), cost: surface.look_cost() }
    }

    /// Takes `looks` at the surface.
    ///
    /// # Errors
    /// [`SurfaceError::TooMuchWork`] where they are no longer there.
    pub(crate) fn look(&self, looks: usize) -> Result<(), SurfaceError> {
        self.terms.set(self.terms.get() - self.cost * looks as f64);
        if self.terms.get() >= 0.0 { Ok(()) } else { Err(SurfaceError::TooMuchWork { terms: MOST_TERMS }) }
    }

    /// Takes one step that is looked at; `false` where there is none left.
    pub(crate) fn try_step(&self) -> bool {
        let left = self.trials.get();
        self.trials.set(left.saturating_sub(1));
        left > 0
    }
}
