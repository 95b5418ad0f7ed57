//! Heidenhain conversational: blocks that are no words of an address each.

use super::super::dialect::Dialect;
use super::super::expression::{Worth, literal};
use super::super::machine::{Group, Mode, Turn, transforms};
use super::super::syntax::Word;
use super::super::token::Token;
use super::{Event, Lister, Said};
use crate::math::se3::Pose;
use crate::program::motion::Reason;

impl Lister<'_, '_> {
    /// What the first word of a block says. True where the block does nothing else.
    pub(super) fn heidenhain(&mut self, said: &Said<'_>) -> bool {
        debug_assert_eq!(self.dialect, Dialect::Heidenhain);
        let Some(first) = said.words.first() else { return false };
        let name = first.name.to_ascii_uppercase();
        match &*name {
            b"L" | b"LN" => {
                self.state.mode = Mode::Linear;
                false
            }
            b"C" | b"CR" => {
                let direction = said.words.iter().find(|word| word.is("DR"));
                let negative = direction.is_some_and(|word| {
                    (word.first..word.end).any(|token| self.tree.kind(token) == Some(Token::Minus))
                });
                self.state.mode = match direction {
                    Some(_) => Mode::Circular(!negative),
                    None => Mode::Other(Reason::NotFollowed),
                };
                false
            }
            b"CT" => {
                self.state.mode = Mode::Other(Reason::NotFollowed);
                false
            }
            b"CC" => {
                for axis in 0..2 {
                    self.state.pole[axis] = match said.axes[axis] {
                        None => self.state.position[axis],
                        Some(index) => {
                            let (value, increment) = self.worth(&said.words[index]);
                            if increment == Some(true) {
                                self.state.position[axis].and_then(|at| value.map(|value| at + value))
                            } else {
                                value
                            }
                        }
                    };
                }
                true
            }
            b"M" => false,
            _ => {
                self.other_block(said, first, &name);
                true
            }
        }
    }

    /// Blocks that are not looked into word by word.
    fn other_block(&mut self, said: &Said<'_>, first: &Word<'_>, name: &[u8]) {
        let text = self.tree.source()[self.tree.range(first.first, first.end)].to_ascii_uppercase();
        let words: Vec<&[u8]> =
            text.split(|byte| byte.is_ascii_whitespace()).filter(|part| !part.is_empty()).collect();
        let second = words.get(1).copied().unwrap_or_default();
        match name {
            b"TOOL" if second == b"CALL" => {
                self.tool_call(first, &words);
                self.state.lose_position();
                self.events.push(Event::Lost(super::POSITION));
            }
            b"CYCL" if second == b"CALL" => {
                self.left(said, "CYCL CALL", Reason::Cycle);
                self.state.lose_position();
                self.events.push(Event::Lost(super::POSITION));
            }
            b"CYCL" => {
                let number: Vec<u8> = words
                    .get(2)
                    .map(|word| word.iter().copied().take_while(u8::is_ascii_digit).collect())
                    .unwrap_or_default();
                let ends = self.ends_cycle(&words);
                let sets = matches!(&*number, b"7" | b"8" | b"10" | b"11" | b"19" | b"26" | b"247");
                match &*number {
                    b"7" => self.datum_shift(&words[3..]),
                    b"247" => {
                        self.state.frame = self.preset(first);
                        self.set(Group::Frame);
                    }
                    b"8" => self.transform(transforms::MIRROR, !ends),
                    b"10" => self.transform(transforms::TURN, !ends),
                    b"11" | b"26" => self.transform(transforms::SCALE, !ends),
                    b"19" => self.transform(transforms::TILT, !ends),
                    _ => {}
                }
                if sets {
                    self.state.lose_position();
                    self.events.push(Event::Lost(super::POSITION));
                }
            }
            b"PLANE" => {
                self.transform(transforms::TILT, second != b"RESET");
                self.state.turn = Turn::Unknown(Reason::OrientationUnknown);
                self.state.lose_position();
                self.events.push(Event::Unknown);
            }
            b"FUNCTION" if second == b"TCPM" => self.tip(true, false),
            b"FUNCTION" if words.contains(&&b"TCPM"[..]) => self.tip(false, false),
            b"TRANS" if second == b"DATUM" => {
                match words.get(2).copied() {
                    Some(b"RESET") => {
                        self.state.programmable = None;
                        self.set(Group::Frame);
                    }
                    Some(b"AXIS") => self.datum_shift(&words[3..]),
                    _ => self.transform(transforms::SYSTEM, true),
                }
                self.state.lose_position();
                self.events.push(Event::Lost(super::POSITION));
            }
            b"TRANS" => {
                let which = match second {
                    b"MIRROR" => transforms::MIRROR,
                    b"ROTATION" => transforms::TURN,
                    b"SCALE" => transforms::SCALE,
                    _ => transforms::SYSTEM,
                };
                self.transform(which, words.get(2).copied() != Some(b"RESET"));
            }
            b"LBL" if second != b"0" => self.forget(),
            b"CALL" | b"SEL" if second == b"LBL" || second == b"PGM" || name == b"CALL" => {
                self.subprogram(said, "CALL");
            }
            b"APPR" | b"DEP" | b"RND" | b"CHF" | b"CP" | b"LP" | b"CTP" | b"FL" | b"FC" | b"FLT" | b"FCT"
            | b"FPOL" | b"SPL" => {
                let text = String::from_utf8_lossy(name).into_owned();
                self.left(said, &text, Reason::NotFollowed);
                self.state.lose_position();
                self.events.push(Event::Lost(super::POSITION));
            }
            b"TCH" => {
                self.left(said, "TCH PROBE", Reason::Probe);
                self.state.lose_position();
                self.events.push(Event::Lost(super::POSITION));
            }
            b"FN" | b"Q" | b"QL" | b"QR" => self.parameter(first),
            b"BEGIN" | b"END" if words.contains(&&b"INCH"[..]) => self.state.unit_mm = 25.4,
            _ => {}
        }
    }

