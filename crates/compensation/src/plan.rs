//! A planned rewrite: what shall change, and what became of each motion.

pub mod listing_only_plan;
pub(crate) mod notes;
pub mod planner;
pub mod reason;
pub mod single_precision;
mod surface_normals;

use crate::deviation::{PathPoint, Status};
use crate::plan::reason::OutcomeReason;
use crate::risk::cut_risk::CutRisk;
use crate::risk::placement::ObjectPlacement;
use truegrind_programs::rewrite::Change;

/// What became of one motion, for the contract's JSON and the table.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionOutcome {
    /// Index into the listing.
    pub motion: u32,
    /// What became of it.
    pub status: Status,
    /// Why.
    pub reason: Option<OutcomeReason>,
    /// Deviation of its end before and after (mm).
    pub before_mm: Option<f64>,
    /// See `before_mm`; a predicted remainder.
    pub after_mm: Option<f64>,
    /// Predicted standard deviation of its place (mm).
    pub sigma_mm: Option<f64>,
    /// The same of the shape of its cut, after the best rigid registration (mm); absent outside cuts.
    pub shape_sigma_mm: Option<f64>,
    /// Largest bend of the path to this end that is left between targets (mm).
    pub path_deviation_mm: Option<f64>,
    /// Targets put in before it.
    pub inserted: usize,
}

impl MotionOutcome {
    /// A motion of which nothing is worked out.
    pub(crate) fn left(motion: u32) -> Self {
        Self {
            motion,
            status: Status::Left,
            reason: None,
            before_mm: None,
            after_mm: None,
            sigma_mm: None,
            shape_sigma_mm: None,
            path_deviation_mm: None,
            inserted: 0,
        }
    }
}

/// A planned rewrite.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plan {
    /// What shall change.
    pub changes: Vec<Change>,
    /// One entry for each motion of the listing.
    pub outcomes: Vec<MotionOutcome>,
    /// The ends of all motions that have a pose, in order; empty unless [`Options::points`](crate::options::Options::points).
    pub points: Vec<PathPoint>,
    /// What was assumed of tools and work objects.
    pub notes: Vec<String>,
    /// What was done about the place of each work object.
    pub placements: Vec<ObjectPlacement>,
    /// What is known of each cut.
    pub cuts: Vec<CutRisk>,
    /// Probability that the cuts that are corrected get worse, taken together; absent where nothing is known of them.
    pub probability_of_harm: Option<f64>,
}
