//! An estimated arm with what every program needs of it.

use truegrind_arm::estimated::{Estimated, PosteriorComponent};

/// An estimated arm, and the posterior of its parameters, which is worked out once and not for each program.
#[derive(Debug, Clone)]
pub struct PreparedEstimate<'a> {
    pub(crate) arm: &'a Estimated,
    pub(crate) posterior: Vec<PosteriorComponent>,
}

impl<'a> PreparedEstimate<'a> {
    /// Of an estimated arm.
    pub fn of(arm: &'a Estimated) -> Self {
        Self { arm, posterior: arm.posterior() }
    }

    /// The arm.
    pub fn arm(&self) -> &'a Estimated {
        self.arm
    }
}
