//! Planning: programs from surface files, and measurement poses from optimal experiment design.

pub mod toolpath;
pub mod taught_cell;
pub mod poses;
