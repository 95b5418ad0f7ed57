//! Segments: the path from one target to the next, as the controller interpolates it and as the estimated arm follows it.

pub(crate) mod circle;
pub(crate) mod condition_schedule;
pub mod corner;
pub mod curve;
pub(crate) mod joint_speed;
pub(crate) mod line;
pub(crate) mod rounded_end;
pub(crate) mod segment_plan;
pub(crate) mod wrist_interpolation;
