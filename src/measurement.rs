//! What was measured: rows of joint angles with a sensor's reading, from files or from a simulated arm.

pub mod dataset;
pub mod import;
pub mod sensor;
pub mod registration;
pub mod simulation;
pub mod split;
pub mod plausibility;
