//! What a block sets: named commands, G words that hold on, G words of one block.

use super::super::arc::Plane;
use super::super::dialect::Dialect;
use super::super::expression::Worth;
use super::super::machine::{Group, Length, Mode, OF_TOOL, State, Turn};
use super::super::syntax::{Belongs, Word};
use super::super::token::Token;
use super::found::key;
use super::names::{code_name, is_cycle, is_harmless_call, is_keyword};
use super::{Event, Lister, Said};
use crate::motion::Reason;

impl Lister<'_, '_> {
    /// Commands with a name. True where nothing else is done in the block.
    pub(super) fn named_commands(&mut self, said: &Said<'_>) -> bool {
        if self.dialect != Dialect::Siemens {
            return false;
        }
        for word in &said.words {
            if word.name.first() == Some(&b'$') && word.assigned {
                self.system_variable(word);
            }
        }
        if self.programmable_frame(said) {
            return true;
        }
        let mut done = false;
        for index in 0..said.words.len() {
            let word = said.words[index];
            if word.name.len() < 2 || word.assigned || self.tree.kind(word.end - 1) == Some(Token::Colon) {
                continue;
            }
            let name = word.name.to_ascii_uppercase();
            match &*name {
                b"TRAORI" => {
                    self.turn_only(Group::Kinematic, false);
                    self.tip(true, false);
                }
                b"TRAFOOF" => {
                    self.turn_only(Group::Kinematic, false);
                    self.tip(false, false);
                }
                b"TRANSMIT" | b"TRACYL" | b"TRAANG" | b"TRACON" => {
                    self.tip(false, false);
                    self.turn(Group::Kinematic, true);
                }
                b"ORIMKS" | b"ORIWKS" => self.turn_only(Group::OrientationFrame, &*name == b"ORIMKS"),
                b"DIAMON" | b"DIAM90" | b"DIAMOF" | b"DIAMCYCOF" | b"DIAMONA" | b"DIAM90A" | b"DIAMOFA" => {
                    self.turn_only(Group::Diameter, !matches!(&*name, b"DIAMOF"));
                }
                b"TOFRAME" | b"TOFRAMEX" | b"TOFRAMEY" | b"TOFRAMEZ" | b"TOROT" | b"TOROTX" | b"TOROTY"
                | b"TOROTZ" => {
                    self.held_here(super::EVERYWHERE);
                    self.turn(Group::ToolFrame, true);
                }
                b"TOROTOF" => self.turn(Group::ToolFrame, false),
                b"PAROT" => self.turn(Group::PartFrame, true),
                b"PAROTOF" => self.turn(Group::PartFrame, false),
                b"ORIRPY" | b"ORIEULER" | b"ORIVIRT1" | b"ORIVIRT2" | b"ORIRPY2" => {
                    self.state.rpy_stated = &*name == b"ORIRPY";
                    self.set(Group::Rpy, 1 + u64::from(self.state.rpy_stated));
                }
                b"ORIROTA" => {
                    self.state.spin_absolute = true;
                    self.set(Group::Spin, 0);
                }
                b"ORIROTR" | b"ORIROTT" | b"ORIROTC" => {
                    self.state.spin_absolute = false;
                    self.set(Group::Spin, 1);
                    self.state.spin = Err(Reason::OrientationUnknown);
                }
                b"ORIPATH" | b"ORIPATHS" | b"ORIRESET" => self.state.lose_orientation(),
                b"CIP" | b"CT" | b"BSPLINE" | b"ASPLINE" | b"CSPLINE" | b"POLY" | b"INVCW" | b"INVCCW" => {
                    self.state.mode = Mode::Other(Reason::NotFollowed);
                    self.state.tangent = !matches!(&*name, b"CIP" | b"POLY" | b"INVCW" | b"INVCCW");
                }
                b"CYCLE800" => {
                    let empty = matches!(word.belongs, Belongs::Arguments { first, end } if end == first + 2);
                    if !empty {
                        self.left(said, "CYCLE800", Reason::Cycle);
                    }
                    self.turn(Group::Swivel, !empty);
                    done = true;
                }
                b"TOFF" | b"FTOCON" | b"FTOCOF" | b"TOFFON" | b"TOFFOF" | b"PUTFTOC" | b"PUTFTOCF"
                | b"TOWSTD" | b"TOWMCS" | b"TOWWCS" | b"TOWBCS" | b"TOWTCS" | b"TOWKCS" | b"TCOABS"
                | b"TCOFR" | b"TCOFRX" | b"TCOFRY" | b"TCOFRZ" => self.tool_assigned(),
                b"GEOAX" => self.frames_assigned(),
                b"PRESETON" | b"PRESETONS" => {
                    self.held_here(super::EVERYWHERE);
                    self.frames_assigned();
                }
                _ => match word.belongs {
                    Belongs::Arguments { .. } if is_harmless_call(&name) => {}
                    Belongs::Arguments { .. } if is_cycle(&name) => {
                        let text = String::from_utf8_lossy(&name).into_owned();
                        self.left(said, &text, Reason::Cycle);
                        self.lose_position();
                        done = true;
                    }
                    _ if is_keyword(&name) => {}
                    Belongs::Nothing | Belongs::Arguments { .. } if self.is_call(said, index) => {
                        let text = String::from_utf8_lossy(word.name).into_owned();
                        self.subprogram(said, &text);
                        done = true;
                    }
                    _ => {
                        let text = String::from_utf8_lossy(word.name).into_owned();
                        self.deny(said, &text, Reason::UnknownWord);
                        return true;
                    }
                },
            }
        }
        done
    }

