//! G words of one block.

use super::super::dialect::Dialect;
use super::super::machine::Mode;
use super::names::code_name;
use super::{Event, Lister, Said};
use crate::motion::Reason;

impl Lister<'_, '_> {
    /// G words of one block. True where the block's axis words are no motion that is followed.
    pub(super) fn unmodal_codes(&mut self, said: &Said<'_>) -> bool {
        said.g.iter().any(|&code| {
            self.stands(said, code)
                || self.unfollowed(said, code)
                || self.cycle_code(said, code)
                || self.shift_code(said, code)
        }) || self.m_motion(said)
    }

    /// G words whose block does not move: dwells, settings, poles, places that are stored.
    fn stands(&mut self, said: &Said<'_>, code: u32) -> bool {
        let siemens = self.dialect == Dialect::Siemens;
        match code {
            // LinuxCNC dwells, stores the place, and then moves.
            40 | 281 | 301 if self.dialect == Dialect::LinuxCnc => return false,
            // A motion on LinuxCNC, none on a Fanuc: a plain file does not tell which.
            40 if self.dialect == Dialect::Iso && said.moves() && said.p.is_some() => {
                self.gone(said, code, Reason::UnknownWord);
            }
            40 | 220 | 230 | 250 | 260 | 1030 | 1870 => {}
            110 if !siemens => {}
            100 if !siemens => self.set_offset(said),
            // A pole: no motion. That of G110 counts from where the tool stands.
            1100 if siemens => self.held_here(super::POSITION),
            1110 | 1120 if siemens => {}
            // grbl: where the tool stands is stored.
            281 | 301 if self.dialect != Dialect::Fanuc && !said.moves() => {}
            _ => return false,
        }
        true
    }

    /// Motions to where the text does not tell: cycles, reference points, probes.
    fn unfollowed(&mut self, said: &Said<'_>, code: u32) -> bool {
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
        self.gone(said, code, reason);
        match code {
            // Measuring cycles set tools or work offsets.
            350 | 360 | 370 | 1360 => {
                self.frames_assigned();
                self.tools_assigned();
            }
            // The spindle turns back to where it began.
            331 => self.state.mode = Mode::Other(Reason::NotFollowed),
            _ => {}
        }
        true
    }

    /// What the control works out from other blocks, or does by a program of its own.
    fn cycle_code(&mut self, said: &Said<'_>, code: u32) -> bool {
        match code {
            // Contours and patterns, where they are no units.
            700 | 710 if self.is_unit(said) => return false,
            700..=769 if self.dialect != Dialect::Siemens && self.reads_contour(said, code) => {
                self.left(said, &code_name(code), Reason::Cycle);
                self.lose_all();
            }
            // The axes turn into the tilted plane.
            531 | 536 => {
                self.left(said, &code_name(code), Reason::Cycle);
                self.lose_all();
            }
            650 => self.subprogram(said, "G65"),
            660 | 661 => {
                self.subprogram(said, "G66");
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
    fn m_motion(&mut self, said: &Said<'_>) -> bool {
        if self.dialect == Dialect::Heidenhain && said.m.contains(&140) {
            // Back along the tool to the end of the range.
            self.left(said, "M140", Reason::ReferenceReturn);
            self.lose_position();
            return true;
        }
        let call = said.m.iter().find(|m| matches!(m, 97 | 98 | 198));
        if self.dialect.paren_comments()
            && let Some(m) = call
        {
            self.subprogram(said, &format!("M{m}"));
            return true;
        }
        false
    }

    /// A motion to where the text does not tell.
    pub(super) fn gone(&mut self, said: &Said<'_>, code: u32, reason: Reason) {
        let name = code_name(code);
        self.left(said, &name, reason);
        let none = said.axes.iter().chain(&said.abc).all(Option::is_none);
        if none {
            self.lose_all();
            return;
        }
        self.lose_axes(said);
    }

    /// Where the axes go that a block names is not known.
    pub(super) fn lose_axes(&mut self, said: &Said<'_>) {
        let mut lost = 0;
        for axis in 0..3 {
            if said.axes[axis].is_some() {
                self.state.position[axis] = Err(Reason::PositionUnknown);
                lost |= 1 << axis;
            }
            if said.abc[axis].is_some() {
                self.state.abc[axis] = Err(Reason::OrientationUnknown);
                lost |= 8 << axis;
            }
        }
        self.state.previous = None;
        self.events.push(Event::Lost(lost));
    }
}
