//! What is not certain: default-deny for words that are not known, and what still holds where ways meet.

use super::super::dialect::Dialect;
use super::super::expression::{Evaluated, literal};
use super::super::modal_state::{AssignedKinds, GROUP_COUNT, ModalGroup, MotionMode};
use super::super::syntax::WordValue;
use super::super::token::Token;
use super::file_effects::name_key;
use super::siemens_names::code_name;
use super::{Block, Interpreter, StateEvent};
use crate::motion::Reason;

impl Interpreter<'_, '_> {
    /// A group is set to something.
    pub(super) fn set_group(&mut self, group: ModalGroup, value: u64) {
        if self.branched || self.in_skippable_block {
            self.effects.record(group, value);
        } else {
            // Before ways part only the last one counts.
            self.effects.overwrite(group, value);
            self.set_before_branch |= group.bit();
        }
        self.state.mark_known(group);
    }

    /// A group is set to what depends on where the tool stands.
    pub(super) fn set_group_varying(&mut self, group: ModalGroup) {
        if self.branched || self.in_skippable_block {
            self.effects.set_varying(group);
        } else {
            self.effects.overwrite(group, u64::MAX);
            self.set_before_branch |= group.bit();
        }
        self.state.mark_known(group);
    }

    /// A group that turns, scales or bends coordinates begins or ends. What ends where nothing is on changes nothing.
    pub(super) fn switch_transform(&mut self, group: ModalGroup, on: bool) {
        let bit = group.bit();
        if !on && !self.state.is_transform_active(group) && self.state.unknown_reason(bit).is_none() {
            return self.set_group(group, 0);
        }
        self.state.set_transform(group, on);
        self.set_group(group, u64::from(on));
        match group {
            ModalGroup::Diameter => self.invalidate_position(),
            _ => self.invalidate_pose(),
        }
    }

    /// A place that can be reached from elsewhere: a group that the whole file sets to one thing only keeps that once it has been
    /// set before ways part, and one that it never sets keeps what the control starts with.
    pub(super) fn join_unseen_predecessors(&mut self) {
        self.branched = true;
        self.effects.joins += 1;
        let siemens = self.dialect == Dialect::Siemens;
        let (mut constant, mut assigned) = (0, AssignedKinds::ALL);
        if let Some(effects) = &self.file_effects {
            assigned = effects.assigned;
            for group in 0..GROUP_COUNT as usize {
                let bit = 1 << group;
                let start = match group {
                    _ if group == ModalGroup::DistanceMode as usize => 900,
                    _ if group == ModalGroup::Unit as usize => 21,
                    _ if group == ModalGroup::Plane as usize => 170,
                    _ if group == ModalGroup::WorkOffset as usize => {
                        name_key(if siemens { "G500" } else { "G54" })
                    }
                    _ if group == ModalGroup::Tool as usize => name_key("T0"),
                    _ => 0,
                };
                let settled = self.set_before_branch & bit != 0;
                let held = match effects.value[group] {
                    // What the file never sets is the caller's where it has one.
                    None => !self.is_subprogram,
                    Some(value) => settled || value == start && !self.is_subprogram,
                };
                if held && effects.varying & bit == 0 {
                    constant |= bit;
                }
            }
        }
        self.state.join_unseen_predecessors(constant, assigned);
        // What was found for a name before says nothing of what it stands for now.
        self.frame_index = None;
        self.tool_index.clear();
        // Elsewhere an origin may have been set, or a tool made ready.
        self.state.origin_set |= self.file_effects.as_ref().is_none_or(|effects| effects.sets_origin);
        self.state.next_tool =
            (self.tool_change_by_m6 || self.dialect == Dialect::LinuxCnc).then(|| "T?".to_owned());
        self.events.push(StateEvent::Join);
    }

    /// Whether what a block sets is not set once and for all: the way has parted before it, or may pass it by.
    pub(super) fn is_conditional(&self) -> bool {
        self.branched || self.in_skippable_block || self.synchronised_actions
    }

    /// The way parts: it may go on elsewhere in the file.
    pub(super) fn branch(&mut self) {
        self.branched = true;
        self.events.push(StateEvent::Branch);
    }

    /// Something that is not followed counts from where the tool stands.
    pub(super) fn mark_position_used(&mut self, axes: u8) {
        self.events.push(StateEvent::PositionUsed { axes, read: false });
    }

    /// A block that reads where the tool stands: what it makes of that moves with it.
    pub(super) fn mark_position_reads(&mut self, block: &Block<'_>) {
        let reads = block.words.iter().any(|word| match word.value {
            WordValue::Expression { first, end } | WordValue::Arguments { first, end } => {
                (first..end).any(|token| self.is_position_variable(token, end))
            }
            _ => false,
        });
        if reads {
            self.events.push(StateEvent::PositionUsed { axes: super::EVERYWHERE, read: true });
        }
    }

