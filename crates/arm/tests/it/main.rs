//! Tests of the arm: kinematics, effects, files, and the mathematics below them.

// A test that cannot go on panics.
#![allow(clippy::unwrap_used, clippy::print_stderr)]

mod arms;
mod axpy;
mod posterior;
mod robots;
mod files;
mod batch;
mod effect;
mod search_budget;
mod foreign;
mod forward;
mod rounding;
mod gram;
mod inverse;
mod inverse_path;
mod jacobian;
mod link_motion;
mod lanes;
mod se3;
mod work;
