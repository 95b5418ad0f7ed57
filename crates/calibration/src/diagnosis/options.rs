//! How to diagnose.

use super::selection::{self, BLOCKS};
use crate::identification::tolerance::Tolerance;
use crate::identification::verdict::Limits;

/// How to diagnose.
#[derive(Debug, Clone)]
pub struct Options {
    /// Priors of links and frames: wide, so that what geometry can explain is never called an effect.
    pub tolerance: Tolerance,
    /// When a cause is accepted.
    pub selection: selection::Options,
    /// Contiguous blocks of the second validation.
    pub blocks: usize,
    /// Whether a smooth correction may follow what no cause explains.
    pub smooth: bool,
    /// Whether rounded angles are sharpened by the controller's read-out.
    pub fuse_readout: bool,
    /// What the held-out error of the written model (random folds) is held against.
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
            selection: selection::Options::default(),
            blocks: BLOCKS,
            smooth: false,
            fuse_readout: true,
            limits: Limits::default(),
        }
    }
}