    /// Whether a token begins the name of a position that the control keeps.
    fn is_position_variable(&self, token: u32, end: u32) -> bool {
        match self.tree.kind(token) {
            Some(Token::Hash) => match self.tree.kind(token + 1) {
                Some(Token::Number) => {
                    let number = literal(self.tree.text(token + 1)).unwrap_or(0.0);
                    // Ends of blocks, machine and work positions, where a probe touched; LinuxCNC: 5420 on.
                    matches!(number as u32, 5001..=5120 | 5420..=5428)
                }
                // The number is worked out: it may be one of them where it is near.
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

    /// The begin of a file that others call: everything is as they have left it.
    pub(super) fn enter_subprogram(&mut self) {
        self.state.join_unseen_predecessors(0, AssignedKinds::default());
        self.state.next_tool = Some("T?".to_owned());
        self.events.push(StateEvent::Join);
    }

    /// A length as it is written, in mm; that of what is not 0 is not known where the unit is not.
    pub(super) fn length_in_mm(&self, value: Evaluated) -> Evaluated {
        match (value?, self.state.unknown_reason(ModalGroup::Unit.bit())) {
            (0.0, _) => Ok(0.0),
            (_, Some(reason)) => Err(reason),
            (value, None) => Ok(value * self.state.unit_mm),
        }
    }

    /// After the machine has gone where the text does not tell.
    pub(super) fn invalidate_pose(&mut self) {
        self.state.invalidate_position();
        self.state.invalidate_orientation();
        self.events.push(StateEvent::PoseUnknown);
    }

    /// After the same, of X, Y and Z only.
    pub(super) fn invalidate_position(&mut self) {
        self.state.invalidate_position();
        self.events.push(StateEvent::AxesUnknown(super::POSITION));
    }

    /// A block with a word that is not known: it is listed, and whatever the word may do and set is not known from here on.
    pub(super) fn list_unknown_word(&mut self, block: &Block<'_>, word: &str, reason: Reason) {
        self.list_left(block, word, reason);
        self.state.invalidate_all(reason);
        // It may have been a motion word.
        self.state.mode = MotionMode::Unknown(reason);
        self.effects.set_all_varying();
        self.events.push(StateEvent::PoseUnknown);
    }

    /// The same for one group only: the word is no motion.
    pub(super) fn invalidate_group(&mut self, group: ModalGroup, because: Reason) {
        self.effects.set_varying(group);
        self.state.unknown_by_word |= group.bit();
        self.state.word_reason = because;
        self.invalidate_pose();
    }

    /// The first word of a block that is not known, and why.
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

    /// What kinds of word a block has, for codes that mean different things with and without.
    pub(super) fn word_kinds(&self, block: &Block<'_>) -> super::g_codes::WordKinds {
        super::g_codes::WordKinds {
            axes: block.has_motion_words() || block.other_axes,
            centre: block.centre.iter().any(Option::is_some),
        }
    }

    /// M72: what M70 has kept holds again.
    pub(super) fn restore_saved_state(&mut self) {
        let Some(kept) = self.state.saved.clone() else {
            self.state.invalidate_all(Reason::UnknownWord);
            self.effects.set_all_varying();
            self.events.push(StateEvent::PoseUnknown);
            return;
        };
        let moved = self.state.work_offset != kept.work_offset || self.state.tool_length != kept.tool_length;
        let state = &mut self.state;
        (state.absolute, state.unit_mm, state.plane) = (kept.absolute, kept.unit_mm, kept.plane);
        (state.radius_compensation, state.centre_absolute) = (kept.radius_compensation, kept.centre_absolute);
        (state.feed, state.feed_per_minute) = (kept.feed, kept.feed_per_minute);
        (state.exact_stop, state.exact_stop_modal) = (kept.exact_stop, kept.exact_stop_modal);
        (state.work_offset, state.tool_length, state.own_length_offset) =
            (kept.work_offset.clone(), kept.tool_length, kept.own_length_offset);
        if state.mode != kept.mode {
            state.mode = MotionMode::Unknown(Reason::UnknownFlow);
        }
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
            let bit = group.bit();
            state.unknown_after_join = state.unknown_after_join & !bit | kept.unknown_after_join & bit;
            state.unknown_by_word = state.unknown_by_word & !bit | kept.unknown_by_word & bit;
            self.effects.set_varying(group);
        }
        state.set_transform(ModalGroup::Diameter, kept.is_transform_active(ModalGroup::Diameter));
        if moved {
            self.invalidate_pose();
        }
    }
}