    /// Whether a name that is not known calls a subprogram: it stands first, alone or with how often (P).
    fn is_call(&self, said: &Said<'_>, index: usize) -> bool {
        !said.opaque
            && said.words.iter().enumerate().all(|(at, word)| {
                at == index || matches!(word.address(), Some(b'N' | b'P' | b'M' | b'F' | b'S' | b'T' | b'D'))
            })
    }

    /// As [`Self::turn`], where the axes stay where they are and keep their values.
    fn turn_only(&mut self, group: Group, on: bool) {
        let was = self.state.turned & 1 << group as u32 != 0;
        if was == on && self.state.doubt(1 << group as u32).is_none() {
            self.set(group, u64::from(on));
        } else {
            self.turn(group, on);
        }
    }

    /// Tool centre point control goes on or off: where it changes, what was the tip is none, or the other way round.
    pub(super) fn tip(&mut self, on: bool, vector_words: bool) {
        let changes = self.state.tip != on || self.state.doubt(1 << Group::Tip as u32).is_some();
        (self.state.tip, self.state.vector_words) = (on, vector_words);
        self.set(Group::Tip, u64::from(on) + 2 * u64::from(vector_words));
        if changes {
            // The axes stay where they are, and so do A, B and C; a tool vector means nothing without control of the tip.
            match self.state.turn {
                Turn::Vector if !on => self.lose_all(),
                _ => self.lose_position(),
            }
        }
    }

    /// Something of the tool changes: where it stands has other coordinates now.
    fn tool_is(&mut self, change: impl FnOnce(&mut State)) {
        let before = self.state.tool_name(self.dialect);
        change(&mut self.state);
        let after = self.state.tool_name(self.dialect);
        if before != after || self.state.doubt(OF_TOOL).is_some() {
            self.lose_position();
        }
    }

    /// Another length of the tool counts, whichever tool that is.
    pub(super) fn length_is(&mut self, change: impl FnOnce(&mut State)) {
        self.tool_is(change);
        let State { length, edge, .. } = self.state;
        let value = match (self.dialect, length) {
            (Dialect::Siemens | Dialect::Heidenhain, _) => u64::from(edge).wrapping_sub(1),
            (_, Length::OfTool) => 0,
            (_, Length::None) => 1,
            (_, Length::Of(number)) => 2 + u64::from(number),
        };
        self.set(Group::Length, value);
    }

    pub(super) fn change_tool(&mut self, name: String) {
        let value = key(&name);
        self.tool_is(|state| {
            state.tool = name;
            (state.edge, state.own_length) = (1, None);
        });
        self.set(Group::Tool, value);
        if matches!(self.dialect, Dialect::Siemens | Dialect::Heidenhain) {
            // Its first edge; Heidenhain has no other.
            self.length_is(|_| {});
        }
    }

