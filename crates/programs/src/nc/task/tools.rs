//! Tools: which one is in, its length and its tip.

use super::super::dialect::Dialect;
use super::super::machine::{Group, Length, OF_TOOL, State, Turn};
use super::found::key;
use super::{Lister, Said};

impl Lister<'_, '_> {
    /// Tool centre point control goes on or off: where it changes, what was the tip is none, or the other way round.
    pub(super) fn tip(&mut self, on: bool, vector_words: bool) {
        let changes = self.state.tip != on || self.state.doubt(1 << Group::Tip as u32).is_some();
        (self.state.tip, self.state.vector_words) = (on, vector_words);
        self.set(Group::Tip, u64::from(on) + 2 * u64::from(vector_words));
        if changes {
            // The axes stay where they are, and so do A, B and C; a tool vector means nothing without control of the tip.
            match self.state.turn {
                Turn::Vector if !on => self.lose_all(),
                _ => self.lose_position(),
            }
        }
    }

    /// Something of the tool changes: where it stands has other coordinates now.
    fn tool_is(&mut self, change: impl FnOnce(&mut State)) {
        let before = self.state.tool_name(self.dialect);
        change(&mut self.state);
        let after = self.state.tool_name(self.dialect);
        if before != after || self.state.doubt(OF_TOOL).is_some() {
            self.lose_position();
        }
    }

    /// Another length of the tool counts, whichever tool that is.
    pub(super) fn length_is(&mut self, change: impl FnOnce(&mut State)) {
        self.tool_is(change);
        let State { length, edge, .. } = self.state;
        let value = match (self.dialect, length) {
            (Dialect::Siemens | Dialect::Heidenhain, _) => u64::from(edge).wrapping_sub(1),
            (_, Length::OfTool) => 0,
            (_, Length::None) => 1,
            (_, Length::Of(number)) => 2 + u64::from(number),
        };
        self.set(Group::Length, value);
    }

    pub(super) fn change_tool(&mut self, name: String) {
        let value = key(&name);
        self.tool_is(|state| {
            state.tool = name;
            (state.edge, state.own_length) = (1, None);
        });
        self.set(Group::Tool, value);
        if matches!(self.dialect, Dialect::Siemens | Dialect::Heidenhain) {
            // Its first edge; Heidenhain has no other.
            self.length_is(|_| {});
        }
    }

    /// The tool that is in is changed by the program to what the text does not tell.
    pub(super) fn tool_assigned(&mut self) {
        if self.state.doubt(OF_TOOL).is_some() {
            // It may be any.
            return self.tools_assigned();
        }
        let name = self.state.tool_name(self.dialect);
        self.state.tools.set(&name, None);
        self.found.assigns.tools |= self.anywhere_else();
        self.tool_index.clear();
        self.lose_position();
    }

    /// Every tool is or may be changed.
    pub(super) fn tools_assigned(&mut self) {
        self.state.tools.lose_all();
        self.found.assigns.tools |= self.anywhere_else();
        self.tool_index.clear();
        self.lose_position();
    }

    /// Which length the control adds. True where the axis words of the block are that length.
    pub(super) fn length(&mut self, said: &Said<'_>, code: u32) -> bool {
        let number = said.h.map(|index| self.literal(&said.words[index]));
        match code {
            490 => self.length_is(|state| state.length = Length::None),
            431 | 432 if self.dialect != Dialect::Fanuc => {
                self.tool_assigned();
                return true;
            }
            _ => match number {
                None => self.length_is(|state| {
                    if state.length == Length::None {
                        state.length = Length::OfTool;
                    }
                }),
                Some(Some(number)) => {
                    let number = number.round() as u32;
                    // On LinuxCNC they are the numbers of tools, elsewhere those of a list of their own.
                    let own = self.dialect != Dialect::LinuxCnc;
                    self.length_is(|state| {
                        state.length = Length::Of(number);
                        if own && state.tool == "T0" && state.own_length.is_none() {
                            state.own_length = Some(number);
                        }
                    });
                }
                Some(None) => self.length_is(|state| state.length = Length::Of(u32::MAX)),
            },
        }
        false
    }
}
