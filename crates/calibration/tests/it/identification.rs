//! Tests of `identification`.

mod calibration;
mod promise;
mod verdict;
