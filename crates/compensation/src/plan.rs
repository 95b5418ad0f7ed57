//! A planned rewrite: the changes, and the outcome of every motion.

pub mod listing_only_plan;
mod measured_sigma;
pub(crate) mod notes;
pub mod planner;
pub mod reason;
pub mod single_precision;
pub mod solved_program;
pub mod steps_to_left;
mod surface_normals;

use crate::deviation::{MissingMotions, MotionStatus, PathPoint};
use crate::plan::reason::OutcomeReason;
use crate::plan::steps_to_left::StepsToLeft;
use crate::risk::cut_risk::CutRisk;
use crate::risk::placement::ObjectPlacement;
use truegrind_math::option_f64::OptionF64;
use truegrind_programs::motion::Listing;
use truegrind_programs::rewrite::Change;

/// Outcome of one motion; feeds the JSON contract and the table. Small, because a program may have a million motions.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionOutcome {
    /// Index into the listing.
    pub motion: u32,
    /// Changed, flagged, refused or left.
    pub status: MotionStatus,
    /// Reason for that status; most motions have none.
    pub reason: Option<Box<OutcomeReason>>,
    /// Deviation of its end before and after (mm).
    pub before_mm: OptionF64,
    /// See `before_mm`; predicted.
    pub after_mm: OptionF64,
    /// Predicted standard deviation of the end position (mm).
    pub sigma_mm: OptionF64,
    /// Predicted standard deviation of the shape of its cut, after the best rigid registration of all on the part (mm); absent outside cuts.
    pub shape_sigma_mm: OptionF64,
    /// Largest deviation from the intended path on the segment to this end that remains (mm).
    pub path_deviation_mm: OptionF64,
    /// Targets inserted before it.
    pub inserted: u32,
}

impl MotionOutcome {
    /// Reason for its status.
    pub fn reason(&self) -> Option<OutcomeReason> {
        self.reason.as_deref().copied()
    }

    /// A motion that nothing is computed for.
    pub(crate) fn left(motion: u32) -> Self {
        Self {
            motion,
            status: MotionStatus::Left,
            reason: None,
            before_mm: OptionF64::NONE,
            after_mm: OptionF64::NONE,
            sigma_mm: OptionF64::NONE,
            shape_sigma_mm: OptionF64::NONE,
            path_deviation_mm: OptionF64::NONE,
            inserted: 0,
        }
    }
}

/// A planned rewrite.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plan {
    /// Changes to write.
    pub changes: Vec<Change>,
    /// One entry per motion of the listing.
    pub outcomes: Vec<MotionOutcome>,
    /// End points of all motions that have a pose, in order; empty unless [`Options::points`](crate::options::Options::points).
    pub points: Vec<PathPoint>,
    /// Assumptions about tools, work objects, payload, backlash and configurations.
    pub notes: Vec<String>,
    /// External axes that move or do not stand at 0, and of which the cell file does not say what they carry.
    pub unstated_axes: Vec<char>,
    /// How many corrected motions have a load that is known only at run time, under a model whose deflection follows the load.
    pub unknown_loads: usize,
    /// How many corrected motions carry another load than that of the measurement, under a deflection that holds for that one alone.
    pub other_loads: usize,
    /// Whether program or job state a mass far above what the robot is rated for: the model was not measured under it.
    pub is_overloaded: bool,
    /// Whether a corrected motion has a tool whose tip lies behind the flange, within the wrist.
    pub has_tip_in_wrist: bool,
    /// Whether a tool or work object has no stated origin and was taken as exact.
    pub assumes_origins: bool,
    /// Steps between corrected motions and neighbours that are left; known once the program is rewritten.
    pub steps: Option<StepsToLeft>,
    /// How the position of each work object was treated.
    pub placements: Vec<ObjectPlacement>,
    /// Risk assessment of each cut.
    pub cuts: Vec<CutRisk>,
    /// Probability that the correction does harm, over all corrected cuts together; absent without an assessment.
    pub probability_of_harm: Option<f64>,
}

impl Plan {
    /// Motions without a point, with their outcomes.
    pub fn missing_motions(&self, listing: &Listing) -> Option<MissingMotions> {
        MissingMotions::of(listing, |motion| match self.outcomes.get(motion as usize) {
            Some(outcome) if outcome.before_mm.get().is_some() => None,
            Some(outcome) => Some((outcome.status, outcome.reason().map(|reason| reason.to_string()))),
            None => Some((MotionStatus::Left, None)),
        })
    }
}
