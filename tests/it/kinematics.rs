//! Tests of `kinematics`, and of the mathematics below it.

mod arms;
mod files;
mod batch;
mod effect;
mod forward;
mod inverse;
mod inverse_path;
mod jacobian;
mod lanes;
mod se3;
