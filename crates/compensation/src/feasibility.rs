//! Motions that must stay unchanged, and why: bounds, joint limits, singularities, arcs, and the rest of a cut.

pub(crate) mod approaches;
pub(crate) mod arc_feasibility;
pub(crate) mod correction_bounds;
pub(crate) mod joint_limits;
pub(crate) mod half_turns;
pub(crate) mod joint_jump;
pub(crate) mod joint_lines;
pub mod measured_turns;
pub(crate) mod path_check;
pub(crate) mod segment_checker;
pub(crate) mod unchanged;
