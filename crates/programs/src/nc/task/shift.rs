//! Coordinate shifts (G52, G92), and the tool position after them.

use super::super::dialect::Dialect;
use super::super::expression::Evaluated;
use super::super::modal_group::ModalGroup;
use super::{Block, Interpreter, StateEvent};
use crate::motion::Reason;

impl Interpreter<'_, '_> {
    /// G52, G92 and their cancellation. True if the axis words are not a modelled motion.
    pub(super) fn shift_code(&mut self, block: &Block<'_>, code: u32) -> bool {
        let linux = self.dialect == Dialect::LinuxCnc;
        match code {
            // Added to the shift of G92 or replacing it: the controls differ.
            520 if self.state.origin_set && !linux => self.invalidate_shift(),
            520 if self.dialect != Dialect::Siemens => self.shift_frame(block),
            // A spindle speed limit.
            920 if self.limits_spindle(block) => {}
            920 => self.set_shift(block),
            // Fanuc cancels the shift of the named axes, LinuxCNC of all.
            921 if !self.cancels_all_shifts(block) => {
                self.leave_if_motion(block, code);
                self.invalidate_shift();
            }
            921 | 922 => {
                self.state.shift = [Ok(0.0); 3];
                self.state.origin_set = false;
                self.mark_shift_stated([true; 3]);
                self.set_group_varying(ModalGroup::CoordinateShift);
                if self.state.groups.is_on(ModalGroup::RotaryOffset) {
                    self.switch_transform(ModalGroup::RotaryOffset, false);
                }
                self.leave_if_motion(block, code);
                return !linux;
            }
            923 => {
                self.events.push(StateEvent::ShiftRestored);
                self.state.shift = [Err(Reason::UnknownVariable); 3];
                self.invalidate_group(ModalGroup::RotaryOffset, Reason::UnknownVariable);
                self.leave_if_motion(block, code);
                return !linux;
            }
            _ => return false,
        }
        true
    }

    /// A motion on LinuxCNC, none on Fanuc; for an ISO file this is unknown.
    fn leave_if_motion(&mut self, block: &Block<'_>, code: u32) {
        if self.dialect == Dialect::Iso && block.has_motion_words() {
            self.leave_unknown_end(block, code, Reason::UnknownWord);
        }
    }

    /// G52: a shift of the work frame, in which the tool position gets other coordinates.
    fn shift_frame(&mut self, block: &Block<'_>) {
        self.keep_unknown_shift();
        for axis in 0..3 {
            if let Some(index) = block.axes[axis] {
                self.state.shift[axis] = self.length_in_mm(self.evaluate_word(&block.words[index]).0);
            }
        }
        self.mark_shift_stated(block.axes.map(|axis| axis.is_some()));
        self.set_rotary_shift(block, |_, value| value == Ok(0.0));
        self.set_group_varying(ModalGroup::CoordinateShift);
    }

    /// G92.1: whether it cancels every shift, or there is none.
    fn cancels_all_shifts(&self, block: &Block<'_>) -> bool {
        let rotary = self.state.groups.is_on(ModalGroup::RotaryOffset);
        let none = self.state.shift == [Ok(0.0); 3]
            && !rotary
            && self
                .state
                .unknown_reason(ModalGroup::CoordinateShift.bit() | ModalGroup::RotaryOffset.bit())
                .is_none();
        let named =
            block.axes.iter().all(Option::is_some) && (!rotary || block.abc.iter().all(Option::is_some));
        self.dialect == Dialect::LinuxCnc
            || self.dialect == Dialect::Iso && !block.has_motion_words()
            || none
            || named
    }

    /// Where the shift is unknown before, it stays unknown for the axes that are not named.
    fn keep_unknown_shift(&mut self) {
        if let Some(reason) = self.state.unknown_reason(ModalGroup::CoordinateShift.bit()) {
            self.state.shift = [Err(reason); 3];
        }
    }

    /// The shift is unknown until it is cancelled.
    fn invalidate_shift(&mut self) {
        self.state.shift = [Err(Reason::Displacement); 3];
        self.set_group_varying(ModalGroup::CoordinateShift);
        self.invalidate_pose();
    }

    /// Offsets of A, B and C, unless `same` shows that a value changes nothing.
    fn set_rotary_shift(&mut self, block: &Block<'_>, same: impl Fn(usize, Evaluated) -> bool) {
        let mut any = false;
        let mut changes = false;
        for axis in 0..3 {
            if let Some(index) = block.abc[axis] {
                any = true;
                changes |= !same(axis, self.evaluate_word(&block.words[index]).0);
            }
        }
        let was = self.state.groups.is_on(ModalGroup::RotaryOffset);
        if any && (changes || was) {
            self.switch_transform(ModalGroup::RotaryOffset, changes || block.abc.iter().any(Option::is_none));
        }
    }

    /// G92: the tool position gets these coordinates.
    fn set_shift(&mut self, block: &Block<'_>) {
        let mut stated = [None; 3];
        self.keep_unknown_shift();
        self.pass.effects.sets_origin = true;
        for (axis, stated) in stated.iter_mut().enumerate() {
            let Some(index) = block.axes[axis] else { continue };
            let value = self.length_in_mm(self.evaluate_word(&block.words[index]).0);
            self.state.shift[axis] = match (self.state.position[axis], value) {
                (Ok(at), Ok(value)) => {
                    *stated = Some(value);
                    Ok(at - value)
                }
                (Err(reason), _) | (_, Err(reason)) => Err(reason),
            };
        }
        let abc = self.state.orientation.abc;
        self.state.origin_set = true;
        self.set_group_varying(ModalGroup::CoordinateShift);
        let named = block.axes.map(|axis| axis.is_some());
        // Angles are set at the current orientation.
        let rotary = super::named_axes(block) & super::ORIENTATION;
        if rotary != 0 {
            self.mark_position_used(rotary);
        }
        if self.in_skippable_block {
            self.mark_position_used(super::named_axes(block));
            self.events.push(StateEvent::ShiftMaybeStated(named));
        } else {
            self.events.push(StateEvent::OriginSet { stated, named });
        }
        self.set_rotary_shift(block, |axis, value| value.is_ok() && abc[axis] == value);
    }

    /// The shift of these axes is stated in full.
    fn mark_shift_stated(&mut self, axes: [bool; 3]) {
        self.events.push(if self.in_skippable_block {
            StateEvent::ShiftMaybeStated(axes)
        } else {
            StateEvent::ShiftStated(axes)
        });
    }
}
