//! Tests of `identification`.

mod calibration;
mod promise;
mod real;
mod verdict;
