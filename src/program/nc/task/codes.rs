//! What a block sets: named commands, G words that hold on, G words of one block.

use super::super::arc::Plane;
use super::super::dialect::Dialect;
use super::super::machine::{Group, Mode, Turn, transforms};
use super::super::syntax::Belongs;
use super::super::token::Token;
use super::names::{HARMLESS, KEYWORDS, is_cycle};
use super::{Event, Lister, Said};
use crate::program::motion::Reason;

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
                b"TRAORI" => self.tip(true, false),
                b"TRAFOOF" => {
                    self.tip(false, false);
                    self.state.transform &= !transforms::KINEMATIC;
                }
                b"TRANSMIT" | b"TRACYL" | b"TRAANG" => self.transform(transforms::KINEMATIC, true),
                b"ORIMKS" => {
                    self.state.transform |= transforms::MACHINE_TURN;
                    self.set(Group::Transform);
                }
                b"ORIWKS" => self.state.transform &= !transforms::MACHINE_TURN,
                b"DIAMON" | b"DIAM90" | b"DIAMOF" => {
                    self.transform(transforms::DIAMETER, &*name != b"DIAMOF");
                }
                b"TOFRAME" | b"TOFRAMEX" | b"TOFRAMEY" | b"TOFRAMEZ" | b"TOROT" | b"TOROTX" | b"TOROTY"
                | b"TOROTZ" | b"PAROT" => self.transform(transforms::TOOL_FRAME, true),
                b"TOROTOF" | b"PAROTOF" => self.transform(transforms::TOOL_FRAME, false),
                b"ORIRPY" => self.state.rpy_stated = true,
                b"ORIEULER" | b"ORIVIRT1" | b"ORIVIRT2" | b"ORIRPY2" => self.state.rpy_stated = false,
                b"CIP" | b"CT" | b"BSPLINE" | b"ASPLINE" | b"CSPLINE" | b"POLY" | b"INVCW" | b"INVCCW" => {
                    self.state.mode = Mode::Other(Reason::NotFollowed);
                }
                b"CYCLE800" => {
                    let empty = matches!(word.belongs, Belongs::Arguments { first, end } if end == first + 2);
                    self.transform(transforms::SWIVEL, !empty);
                    self.state.turn = Turn::Unknown(Reason::OrientationUnknown);
                    self.events.push(Event::Unknown);
                    done = true;
                }
                _ => match word.belongs {
                    Belongs::Arguments { .. } if HARMLESS.iter().any(|known| word.is(known)) => {}
                    Belongs::Arguments { .. } if is_cycle(&name) => {
                        let text = String::from_utf8_lossy(&name).into_owned();
                        self.left(said, &text, Reason::Cycle);
                        self.state.lose_position();
                        self.events.push(Event::Lost(super::POSITION));
                        done = true;
                    }
                    Belongs::Arguments { .. } => {
                        let text = String::from_utf8_lossy(word.name).into_owned();
                        self.subprogram(said, &text);
                        done = true;
                    }
                    Belongs::Nothing
                        if self.is_alone(said) && !KEYWORDS.iter().any(|known| word.is(known)) =>
                    {
                        let text = String::from_utf8_lossy(word.name).into_owned();
                        self.subprogram(said, &text);
                        done = true;
                    }
                    _ => {}
                },
            }
        }
        done
    }

    /// Whether a block has but one word beside its number, and how often it is done (P3).
    fn is_alone(&self, said: &Said<'_>) -> bool {
        let aside = |address: Option<u8>| matches!(address, Some(b'N' | b'P'));
        said.words.iter().filter(|word| !aside(word.address())).count() == 1 && !said.opaque
    }

    /// G words that hold on. True where the block's axis words are no motion.
    pub(super) fn modal_codes(&mut self, said: &Said<'_>) -> bool {
        let siemens = self.dialect == Dialect::Siemens;
        let linux = self.dialect == Dialect::LinuxCnc;
        self.state.exact_stop &= self.state.exact_stop_holds;
        for &code in &said.g {
            match code {
                0 => self.state.mode = Mode::Rapid,
                10 => self.state.mode = Mode::Linear,
                20 => self.state.mode = Mode::Circular(false),
                30 => self.state.mode = Mode::Circular(true),
                50 | 51 if linux => self.state.mode = Mode::Other(Reason::NotFollowed),
                22 | 23 | 24 | 32 | 33 | 34 | 52 | 53 | 62 | 320 | 330 | 340 | 3310 | 3320 => {
                    self.state.mode = Mode::Other(Reason::NotFollowed);
                }
                70 if linux => self.transform(transforms::DIAMETER, true),
                80 if linux => self.transform(transforms::DIAMETER, false),
                // The radius of the cylinder stands as C.
                71 | 1070 if !siemens => {
                    let c = said.abc[2].and_then(|index| self.literal(&said.words[index]));
                    self.transform(transforms::KINEMATIC, c != Some(0.0));
                    return true;
                }
                121 | 1120 if !siemens => self.transform(transforms::KINEMATIC, true),
                131 | 1130 if !siemens => self.transform(transforms::KINEMATIC, false),
                1100..=1120 if siemens => {
                    self.transform(transforms::POLAR, false);
                    return true;
                }
                90 => self.state.exact_stop = true,
                150 | 160 if !siemens => self.transform(transforms::POLAR, code == 160),
                500 | 510 if !siemens => {
                    self.transform(transforms::SCALE, code == 510);
                    return true;
                }
                // G100 and G101 are Haas's; elsewhere macros have such numbers, and arguments.
                501 | 511 if !siemens => {
                    self.transform(transforms::MIRROR, code == 511);
                    return true;
                }
                1000 | 1010 if !siemens && !linux && said.axes.iter().any(Option::is_some) => {
                    self.transform(transforms::MIRROR, code == 1010);
                    return true;
                }
                680 if !siemens => {
                    self.transform(transforms::TURN, true);
                    return true;
                }
                682..=684 if !siemens => {
                    self.transform(transforms::TILT, true);
                    return true;
                }
                690 if !siemens => self.transform(transforms::TURN | transforms::TILT, false),
                // Dynamic work offsets of Haas.
                2540 | 2550 if !siemens => self.transform(transforms::KINEMATIC, code == 2540),
                170 | 180 | 190 => {
                    self.state.plane = match code {
                        170 => Plane::XY,
                        180 => Plane::ZX,
                        _ => Plane::YZ,
                    };
                    self.set(Group::Plane);
                }
                200 => self.unit(25.4),
                210 => self.unit(1.0),
                // Lathe cycles of Fanuc have the same numbers, and a P.
                700 | 710 | 720 if linux || self.dialect == Dialect::Fanuc => {
                    self.cycle(said, code);
                    return true;
                }
                700 | 710 if said.p.is_none() => self.unit(if code == 700 { 25.4 } else { 1.0 }),
                7000 if siemens => self.unit(25.4),
                7100 if siemens => self.unit(1.0),
                400 => {
                    self.state.radius = false;
                    self.set(Group::Radius);
                }
                // G41.1, G41.2, …: about the tool, in space.
                410..=429 => {
                    self.state.radius = true;
                    self.set(Group::Radius);
                }
                // G234 is Haas's.
                434 | 435 | 2340 => self.tip(true, code == 435),
                490 => self.tip(false, false),
                // Of the same group.
                430 | 440 | 431 if !linux && !siemens => self.tip(false, false),
                431 | 432 if linux => {
                    // No motion: words of axes are the tool's length.
                    self.state.tool = format!("{} +{}", base(&self.state.tool), code_name(code));
                    self.set(Group::Tool);
                    self.state.lose_position();
                    self.events.push(Event::Lost(super::POSITION));
                    return true;
                }
                580 | 590 if siemens => {
                    // Shifts of single axes within the work frame.
                    self.transform(transforms::PROGRAMMABLE, true);
                    return true;
                }
                1100..=1290 | 1540 if !siemens && !linux => self.work_offset(code, said),
                540..=599 | 5000..=5999 => self.work_offset(code, said),
                600 | 610 => (self.state.exact_stop, self.state.exact_stop_holds) = (true, true),
                640 | 6410..=6450 => (self.state.exact_stop, self.state.exact_stop_holds) = (false, false),
                730 | 740 | 760 | 810..=890 if !siemens => self.state.mode = Mode::Other(Reason::Cycle),
                800 => self.state.mode = Mode::Unset,
                900 | 910 => {
                    self.state.absolute = code == 900;
                    self.set(Group::Distance);
                }
                901 => self.state.centre_absolute = true,
                911 => self.state.centre_absolute = false,
                930 | 950 => self.state.feed_per_minute = false,
                940 => self.state.feed_per_minute = true,
                _ => {}
            }
        }
        false
    }

    fn unit(&mut self, mm: f64) {
        self.state.unit_mm = mm;
        self.set(Group::Unit);
    }

    /// Tool centre point control goes on or off. Where the tool stands has other coordinates then.
    pub(super) fn tip(&mut self, on: bool, vector_words: bool) {
        if self.state.tip != on && self.dialect.needs_tip() {
            self.state.position = [Err(Reason::PositionUnknown); 3];
            self.events.push(Event::Lost(super::POSITION));
        }
        (self.state.tip, self.state.vector_words) = (on, vector_words);
        self.set(Group::Tip);
    }

    /// A cycle of the control.
    fn cycle(&mut self, said: &Said<'_>, code: u32) {
        self.left(said, &code_name(code), Reason::Cycle);
        self.state.lose_position();
        self.events.push(Event::Lost(super::POSITION));
    }

    /// A G word that is not known, in a block with axis words. It may do anything.
    pub(super) fn unknown_code(&mut self, said: &Said<'_>) -> bool {
        let words = said.moves() || said.centre.iter().any(Option::is_some);
        let dialect = self.dialect;
        let unknown = |code: &&u32| dialect != Dialect::Heidenhain && !is_known(**code, dialect);
        let Some(&code) = said.g.iter().find(unknown).filter(|_| words) else { return false };
        self.left(said, &code_name(code), Reason::UnknownInstruction);
        self.forget();
        true
    }

    pub(super) fn transform(&mut self, which: u16, on: bool) {
        self.state.transform = self.state.transform & !which | if on { which } else { 0 };
        self.set(Group::Transform);
        self.state.lose_position();
        self.events.push(Event::Lost(super::POSITION));
    }

    fn work_offset(&mut self, code: u32, said: &Said<'_>) {
        let mut name = code_name(code);
        if (code == 541 || code == 1540)
            && let Some(number) = said.p.and_then(|index| self.literal(&said.words[index]))
        {
            name = format!("{name} P{}", number.round());
        }
        if name != self.state.frame {
            // Where the tool stands has other coordinates now.
            self.state.lose_position();
            self.events.push(Event::Lost(super::POSITION));
        }
        self.state.frame = name;
        self.set(Group::Frame);
    }

    /// G words of one block. True where the block's axis words are no motion that is followed.
    pub(super) fn unmodal_codes(&mut self, said: &Said<'_>) -> bool {
        let siemens = self.dialect == Dialect::Siemens;
        for &code in &said.g {
            match code {
                40 | 110 | 220 | 230 | 250 | 260 => return true,
                100 if !siemens => {
                    self.set_offset(said);
                    return true;
                }
                120 | 130 => {
                    self.left(said, "G12", Reason::Cycle);
                    return true;
                }
                // Stores where the tool stands.
                281 | 301 if self.dialect == Dialect::LinuxCnc => return true,
                270 if !siemens => {
                    self.gone(said, code, Reason::ReferenceReturn);
                    return true;
                }
                350 | 360 | 370 | 1360 if matches!(self.dialect, Dialect::Fanuc | Dialect::Iso) => {
                    // What it finds becomes an offset of the tool or of the work.
                    self.gone(said, code, Reason::Probe);
                    self.some_tools_set();
                    self.some_frames_set();
                    return true;
                }
                470 | 770..=790 | 1500 | 1610..=1690 | 1740 | 1840
                    if matches!(self.dialect, Dialect::Fanuc | Dialect::Iso) && said.moves() =>
                {
                    self.cycle(said, code);
                    return true;
                }
                // High speed machining, splines.
                50 | 51 if matches!(self.dialect, Dialect::Fanuc | Dialect::Iso) && said.moves() => {
                    self.gone(said, code, Reason::NotFollowed);
                    return true;
                }
                331 if !siemens => {
                    self.gone(said, code, Reason::NotFollowed);
                    self.state.lose_position();
                    self.events.push(Event::Lost(super::POSITION));
                    return true;
                }
                280 | 281 | 290 | 300 | 301 => {
                    self.gone(said, code, Reason::ReferenceReturn);
                    return true;
                }
                740 | 750 if siemens => {
                    self.gone(said, code, Reason::ReferenceReturn);
                    return true;
                }
                310 | 382..=385 => {
                    self.gone(said, code, Reason::Probe);
                    return true;
                }
                1470 | 1480 | 2470 | 2480 | 3470 | 3480 if siemens => {
                    self.gone(said, code, Reason::NotFollowed);
                    return true;
                }
                531 => {
                    self.state.lose_position();
                    self.state.turn = Turn::Unknown(Reason::OrientationUnknown);
                    self.events.push(Event::Unknown);
                    return true;
                }
                520 if !siemens => {
                    // A shift of the work frame itself: the tool stands elsewhere in it.
                    for axis in 0..3 {
                        if let Some(index) = said.axes[axis] {
                            let value = self.worth(&said.words[index]).0;
                            self.state.shift[axis] = value.map(|value| value * self.state.unit_mm);
                        }
                    }
                    self.set(Group::Shift);
                    self.turns_rotary(said);
                    return true;
                }
                650 | 660 | 661 => {
                    self.subprogram(said, if code == 650 { "G65" } else { "G66" });
                    if code != 650 {
                        self.state.calls = Some(Reason::Subprogram);
                    }
                    return true;
                }
                670 => self.state.calls = None,
                920 => {
                    self.set_shift(said);
                    return true;
                }
                921 | 922 => {
                    self.state.shift = [Ok(0.0); 3];
                    self.state.transform &= !transforms::ROTARY;
                    self.events.push(Event::NoShift);
                    self.set(Group::Shift);
                    return true;
                }
                923 => {
                    self.state.shift = [Err(Reason::Variable); 3];
                    return true;
                }
                _ => {}
            }
        }
        if self.dialect == Dialect::Heidenhain && said.m.contains(&140) {
            // Back along the tool to the end of the range.
            self.left(said, "M140", Reason::ReferenceReturn);
            self.state.lose_position();
            self.events.push(Event::Lost(super::POSITION));
            return true;
        }
        if matches!(self.dialect, Dialect::Fanuc | Dialect::Iso | Dialect::LinuxCnc)
            && said.m.iter().any(|m| matches!(m, 97 | 98 | 198))
        {
            self.subprogram(said, "M98");
            return true;
        }
        false
    }

    /// G92: the place where the tool stands is called this from here on.
    fn set_shift(&mut self, said: &Said<'_>) {
        let mut stated = [None; 3];
        for (axis, stated) in stated.iter_mut().enumerate() {
            let Some(index) = said.axes[axis] else { continue };
            let value = self.worth(&said.words[index]).0.map(|value| value * self.state.unit_mm);
            self.state.shift[axis] = match (self.state.position[axis], value) {
                (Ok(at), Ok(value)) => {
                    *stated = Some(value);
                    Ok(at - value)
                }
                (Err(reason), _) | (_, Err(reason)) => Err(reason),
            };
        }
        self.set(Group::Shift);
        self.events.push(Event::Shift(stated));
        self.turns_rotary(said);
    }

    /// A shift of rotary axes: what A, B and C say from here on is counted from elsewhere.
    fn turns_rotary(&mut self, said: &Said<'_>) {
        if said.abc.iter().any(Option::is_some) {
            self.state.transform |= transforms::ROTARY;
            self.set(Group::Transform);
        }
    }

    /// A motion to where the text does not tell.
    fn gone(&mut self, said: &Said<'_>, code: u32, reason: Reason) {
        let name = code_name(code);
        self.left(said, &name, reason);
        let none = said.axes.iter().chain(&said.abc).all(Option::is_none);
        let mut lost = 0;
        for axis in 0..3 {
            if none || said.axes[axis].is_some() {
                self.state.position[axis] = Err(Reason::PositionUnknown);
                lost |= 1 << axis;
            }
            if none || said.abc[axis].is_some() {
                self.state.abc[axis] = Err(Reason::OrientationUnknown);
                lost |= 8 << axis;
            }
        }
        self.state.previous = None;
        self.events.push(Event::Lost(lost));
    }
}

