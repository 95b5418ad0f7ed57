//! Tests of `kinematics`.

mod arms;
mod inverse;
