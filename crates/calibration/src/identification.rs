//! From measured rows to an estimated arm: the calibration as a [`truegrind_estimation::problem::Problem`], what the data
//! can and cannot tell, and the fit with its verdict.

pub mod calibration;
pub mod tolerance;
pub(crate) mod unseen_target;
pub mod prior_width;
pub mod rounding;
pub(crate) mod rounded_log;
pub mod identifiability;
pub mod network;
pub mod solver;
pub mod fit;
pub mod start;
pub(crate) mod parameter_table;
pub mod repeats;
mod sessions;
mod cable_factor;
pub(crate) mod shifted_rows;
pub(crate) mod misreading;
pub(crate) mod mixed_rows;
pub(crate) mod rigid_motion_columns;
pub mod stated_frame;
pub mod stated_placement;
pub mod sensor_laws;
pub(crate) mod scaled_cholesky;
pub(crate) mod linearised_readings;
pub(crate) mod shape_metric;
pub mod inflation;
pub mod benefit;
pub mod beyond_noise;
pub mod verdict;
pub mod identify;
pub mod register;
pub mod study;
