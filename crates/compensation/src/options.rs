//! What a rewrite may do.

use crate::condition::payload::Loads;
use crate::cut::Cuts;
use crate::risk::placement::Placement;
use truegrind_arm::condition::Condition;
use truegrind_programs::motion::{Motion, MotionKind};

/// What is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Emit {
    /// Moved robtargets: the program keeps its form.
    #[default]
    Targets,
    /// Joint targets, for controllers whose own model should have no say.
    Joints,
}

/// What becomes of circular motions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Circles {
    /// Three corrected points make a circle again; the path is checked by sampling it.
    #[default]
    Keep,
    /// Straight pieces within the tolerance, where the language and the arm allow it.
    Segments,
}

/// Bounds of a rewrite.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// What is written.
    pub emit: Emit,
    /// What becomes of circular motions.
    pub circles: Circles,
    /// How far the path between two targets may leave the intended line (mm).
    pub tolerance_mm: f64,
    /// Largest correction of a position that is written (mm).
    pub max_correction_mm: f64,
    /// Largest correction of an orientation that is written (rad).
    pub max_rotation_rad: f64,
    /// A pose with a smaller distance to singularity is refused (scaled smallest singular value, of order sin θ5 / 10).
    pub min_singularity: f64,
    /// How far a correction may turn a joint: so many times the size of the correction, which is the shift of the flange
    /// over half the length of the arm's links (so that it is in rad) plus its turn (rad). An arm far from singularities
    /// needs once that, hardly ever five times; 1/sin θ5 and the like make it more near a singularity.
    pub joint_gain: f64,
    /// A joint may turn by this for any correction (rad), so that rounding and small corrections are let through where
    /// what they cost does no harm.
    pub free_joint_change_rad: f64,
    /// Whether joint targets are rewritten too: a home position says joints, not a pose.
    pub joint_targets: bool,
    /// Decimals of positions as they will be written, to state what rounding leaves.
    pub position_decimals: u8,
    /// What circumstances the program will run under. The sides from which joints come follow from its motion.
    pub condition: Condition,
    /// What the program says that the arm carries; absent where the payload of `condition` counts throughout.
    pub loads: Option<Loads>,
    /// What becomes of a cut of which not every motion can be corrected.
    pub cuts: Cuts,
    /// Whether the place of a path is corrected, or its shape alone.
    pub placement: Placement,
    /// A cut that the correction makes worse with a larger probability is left.
    pub max_risk: f64,
    /// Whether motions are flagged one by one ([`OutcomeReason::UnknownStart`](crate::plan::reason::OutcomeReason::UnknownStart)) that rest on a configuration which the
    /// controller does not check, from a start that the text does not tell. Otherwise a note says where such a way begins.
    pub flag_unknown_starts: bool,
    /// Whether [`Plan::points`](crate::plan::Plan::points) are filled: tables and pictures of the path need them, the rewrite itself
    /// does not.
    pub points: bool,
    /// Whether [`ObjectPlacement::remedy`](crate::risk::placement::ObjectPlacement::remedy) is worked out, which takes longer than a small
    /// program: who reads of many programs at once does not see it.
    pub remedies: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            emit: Emit::Targets,
            circles: Circles::Keep,
            tolerance_mm: 0.05,
            max_correction_mm: 10.0,
            max_rotation_rad: 2.0_f64.to_radians(),
            min_singularity: 1e-3,
            joint_gain: 8.0,
            free_joint_change_rad: 0.5_f64.to_radians(),
            joint_targets: false,
            position_decimals: 4,
            condition: Condition::default(),
            loads: None,
            cuts: Cuts::Whole,
            placement: Placement::Auto,
            max_risk: 0.1,
            flag_unknown_starts: false,
            points: true,
            remedies: true,
        }
    }
}

/// Whether a motion is of a kind that is rewritten at all.
pub(crate) fn is_rewritable(motion: &Motion, options: &Options) -> bool {
    motion.left.is_none() && (motion.kind != MotionKind::AbsoluteJoint || options.joint_targets)
}
