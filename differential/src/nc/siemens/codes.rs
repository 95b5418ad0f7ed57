//! What the words of a Siemens block do.

use super::super::arc::Circle;
use super::super::machine::{Mode, Say, Words};
use super::super::setting::{Pose, plain};
use super::{Siemens, Word};

const AXES: [&str; 3] = ["X", "Y", "Z"];

/// How a word counts: `X=AC(5)`, `X=IC(5)`, or as the mode says.
fn counted(text: &str) -> (Option<bool>, &str) {
    for (name, absolute) in [("AC(", true), ("IC(", false)] {
        if let Some(inner) = text.strip_prefix(name).and_then(|rest| rest.strip_suffix(')')) {
            return (Some(absolute), inner);
        }
    }
    (None, text)
}

impl Siemens<'_> {
    pub fn recount(&mut self) {
        let frame = self.frames.get(&self.frame).copied();
        let chain = frame.zip(self.programmed).map(|(frame, programmed)| frame * programmed);
        self.machine.recount(chain);
    }

    /// One block.
    pub(super) fn act(&mut self, words: &[Word], text: &str) -> Result<(), String> {
        if self.frame_word(words)? || self.command(words, text)? {
            return Ok(());
        }
        self.modes(words)?;
        for word in words {
            if let Word::Sets(name, value) = word {
                self.set(name, value)?;
            }
        }
        let code = |wanted: f64| words.contains(&Word::Letter('G', wanted));
        if code(4.0) {
            self.machine.note(format!("wait {text}"));
            return Ok(());
        }
        let path = words
            .iter()
            .any(|word| matches!(word, Word::Name(n) if matches!(n.as_str(), "CIP" | "CT" | "POLY")));
        if path {
            self.machine.mode = Mode::Other(1);
        }
        // A thread: a line to the place that its words name, at a pace of its own, and it holds on.
        if code(33.0) {
            self.machine.mode = Mode::Other(33);
        }
        let begins = [74.0, 75.0].iter().any(|g| code(*g));
        let machine = code(53.0) || words.contains(&Word::Name("SUPA".into()));
        if begins || machine {
            let mut named = [false; 3];
            for (axis, letter) in AXES.iter().enumerate() {
                named[axis] |= self.say(words, letter, 1.0)?.is_some();
            }
            self.machine.some_elsewhere(text, !machine, named);
            return Ok(());
        }
        self.motion(words, text)
    }

    /// TRANS, ROT, MIRROR, SCALE and those that add; G58. True where the block is one.
    fn frame_word(&mut self, words: &[Word]) -> Result<bool, String> {
        let Some(first) = words.first() else { return Ok(true) };
        let name = match first {
            Word::Name(name) => name.as_str(),
            Word::Letter('G', 58.0) => "G58",
            _ => return Ok(false),
        };
        let mut values = [None; 3];
        for (axis, letter) in AXES.iter().enumerate() {
            values[axis] = self.number(words, letter)?;
        }
        let lengths = values.map(|value| value.unwrap_or(0.0) * self.machine.unit);
        let angles = values.map(|value| value.unwrap_or(0.0));
        let shift = Pose::translation(lengths[0], lengths[1], lengths[2]);
        let turn = plain([0.0; 3], angles);
        let old = self.programmed;
        let substitutes = matches!(name, "TRANS" | "ROT" | "MIRROR" | "SCALE");
        let new = match name {
            "TRANS" => Some(shift),
            "ATRANS" => old.map(|old| old * shift),
            "ROT" => Some(turn),
            "AROT" => old.map(|old| old * turn),
            "MIRROR" | "SCALE" | "AMIRROR" | "ASCALE" => {
                old.filter(|_| !substitutes).or(Some(Pose::identity()))
            }
            "G58" => old.map(|mut old| {
                for (axis, value) in values.iter().enumerate() {
                    if let Some(value) = value {
                        old.translation.vector[axis] = value * self.machine.unit;
                    }
                }
                old
            }),
            _ => return Ok(false),
        };
        if substitutes {
            self.machine.bend("mirrored", false);
            self.machine.bend("scaled", false);
        }
        if values.iter().any(Option::is_some) {
            match name {
                "MIRROR" | "AMIRROR" => self.machine.bend("mirrored", true),
                "SCALE" | "ASCALE" => self.machine.bend("scaled", true),
                _ => {}
            }
        }
        self.programmed = new;
        self.recount();
        Ok(true)
    }

    /// Names that stand alone. True where the block does nothing else.
    fn command(&mut self, words: &[Word], text: &str) -> Result<bool, String> {
        for word in words {
            let Word::Name(name) = word else { continue };
            match name.as_str() {
                "TRAORI" | "TRAFOOF" => {
                    self.machine.follow_tip(name == "TRAORI");
                }
                name if name.starts_with("CYCLE832") || name.starts_with("MSG") => self.machine.note(name),
                "STOPRE" | "SOFT" | "BRISK" | "COMPCAD" | "COMPOF" | "FFWON" | "FFWOF" => {
                    self.machine.note(name.as_str())
                }
                "ORIWKS" | "ORIROTA" | "ORIVECT" | "ORIAXES" => self.machine.note(name.as_str()),
                "CIP" | "CT" | "POLY" | "SUPA" => {}
                name if name.starts_with("CYCLE") => {
                    self.machine.elsewhere(text, true);
                    return Ok(true);
                }
                other => return Err(format!("{other} is not known")),
            }
        }
        if let Some(Word::Letter('L', number)) = words.first() {
            self.machine.elsewhere(format!("call L{number}"), true);
            self.machine.lost();
            return Ok(true);
        }
        Ok(false)
    }

    fn modes(&mut self, words: &[Word]) -> Result<(), String> {
        for word in words {
            let Word::Letter(letter, value) = word else { continue };
            match (letter, *value) {
                ('F', feed) => self.machine.feed = format!("{feed}"),
                ('S', speed) => self.machine.note(format!("S{speed}")),
                ('T', tool) => self.waiting = Some(tool as i32),
                ('G', code) => self.code(code),
                _ => {}
            }
        }
        for word in words {
            match word {
                Word::Letter('M', code) => {
                    self.machine.note(format!("M{code}"));
                    if let (6.0, Some(tool)) = (*code, self.waiting) {
                        self.machine.tool = Some(format!("T{tool}"));
                        self.machine.note(format!("T{tool}"));
                        self.machine.lost();
                    }
                }
                Word::Letter('D', edge) => {
                    let first = self.waiting.filter(|_| *edge == 1.0).map(|tool| format!("T{tool}"));
                    if self.machine.tool != first {
                        self.machine.tool = first;
                        self.machine.lost();
                    }
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn code(&mut self, code: f64) {
        let machine = &mut self.machine;
        match code as i32 {
            0 => machine.mode = Mode::Rapid,
            1 => machine.mode = Mode::Line,
            2 => machine.mode = Mode::Clockwise,
            3 => machine.mode = Mode::Anticlockwise,
            17..=19 => machine.plane = code as u8,
            40..=42 => machine.side = code as u8,
            70 | 700 => machine.unit = 25.4,
            71 | 710 => machine.unit = 1.0,
            90 => machine.absolute = true,
            91 => machine.absolute = false,
            54..=57 | 500 | 505..=599 => {
                self.frame = format!("G{}", code as i32);
                self.recount();
            }
            60 | 64 | 641 | 642 | 9 => machine.note(format!("G{code}")),
            _ => {}
        }
    }

    /// A variable, a work offset or a setting.
    fn set(&mut self, name: &str, text: &str) -> Result<(), String> {
        if let Some(number) = name.strip_prefix("$P_UIFR[").and_then(|rest| rest.strip_suffix(']')) {
            let number: i32 = number.parse().map_err(|_| name.to_owned())?;
            self.frames.insert(format!("G{}", 53 + number), self.ctrans(text)?);
            return Ok(());
        }
        if name == "$P_PFRAME" {
            self.programmed = Some(self.ctrans(text)?);
            self.recount();
            return Ok(());
        }
        let parameter =
            name.strip_prefix('R').is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()));
        if parameter || self.variables.contains_key(name) {
            let value = self.value(text)?;
            self.variables.insert(name.to_owned(), value);
        } else if matches!(name, "RND" | "CHF" | "CHR" | "RNDM" | "FRC" | "TURN") {
            self.machine.note(format!("{name}={text}"));
        } else if name.len() > 1 && !is_word(name) {
            return Err(format!("{name} is not known"));
        }
        Ok(())
    }

    /// `CTRANS(X,5,Y,2):CROT(Z,90)`
    fn ctrans(&self, text: &str) -> Result<Pose, String> {
        let mut pose = Pose::identity();
        for part in text.split(':') {
            let (name, inner) = part.trim_end_matches(')').split_once('(').ok_or(part)?;
            let list: Vec<&str> = inner.split(',').collect();
            let mut values = [0.0; 3];
            for pair in list.chunks(2) {
                let axis = AXES.iter().position(|axis| *axis == pair[0].trim()).ok_or(part)?;
                values[axis] = self.value(pair.get(1).ok_or(part)?)?;
            }
            pose *= match name {
                "CTRANS" => Pose::translation(values[0], values[1], values[2]),
                "CROT" => plain([0.0; 3], values),
                _ => return Err(part.to_owned()),
            };
        }
        Ok(pose)
    }

    /// What a block says of a letter, as it counts.
    fn say(&self, words: &[Word], name: &str, unit: f64) -> Result<Option<Say>, String> {
        for word in words {
            let (own, value) = match word {
                Word::Letter(letter, value) if name.len() == 1 && name.starts_with(*letter) => (None, *value),
                Word::Sets(other, text) if other == name => {
                    let (own, inner) = counted(text);
                    (own, self.value(inner)?)
                }
                _ => continue,
            };
            let absolute = own.unwrap_or(self.machine.absolute);
            return Ok(Some(if absolute { Say::To(value * unit) } else { Say::By(value * unit) }));
        }
        Ok(None)
    }

    fn number(&self, words: &[Word], name: &str) -> Result<Option<f64>, String> {
        Ok(self.say(words, name, 1.0)?.map(|say| match say {
            Say::To(value) | Say::By(value) => value,
        }))
    }

    fn motion(&mut self, list: &[Word], text: &str) -> Result<(), String> {
        let unit = self.machine.unit;
        let mut words = Words::default();
        for axis in 0..3 {
            words.place[axis] = self.say(list, AXES[axis], unit)?;
            words.turn[axis] = self.say(list, ["A", "B", "C"][axis], 1.0)?;
            words.vector[axis] = self.number(list, ["A3", "B3", "C3"][axis])?;
        }
        words.spin = self.number(list, "THETA")?;
        let mut centre = [None; 3];
        let mut any = false;
        for (axis, letter) in ["I", "J", "K"].iter().enumerate() {
            // I, J and K count from the start, but for I=AC().
            let own =
                list.iter().any(|w| matches!(w, Word::Sets(n, t) if n == letter && t.starts_with("AC(")));
            if let Some(value) = self.number(list, letter)? {
                any = true;
                let start = if own { Some(0.0) } else { self.machine.at[axis] };
                centre[axis] = start.map(|start| start + value * unit);
            }
        }
        if !words.moves() && !any {
            return Ok(());
        }
        if let Mode::Other(_) = self.machine.mode {
            let (at, turn) = (self.machine.at, self.machine.turn);
            self.machine.elsewhere(text, true);
            (self.machine.at, self.machine.turn) = (at, turn);
            self.machine.turn_to(&words);
            for axis in 0..3 {
                if let Some(say) = words.place[axis] {
                    self.machine.at[axis] = match say {
                        Say::To(value) => Some(value),
                        Say::By(value) => self.machine.at[axis].map(|at| at + value),
                    };
                }
            }
            return Ok(());
        }
        if matches!(self.machine.mode, Mode::Clockwise | Mode::Anticlockwise) {
            words.circle = Some(if let Some(radius) = self.number(list, "CR")? {
                Circle::Radius(radius * unit)
            } else if let Some(angle) = self.number(list, "AR")? {
                Circle::Opening(angle)
            } else {
                Circle::Centre(centre)
            });
        }
        if words.moves() {
            self.machine.go(words);
        }
        Ok(())
    }
}

/// Names of words that move or say how.
fn is_word(name: &str) -> bool {
    matches!(name, "A3" | "B3" | "C3" | "CR" | "AR" | "THETA" | "I1" | "J1" | "K1")
}
