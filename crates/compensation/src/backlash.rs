//! Backlash: from which side each joint arrives at every target, and where the links lie within their play on the way.

pub(crate) mod joint_samples;
pub(crate) mod motion_end;
pub(crate) mod play_operator;
mod play_track;
mod reversals;
pub(crate) mod sides;