    /// The tool that is in is changed by the program to what the text does not tell.
    pub(super) fn tool_assigned(&mut self) {
        if self.state.doubt(OF_TOOL).is_some() {
            // It may be any.
            return self.tools_assigned();
        }
        let name = self.state.tool_name(self.dialect);
        self.state.tools.set(&name, None);
        self.found.assigns.1 |= self.anywhere_else();
        self.tool_index.clear();
        self.lose_position();
    }

    /// Every work offset is or may be changed to what the text does not tell.
    pub(super) fn frames_assigned(&mut self) {
        self.state.frames.lose_all();
        self.found.assigns.0 |= self.anywhere_else();
        self.frame_index = None;
        self.lose_all();
    }

    /// Every tool is or may be changed.
    pub(super) fn tools_assigned(&mut self) {
        self.state.tools.lose_all();
        self.found.assigns.1 |= self.anywhere_else();
        self.tool_index.clear();
        self.lose_position();
    }

    /// G words that hold on. True where the block's axis words are no motion.
    pub(super) fn modal_codes(&mut self, said: &Said<'_>) -> bool {
        let siemens = self.dialect == Dialect::Siemens;
        let linux = self.dialect == Dialect::LinuxCnc;
        let fanuc = self.dialect == Dialect::Fanuc;
        self.state.exact_stop &= self.state.exact_stop_holds;
        // Of the paths with a number only the cubic spline goes on in the direction of the one before.
        if said
            .g
            .iter()
            .any(|code| matches!(code, 22..=24 | 32..=34 | 50..=53 | 62 | 320..=350 | 630 | 3310..=3360))
        {
            self.state.tangent = said.g.contains(&50);
        }
        for &code in &said.g {
            match code {
                0 => self.state.mode = Mode::Rapid,
                10 => self.state.mode = Mode::Linear,
                20 => self.state.mode = Mode::Circular(false),
                30 => self.state.mode = Mode::Circular(true),
                50 | 51 if !siemens => {
                    if linux || !fanuc && said.centre.iter().any(Option::is_some) {
                        self.state.mode = Mode::Other(Reason::NotFollowed);
                    } else {
                        // A switch of the control: axis words only name axes.
                        return true;
                    }
                }
                22..=24 | 32..=34 | 52 | 53 | 62 | 320 | 330 | 340 | 350 | 3310 | 3320 | 3350 | 3360
                    if siemens || code != 350 =>
                {
                    self.state.mode = Mode::Other(Reason::NotFollowed);
                }
                630 if siemens => self.state.mode = Mode::Other(Reason::NotFollowed),
                70 if !siemens && !fanuc => self.turn_only(Group::Diameter, true),
                80 if linux || !fanuc && said.p.is_none() => self.turn_only(Group::Diameter, false),
                71 | 1070 if !siemens => {
                    let word = said.abc.iter().chain(&said.axes).flatten().next();
                    let ends = word.is_some_and(|&index| self.literal(&said.words[index]) == Some(0.0));
                    self.turn(Group::Cylinder, !ends);
                    return true;
                }
                121 | 1120 if !siemens => self.turn(Group::PolarPath, true),
                131 | 1130 if !siemens => self.turn(Group::PolarPath, false),
                90 => self.state.exact_stop = true,
                // Okuma: a work offset by its number.
                150 | 160 if !siemens && said.h.is_some() => self.work_offset(code, said),
                150 | 160 if !siemens => self.turn(Group::Polar, code == 160),
                500 if self.limits_spindle(said) => return true,
                500 | 510 if !siemens => {
                    if code == 510 && said.axes.contains(&None) {
                        // Centres that are left out are where the tool stands.
                        self.held_here(super::POSITION);
                    }
                    self.turn(Group::Scale, code == 510);
                    return true;
                }
                501 | 511 | 1000 | 1010 if !siemens => {
                    self.turn(Group::Mirror, matches!(code, 511 | 1010));
                    return true;
                }
                680..=689 => {
                    if !siemens && said.axes.iter().flatten().count() < 2 {
                        self.held_here(super::POSITION);
                    }
                    self.turn(Group::Rotation, true);
                    return true;
                }
                690 => {
                    self.turn(Group::Rotation, false);
                }
                2680 | 2690 if !siemens => {
                    self.turn(Group::Swivel, code == 2680);
                    return true;
                }
                2540 | 2550 if !siemens => self.turn(Group::Fixture, code == 2540),
                542 | 544 if !siemens => {
                    let ends = said.p.is_some_and(|index| self.literal(&said.words[index]) == Some(0.0));
                    self.turn(Group::Fixture, !ends);
                    return true;
                }
                170 => self.plane_is(Plane::XY, code),
                180 => self.plane_is(Plane::ZX, code),
                190 => self.plane_is(Plane::YZ, code),
                200 if !siemens => self.unit(25.4),
                210 if !siemens => self.unit(1.0),
                700 | 710 if siemens || self.is_unit(said) => self.unit(if code == 700 { 25.4 } else { 1.0 }),
                7000 if siemens => self.unit(25.4),
                7100 if siemens => self.unit(1.0),
                400 => {
                    self.state.radius = false;
                    self.set(Group::Radius, 0);
                }
                410..=429 => {
                    self.state.radius = true;
                    self.set(Group::Radius, 1);
                }
                // One group on a control: G43, G44, G43.1, G43.4, G43.5, G49. G234 is Haas's.
                430 | 431 | 432 | 434 | 435 | 440 | 490 | 2340 if !siemens => {
                    self.tip(matches!(code, 434 | 435 | 2340), code == 435);
                    if self.length(said, code) {
                        return true;
                    }
                }
                580 | 590 if siemens => {
                    self.axial_shift(said, code == 580);
                    return true;
                }
                540..=599 | 5000..=5999 | 1540 => self.work_offset(code, said),
                600 | 610 | 611 | 6010..=6030 => {
                    (self.state.exact_stop, self.state.exact_stop_holds) = (true, true)
                }
                640 | 6410..=6450 => (self.state.exact_stop, self.state.exact_stop_holds) = (false, false),
                730..=790 | 810..=899 | 1530 | 1550 | 1610..=1690 | 1740 | 1840
                    if !siemens && !self.reads_contour(said, code) =>
                {
                    if !matches!(self.state.mode, Mode::Other(Reason::Cycle)) {
                        self.state.before_cycle = self.state.mode;
                    }
                    self.state.mode = Mode::Other(Reason::Cycle);
                }
                // Beside a motion word it only ends the cycle.
                800 if said.g.iter().any(|code| matches!(code, 0 | 10 | 20 | 30)) => {}
                // The motion word of before holds on a Fanuc; LinuxCNC wants a new one.
                800 if fanuc && self.state.mode != Mode::Other(Reason::Cycle) => {}
                800 if fanuc => self.state.mode = self.state.before_cycle,
                800 => self.state.mode = Mode::Lost(Reason::NoMotionCode),
                900 | 910 => {
                    self.state.absolute = code == 900;
                    self.set(Group::Distance, u64::from(code));
                }
                901 | 911 => {
                    self.state.centre_absolute = code == 901;
                    self.set(Group::Centre, u64::from(self.state.centre_absolute));
                }
                930 | 950 => self.state.feed_per_minute = false,
                940 => self.state.feed_per_minute = true,
                _ => {}
            }
        }
        false
    }

