//! The masses of an arm.

use serde::{Deserialize, Serialize};

/// Mass of one link.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Mass (kg).
    pub mass_kg: f64,
    /// Centre of mass in the frame at the end of the link (mm).
    pub centre_mm: [f64; 3],
}
