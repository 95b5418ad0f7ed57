//! Options of a diagnosis.

use super::selection::{self, BLOCKS};
use crate::identification::tolerance::Tolerance;
use crate::identification::verdict::Limits;

/// Options of a diagnosis.
#[derive(Debug, Clone)]
pub struct Options {
    /// Priors of links and frames in the search: wide, so that errors that geometry can explain are never called an effect.
    pub tolerance: Tolerance,
    /// Manufacturing tolerances of the arm: the written model is fitted under them and judged by them. With
    /// [`Tolerance::learn_widths`] (the default) they are estimated from the rows.
    pub arm_tolerance: Tolerance,
    /// Criteria of selection.
    pub selection: selection::Options,
    /// Number of contiguous blocks of the second validation.
    pub blocks: usize,
    /// Whether a smooth correction is fitted to a structured residual.
    pub smooth: bool,
    /// Whether rounded angles are fused with the controller's read-out.
    pub fuse_readout: bool,
    /// Limits for the held-out error of the written model (random folds).
    pub limits: Limits,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            tolerance: Tolerance {
                length_mm: 3.0,
                angle_rad: 1.0_f64.to_radians(),
                zero_rad: 1.0_f64.to_radians(),
                ..Tolerance::default()
            },
            arm_tolerance: Tolerance { learn_widths: true, ..Tolerance::default() },
            selection: selection::Options::default(),
            blocks: BLOCKS,
            smooth: false,
            fuse_readout: true,
            limits: Limits::default(),
        }
    }
}
