//! Tools and work objects: as programmed, and where they really are.

pub(crate) mod frame_pair;
pub(crate) mod frame_table;
mod known_tools;
pub mod surface_frames;
pub mod taught;
pub(crate) mod teaching_geometry;
pub(crate) mod tip_in_wrist;
pub mod undeclared;