    /// Whether G50 or G92 states the greatest speed of the spindle, and no place.
    fn limits_spindle(&self, said: &Said<'_>) -> bool {
        !said.moves() && !said.others && said.words.iter().any(|word| word.address() == Some(b'S'))
    }

    /// The plane of arcs.
    pub(super) fn plane_is(&mut self, plane: Plane, code: u32) {
        self.state.plane = plane;
        self.set(Group::Plane, u64::from(code));
    }

    fn unit(&mut self, mm: f64) {
        self.state.unit_mm = mm;
        self.set(Group::Unit, if mm == 1.0 { 21 } else { 20 });
    }

    /// Whether G70 or G71 says a unit: on lathes and mills of Fanuc, Haas and LinuxCNC they are cycles, with words of their own.
    fn is_unit(&self, said: &Said<'_>) -> bool {
        let bare = |word: &Word<'_>| matches!(word.address(), Some(b'G' | b'N' | b'M' | b'S' | b'T' | b'F'));
        self.dialect == Dialect::Iso && said.words.iter().all(bare)
    }

    /// Whether a cycle of a lathe reads a contour from P to Q, or is a pattern of Haas: no motion word that holds on.
    fn reads_contour(&self, said: &Said<'_>, code: u32) -> bool {
        matches!(code, 700..=729) || matches!(code, 730 | 740..=769) && said.p.is_some() && said.q.is_some()
    }

