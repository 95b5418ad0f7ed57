//! Tests of `identification`.

mod calibration;
mod prior_width;
mod promise;
mod verdict;
