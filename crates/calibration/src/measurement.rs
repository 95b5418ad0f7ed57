//! Measurements: rows of joint angles, each with a sensor's reading, read from files or simulated.
//!
//! ```text
//! bytes → import → Dataset → plausibility (units, quaternion order) → convention (the controller's angles)
//!       → registration (sensor frame and target) → split (held-out rows) → identification
//! ```
//!
//! A [`simulation`] writes the same files from a known arm, so that everything above can be checked against the truth.
//! Nothing in this module opens a file or knows the catalogue of robots: the caller resolves names.

pub mod dataset;
pub mod import;
pub mod convention;
pub mod plausibility;
pub mod matching;
pub mod rows_of_robot;
mod axis_range;
mod copies;
mod measuring_order;
mod reach;
pub(crate) mod row_list;
pub mod sensor;
pub mod registration;
pub mod stations;
pub mod repeated_poses;
mod reversed_sides;
pub mod noise_floor;
pub mod split;
pub mod simulation;
