//! Results of the inverse: a solution, or the reason why there is none.

use super::configuration::Configuration;
use crate::joints::Joints;
use crate::limits::Limited;

/// Joints that reach a target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solution {
    /// Controller angles (rad).
    pub joints: Joints,
    /// Position residual of the flange (mm).
    pub residual_mm: f64,
    /// Orientation residual of the flange (rad).
    pub residual_rad: f64,
    /// Newton steps taken.
    pub iterations: usize,
    /// Distance to singularity: 1/‖J⁻¹‖ (Frobenius), J as in
    /// [`Inverse::smallest_singular_value`](super::Inverse::smallest_singular_value), of which it is a
    /// lower bound: equal close to a singularity, and smaller by at most √6. 0 at a singularity.
    pub singularity: f64,
}

/// A named singularity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Singularity {
    /// Axes 4 and 6 (UR: 6 and the parallel ones) in line: joint 5.
    Wrist,
    /// The arm stretched or folded: joint 3.
    Elbow,
    /// The wrist centre on axis 1: joint 1.
    Shoulder,
    /// None of the named ones.
    Other,
}

impl Singularity {
    /// The joint (0-based) whose motion leaves the singularity or which moves fast near it.
    pub fn joint(&self) -> Option<usize> {
        match self {
            Singularity::Wrist => Some(4),
            Singularity::Elbow => Some(2),
            Singularity::Shoulder => Some(0),
            Singularity::Other => None,
        }
    }
}

impl std::fmt::Display for Singularity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Singularity::Wrist => "wrist singularity (joint 5)",
            Singularity::Elbow => "elbow singularity (joint 3)",
            Singularity::Shoulder => "shoulder singularity (joint 1)",
            Singularity::Other => "singularity",
        })
    }
}

/// Distances to the named singularities, each 0 at the singularity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SingularityDistances {
    /// |sin| of the angle between axes 4 and 6; of axis 6 and the parallel axes for a UR arm.
    pub wrist: f64,
    /// |sin| of the angle between lower arm and forearm.
    pub elbow: f64,
    /// Distance of the wrist centre from the plane of axis 1, as a fraction of the arm's extent.
    pub shoulder: f64,
}

impl SingularityDistances {
    /// The nearest singularity and its distance.
    pub fn nearest(&self) -> (Singularity, f64) {
        let named = [
            (Singularity::Wrist, self.wrist),
            (Singularity::Elbow, self.elbow),
            (Singularity::Shoulder, self.shoulder),
        ];
        named
            .into_iter()
            .fold((Singularity::Other, f64::INFINITY), |best, n| if n.1 < best.1 { n } else { best })
    }
}

/// Why a target has no joints.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InverseError {
    /// No branch reaches the target.
    #[error("target is out of reach by {beyond_mm:.3} mm")]
    Unreachable {
        /// How far the target's wrist centre lies outside the nominal arm's reach, on the nearest branch (mm).
        beyond_mm: f64,
    },
    /// The target requires an angle outside the range of a joint or a sum of joints.
    #[error(
        "{what} would need {:.3}°, its range is {:.3}° to {:.3}°",
        angle_rad.to_degrees(), min_rad.to_degrees(), max_rad.to_degrees()
    )]
    OutsideLimits {
        /// What has that range.
        what: Limited,
        /// The angle it would need (rad).
        angle_rad: f64,
        /// Lower limit (rad).
        min_rad: f64,
        /// Upper limit (rad).
        max_rad: f64,
    },
    /// No joints were found because the arm is too close to a singularity.
    #[error("no joints found this close to the {singularity}: distance {distance:.2e}")]
    NearSingularity {
        /// Which one.
        singularity: Singularity,
        /// Its distance, see [`SingularityDistances`].
        distance: f64,
    },
    /// The target is reachable, but not on the branch of the seed.
    #[error("target is reachable only in another configuration: cfx {found} instead of {wanted}")]
    OtherBranch {
        /// cfx of the seed.
        wanted: i32,
        /// cfx of the nearest solution.
        found: i32,
    },
    /// The target is reachable, but not in the requested configuration.
    #[error("target is not reachable in configuration {wanted}; the nearest is {nearest}")]
    OtherConfiguration {
        /// The requested configuration.
        wanted: Configuration,
        /// The nearest that reaches the target.
        nearest: Configuration,
    },
    /// Newton's method did not converge.
    #[error("no solution found: {residual_mm:.3e} mm and {residual_rad:.3e} rad remain")]
    NotConverged {
        /// Remaining distance (mm).
        residual_mm: f64,
        /// Remaining angle (rad).
        residual_rad: f64,
    },
    /// The search budget is used up: see [`budget`](super::budget).
    #[error(
        "the search for its joints was stopped: too many targets of this program are out of reach or near a singularity, and the \
         work on such targets is bounded; correct them first, or divide the program"
    )]
    Abandoned,
    /// The target or the seed holds NaN or an infinity.
    #[error("target or seed is not a finite number")]
    NotFinite,
}
