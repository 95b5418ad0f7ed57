//! Calibration as a nonlinear least-squares problem: link, effect and frame parameters from cable lengths, positions or poses.
//!
//! Residuals, whitened by the row's weight w = 1/σ, with p the target in the base, C the sensor's frame in the base, m the
//! reading:
//!
//! - cable: w (‖p − outlet‖ + zero − L), with the Jacobian row uᵀ·∂p, u the unit cable direction. ltlm-2024 eq. 10 and
//!   13 need this chain-rule step and print only the 3 × 24 Jacobian of position (eq. 7);
//! - position: w (C m − p), three rows;
//! - pose: the same, and three rows of ½ vee(E − Eᵀ), E = R_C R_m (R R_t)ᵀ, which is the rotation vector up to third
//!   order of the remaining angle, with a weight of its own.
//!
//! Shapes: x holds deviations from the starting values of [`CalibrationProblem::free_parameters`], so that the nominal arm is
//! x = 0 and every prior has mean 0. Rows are processed eight at a time in SIMD lanes; sines and cosines of the logged joints
//! are stored, except for very many rows. One pass over n rows with 28 parameters costs some 1,200 n operations and reads 13
//! numbers a row.
//! Checked against: numerical derivatives of every column, in the tests.

mod columns;
mod regressors;
mod sensor_motion;
mod frames;
mod kernel;
mod passes;
mod problem;

pub use frames::{Frames, Weight};
pub use problem::CalibrationProblem;
pub use regressors::{
    LoadedRows, flange_torques, joint_rotations, sensor_shifts, sensor_turns, torques_under,
};
pub use sensor_motion::{Motion, motions_by_links};
