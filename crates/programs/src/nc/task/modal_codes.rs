//! Modal G codes: motion, transforms, offsets, and how numbers are read.

use super::super::dialect::Dialect;
use super::super::modal_group::{ModalGroup, name_key};
use super::super::modal_state::{MotionMode, ToolLength};
use super::super::syntax::Word;
use super::g_codes::{Action, action};
use super::siemens_names::code_name;
use super::{Block, Interpreter};
use crate::motion::Reason;

impl Interpreter<'_, '_> {
    /// Applies the modal G codes of a block. True if its axis words are not a motion.
    pub(super) fn modal_codes(&mut self, block: &Block<'_>) -> bool {
        self.state.feed.exact_stop &= self.state.feed.exact_stop_modal;
        // Of the numbered paths only the cubic spline (G5) continues in the direction of the motion before.
        if block
            .g
            .iter()
            .any(|code| matches!(code, 22..=24 | 32..=34 | 50..=53 | 62 | 320..=350 | 630 | 3310..=3360))
        {
            self.state.starts_tangent = block.g.contains(&50);
        }
        let names_axes = block.g.iter().any(|&code| {
            action(code, self.dialect).is_some_and(|action| self.modal_action(block, code, action))
        });
        if self.is_length_offset_alone(block) {
            self.length(block, 430);
        }
        names_axes
    }

    /// Whether H stands without its G code while an offset is in effect: it selects another one (Fanuc).
    fn is_length_offset_alone(&self, block: &Block<'_>) -> bool {
        let takes_h = |code: &u32| {
            matches!(code, 100 | 150 | 160 | 370 | 650..=669)
                || matches!(action(*code, self.dialect), Some(Action::ToolLength))
        };
        matches!(self.dialect, Dialect::Fanuc | Dialect::Iso)
            && block.h.is_some()
            && self.state.tool.length != ToolLength::None
            && !block.g.iter().any(takes_h)
            && !block.m.iter().any(|m| matches!(m, 96..=99 | 198))
    }

    /// Applies a modal G code. True if the axis words of its block are not a motion.
    fn modal_action(&mut self, block: &Block<'_>, code: u32, action: Action) -> bool {
        match action {
            Action::Set(group, value) => self.set_group(group, value),
            Action::ContourOrUnit if self.is_unit(block, code) => {
                self.set_group(ModalGroup::Unit, u64::from(code - 500));
            }
            Action::ExactStopOnce => self.state.feed.exact_stop = true,
            Action::ExactStop | Action::ContinuousPath => {
                let on = action == Action::ExactStop;
                (self.state.feed.exact_stop, self.state.feed.exact_stop_modal) = (on, on);
            }
            Action::FeedPerMinute(on) => self.state.feed.per_minute = on,
            Action::Motion(mode) => self.state.mode = mode,
            Action::SplineOrSwitch | Action::Cycle | Action::CycleEnd => {
                return self.path_action(block, code, action);
            }
            Action::ToolLength => {
                // One group on a control: G43, G44, G43.1, G43.4, G43.5, G49. G234 is of Haas.
                self.set_tcp_mode(matches!(code, 434 | 435 | 2340), code == 435);
                return self.length(block, code);
            }
            Action::AxialShift => {
                self.without_moving(|this| this.axial_shift(block, code == 580));
                return true;
            }
            Action::WorkOffset => self.work_offset(code, block),
            _ => return self.transform_action(block, code, action),
        }
        false
    }

