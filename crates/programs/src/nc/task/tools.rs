//! The active tool, its length offset and the TCP mode.

use nalgebra::UnitQuaternion;

use super::super::dialect::Dialect;
use super::super::modal_group::{ModalGroup, TOOL_GROUPS, name_key};
use super::super::modal_state::{ActiveTool, OrientationMode, ToolLength};
use super::{Block, Interpreter, START_TOOL};
use crate::motion::Frame;

fn turn_of(tool: &Frame) -> UnitQuaternion<f64> {
    tool.pose().rotation
}

fn is_same_turn(a: &UnitQuaternion<f64>, b: &UnitQuaternion<f64>) -> bool {
    a.angle_to(b) < 1e-9
}

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

    /// Changes the tool. The coordinates of the tool position change with its length, and its orientation if the tools are, or
    /// may be, turned against each other: whether a control then keeps the programmed angles or counts those of the new tool
    /// where the flange stands, the text does not tell.
    fn change_tool_frame(&mut self, change: impl FnOnce(&mut ActiveTool)) {
        let before = self.state.tool.frame_name(self.dialect);
        let turn_before = self.turn_of_tool();
        change(&mut self.state.tool);
        let after = self.state.tool.frame_name(self.dialect);
        let unknown = self.state.unknown_reason(TOOL_GROUPS).is_some();
        if before == after && !unknown {
            return;
        }
        let alike = match (turn_before, self.turn_of_tool()) {
            // Any of them may have been in use.
            (_, Some(turn)) if unknown => self.tools.values().all(|tool| is_same_turn(&turn_of(tool), &turn)),
            (Some(before), Some(after)) => is_same_turn(&before, &after),
            _ => false,
        };
        if alike {
            self.invalidate_position();
        } else {
            self.invalidate_pose();
        }
    }

    /// How the active tool is turned on the flange; without its length as with it. A number of which nothing is stated is a
    /// length, unless others are turned.
    fn turn_of_tool(&self) -> Option<UnitQuaternion<f64>> {
        let tool = &self.state.tool;
        let cancelled = tool.length == ToolLength::None;
        let name = if cancelled { tool.name.clone() } else { tool.frame_name(self.dialect) };
        if let Ok(frame) = self.tool_value(&name) {
            return Some(turn_of(&frame));
        }
        let none = UnitQuaternion::identity();
        let lengths_alone = || self.tools.values().all(|tool| is_same_turn(&turn_of(tool), &none));
        (name == START_TOOL || lengths_alone()).then_some(none)
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
                None => {
                    // On LinuxCNC it is that of the loaded tool, elsewhere the last H stays.
                    let of_tool = self.dialect == Dialect::LinuxCnc;
                    self.change_tool_length(|tool| {
                        if of_tool || tool.length == ToolLength::None {
                            tool.length = ToolLength::OfTool;
                        }
                    });
                }
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
