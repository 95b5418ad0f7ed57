//! What, beside the joint angles, decides where the arm stands.

use serde::{Deserialize, Serialize};

/// The circumstances of one pose. A circumstance that is not known is `None`, and effects that need it stand still.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Condition {
    /// Time since the arm was switched on (h).
    pub time_h: Option<f64>,
    /// Temperature of the arm [°C].
    pub temperature_c: Option<f64>,
    /// Mass at the flange (kg).
    pub payload_kg: Option<f64>,
    /// Centre of the payload in the last frame of the arm (mm).
    pub payload_centre_mm: [f64; 3],
    /// The side from which each joint came to rest: −1 from below, +1 from above, 0 not known.
    pub approach: [i8; 6],
}
