//! One-shot (non-modal) G codes.

use super::super::dialect::Dialect;
use super::super::modal_state::MotionMode;
use super::super::preceding::Preceding;
use super::g_codes::{Action, action};
use super::siemens_names::code_name;
use super::{Block, Interpreter, StateEvent};
use crate::motion::Reason;

impl Interpreter<'_, '_> {
    /// Applies the one-shot G codes of a block. True if its axis words are not a modelled motion.
    pub(super) fn one_shot_codes(&mut self, block: &Block<'_>) -> bool {
        let one_shot = |&code: &u32| {
            action(code, self.dialect).is_some_and(|action| self.one_shot_action(block, code, action))
        };
        block.g.iter().any(one_shot) || self.m_motion(block)
    }

    /// Applies a one-shot G code. True if the axis words of its block are not a modelled motion.
    fn one_shot_action(&mut self, block: &Block<'_>, code: u32, action: Action) -> bool {
        let (iso, linux) = (self.dialect == Dialect::Iso, self.dialect == Dialect::LinuxCnc);
        match action {
            // LinuxCNC dwells or stores the position, and then moves.
            Action::Dwell | Action::StorePosition if linux => return false,
            // A motion on LinuxCNC, none on Fanuc; for an ISO file this is unknown.
            Action::Dwell if iso && block.has_motion_words() && block.p.is_some() => {
                self.leave_unknown_end(block, code, Reason::UnknownWord);
            }
            Action::Dwell | Action::NoMotion => {}
            Action::PoleAtPosition => self.mark_position_used(super::POSITION),
            Action::SetOffset => self.set_offset(block),
            // grbl stores the tool position.
            Action::StorePosition if iso && !block.has_motion_words() => {}
            Action::StorePosition => self.leave_unknown_end(block, code, Reason::ReferenceReturn),
            Action::UnknownEnd(reason) => self.leave_unknown_end(block, code, reason),
            Action::Measure => {
                self.leave_unknown_end(block, code, Reason::Probe);
                self.invalidate_by_probing();
            }
            Action::RigidTapping => {
                self.leave_unknown_end(block, code, Reason::UnsupportedPath);
                // The spindle reverses back to the start.
                self.state.mode = MotionMode::Unsupported(Reason::UnsupportedPath);
            }
            Action::ContourOrUnit if self.is_unit(block, code) => return false,
            Action::ContourOrUnit | Action::Cycle if self.reads_contour(block, code) => {
                self.list_left(block, &code_name(code), Reason::Cycle);
                self.invalidate_pose();
            }
            Action::AlignToPlane => {
                self.list_left(block, &code_name(code), Reason::TiltsTool);
                self.invalidate_pose();
            }
            Action::Call => self.subprogram(block, "G65"),
            Action::ModalCall => {
                self.subprogram(block, "G66");
                self.pass.modal_callee = self.callee(block);
                self.state.modal_call = Some(Reason::Subprogram);
            }
            Action::ModalCallEnd => {
                self.state.modal_call = None;
                return false;
            }
            Action::Shift => return self.shift_code(block, code),
            _ => return false,
        }
        true
    }

    /// M words that move or call. True if the axis words are not a modelled motion.
    pub(super) fn m_motion(&mut self, block: &Block<'_>) -> bool {
        if self.dialect == Dialect::Heidenhain && block.m.contains(&140) {
            // Retraction along the tool axis to the end of the range.
            self.list_left(block, "M140", Reason::ReferenceReturn);
            self.invalidate_position();
            return true;
        }
        let call = block.m.iter().find(|m| matches!(m, 97 | 98 | 198));
        if self.dialect.paren_comments()
            && let Some(m) = call
        {
            self.subprogram(block, &format!("M{m}"));
            return true;
        }
        false
    }

    /// Lists a motion whose end the text does not determine.
    pub(super) fn leave_unknown_end(&mut self, block: &Block<'_>, code: u32, reason: Reason) {
        let name = code_name(code);
        self.list_left(block, &name, reason);
        let none = block.axes.iter().chain(&block.abc).all(Option::is_none);
        if none {
            self.invalidate_pose();
            return;
        }
        self.invalidate_named_axes(block);
    }

    /// The axes that a block names are unknown from here on.
    pub(super) fn invalidate_named_axes(&mut self, block: &Block<'_>) {
        let mut unknown = 0;
        for axis in 0..3 {
            if block.axes[axis].is_some() {
                self.state.position[axis] = Err(Reason::PositionUnknown);
                unknown |= 1 << axis;
            }
            if block.abc[axis].is_some() {
                self.state.orientation.abc[axis] = Err(Reason::OrientationUnknown);
                unknown |= 8 << axis;
            }
        }
        self.state.preceding = Preceding::default();
        self.events.push(StateEvent::AxesUnknown(unknown));
    }
}
