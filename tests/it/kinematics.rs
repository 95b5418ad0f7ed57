//! Tests of `kinematics`.
