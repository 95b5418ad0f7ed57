//! What the control holds while a rewritten file runs.

/// What the control will hold at a block, where the rewritten file says something else than the original.
#[derive(Debug, Clone, Default)]
pub(super) struct ControlState {
    /// Position (mm); `None` where it is as the original says.
    pub(super) position: [Option<f64>; 3],
    /// What the original says there.
    pub(super) intended: [Option<f64>; 3],
    pub(super) angles: [Option<f64>; 3],
    pub(super) vector: Option<([f64; 3], f64)>,
    /// By how much a shift of G92 has moved, because it was set where the tool now stands elsewhere.
    pub(super) moved: [f64; 3],
    /// Whether G1 holds where the original has G2 or G3, because an arc before has become straight.
    pub(super) straightened: bool,
}

impl ControlState {
    pub(super) fn lose(&mut self, axes: u8) {
        for axis in 0..3 {
            if axes & 1 << axis != 0 {
                (self.position[axis], self.intended[axis]) = (None, None);
            }
            if axes & 8 << axis != 0 {
                self.angles[axis] = None;
            }
        }
    }

    pub(super) fn place(&mut self, axes: [bool; 3]) {
        for (moved, _) in self.moved.iter_mut().zip(axes).filter(|(_, placed)| *placed) {
            *moved = 0.0;
        }
    }

    pub(super) fn shift_at(&mut self, stated: [Option<f64>; 3]) {
        for (axis, _) in stated.iter().enumerate().filter(|(_, stated)| stated.is_some()) {
            self.moved[axis] = match (self.position[axis], self.intended[axis]) {
                (Some(now), Some(intended)) if !now.is_nan() => now - intended,
                // It stands where the original says.
                _ => 0.0,
            };
        }
    }
}
