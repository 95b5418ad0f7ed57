//! truegrind learns how one real robot arm differs from its data sheet, names the causes, and rewrites RAPID and NC
//! programs so that the real arm follows the intended path.

pub mod math;
pub mod kinematics;
pub mod program;
pub mod surface;
pub mod robots;
pub mod measurement;
pub mod estimation;
pub mod identification;
pub mod diagnosis;
pub mod compensation;
pub mod planning;
pub mod comparison;
pub mod report;
#[cfg(feature = "visual")]
pub mod visual;
