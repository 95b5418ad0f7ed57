//! Tests of `identification`.

mod beyond_noise;
mod calibration;
mod fit;
mod misread_poses;
mod mixed_rows;
mod prior_width;
mod promise;
mod repeats;
mod rounded_log;
mod sensor_laws;
mod shifted_rows;
mod stated_frame;
mod stations;
pub(crate) mod unseen_target;
mod verdict;
