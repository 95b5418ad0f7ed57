//! G words of one block.

use super::super::dialect::Dialect;
use super::super::modal_state::MotionMode;
use super::siemens_names::code_name;
use super::{Block, Interpreter, StateEvent};
use crate::motion::Reason;

impl Interpreter<'_, '_> {
    /// G words of one block. True where the block's axis words are no motion that is followed.
    pub(super) fn one_shot_codes(&mut self, block: &Block<'_>) -> bool {
        block.g.iter().any(|&code| {
            self.non_moving_code(block, code)
                || self.unpredictable_code(block, code)
                || self.cycle_code(block, code)
                || self.shift_code(block, code)
        }) || self.m_motion(block)
    }

    /// G words whose block does not move: dwells, settings, poles, places that are stored.
    fn non_moving_code(&mut self, block: &Block<'_>, code: u32) -> bool {
        let siemens = self.dialect == Dialect::Siemens;
        match code {
            // LinuxCNC dwells, stores the place, and then moves.
            40 | 281 | 301 if self.dialect == Dialect::LinuxCnc => return false,
            // A motion on LinuxCNC, none on a Fanuc: a plain file does not tell which.
            40 if self.dialect == Dialect::Iso && block.has_motion_words() && block.p.is_some() => {
                self.leave_unknown_end(block, code, Reason::UnknownWord);
            }
            40 | 220 | 230 | 250 | 260 | 1030 | 1870 => {}
            110 if !siemens => {}
            100 if !siemens => self.set_offset(block),
            // A pole: no motion. That of G110 counts from where the tool stands.
            1100 if siemens => self.mark_position_used(super::POSITION),
            1110 | 1120 if siemens => {}
            // grbl: where the tool stands is stored.
            281 | 301 if self.dialect != Dialect::Fanuc && !block.has_motion_words() => {}
            _ => return false,
        }
        true
    }

    /// Motions to where the text does not tell: cycles, reference points, probes.
    fn unpredictable_code(&mut self, block: &Block<'_>, code: u32) -> bool {
        let siemens = self.dialect == Dialect::Siemens;
        let reason = match code {
            120 | 130 | 470 | 1500 => Reason::Cycle,
            270 | 280 | 290 | 300 => Reason::ReferenceReturn,
            281 | 301 if self.dialect != Dialect::LinuxCnc => Reason::ReferenceReturn,
            740 | 750 if siemens => Reason::ReferenceReturn,
            350 | 360 | 370 | 1360 if !siemens => Reason::Probe,
            310..=318 | 382..=385 => Reason::Probe,
            331 => Reason::NotFollowed,
            1470 | 1480 | 2470 | 2480 | 3470 | 3480 if siemens => Reason::NotFollowed,
            _ => return false,
        };
        self.leave_unknown_end(block, code, reason);
        match code {
            // Measuring cycles set tools or work offsets.
            350 | 360 | 370 | 1360 => {
                self.frames_assigned();
                self.tools_assigned();
            }
            // The spindle turns back to where it began.
            331 => self.state.mode = MotionMode::Unsupported(Reason::NotFollowed),
            _ => {}
        }
        true
    }

    /// What the control works out from other blocks, or does by a program of its own.
    fn cycle_code(&mut self, block: &Block<'_>, code: u32) -> bool {
        match code {
            // Contours and patterns, where they are no units.
            700 | 710 if self.is_unit(block) => return false,
            700..=769 if self.dialect != Dialect::Siemens && self.reads_contour(block, code) => {
                self.list_left(block, &code_name(code), Reason::Cycle);
                self.invalidate_pose();
            }
            // The axes turn into the tilted plane.
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

    /// M words that move or call by themselves. True where the block's axis words are no motion that is followed.
    fn m_motion(&mut self, block: &Block<'_>) -> bool {
        if self.dialect == Dialect::Heidenhain && block.m.contains(&140) {
            // Back along the tool to the end of the range.
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

    /// A motion to where the text does not tell.
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

    /// Where the axes go that a block names is not known.
    pub(super) fn invalidate_named_axes(&mut self, block: &Block<'_>) {
        let mut lost = 0;
        for axis in 0..3 {
            if block.axes[axis].is_some() {
                self.state.position[axis] = Err(Reason::PositionUnknown);
                lost |= 1 << axis;
            }
            if block.abc[axis].is_some() {
                self.state.abc[axis] = Err(Reason::OrientationUnknown);
                lost |= 8 << axis;
            }
        }
        self.state.previous = None;
        self.events.push(StateEvent::AxesUnknown(lost));
    }
}