    /// Which length the control adds. True where the axis words of the block are that length.
    fn length(&mut self, said: &Said<'_>, code: u32) -> bool {
        let number = said.h.map(|index| self.literal(&said.words[index]));
        match code {
            490 => self.length_is(|state| state.length = Length::None),
            431 | 432 if self.dialect != Dialect::Fanuc => {
                self.tool_assigned();
                return true;
            }
            _ => match number {
                None => self.length_is(|state| {
                    if state.length == Length::None {
                        state.length = Length::OfTool;
                    }
                }),
                Some(Some(number)) => {
                    let number = number.round() as u32;
                    // On LinuxCNC they are the numbers of tools, elsewhere those of a list of their own.
                    let own = self.dialect != Dialect::LinuxCnc;
                    self.length_is(|state| {
                        state.length = Length::Of(number);
                        if own && state.tool == "T0" && state.own_length.is_none() {
                            state.own_length = Some(number);
                        }
                    });
                }
                Some(None) => self.length_is(|state| state.length = Length::Of(u32::MAX)),
            },
        }
        false
    }

    fn work_offset(&mut self, code: u32, said: &Said<'_>) {
        let mut name = code_name(code);
        let number = |at: Option<usize>| at.map(|index| self.literal(&said.words[index]));
        let number = match code {
            150 | 160 => number(said.h).map(|number| (" H", number)),
            541 | 1540 => number(said.p).map(|number| (" P", number)),
            // On some controls that is G54.1 P, on others P means nothing: a name of its own, which only the setup can know.
            540 if !self.p_belongs_elsewhere(said) => number(said.p).map(|number| (" P", number)),
            _ => None,
        };
        match number {
            Some((letter, Some(number))) => name += &format!("{letter}{}", number.round()),
            Some((letter, None)) => name += &format!("{letter}?"),
            None => {}
        }
        self.frame_is(name);
    }

    /// Whether P of a block is a value of another word than its work offset: a call, a dwell, a cycle.
    fn p_belongs_elsewhere(&self, said: &Said<'_>) -> bool {
        matches!(self.dialect, Dialect::Siemens | Dialect::LinuxCnc)
            || said.m.iter().any(|m| matches!(m, 46 | 62..=68 | 96..=99 | 198))
            || said.g.iter().any(|g| matches!(g, 20 | 30 | 40 | 50..=52 | 80 | 100 | 510 | 470 | 650..=661 | 680..=689 | 700..=769 | 810..=899 | 1500))
    }

    /// Another work offset holds: where the tool stands has other coordinates now, and turns otherwise where the frames do.
    pub(super) fn frame_is(&mut self, name: String) {
        let before = self.frame_value(&self.state.frame.clone());
        let stale = std::mem::take(&mut self.state.stale);
        let doubtful = self.state.doubt(1 << Group::Frame as u32).is_some();
        let changes = name != self.state.frame || stale || doubtful;
        let after = self.frame_value(&name);
        self.set(Group::Frame, key(&name));
        self.state.frame = name;
        self.frame_index = None;
        if !changes {
            return;
        }
        self.lose_position();
        let alike = match (before, after) {
            (Ok(a), Ok(b)) => a.pose().rotation.angle_to(&b.pose().rotation) < 1e-9,
            _ => false,
        };
        if !alike || stale || doubtful {
            self.lose_all();
        }
    }

