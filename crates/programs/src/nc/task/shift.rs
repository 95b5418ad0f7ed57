//! What is added to programmed values (G52, G92), and where the tool stands after it.

use super::super::dialect::Dialect;
use super::super::expression::Worth;
use super::super::machine::Group;
use super::{Event, Lister, Said};
use crate::motion::Reason;

impl Lister<'_, '_> {
    /// G52, G92 and what ends them. True where the block's axis words are no motion that is followed.
    pub(super) fn shift_code(&mut self, said: &Said<'_>, code: u32) -> bool {
        let linux = self.dialect == Dialect::LinuxCnc;
        match code {
            // Within what G92 has shifted, or in its place: the controls differ.
            520 if self.state.preset && !linux => self.shift_is_lost(),
            520 if self.dialect != Dialect::Siemens => self.shift_frame(said),
            // The greatest speed of the spindle.
            920 if self.limits_spindle(said) => {}
            920 => self.set_shift(said),
            // Fanuc ends the shift of the axes that are named, LinuxCNC all.
            921 if !self.ends_all(said) => {
                self.may_move(said, code);
                self.shift_is_lost();
            }
            921 | 922 => {
                self.state.shift = [Ok(0.0); 3];
                self.state.preset = false;
                self.placed([true; 3]);
                self.set_any(Group::Shift);
                if self.state.turned & 1 << Group::Rotary as u32 != 0 {
                    self.turn(Group::Rotary, false);
                }
                self.may_move(said, code);
                return !linux;
            }
            923 => {
                self.events.push(Event::Restored);
                self.state.shift = [Err(Reason::Variable); 3];
                self.doubt(Group::Rotary, Reason::Variable);
                self.may_move(said, code);
                return !linux;
            }
            _ => return false,
        }
        true
    }

    /// What is a motion on LinuxCNC and none on a Fanuc: a plain file does not tell which.
    fn may_move(&mut self, said: &Said<'_>, code: u32) {
        if self.dialect == Dialect::Iso && said.moves() {
            self.gone(said, code, Reason::UnknownWord);
        }
    }

    /// G52: a shift of the work frame itself, in which the tool stands elsewhere then.
    fn shift_frame(&mut self, said: &Said<'_>) {
        self.shift_so_far();
        for axis in 0..3 {
            if let Some(index) = said.axes[axis] {
                self.state.shift[axis] = self.in_mm(self.worth(&said.words[index]).0);
            }
        }
        self.placed(said.axes.map(|axis| axis.is_some()));
        self.rotary(said, |_, value| value == Ok(0.0));
        self.set_any(Group::Shift);
    }

    /// G92.1: whether every shift ends by it, or there is none.
    fn ends_all(&self, said: &Said<'_>) -> bool {
        let rotary = self.state.turned & 1 << Group::Rotary as u32 != 0;
        let none = self.state.shift == [Ok(0.0); 3]
            && !rotary
            && self.state.doubt(1 << Group::Shift as u32 | 1 << Group::Rotary as u32).is_none();
        let named =
            said.axes.iter().all(Option::is_some) && (!rotary || said.abc.iter().all(Option::is_some));
        self.dialect == Dialect::LinuxCnc || self.dialect == Dialect::Iso && !said.moves() || none || named
    }

    /// What has been added to programmed values so far: where that is in doubt, of the axes that are not said now it stays
    /// unknown.
    fn shift_so_far(&mut self) {
        if let Some(reason) = self.state.doubt(1 << Group::Shift as u32) {
            self.state.shift = [Err(reason); 3];
        }
    }

    /// What is added to programmed values is not known until it ends.
    fn shift_is_lost(&mut self) {
        self.state.shift = [Err(Reason::Displacement); 3];
        self.set_any(Group::Shift);
        self.lose_all();
    }

    /// A, B and C are counted from elsewhere, where `same` does not say that nothing changes.
    fn rotary(&mut self, said: &Said<'_>, same: impl Fn(usize, Worth) -> bool) {
        let mut any = false;
        let mut changes = false;
        for axis in 0..3 {
            if let Some(index) = said.abc[axis] {
                any = true;
                changes |= !same(axis, self.worth(&said.words[index]).0);
            }
        }
        let was = self.state.turned & 1 << Group::Rotary as u32 != 0;
        if any && (changes || was) {
            self.turn(Group::Rotary, changes || said.abc.iter().any(Option::is_none));
        }
    }

    /// G92: the place where the tool stands is called this from here on.
    fn set_shift(&mut self, said: &Said<'_>) {
        let mut stated = [None; 3];
        self.shift_so_far();
        self.found.presets = true;
        for (axis, stated) in stated.iter_mut().enumerate() {
            let Some(index) = said.axes[axis] else { continue };
            let value = self.in_mm(self.worth(&said.words[index]).0);
            self.state.shift[axis] = match (self.state.position[axis], value) {
                (Ok(at), Ok(value)) => {
                    *stated = Some(value);
                    Ok(at - value)
                }
                (Err(reason), _) | (_, Err(reason)) => Err(reason),
            };
        }
        let abc = self.state.abc;
        self.state.preset = true;
        self.set_any(Group::Shift);
        let named = said.axes.map(|axis| axis.is_some());
        // Angles are counted from how the tool is turned here.
        let turned = super::named_axes(said) & super::ORIENTATION;
        if turned != 0 {
            self.held_here(turned);
        }
        if self.skipping {
            self.held_here(super::named_axes(said));
            self.events.push(Event::MaybePlaced(named));
        } else {
            self.events.push(Event::Shift { stated, named });
        }
        self.rotary(said, |axis, value| value.is_ok() && abc[axis] == value);
    }

    /// The shift of these axes is said whole.
    fn placed(&mut self, axes: [bool; 3]) {
        self.events.push(if self.skipping { Event::MaybePlaced(axes) } else { Event::Placed(axes) });
    }
}
