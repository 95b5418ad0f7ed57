//! Tools: which one is in, its length and its tip.

use super::super::dialect::Dialect;
use super::super::modal_state::{ModalGroup, ModalState, OrientationMode, TOOL_GROUPS, ToolLength};
use super::file_effects::name_key;
use super::{Block, Interpreter};

impl Interpreter<'_, '_> {
    /// Tool centre point control goes on or off: where it changes, what was the tip is none, or the other way round.
    pub(super) fn set_tcp_mode(&mut self, on: bool, vector_words: bool) {
        let changes =
            self.state.tcp_mode != on || self.state.unknown_reason(ModalGroup::TcpMode.bit()).is_some();
        (self.state.tcp_mode, self.state.vector_words) = (on, vector_words);
        self.set_group(ModalGroup::TcpMode, u64::from(on) + 2 * u64::from(vector_words));
        if changes {
            // The axes stay where they are, and so do A, B and C; a tool vector means nothing without control of the tip.
            match self.state.orientation_mode {
                OrientationMode::Vector if !on => self.invalidate_pose(),
                _ => self.invalidate_position(),
            }
        }
    }

    /// Something of the tool changes: where it stands has other coordinates now.
    fn tool_is(&mut self, change: impl FnOnce(&mut ModalState)) {
        let before = self.state.tool_name(self.dialect);
        change(&mut self.state);
        let after = self.state.tool_name(self.dialect);
        if before != after || self.state.unknown_reason(TOOL_GROUPS).is_some() {
            self.invalidate_position();
        }
    }

    /// Another length of the tool counts, whichever tool that is.
    pub(super) fn length_is(&mut self, change: impl FnOnce(&mut ModalState)) {
        self.tool_is(change);
        let ModalState { tool_length, cutting_edge, .. } = self.state;
        let value = match (self.dialect, tool_length) {
            (Dialect::Siemens | Dialect::Heidenhain, _) => u64::from(cutting_edge).wrapping_sub(1),
            (_, ToolLength::OfTool) => 0,
            (_, ToolLength::None) => 1,
            (_, ToolLength::Offset(number)) => 2 + u64::from(number),
        };
        self.set_group(ModalGroup::ToolLength, value);
    }

    pub(super) fn change_tool(&mut self, name: String) {
        let value = name_key(&name);
        self.tool_is(|state| {
            state.tool = name;
            (state.cutting_edge, state.own_length_offset) = (1, None);
        });
        self.set_group(ModalGroup::Tool, value);
        if matches!(self.dialect, Dialect::Siemens | Dialect::Heidenhain) {
            // Its first edge; Heidenhain has no other.
            self.length_is(|_| {});
        }
    }

    /// The tool that is in is changed by the program to what the text does not tell.
    pub(super) fn tool_assigned(&mut self) {
        if self.state.unknown_reason(TOOL_GROUPS).is_some() {
            // It may be any.
            return self.tools_assigned();
        }
        let name = self.state.tool_name(self.dialect);
        self.state.assigned_tools.set(&name, None);
        self.effects.assigned.tools |= self.is_conditional();
        self.tool_index.clear();
        self.invalidate_position();
    }

    /// Every tool is or may be changed.
    pub(super) fn tools_assigned(&mut self) {
        self.state.assigned_tools.invalidate();
        self.effects.assigned.tools |= self.is_conditional();
        self.tool_index.clear();
        self.invalidate_position();
    }

    /// Which length the control adds. True where the axis words of the block are that length.
    pub(super) fn length(&mut self, block: &Block<'_>, code: u32) -> bool {
        let number = block.h.map(|index| self.literal(&block.words[index]));
        match code {
            490 => self.length_is(|state| state.tool_length = ToolLength::None),
            431 | 432 if self.dialect != Dialect::Fanuc => {
                self.tool_assigned();
                return true;
            }
            _ => match number {
                None => self.length_is(|state| {
                    if state.tool_length == ToolLength::None {
                        state.tool_length = ToolLength::OfTool;
                    }
                }),
                Some(Some(number)) => {
                    let number = number.round() as u32;
                    // On LinuxCNC they are the numbers of tools, elsewhere those of a list of their own.
                    let own = self.dialect != Dialect::LinuxCnc;
                    self.length_is(|state| {
                        state.tool_length = ToolLength::Offset(number);
                        if own && state.tool == "T0" && state.own_length_offset.is_none() {
                            state.own_length_offset = Some(number);
                        }
                    });
                }
                Some(None) => self.length_is(|state| state.tool_length = ToolLength::Offset(u32::MAX)),
            },
        }
        false
    }
}
