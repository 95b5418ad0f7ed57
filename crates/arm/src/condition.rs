//! Conditions beside the joint angles that determine the pose of the arm.

use serde::{Deserialize, Serialize};

/// The condition of one pose. An unknown value is `None`, and effects that depend on it are zero.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Condition {
    /// Time since the arm was switched on (h).
    pub time_h: Option<f64>,
    /// Temperature of the arm [°C].
    pub temperature_c: Option<f64>,
    /// Mass at the flange (kg).
    pub payload_kg: Option<f64>,
    /// Centre of the payload in the flange frame (mm).
    pub payload_centre_mm: [f64; 3],
    /// Approach direction of each joint, in the sense of the controller's angle: −1 from below, +1 from above, 0 unknown.
    pub approach: [i8; 6],
}

impl Condition {
    /// This condition with the time, temperature and payload of `other` where they are unknown.
    #[must_use]
    pub fn or(self, other: &Self) -> Self {
        let (payload_kg, payload_centre_mm) = match self.payload_kg {
            Some(_) => (self.payload_kg, self.payload_centre_mm),
            None => (other.payload_kg, other.payload_centre_mm),
        };
        Self {
            time_h: self.time_h.or(other.time_h),
            temperature_c: self.temperature_c.or(other.temperature_c),
            payload_kg,
            payload_centre_mm,
            approach: self.approach,
        }
    }
}