    /// Splines and cycles. True if the code is a mode switch and axis words only name axes.
    fn path_action(&mut self, block: &Block<'_>, code: u32, action: Action) -> bool {
        let (fanuc, linux) = (self.dialect == Dialect::Fanuc, self.dialect == Dialect::LinuxCnc);
        self.state.mode = match action {
            Action::SplineOrSwitch if !linux && (fanuc || block.centre.iter().all(Option::is_none)) => {
                return true;
            }
            Action::SplineOrSwitch => MotionMode::Unsupported(Reason::UnsupportedPath),
            Action::Cycle if self.reads_contour(block, code) => return false,
            Action::Cycle => {
                if !matches!(self.state.mode, MotionMode::Unsupported(Reason::Cycle)) {
                    self.state.mode_before_cycle = self.state.mode;
                }
                MotionMode::Unsupported(Reason::Cycle)
            }
            // Beside a motion code G80 only ends the cycle.
            _ if block.g.iter().any(|code| matches!(code, 0 | 10 | 20 | 30)) => return false,
            // On a Fanuc the motion mode before the cycle holds again, or, depending on the control, the rapid motion
            // of the cycle. LinuxCNC requires a new motion code.
            _ if fanuc && self.state.mode != MotionMode::Unsupported(Reason::Cycle) => return false,
            _ if fanuc && self.state.mode_before_cycle == MotionMode::Rapid => MotionMode::Rapid,
            _ => MotionMode::Unknown(Reason::NoMotionCode),
        };
        false
    }

    /// Coordinate transforms. True if the axis words are their values.
    fn transform_action(&mut self, block: &Block<'_>, code: u32, action: Action) -> bool {
        let zero = |index: usize| self.literal(&block.words[index]) == Some(0.0);
        match action {
            Action::Transform(group, on) => {
                self.switch_transform(group, on);
                return false;
            }
            Action::DiameterOn => {
                self.switch_transform_in_place(ModalGroup::Diameter, true);
                return false;
            }
            Action::DiameterOffOrLookAhead => {
                let fanuc = self.dialect == Dialect::Fanuc;
                if !fanuc && (block.p.is_none() || self.dialect == Dialect::LinuxCnc) {
                    self.switch_transform_in_place(ModalGroup::Diameter, false);
                }
                return false;
            }
            Action::PolarOrWorkOffset => {
                // Okuma: a work offset by its number.
                match block.h {
                    Some(_) => self.work_offset(code, block),
                    None => self.switch_transform(ModalGroup::Polar, code == 160),
                }
                return false;
            }
            Action::Rotation => {
                if block.axes.iter().flatten().count() < 2 {
                    self.mark_position_used(super::POSITION);
                }
                self.switch_transform(ModalGroup::Rotation, true);
            }
            Action::Cylinder => {
                let ends =
                    block.abc.iter().chain(&block.axes).flatten().next().is_some_and(|&index| zero(index));
                self.switch_transform(ModalGroup::Cylinder, !ends);
            }
            Action::Scaling if code == 500 && self.limits_spindle(block) => {}
            Action::Scaling => {
                if code == 510 && block.axes.contains(&None) {
                    // Omitted centre words are at the tool position.
                    self.mark_position_used(super::POSITION);
                }
                self.switch_transform(ModalGroup::Scaling, code == 510);
            }
            Action::Mirror(on) => self.switch_transform(ModalGroup::Mirror, on),
            Action::TiltedPlane(on) => self.switch_transform(ModalGroup::TiltedPlane, on),
            Action::FixtureOffset => {
                let ends = block.p.is_some_and(zero);
                self.switch_transform(ModalGroup::FixtureOffset, !ends);
            }
            _ => return false,
        }
        true
    }

    /// As [`Self::switch_transform`], for transforms that leave the axes and their values unchanged.
    pub(super) fn switch_transform_in_place(&mut self, group: ModalGroup, on: bool) {
        let was = self.state.groups.is_on(group);
        if was == on && self.state.unknown_reason(group.bit()).is_none() {
            self.set_group(group, u64::from(on));
        } else {
            self.switch_transform(group, on);
        }
    }

    /// Every work offset is or may be assigned an unknown value.
    pub(super) fn invalidate_offsets(&mut self) {
        self.state.work_offset.assigned.invalidate();
        self.pass.effects.assigned.offsets |= self.is_conditional();
        self.pass.effects.assigned.rotary |= self.is_conditional();
        self.frame_index = None;
        self.invalidate_pose();
    }

