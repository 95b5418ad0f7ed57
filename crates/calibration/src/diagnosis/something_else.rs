//! What a planner needs to know of the part of the residual that no cause explains: how it depends on time and pose, and what was
//! read where.
//!
//! The part over poses is a Gaussian process of the first five joint angles q, of each coordinate of the reading:
//! cov(f(q), f(q′)) = Σ σ² exp(−|q − q′|² / 2ℓ²), one term for each field, beside independent noise. The variances are those
//! of the discrepancy by marginal likelihood; the random features of the fit have this covariance as their mean.

use serde::{Deserialize, Serialize};

/// A smooth function of the joint angles.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Field {
    /// Correlation length ℓ (rad).
    pub length_rad: f64,
    /// Standard deviation σ of a coordinate or length (mm).
    pub sigma_mm: f64,
}

/// What remained at a pose.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RemainingAt {
    /// Joint angles (°).
    pub joints_deg: [f64; 6],
    /// Measured minus modelled, of a length or of three coordinates, mean of its readings (mm).
    pub residual_mm: Vec<f64>,
}

/// The unexplained part of a diagnosis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SomethingElse {
    /// Its size in the readings (mm RMS).
    pub size_mm: f64,
    /// The part that follows time (mm RMS).
    pub in_time_mm: f64,
    /// The part that follows the pose (mm RMS).
    pub over_poses_mm: f64,
    /// Correlation of consecutive readings; 0 if insignificant.
    pub correlation: f64,
    /// Duration of the measurement (h), where it was logged.
    pub hours: Option<f64>,
    /// Standard deviation of the noise beside it, of a coordinate or length (mm).
    pub noise_mm: f64,
    /// The fields over poses.
    pub fields: Vec<Field>,
    /// Measured poses, at most 300 of them.
    pub poses: Vec<RemainingAt>,
}

impl SomethingElse {
    /// Whether a course in time is the larger question.
    pub fn is_in_time(&self) -> bool {
        self.fields.is_empty() || self.in_time_mm > self.over_poses_mm
    }
}
