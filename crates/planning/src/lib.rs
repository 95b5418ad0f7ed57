//! From intentions to motions: surfaces to programs, and what to measure.

pub mod toolpath;
pub mod taught_cell;
pub mod poses;
