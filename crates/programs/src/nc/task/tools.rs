//! The active tool, its length offset and the TCP mode.

use super::super::dialect::Dialect;
use super::super::modal_group::{ModalGroup, TOOL_GROUPS, name_key};
use super::super::modal_state::{ActiveTool, OrientationMode, ToolLength};
use super::{Block, Interpreter};

impl Interpreter<'_, '_> {
    /// Switches the TCP mode. A change invalidates the stored position.
    pub(super) fn set_tcp_mode(&mut self, on: bool, vector_words: bool) {
        let changes = self.state.groups.tcp_mode() != on
            || self.state.unknown_reason(ModalGroup::TcpMode.bit()).is_some();
        self.set_group(ModalGroup::TcpMode, u64::from(on) + 2 * u64::from(vector_words));
        if changes {
            // The axes do not move, and A, B and C keep their values; a tool vector is meaningless without TCP mode.
            match self.state.orientation.mode {
                OrientationMode::Vector if !on => self.invalidate_pose(),
                _ => self.invalidate_position(),
            }
        }
    }

    /// Changes the tool. The coordinates of the tool position change with its length.
    fn change_tool_frame(&mut self, change: impl FnOnce(&mut ActiveTool)) {
        let before = self.state.tool.frame_name(self.dialect);
        change(&mut self.state.tool);
        let after = self.state.tool.frame_name(self.dialect);
        if before != after || self.state.unknown_reason(TOOL_GROUPS).is_some() {
            self.invalidate_position();
        }
    }

    /// Changes the length offset, whichever the tool.
    pub(super) fn change_tool_length(&mut self, change: impl FnOnce(&mut ActiveTool)) {
        self.change_tool_frame(change);
        let ActiveTool { length, cutting_edge, .. } = self.state.tool;
        let value = match (self.dialect, length) {
            (Dialect::Siemens | Dialect::Heidenhain, _) => u64::from(cutting_edge).wrapping_sub(1),
            (_, ToolLength::OfTool) => 0,
            (_, ToolLength::None) => 1,
            (_, ToolLength::Offset(number)) => 2 + u64::from(number),
        };
        self.set_group(ModalGroup::ToolLength, value);
    }

    pub(super) fn change_tool(&mut self, name: String) {
        let value = name_key(&name);
        self.change_tool_frame(|tool| {
            tool.name = name;
            (tool.cutting_edge, tool.own_length_offset) = (1, None);
        });
        self.set_group(ModalGroup::Tool, value);
        if matches!(self.dialect, Dialect::Siemens | Dialect::Heidenhain) {
            // Its first cutting edge; Heidenhain has no other.
            self.change_tool_length(|_| {});
        }
    }

    /// The program changes the active tool to a value that the text does not hold.
    pub(super) fn invalidate_active_tool(&mut self) {
        if self.state.unknown_reason(TOOL_GROUPS).is_some() {
            // It may be any tool.
            return self.invalidate_tools();
        }
        let name = self.state.tool.frame_name(self.dialect);
        self.state.tool.assigned.set(&name, None);
        self.pass.effects.assigned.tools |= self.is_conditional();
        self.tool_index.clear();
        self.invalidate_position();
    }

    /// Every tool is or may be changed.
    pub(super) fn invalidate_tools(&mut self) {
        self.state.tool.assigned.invalidate();
        self.pass.effects.assigned.tools |= self.is_conditional();
        self.tool_index.clear();
        self.invalidate_position();
    }

    /// Tool length compensation. True if the axis words are lengths.
    pub(super) fn length(&mut self, block: &Block<'_>, code: u32) -> bool {
        let number = block.h.map(|index| self.literal(&block.words[index]));
        match code {
            490 => self.change_tool_length(|tool| tool.length = ToolLength::None),
            431 | 432 if self.dialect != Dialect::Fanuc => {
                self.invalidate_active_tool();
                return true;
            }
            _ => match number {
                None => self.change_tool_length(|tool| {
                    if tool.length == ToolLength::None {
                        tool.length = ToolLength::OfTool;
                    }
                }),
                Some(Some(number)) => {
                    let number = number.round() as u32;
                    // On LinuxCNC H is a tool number, elsewhere an index of an offset table.
                    let own = self.dialect != Dialect::LinuxCnc;
                    self.change_tool_length(|tool| {
                        tool.length = ToolLength::Offset(number);
                        if own && tool.name == "T0" && tool.own_length_offset.is_none() {
                            tool.own_length_offset = Some(number);
                        }
                    });
                }
                Some(None) => self.change_tool_length(|tool| tool.length = ToolLength::Offset(u32::MAX)),
            },
        }
        false
    }
}