/// The number of a tool without what has become of its length.
pub(super) fn base(tool: &str) -> &str {
    tool.split(" +").next().unwrap_or(tool)
}

/// Whether it is known what a G word does with the axis words of its block; by tenths.
fn is_known(code: u32, dialect: Dialect) -> bool {
    const COMMON: &[u32] = &[
        0, 10, 20, 30, 40, 50, 51, 52, 53, 62, 63, 70, 80, 90, 100, 110, 120, 130, 170, 180, 190, 200, 210,
        220, 230, 250, 260, 270, 280, 281, 290, 300, 301, 310, 320, 330, 331, 340, 350, 360, 370, 400, 401,
        430, 431, 432, 434, 435, 440, 490, 520, 530, 531, 600, 610, 611, 620, 630, 640, 650, 660, 661, 670,
        700, 710, 720, 730, 740, 750, 760, 800, 900, 901, 910, 911, 920, 921, 922, 923, 930, 940, 950, 960,
        970, 980, 990,
    ];
    let common = COMMON.binary_search(&code).is_ok()
        || matches!(code, 382..=385 | 410..=429 | 540..=599)
        || matches!(code, 810 | 820 | 830 | 840 | 850 | 860 | 870 | 880 | 890);
    common
        || match dialect {
            Dialect::Siemens => {
                matches!(code, 601 | 602 | 1100..=1120 | 1400..=1430 | 1470 | 1480 | 1530 | 2470 | 2480)
                    || matches!(code, 2900 | 2910 | 3310 | 3320 | 3350 | 3360 | 3470 | 3480 | 3400 | 3410)
                    || matches!(code, 4500 | 4510 | 4600..=4620 | 5000..=5999 | 6010..=6030 | 6200 | 6210)
                    || matches!(code, 6410..=6450 | 7000 | 7100 | 9310 | 9420 | 9520 | 9610..=9730)
            }
            Dialect::LinuxCnc => matches!(code, 22 | 32),
            _ => {
                matches!(code, 22..=24 | 32..=34 | 71 | 121 | 131 | 150 | 160 | 470 | 500 | 501 | 510 | 511)
                    || matches!(code, 680 | 682..=684 | 690 | 770..=790 | 1000 | 1010 | 1030 | 1070)
                    || matches!(code, 1100..=1290 | 1360 | 1430 | 1500 | 1540 | 1610..=1690 | 1740 | 1840)
                    || matches!(code, 1870 | 2340 | 2540 | 2550)
            }
        }
}

/// A code as a program writes it: G54, G43.4.
fn code_name(code: u32) -> String {
    match (code / 10, code % 10) {
        (whole, 0) => format!("G{whole}"),
        (whole, tenth) => format!("G{whole}.{tenth}"),
    }
}
