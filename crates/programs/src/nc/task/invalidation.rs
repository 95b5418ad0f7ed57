//! Setting and invalidating modal state: which groups survive a join, and default-deny for unknown words.

use super::super::dialect::Dialect;
use super::super::expression::{Evaluated, literal};
use super::super::modal_group::{GroupTable, ModalGroup};
use super::super::modal_state::{AssignedKinds, MotionMode};
use super::super::syntax::{Word, WordValue};
use super::super::token::Token;
use super::siemens_names::code_name;
use super::{Block, FlowPoint, Interpreter, START_TOOL, StateEvent, start_offset};
use crate::motion::Reason;

impl Interpreter<'_, '_> {
    /// Sets a group to a value.
    pub(super) fn set_group(&mut self, group: ModalGroup, value: u64) {
        if self.pass.branched || self.in_skippable_block {
            self.pass.effects.record(group, value);
        } else {
            // Before the first branch only the last value counts.
            self.pass.effects.overwrite(group, value);
            self.pass.set_before_branch |= group.bit();
        }
        self.state.groups.set_value(group, value);
        self.state.groups.mark_known(group);
    }

    /// Sets a group to a value that depends on the tool position.
    pub(super) fn set_group_varying(&mut self, group: ModalGroup) {
        if self.pass.branched || self.in_skippable_block {
            self.pass.effects.set_varying(group);
        } else {
            self.pass.effects.overwrite(group, u64::MAX);
            self.pass.set_before_branch |= group.bit();
        }
        self.state.groups.mark_known(group);
    }

    /// Switches a coordinate transform. Cancelling one that is not active changes nothing.
    pub(super) fn switch_transform(&mut self, group: ModalGroup, on: bool) {
        let bit = group.bit();
        if !on && !self.state.groups.is_on(group) && self.state.unknown_reason(bit).is_none() {
            return self.set_group(group, 0);
        }
        self.set_group(group, u64::from(on));
        match group {
            ModalGroup::Diameter => self.invalidate_position(),
            _ => self.invalidate_pose(),
        }
    }

    /// Joins with predecessors elsewhere in the file. A group stays known if the whole file sets it to one value and
    /// this happens before the first branch or equals the power-on value, or if the file never sets it.
    pub(super) fn join_unseen_predecessors(&mut self) {
        self.pass.branched = true;
        self.pass.effects.joins += 1;
        let start = GroupTable::start(start_offset(self.dialect), START_TOOL);
        let (mut constant, mut assigned) = (0, AssignedKinds::ALL);
        if let Some(effects) = &self.file_effects {
            assigned = effects.assigned;
            for (group, start) in start.values().enumerate() {
                let bit = 1 << group;
                let settled = self.pass.set_before_branch & bit != 0;
                let constant_here = match effects.value[group] {
                    // A group that the file never sets has the caller's value in a subprogram.
                    None => !self.scan.is_subprogram,
                    Some(value) => settled || value == start && !self.scan.is_subprogram,
                };
                if constant_here && effects.varying & bit == 0 {
                    constant |= bit;
                }
            }
        }
        self.state.join_unseen_predecessors(constant, assigned);
        // Cached indices belong to the values before the join.
        self.frame_index = None;
        self.tool_index.clear();
        // An unseen predecessor may have set an origin or prepared a tool.
        self.state.origin_set |= self.file_effects.as_ref().is_none_or(|effects| effects.sets_origin);
        self.state.tool.next =
            (self.scan.tool_change_by_m6 || self.dialect == Dialect::LinuxCnc).then(|| "T?".to_owned());
        self.events.push(StateEvent::Join);
    }

    /// Whether a block's settings hold only on some paths: after a branch, in a skippable block, or with synchronised
    /// actions.
    pub(super) fn is_conditional(&self) -> bool {
        self.pass.branched || self.in_skippable_block || self.pass.synchronised_actions
    }

    /// A branch: control flow may continue elsewhere in the file.
    pub(super) fn branch(&mut self) {
        self.branch_by(FlowPoint::Leaves);
    }

