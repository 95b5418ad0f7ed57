//! One-shot (non-modal) G codes.

use super::super::dialect::Dialect;
use super::super::modal_state::MotionMode;
use super::siemens_names::code_name;
use super::{Block, Interpreter, StateEvent};
use crate::motion::Reason;

impl Interpreter<'_, '_> {
    /// Applies the one-shot G codes of a block. True if its axis words are not a modelled motion.
    pub(super) fn one_shot_codes(&mut self, block: &Block<'_>) -> bool {
        block.g.iter().any(|&code| {
            self.non_moving_code(block, code)
                || self.unpredictable_code(block, code)
                || self.cycle_code(block, code)
                || self.shift_code(block, code)
        }) || self.m_motion(block)
    }

    /// G codes whose block does not move: dwells, settings, poles, saved positions.
    fn non_moving_code(&mut self, block: &Block<'_>, code: u32) -> bool {
        let siemens = self.dialect == Dialect::Siemens;
        match code {
            // LinuxCNC dwells or stores the position, and then moves.
            40 | 281 | 301 if self.dialect == Dialect::LinuxCnc => return false,
            // A motion on LinuxCNC, none on Fanuc; for an ISO file this is unknown.
            40 if self.dialect == Dialect::Iso && block.has_motion_words() && block.p.is_some() => {
                self.leave_unknown_end(block, code, Reason::UnknownWord);
            }
            40 | 220 | 230 | 250 | 260 | 1030 | 1870 => {}
            110 if !siemens => {}
            100 if !siemens => self.set_offset(block),
            // A pole: no motion. G110 is relative to the tool position.
            1100 if siemens => self.mark_position_used(super::POSITION),
            1110 | 1120 if siemens => {}
            // grbl stores the tool position.
            281 | 301 if self.dialect != Dialect::Fanuc && !block.has_motion_words() => {}
            _ => return false,
        }
        true
    }

    /// Motions whose end the text does not determine: cycles, reference points, probes.
    fn unpredictable_code(&mut self, block: &Block<'_>, code: u32) -> bool {
        let siemens = self.dialect == Dialect::Siemens;
        let reason = match code {
            120 | 130 | 470 | 1500 => Reason::Cycle,
            270 | 280 | 290 | 300 => Reason::ReferenceReturn,
            281 | 301 if self.dialect != Dialect::LinuxCnc => Reason::ReferenceReturn,
            740 | 750 if siemens => Reason::ReferenceReturn,
            350 | 360 | 370 | 1360 if !siemens => Reason::Probe,
            310..=318 | 382..=385 => Reason::Probe,
            331 => Reason::UnsupportedPath,
            1470 | 1480 | 2470 | 2480 | 3470 | 3480 if siemens => Reason::UnsupportedPath,
            _ => return false,
        };
        self.leave_unknown_end(block, code, reason);
        match code {
            // Measuring cycles set tools or work offsets.
            350 | 360 | 370 | 1360 => {
                self.invalidate_offsets();
                self.invalidate_tools();
            }
            // Rigid tapping: the spindle reverses back to the start.
            331 => self.state.mode = MotionMode::Unsupported(Reason::UnsupportedPath),
            _ => {}
        }
        true
    }

    /// Motions that the control derives from other blocks or a program of its own.
    fn cycle_code(&mut self, block: &Block<'_>, code: u32) -> bool {
        match code {
            // Contours and patterns, unless they are units.
            700 | 710 if self.is_unit(block) => return false,
            700..=769 if self.dialect != Dialect::Siemens && self.reads_contour(block, code) => {
                self.list_left(block, &code_name(code), Reason::Cycle);
                self.invalidate_pose();
            }
            // The rotary axes move to the tilted plane.
            531 | 536 => {
                self.list_left(block, &code_name(code), Reason::Cycle);
                self.invalidate_pose();
            }
            650 => self.subprogram(block, "G65"),
            660 | 661 => {
                self.subprogram(block, "G66");
                self.state.modal_call = Some(Reason::Subprogram);
            }
            670 => {
                self.state.modal_call = None;
                return false;
            }
            _ => return false,
        }
        true
    }

    /// M words that move or call. True if the axis words are not a modelled motion.
    fn m_motion(&mut self, block: &Block<'_>) -> bool {
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
                self.state.abc[axis] = Err(Reason::OrientationUnknown);
                unknown |= 8 << axis;
            }
        }
        self.state.previous = None;
        self.events.push(StateEvent::AxesUnknown(unknown));
    }
}
