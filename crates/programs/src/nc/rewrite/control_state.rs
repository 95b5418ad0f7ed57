//! The state of the control while a rewritten file runs.

use crate::nc::task::BlockContext;

/// The state of the control at a block, where the rewritten file differs from the original. NaN: restate in any case.
#[derive(Debug, Clone, Default)]
pub(super) struct ControlState {
    /// Position (mm); `None` where it is as in the original.
    pub(super) position: [Option<f64>; 3],
    /// The position in the original.
    pub(super) intended: [Option<f64>; 3],
    pub(super) angles: [Option<f64>; 3],
    pub(super) vector: Option<([f64; 3], f64)>,
    /// The change of a G92 shift that is set at a corrected position (mm).
    pub(super) shift_change: [f64; 3],
    /// Whether G1 is in effect instead of G2 or G3, because an arc before has become straight.
    pub(super) straightened: bool,
}

impl ControlState {
    /// The start of a motion (mm).
    pub(super) fn start(&self, context: &BlockContext) -> [Option<f64>; 3] {
        std::array::from_fn(|axis| self.position[axis].or(context.start[axis]))
    }

    pub(super) fn invalidate_axes(&mut self, axes: u8) {
        for axis in 0..3 {
            if axes & 1 << axis != 0 {
                (self.position[axis], self.intended[axis]) = (None, None);
            }
            if axes & 8 << axis != 0 {
                self.angles[axis] = None;
            }
        }
    }

    pub(super) fn move_frame(&mut self, by_mm: [f64; 3]) {
        for (axis, by_mm) in by_mm.into_iter().enumerate() {
            for position in [&mut self.position[axis], &mut self.intended[axis]].into_iter().flatten() {
                *position += by_mm;
            }
        }
    }

    pub(super) fn shift_stated(&mut self, axes: [bool; 3]) {
        for (shift_change, _) in self.shift_change.iter_mut().zip(axes).filter(|(_, placed)| *placed) {
            *shift_change = 0.0;
        }
    }

    pub(super) fn set_origin(&mut self, stated: [Option<f64>; 3]) {
        for (axis, _) in stated.iter().enumerate().filter(|(_, stated)| stated.is_some()) {
            self.shift_change[axis] = match (self.position[axis], self.intended[axis]) {
                (Some(current), Some(intended)) if !current.is_nan() => current - intended,
                // The position is as in the original.
                _ => 0.0,
            };
        }
    }
}
