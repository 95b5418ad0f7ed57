//! Bounds and choices of a correction.

use crate::cut::Cuts;
use crate::risk::placement::Placement;
use truegrind_arm::condition::Condition;
use truegrind_programs::motion::load::Loads;
use truegrind_programs::motion::{Motion, MotionKind};

/// How corrected targets are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Emit {
    /// Moved robtargets: the program keeps its form.
    #[default]
    Targets,
    /// Joint targets, for controllers whose own kinematic model should not be used.
    Joints,
}

/// Treatment of circular motions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Circles {
    /// Three corrected points define the new circle; its path is checked by sampling.
    #[default]
    Keep,
    /// Straight segments within the tolerance, where the language and the arm allow it.
    Segments,
}

/// Bounds and choices of a correction.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// How corrected targets are written.
    pub emit: Emit,
    /// Treatment of circular motions.
    pub circles: Circles,
    /// Largest deviation of the path between two targets from the intended one (mm).
    pub tolerance_mm: f64,
    /// Largest position correction that is written (mm).
    pub max_correction_mm: f64,
    /// Largest orientation correction that is written (rad).
    pub max_rotation_rad: f64,
    /// A pose closer to a singularity than this is refused (scaled smallest singular value, of order sin θ5 / 10).
    pub min_singularity: f64,
    /// Largest joint change per size of the correction. The size is the flange displacement over half the length of the arm's
    /// links (hence in rad) plus its rotation (rad). Far from singularities the ratio is about 1 and rarely reaches 5; near
    /// one, factors such as 1/sin θ5 increase it.
    pub joint_gain: f64,
    /// A joint change below this is always allowed (rad), so that rounding and small corrections pass where they do no harm.
    pub free_joint_change_rad: f64,
    /// Whether joint targets are rewritten too: a home position means joints, not a pose.
    pub joint_targets: bool,
    /// Decimals of written positions, to predict the rounding error.
    pub position_decimals: u8,
    /// Condition under which the program will run. Backlash sides follow from the program's own motion.
    pub condition: Condition,
    /// Payloads that the program states; absent where the payload of `condition` applies throughout.
    pub loads: Option<Loads>,
    /// Treatment of a cut in which some motion cannot be corrected.
    pub cuts: Cuts,
    /// Whether the position of a path is corrected, or only its shape.
    pub placement: Placement,
    /// A cut that the correction makes worse with a higher probability remains unmodified.
    pub max_risk: f64,
    /// Whether [`Plan::points`](crate::plan::Plan::points) is filled: needed for tables and pictures of the path, not for the
    /// rewrite.
    pub points: bool,
    /// Whether [`ObjectPlacement::remedy`](crate::risk::placement::ObjectPlacement::remedy) is computed. It takes longer than
    /// correcting a small program and is not shown in batch reports.
    pub remedies: bool,
}

impl Options {
    /// Largest [`Options::tolerance_mm`] that can be meant (mm): a path that deviates by more is another one.
    pub const MAX_TOLERANCE_MM: f64 = 10.0;
    /// Largest [`Options::max_correction_mm`] that can be meant (mm): ten times what an arm is off by.
    pub const MAX_CORRECTION_MM: f64 = 100.0;
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
            points: true,
            remedies: true,
        }
    }
}

/// Whether a motion is of a kind that can be rewritten.
pub(crate) fn is_rewritable(motion: &Motion, options: &Options) -> bool {
    motion.own_reason.is_none() && (motion.kind != MotionKind::AbsoluteJoint || options.joint_targets)
}
