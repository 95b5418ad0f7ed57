//! What a block sets: named commands, G words that hold on, G words of one block.

use super::super::arc::Plane;
use super::super::dialect::Dialect;
use super::super::machine::{Group, Mode, Turn};
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
                b"TRAORI" => {
                    self.state.tip = true;
                    self.set(Group::Tip);
                }
                b"TRAFOOF" => {
                    self.state.tip = false;
                    self.set(Group::Tip);
                    if self.state.transform == Some(Reason::Transformed) {
                        self.state.transform = None;
                    }
                }
                b"TRANSMIT" | b"TRACYL" | b"TRAANG" | b"ORIMKS" => {
                    self.state.transform = Some(Reason::Transformed);
                    self.set(Group::Transform);
                }
                b"ORIWKS" => self.state.transform = None,
                b"ORIRPY" => self.state.rpy_stated = true,
                b"ORIEULER" | b"ORIVIRT1" | b"ORIVIRT2" | b"ORIRPY2" => self.state.rpy_stated = false,
                b"CIP" | b"CT" | b"BSPLINE" | b"ASPLINE" | b"CSPLINE" | b"POLY" | b"INVCW" | b"INVCCW" => {
                    self.state.mode = Mode::Other(Reason::NotFollowed);
                }
                b"CYCLE800" => {
                    let empty = matches!(word.belongs, Belongs::Arguments { first, end } if end == first + 2);
                    self.state.transform = (!empty).then_some(Reason::Transformed);
                    self.set(Group::Transform);
                    self.state.lose_position();
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

    /// Whether a block has but one word beside its number.
    fn is_alone(&self, said: &Said<'_>) -> bool {
        said.words.iter().filter(|word| word.address() != Some(b'N')).count() == 1 && !said.opaque
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
                52 | 53 | 62 | 320 | 330 | 340 | 3310 | 3320 => {
                    self.state.mode = Mode::Other(Reason::NotFollowed);
                }
                70 if linux => self.transform(Some(Reason::Transformed)),
                80 if linux => self.transform(None),
                90 => self.state.exact_stop = true,
                160 | 510 | 511 if !siemens => self.transform(Some(Reason::Transformed)),
                680 | 682 | 683 | 684 => {
                    self.transform(Some(Reason::Transformed));
                    self.state.lose_position();
                    self.events.push(Event::Lost(super::POSITION));
                    return true;
                }
                150 | 500 | 501 | 690 if !siemens => self.transform(None),
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
                700 | 710 if said.p.is_none() => self.unit(if code == 700 { 25.4 } else { 1.0 }),
                7000 if siemens => self.unit(25.4),
                7100 if siemens => self.unit(1.0),
                400 => {
                    self.state.radius = false;
                    self.set(Group::Radius);
                }
                410 | 420 => {
                    self.state.radius = true;
                    self.set(Group::Radius);
                }
                // G234 is Haas's.
                434 | 435 | 2340 => {
                    (self.state.tip, self.state.vector_words) = (true, code == 435);
                    self.set(Group::Tip);
                }
                490 => {
                    (self.state.tip, self.state.vector_words) = (false, false);
                    self.set(Group::Tip);
                }
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

    fn transform(&mut self, reason: Option<Reason>) {
        self.state.transform = reason;
        self.set(Group::Transform);
        self.state.lose_position();
        self.events.push(Event::Lost(super::POSITION));
    }

    fn work_offset(&mut self, code: u32, said: &Said<'_>) {
        let mut name = code_name(code);
        if code == 541
            && let Some(number) = said.p.and_then(|index| self.literal(&said.words[index]))
        {
            name = format!("G54.1 P{}", number.round());
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
                    return true;
                }
                650 | 660 => {
                    self.subprogram(said, if code == 650 { "G65" } else { "G66" });
                    return true;
                }
                920 => {
                    self.set_shift(said);
                    return true;
                }
                921 | 922 => {
                    self.state.shift = [Ok(0.0); 3];
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

/// A code as a program writes it: G54, G43.4.
fn code_name(code: u32) -> String {
    match (code / 10, code % 10) {
        (whole, 0) => format!("G{whole}"),
        (whole, tenth) => format!("G{whole}.{tenth}"),
    }
}
