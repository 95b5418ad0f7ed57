//! Tests of `identification`.

mod beyond_noise;
mod calibration;
mod prior_width;
mod promise;
mod verdict;