    /// G words of one block. True where the block's axis words are no motion that is followed.
    pub(super) fn unmodal_codes(&mut self, said: &Said<'_>) -> bool {
        let siemens = self.dialect == Dialect::Siemens;
        let linux = self.dialect == Dialect::LinuxCnc;
        // A motion on LinuxCNC, none on a Fanuc: a plain file does not tell which.
        let either = self.dialect == Dialect::Iso && said.moves();
        for &code in &said.g {
            match code {
                // LinuxCNC dwells, stores the place or ends a shift, and then moves.
                40 | 281 | 301 if linux => {}
                40 if either && said.p.is_some() => {
                    self.gone(said, code, Reason::UnknownWord);
                    return true;
                }
                40 | 220 | 230 | 250 | 260 | 1030 | 1870 => return true,
                110 if !siemens => return true,
                100 if !siemens => {
                    self.set_offset(said);
                    return true;
                }
                // A pole: no motion. That of G110 counts from where the tool stands.
                1100 | 1110 | 1120 if siemens => {
                    if code == 1100 {
                        self.held_here(super::POSITION);
                    }
                    return true;
                }
                120 | 130 | 470 | 1500 => {
                    self.gone(said, code, Reason::Cycle);
                    return true;
                }
                // Contours and patterns, where they are no units.
                700 | 710 if siemens || self.is_unit(said) => {}
                700..=769 if !siemens && self.reads_contour(said, code) => {
                    let name = code_name(code);
                    self.left(said, &name, Reason::Cycle);
                    self.lose_all();
                    return true;
                }
                // LinuxCNC and grbl: where the tool stands is stored.
                281 | 301 if self.dialect != Dialect::Fanuc && !said.moves() => return true,
                270 | 280 | 281 | 290 | 300 | 301 => {
                    self.gone(said, code, Reason::ReferenceReturn);
                    return true;
                }
                740 | 750 if siemens => {
                    self.gone(said, code, Reason::ReferenceReturn);
                    return true;
                }
                // Measuring cycles set tools or work offsets.
                350 | 360 | 370 | 1360 if !siemens => {
                    self.gone(said, code, Reason::Probe);
                    self.frames_assigned();
                    self.tools_assigned();
                    return true;
                }
                310..=318 | 382..=385 => {
                    self.gone(said, code, Reason::Probe);
                    return true;
                }
                331 => {
                    // The spindle turns back to where it began.
                    self.gone(said, code, Reason::NotFollowed);
                    self.state.mode = Mode::Other(Reason::NotFollowed);
                    return true;
                }
                1470 | 1480 | 2470 | 2480 | 3470 | 3480 if siemens => {
                    self.gone(said, code, Reason::NotFollowed);
                    return true;
                }
                531 | 536 => {
                    // The axes turn into the tilted plane.
                    self.left(said, &code_name(code), Reason::Cycle);
                    self.lose_all();
                    return true;
                }
                // Within what G92 has shifted, or in its place: the controls differ.
                520 if self.state.preset && self.dialect != Dialect::LinuxCnc => {
                    self.shift_is_lost();
                    return true;
                }
                520 if !siemens => {
                    self.shift_so_far();
                    // A shift of the work frame itself: the tool stands elsewhere in it.
                    for axis in 0..3 {
                        if let Some(index) = said.axes[axis] {
                            self.state.shift[axis] = self.in_mm(self.worth(&said.words[index]).0);
                        }
                    }
                    self.placed(said.axes.map(|axis| axis.is_some()));
                    self.rotary(said, |_, value| value == Ok(0.0));
                    self.set_any(Group::Shift);
                    return true;
                }
                650 | 660 | 661 => {
                    self.subprogram(said, if code == 650 { "G65" } else { "G66" });
                    if code != 650 {
                        self.state.modal_call = Some(Reason::Subprogram);
                    }
                    return true;
                }
                670 => self.state.modal_call = None,
                // The greatest speed of the spindle.
                920 if self.limits_spindle(said) => return true,
                920 => {
                    self.set_shift(said);
                    return true;
                }
                // Fanuc ends the shift of the axes that are named, LinuxCNC all.
                921 if !self.ends_all(said) => {
                    if either {
                        self.gone(said, code, Reason::UnknownWord);
                    }
                    self.shift_is_lost();
                    return true;
                }
                921 | 922 => {
                    self.state.shift = [Ok(0.0); 3];
                    self.state.preset = false;
                    self.placed([true; 3]);
                    self.set_any(Group::Shift);
                    if self.state.turned & 1 << Group::Rotary as u32 != 0 {
                        self.turn(Group::Rotary, false);
                    }
                    if either {
                        self.gone(said, code, Reason::UnknownWord);
                    }
                    if !linux {
                        return true;
                    }
                }
                923 => {
                    self.events.push(Event::Restored);
                    self.state.shift = [Err(Reason::Variable); 3];
                    self.doubt(Group::Rotary, Reason::Variable);
                    if either {
                        self.gone(said, code, Reason::UnknownWord);
                    }
                    if !linux {
                        return true;
                    }
                }
                _ => {}
            }
        }
        if self.dialect == Dialect::Heidenhain && said.m.contains(&140) {
            // Back along the tool to the end of the range.
            self.left(said, "M140", Reason::ReferenceReturn);
            self.lose_position();
            return true;
        }
        if self.dialect.paren_comments()
            && let Some(m) = said.m.iter().find(|m| matches!(m, 97 | 98 | 198))
        {
            self.subprogram(said, &format!("M{m}"));
            return true;
        }
        false
    }