    /// The same, by a jump or a return.
    pub(super) fn branch_by(&mut self, point: FlowPoint) {
        self.pass.branched = true;
        self.events.push(StateEvent::Branch);
        self.flow(point);
    }

    /// Records that a block which is never modified depends on the tool position.
    pub(super) fn mark_position_used(&mut self, axes: u8) {
        self.events.push(StateEvent::PositionUsed { axes, read: false });
    }

    /// Records blocks whose expressions or conditions read the tool position: at a corrected end it would be another one.
    pub(super) fn mark_position_reads(&mut self, block: &Block<'_>) {
        let reads_in = |first: u32, end: u32| (first..end).any(|token| self.is_position_variable(token, end));
        let reads = block.words.iter().any(|word| match word.value {
            WordValue::Expression { first, end } | WordValue::Arguments { first, end } => {
                reads_in(first, end)
            }
            _ => false,
        });
        // The brackets of IF and WHILE belong to no word.
        let is_control = |word: &Word<'_>| word.name.len() > 1 || word.address() == Some(b'O');
        let node = || self.tree.nodes.get(block.node);
        if reads || block.words.iter().take(3).any(is_control) && reads_in(node().first, node().end) {
            self.events.push(StateEvent::PositionUsed { axes: super::EVERYWHERE, read: true });
        }
    }

    /// Whether a token begins the name of a system variable that holds a position.
    fn is_position_variable(&self, token: u32, end: u32) -> bool {
        match self.tree.kind(token) {
            Some(Token::Hash) => match self.tree.kind(token + 1) {
                Some(Token::Number) => {
                    let number = literal(self.tree.text(token + 1)).unwrap_or(0.0);
                    // Block ends, machine and work positions, probe contacts; LinuxCNC: 5420 on.
                    matches!(number as u32, 5001..=5120 | 5420..=5428)
                }
                // A computed number may be one of them if it has a literal near them.
                Some(Token::BracketOpen) => {
                    let near = |token: u32| {
                        let number = literal(self.tree.text(token)).unwrap_or(0.0);
                        self.tree.kind(token) == Some(Token::Number) && (4900.0..5500.0).contains(&number)
                    };
                    (token + 2..end)
                        .take_while(|&token| self.tree.kind(token) != Some(Token::BracketClose))
                        .any(near)
                }
                Some(Token::Name) => {
                    let name = self.tree.text(token + 1).to_ascii_uppercase();
                    matches!(&*name, [b'<', b'_', b'X'..=b'Z' | b'A'..=b'C', b'>'])
                        || name.starts_with(b"<_ABS_")
                        || name.starts_with(b"<_ABSOLUTE")
                }
                _ => false,
            },
            Some(Token::Name) if self.dialect == Dialect::Siemens => {
                let name = self.tree.text(token).to_ascii_uppercase();
                [&b"$AA_I"[..], b"$AA_M", b"$AA_ETRANS", b"$P_EP", b"$VA_I", b"$AC_P"]
                    .iter()
                    .any(|begin| name.starts_with(begin))
            }
            _ => false,
        }
    }

    /// The start of a subprogram file: every group has the unknown value of the caller.
    pub(super) fn start_subprogram(&mut self) {
        self.state.join_unseen_predecessors(0, AssignedKinds::default());
        // TOOL CALL prepares nothing.
        self.state.tool.next = (self.dialect != Dialect::Heidenhain).then(|| "T?".to_owned());
        self.events.push(StateEvent::Join);
    }

    /// A programmed length in mm; unknown where the unit is, unless it is 0.
    pub(super) fn length_in_mm(&self, value: Evaluated) -> Evaluated {
        match (value?, self.state.unknown_reason(ModalGroup::Unit.bit())) {
            (0.0, _) => Ok(0.0),
            (_, Some(reason)) => Err(reason),
            (value, None) => Ok(value * self.state.groups.unit_mm()),
        }
    }

