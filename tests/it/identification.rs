//! Tests of `identification`.

mod calibration;
