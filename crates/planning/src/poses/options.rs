//! Settings of a plan.

use super::candidate::Bounds;
use super::questions::Question;
use super::schedule::Visits;
use truegrind_calibration::identification::tolerance::Tolerance;

/// Settings of a plan.
#[derive(Debug, Clone)]
pub struct Options {
    /// Number of different poses.
    pub poses: usize,
    /// Optimality criterion.
    pub index: Index,
    /// Noise of a reading.
    pub noise: Noise,
    /// Priors.
    pub tolerance: Tolerance,
    /// Number of candidates.
    pub candidates: usize,
    /// Constraints on candidates.
    pub bounds: Bounds,
    /// Repeated visits.
    pub visits: Visits,
    /// Ambiguous findings of a diagnosis.
    pub questions: Vec<Question>,
    /// Non-centrality from which an effect counts as detected.
    pub decisive: f64,
    /// Seed of all random numbers.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            poses: 60,
            index: Index::default(),
            noise: Noise::default(),
            tolerance: Tolerance::default(),
            candidates: 2000,
            bounds: Bounds::default(),
            visits: Visits::default(),
            questions: Vec::new(),
            decisive: 25.0,
            seed: 0,
        }
    }
}

/// Total standard deviations of a reading: sensor, hook, repeatability of the arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Of a length or a coordinate (mm).
    pub reading_mm: f64,
    /// Of an orientation (rad).
    pub reading_rad: f64,
}

impl Default for Noise {
    fn default() -> Self {
        Self { reading_mm: 0.03, reading_rad: 1e-4 }
    }
}

/// Optimality criterion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Index {
    /// Determinant of the normal matrix with its priors: minimises the volume of the posterior's confidence ellipsoid.
    #[default]
    D,
    /// Observability index O1: the geometric mean of the singular values, without priors, over the combinations that
    /// the candidates determine.
    O1,
}
