//! Tests of `identification`.

mod calibration;
mod real;