    /// G92.1: whether every shift ends by it, or there is none.
    fn ends_all(&self, said: &Said<'_>) -> bool {
        let rotary = self.state.turned & 1 << Group::Rotary as u32 != 0;
        let none = self.state.shift == [Ok(0.0); 3]
            && !rotary
            && self.state.doubt(1 << Group::Shift as u32 | 1 << Group::Rotary as u32).is_none();
        let named =
            said.axes.iter().all(Option::is_some) && (!rotary || said.abc.iter().all(Option::is_some));
        self.dialect == Dialect::LinuxCnc || self.dialect == Dialect::Iso && !said.moves() || none || named
    }

    /// What has been added to programmed values so far: where that is in doubt, of the axes that are not said now it stays
    /// unknown.
    fn shift_so_far(&mut self) {
        if let Some(reason) = self.state.doubt(1 << Group::Shift as u32) {
            self.state.shift = [Err(reason); 3];
        }
    }

    /// What is added to programmed values is not known until it ends.
    fn shift_is_lost(&mut self) {
        self.state.shift = [Err(Reason::Displacement); 3];
        self.set_any(Group::Shift);
        self.lose_all();
    }

    /// A, B and C are counted from elsewhere, where `same` does not say that nothing changes.
    fn rotary(&mut self, said: &Said<'_>, same: impl Fn(usize, Worth) -> bool) {
        let mut any = false;
        let mut changes = false;
        for axis in 0..3 {
            if let Some(index) = said.abc[axis] {
                any = true;
                changes |= !same(axis, self.worth(&said.words[index]).0);
            }
        }
        let was = self.state.turned & 1 << Group::Rotary as u32 != 0;
        if any && (changes || was) {
            self.turn(Group::Rotary, changes || said.abc.iter().any(Option::is_none));
        }
    }

    /// G92: the place where the tool stands is called this from here on.
    fn set_shift(&mut self, said: &Said<'_>) {
        let mut stated = [None; 3];
        self.shift_so_far();
        self.found.presets = true;
        for (axis, stated) in stated.iter_mut().enumerate() {
            let Some(index) = said.axes[axis] else { continue };
            let value = self.in_mm(self.worth(&said.words[index]).0);
            self.state.shift[axis] = match (self.state.position[axis], value) {
                (Ok(at), Ok(value)) => {
                    *stated = Some(value);
                    Ok(at - value)
                }
                (Err(reason), _) | (_, Err(reason)) => Err(reason),
            };
        }
        let abc = self.state.abc;
        self.state.preset = true;
        self.set_any(Group::Shift);
        let named = said.axes.map(|axis| axis.is_some());
        // Angles are counted from how the tool is turned here.
        let turned = super::named_axes(said) & super::ORIENTATION;
        if turned != 0 {
            self.held_here(turned);
        }
        if self.skipping {
            self.held_here(super::named_axes(said));
            self.events.push(Event::MaybePlaced(named));
        } else {
            self.events.push(Event::Shift { stated, named });
        }
        self.rotary(said, |axis, value| value.is_ok() && abc[axis] == value);
    }

    /// The shift of these axes is said whole.
    fn placed(&mut self, axes: [bool; 3]) {
        self.events.push(if self.skipping { Event::MaybePlaced(axes) } else { Event::Placed(axes) });
    }

    /// A motion to where the text does not tell.
    fn gone(&mut self, said: &Said<'_>, code: u32, reason: Reason) {
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
