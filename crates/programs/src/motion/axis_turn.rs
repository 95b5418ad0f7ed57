//! The turn of a tool by three words of orientation.

use nalgebra::UnitQuaternion;

use crate::nc::orientation::Angles;

/// Three words of orientation that run linearly, each on its own, as rotary axes do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisTurn {
    /// Their convention.
    pub convention: Angles,
    /// The words in effect at the start (°), whole turns included.
    pub from_deg: [f64; 3],
    /// Those at the end.
    pub to_deg: [f64; 3],
}

impl AxisTurn {
    /// The orientation at a share of the path.
    pub fn at(&self, share: f64) -> UnitQuaternion<f64> {
        self.convention.rotation(std::array::from_fn(|axis| {
            self.from_deg[axis] + share * (self.to_deg[axis] - self.from_deg[axis])
        }))
    }
}
