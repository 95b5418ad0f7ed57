//! What is added to programmed values (G52, G92), and where the tool stands after it.

use super::super::dialect::Dialect;
use super::super::expression::Evaluated;
use super::super::modal_state::ModalGroup;
use super::{Block, Interpreter, StateEvent};
use crate::motion::Reason;

impl Interpreter<'_, '_> {
    /// G52, G92 and what ends them. True where the block's axis words are no motion that is followed.
    pub(super) fn shift_code(&mut self, block: &Block<'_>, code: u32) -> bool {
        let linux = self.dialect == Dialect::LinuxCnc;
        match code {
            // Within what G92 has shifted, or in its place: the controls differ.
            520 if self.state.origin_set && !linux => self.shift_is_lost(),
            520 if self.dialect != Dialect::Siemens => self.shift_frame(block),
            // The greatest speed of the spindle.
            920 if self.limits_spindle(block) => {}
            920 => self.set_shift(block),
            // Fanuc ends the shift of the axes that are named, LinuxCNC all.
            921 if !self.ends_all(block) => {
                self.may_move(block, code);
                self.shift_is_lost();
            }
            921 | 922 => {
                self.state.shift = [Ok(0.0); 3];
                self.state.origin_set = false;
                self.placed([true; 3]);
                self.set_group_varying(ModalGroup::CoordinateShift);
                if self.state.is_transform_active(ModalGroup::RotaryOffset) {
                    self.switch_transform(ModalGroup::RotaryOffset, false);
                }
                self.may_move(block, code);
                return !linux;
            }
            923 => {
                self.events.push(StateEvent::ShiftRestored);
                self.state.shift = [Err(Reason::Variable); 3];
                self.invalidate_group(ModalGroup::RotaryOffset, Reason::Variable);
                self.may_move(block, code);
                return !linux;
            }
            _ => return false,
        }
        true
    }

    /// What is a motion on LinuxCNC and none on a Fanuc: a plain file does not tell which.
    fn may_move(&mut self, block: &Block<'_>, code: u32) {
        if self.dialect == Dialect::Iso && block.has_motion_words() {
            self.leave_unknown_end(block, code, Reason::UnknownWord);
        }
    }

    /// G52: a shift of the work frame itself, in which the tool stands elsewhere then.
    fn shift_frame(&mut self, block: &Block<'_>) {
        self.shift_so_far();
        for axis in 0..3 {
            if let Some(index) = block.axes[axis] {
                self.state.shift[axis] = self.length_in_mm(self.evaluate_word(&block.words[index]).0);
            }
        }
        self.placed(block.axes.map(|axis| axis.is_some()));
        self.rotary(block, |_, value| value == Ok(0.0));
        self.set_group_varying(ModalGroup::CoordinateShift);
    }

    /// G92.1: whether every shift ends by it, or there is none.
    fn ends_all(&self, block: &Block<'_>) -> bool {
        let rotary = self.state.is_transform_active(ModalGroup::RotaryOffset);
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

    /// What has been added to programmed values so far: where that is in doubt, of the axes that are not said now it stays
    /// unknown.
    fn shift_so_far(&mut self) {
        if let Some(reason) = self.state.unknown_reason(ModalGroup::CoordinateShift.bit()) {
            self.state.shift = [Err(reason); 3];
        }
    }

    /// What is added to programmed values is not known until it ends.
    fn shift_is_lost(&mut self) {
        self.state.shift = [Err(Reason::Displacement); 3];
        self.set_group_varying(ModalGroup::CoordinateShift);
        self.invalidate_pose();
    }

    /// A, B and C are counted from elsewhere, where `same` does not say that nothing changes.
    fn rotary(&mut self, block: &Block<'_>, same: impl Fn(usize, Evaluated) -> bool) {
        let mut any = false;
        let mut changes = false;
        for axis in 0..3 {
            if let Some(index) = block.abc[axis] {
                any = true;
                changes |= !same(axis, self.evaluate_word(&block.words[index]).0);
            }
        }
        let was = self.state.is_transform_active(ModalGroup::RotaryOffset);
        if any && (changes || was) {
            self.switch_transform(ModalGroup::RotaryOffset, changes || block.abc.iter().any(Option::is_none));
        }
    }

    /// G92: the place where the tool stands is called this from here on.
    fn set_shift(&mut self, block: &Block<'_>) {
        let mut stated = [None; 3];
        self.shift_so_far();
        self.effects.sets_origin = true;
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
        let abc = self.state.abc;
        self.state.origin_set = true;
        self.set_group_varying(ModalGroup::CoordinateShift);
        let named = block.axes.map(|axis| axis.is_some());
        // Angles are counted from how the tool is turned here.
        let turned = super::named_axes(block) & super::ORIENTATION;
        if turned != 0 {
            self.mark_position_used(turned);
        }
        if self.in_skippable_block {
            self.mark_position_used(super::named_axes(block));
            self.events.push(StateEvent::ShiftMaybeStated(named));
        } else {
            self.events.push(StateEvent::OriginSet { stated, named });
        }
        self.rotary(block, |axis, value| value.is_ok() && abc[axis] == value);
    }

    /// The shift of these axes is said whole.
    fn placed(&mut self, axes: [bool; 3]) {
        self.events.push(if self.in_skippable_block {
            StateEvent::ShiftMaybeStated(axes)
        } else {
            StateEvent::ShiftStated(axes)
        });
    }
}
