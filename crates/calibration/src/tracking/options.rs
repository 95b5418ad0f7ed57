//! Settings of a track.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Settings of a track.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Options {
    /// Random walk of a length of the arm from pose to pose (mm).
    pub drift_length_mm: f64,
    /// Random walk of an angle of the arm from pose to pose (rad).
    pub drift_angle_rad: f64,
    /// Random walk of a frame's position from pose to pose (mm).
    pub drift_frame_mm: f64,
    /// Random walk of a frame's orientation from pose to pose (rad).
    pub drift_frame_rad: f64,
    /// Random walks of single parameters that replace the above, by name (`link2.theta`), in mm or rad.
    pub drift: BTreeMap<String, f64>,
    /// Standard deviation of a reading (mm), unmodelled effects included. Where not stated: the residual of the first poses, but
    /// at least the model's held-out error.
    pub sigma_mm: Option<f64>,
    /// Poses that register the sensor before tracking begins.
    pub first_poses: usize,
    /// Poses of the alarm's window.
    pub window: usize,
    /// Poses of the history that is searched for a change.
    pub history: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            drift_length_mm: 2e-4,
            drift_angle_rad: 4e-7,
            drift_frame_mm: 2e-4,
            drift_frame_rad: 4e-7,
            drift: BTreeMap::new(),
            sigma_mm: None,
            first_poses: 30,
            window: 15,
            history: 200,
        }
    }
}