    /// A probing cycle of the control may set work offsets, their rotation and tools from what it measures.
    pub(super) fn invalidate_by_probing(&mut self) {
        self.invalidate_offsets();
        self.invalidate_tools();
        self.state.work_offset.assigned.invalidate_by_probing();
        self.state.tool.assigned.invalidate_by_probing();
    }

    /// Whether G50 or G92 states a spindle speed limit, and not a position.
    pub(super) fn limits_spindle(&self, block: &Block<'_>) -> bool {
        !block.has_motion_words()
            && !block.flags.other_axes
            && block.words.iter().any(|word| word.address() == Some(b'S'))
    }

    /// Whether G70 or G71 is a unit: on Fanuc, Haas and LinuxCNC they are cycles, with words of their own.
    pub(super) fn is_unit(&self, block: &Block<'_>, code: u32) -> bool {
        let bare = |word: &Word<'_>| matches!(word.address(), Some(b'G' | b'N' | b'M' | b'S' | b'T' | b'F'));
        matches!(code, 700 | 710) && self.dialect == Dialect::Iso && block.words.iter().all(bare)
    }

    /// Whether this is a lathe cycle that reads a contour from P to Q, or a pattern of Haas: neither is modal.
    pub(super) fn reads_contour(&self, block: &Block<'_>, code: u32) -> bool {
        matches!(code, 700..=729) || matches!(code, 730 | 740..=769) && block.p.is_some() && block.q.is_some()
    }

    fn work_offset(&mut self, code: u32, block: &Block<'_>) {
        let mut name = code_name(code);
        let number = |at: Option<usize>| at.map(|index| self.literal(&block.words[index]));
        let number = match code {
            150 | 160 => number(block.h).map(|number| (" H", number)),
            541 | 1540 => number(block.p).map(|number| (" P", number)),
            // P means G54.1 P on some controls and nothing on others: the name is distinct, so that only a setup can
            // state it.
            540 if !self.p_belongs_elsewhere(block) => number(block.p).map(|number| (" P", number)),
            _ => None,
        };
        match number {
            Some((letter, Some(number))) => name += &format!("{letter}{}", number.round()),
            Some((letter, None)) => name += &format!("{letter}?"),
            None => {}
        }
        self.without_moving(|this| this.select_work_offset(name));
    }

    /// Whether P belongs to another word than the work offset: a call, a dwell, a cycle.
    fn p_belongs_elsewhere(&self, block: &Block<'_>) -> bool {
        matches!(self.dialect, Dialect::Siemens | Dialect::LinuxCnc)
            || block.m.iter().any(|m| matches!(m, 46 | 62..=68 | 96..=99 | 198))
            || block.g.iter().any(|g| matches!(g, 20 | 30 | 40 | 50..=52 | 80 | 100 | 510 | 470 | 650..=661 | 680..=689 | 700..=769 | 810..=899 | 1500))
    }

    /// Selects a work offset. The coordinates of the tool position change, and its orientation if the frames are
    /// rotated.
    pub(super) fn select_work_offset(&mut self, name: String) {
        let before = self.frame_value(&self.state.work_offset.name.clone());
        let pending = std::mem::take(&mut self.state.work_offset.pending);
        let unknown = self.state.unknown_reason(ModalGroup::WorkOffset.bit()).is_some();
        let changes = name != self.state.work_offset.name || pending || unknown;
        let after = self.frame_value(&name);
        self.set_group(ModalGroup::WorkOffset, name_key(&name));
        self.state.work_offset.name = name;
        self.frame_index = None;
        if !changes {
            return;
        }
        self.invalidate_position();
        let same_rotation = match (before, after) {
            (Ok(a), Ok(b)) => a.pose().rotation.angle_to(&b.pose().rotation) < 1e-9,
            _ => false,
        };
        if !same_rotation || pending || unknown {
            self.invalidate_pose();
        }
    }
}