    /// `CYCL DEF 7.1 X+10` and `TRANS DATUM AXIS X+10 Y-5`: a shift within the preset. Axes that are not named keep theirs; a
    /// row of the datum table is not known here.
    fn datum_shift(&mut self, words: &[&[u8]]) {
        let known = self.state.programmable.unwrap_or_else(Pose::identity);
        let mut shift = known.translation.vector;
        let mut good = known.rotation.angle() == 0.0;
        for word in words {
            let (axis, increment) = match *word {
                [b'I', axis @ b'X'..=b'Z', ..] => (axis, true),
                [axis @ b'X'..=b'Z', ..] => (axis, false),
                // The title of the cycle.
                [first, ..] if first.is_ascii_alphabetic() => break,
                _ => {
                    good = false;
                    break;
                }
            };
            let value = match &word[1 + usize::from(increment)..] {
                [b'-', digits @ ..] => literal(digits).map(|value| -value),
                [b'+', digits @ ..] | digits => literal(digits),
            };
            match value {
                Some(value) => {
                    let entry = &mut shift[usize::from(axis - b'X')];
                    *entry = value * self.state.unit_mm + if increment { *entry } else { 0.0 };
                }
                None => good = false,
            }
        }
        if good {
            self.state.programmable =
                (shift.norm() > 0.0).then(|| Pose::translation(shift.x, shift.y, shift.z));
            self.set(Group::Frame);
        } else {
            self.transform(transforms::SYSTEM, true);
        }
    }

    /// Whether what is left of `CYCL DEF 10.1 ROT+0` ends the cycle.
    fn ends_cycle(&self, words: &[&[u8]]) -> bool {
        if !words.get(2).is_some_and(|number| number.ends_with(b".1")) {
            return false;
        }
        let neutral = |word: &&[u8]| {
            let at = word.iter().position(|byte| !byte.is_ascii_alphabetic()).unwrap_or(word.len());
            let (name, value) = word.split_at(at);
            let value = literal(value.strip_prefix(b"+").unwrap_or(value));
            match name {
                b"A" | b"B" | b"C" | b"ROT" => value == Some(0.0),
                b"SCL" => value.is_none_or(|value| value == 1.0),
                b"" => value == Some(1.0),
                _ => false,
            }
        };
        words[3..].iter().all(neutral)
    }

    /// `TOOL CALL 5 Z S1000`, `TOOL CALL "MILL"`, `TOOL CALL Z S2000` (the spindle alone).
    fn tool_call(&mut self, first: &Word<'_>, words: &[&[u8]]) {
        let Some(&named) = words.get(2) else { return };
        let name = if let Some(number) = literal(named) {
            format!("T{number}")
        } else if named.starts_with(b"\"") {
            let text = &self.tree.source()[self.tree.range(first.first, first.end)];
            let name = text.split(|&byte| byte == b'"').nth(1).unwrap_or_default();
            String::from_utf8_lossy(name).into_owned()
        } else if named.starts_with(b"Q") {
            "T?".to_owned()
        } else {
            super::codes::base(&self.state.tool).to_owned()
        };
        // Another length than that of its table.
        let longer = words.iter().any(|word| word.starts_with(b"DL"));
        self.state.tool = if longer { format!("{name} +DL") } else { name };
        self.set(Group::Tool);
    }

    /// The name of the preset that `CYCL DEF 247 … Q339=n` takes: `PRESET1`; the number may stand in the next line.
    fn preset(&self, first: &Word<'_>) -> String {
        const NEAR: usize = 200;
        let start = self.tree.start(first.first);
        let source = &self.tree.source()[start..];
        let text = source[..source.len().min(NEAR)].to_ascii_uppercase();
        let at = text.windows(5).position(|five| five == b"Q339=").map(|at| at + 5);
        let digits: String = at
            .into_iter()
            .flat_map(|at| &text[at..])
            .map(|&byte| char::from(byte))
            .skip_while(|c| matches!(c, ' ' | '+'))
            .take_while(char::is_ascii_digit)
            .collect();
        format!("PRESET{digits}")
    }

    /// `Q1 = +5`, `FN 0: Q1 = +5`.
    fn parameter(&mut self, word: &Word<'_>) {
        let equal = (word.first..word.end).find(|&token| self.tree.kind(token) == Some(Token::Equal));
        let Some(equal) = equal else { return };
        let number = (word.first..equal)
            .rev()
            .find(|&token| self.tree.kind(token) == Some(Token::Number))
            .and_then(|token| literal(self.tree.text(token)));
        let Some(number) = number else { return };
        let value: Worth = self.evaluated((equal + 1, word.end));
        // QL and QR are sets of their own.
        let source = &self.tree.source()[self.tree.range(word.first, equal)];
        let letters = source.iter().rposition(|byte| byte.is_ascii_alphabetic());
        match letters.map(|at| source[at].to_ascii_uppercase()) {
            Some(set @ (b'L' | b'R')) => {
                self.state.variables.insert([b"Q", &super::numbered(set, number)[..]].concat(), value);
            }
            _ => {
                self.state.variables.insert(super::numbered(b'Q', number), value);
            }
        }
    }
}