    /// A change of frames: its coordinates may be unknown from here on, but the arm stands where the motion before ended.
    pub(super) fn without_moving<T>(&mut self, change: impl FnOnce(&mut Self) -> T) -> T {
        let preceding = self.state.preceding.clone();
        let out = change(self);
        self.state.preceding = preceding;
        out
    }

    /// The pose is unknown from here on.
    pub(super) fn invalidate_pose(&mut self) {
        self.state.invalidate_position();
        self.state.invalidate_orientation();
        self.events.push(StateEvent::PoseUnknown);
    }

    /// X, Y and Z are unknown from here on.
    pub(super) fn invalidate_position(&mut self) {
        self.state.invalidate_position();
        self.events.push(StateEvent::AxesUnknown(super::POSITION));
    }

    /// Default-deny: a block with an unknown word is listed, and the whole modal state is unknown from here on.
    pub(super) fn list_unknown_word(&mut self, block: &Block<'_>, word: &str, reason: Reason) {
        self.list_left(block, word, reason);
        // It may have been a jump.
        self.leads_anywhere();
        self.state.invalidate_all(reason);
        // It may have been a motion code.
        self.state.mode = MotionMode::Unknown(reason);
        self.pass.effects.set_all_varying();
        self.events.push(StateEvent::PoseUnknown);
    }

    /// Makes one group unknown; the word is not a motion.
    pub(super) fn invalidate_group(&mut self, group: ModalGroup, because: Reason) {
        self.pass.effects.set_varying(group);
        self.state.groups.mark_unknown_by_word(group.bit(), because);
        self.invalidate_pose();
    }

    /// The first unknown word of a block, and why it is unknown.
    pub(super) fn unknown_word(&self, block: &Block<'_>) -> Option<(String, Reason)> {
        if let Some((word, reason)) = &block.unknown_word {
            return Some((word.clone(), *reason));
        }
        match block.g.iter().find(|&&code| !super::g_codes::is_g(code, self.dialect, self.word_kinds(block)))
        {
            Some(code) => Some((code_name(*code), Reason::UnknownWord)),
            None => self.unknown_m_word(block),
        }
    }

    /// The kinds of word in a block.
    pub(super) fn word_kinds(&self, block: &Block<'_>) -> super::g_codes::WordKinds {
        super::g_codes::WordKinds {
            axes: block.has_motion_words() || block.flags.other_axes,
            centre: block.centre.iter().any(Option::is_some),
        }
    }

    /// M72: restores the state that M70 has saved.
    pub(super) fn restore_saved_state(&mut self) {
        let Some(kept) = self.state.saved.clone() else {
            self.state.invalidate_all(Reason::UnknownWord);
            self.pass.effects.set_all_varying();
            self.events.push(StateEvent::PoseUnknown);
            return;
        };
        let state = &mut self.state;
        let moved = state.work_offset.name != kept.work_offset.name || state.tool.length != kept.tool.length;
        state.feed = kept.feed;
        state.work_offset.name = kept.work_offset.name;
        (state.tool.length, state.tool.own_length_offset) = (kept.tool.length, kept.tool.own_length_offset);
        if state.mode != kept.mode {
            state.mode = MotionMode::Unknown(Reason::UnknownFlow);
        }
        // The tool in the spindle stays.
        let tool = state.groups.value(ModalGroup::Tool);
        for group in [
            ModalGroup::DistanceMode,
            ModalGroup::Unit,
            ModalGroup::Plane,
            ModalGroup::RadiusCompensation,
            ModalGroup::WorkOffset,
            ModalGroup::Tool,
            ModalGroup::ToolLength,
            ModalGroup::ArcCentreMode,
            ModalGroup::Diameter,
        ] {
            state.groups.restore(group, &kept.groups);
            self.pass.effects.set_varying(group);
        }
        state.groups.set_value(ModalGroup::Tool, tool);
        if moved {
            self.invalidate_pose();
        }
    }
}
