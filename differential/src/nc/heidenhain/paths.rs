//! Blocks that move, and what stands beside their axes.

use super::super::arc::Circle;
use super::super::machine::{Mode, Say, Turn, Words};
use super::Heidenhain;

/// What a path block says beside its axes.
#[derive(Default)]
struct Beside {
    radius: Option<f64>,
    anticlockwise: bool,
    rapid: bool,
    machine: bool,
    cycle: bool,
    control_off: bool,
    ends: bool,
    normal: bool,
    polar: bool,
}

impl Heidenhain<'_> {
    /// A block of a path; true where the program ends with it.
    pub(super) fn path(&mut self, line: &str) -> Result<bool, String> {
        let mut parts = line.split_whitespace().peekable();
        let mut kind = parts.peek().copied().unwrap_or_default();
        if matches!(kind, "L" | "LN" | "C" | "CR" | "CT" | "CC" | "CP" | "LP" | "RND" | "CHF" | "STOP") {
            parts.next();
        } else {
            kind = "";
        }
        let mut words = Words::default();
        let mut beside = Beside::default();
        for part in parts {
            self.word(part, &mut words, &mut beside)?;
        }
        match kind {
            "CC" => {
                for (axis, say) in words.place.iter().enumerate() {
                    self.centre[axis] = match say {
                        Some(Say::To(value)) => Some(*value),
                        Some(Say::By(value)) => self.machine.at[axis].map(|at| at + value),
                        // Without words the centre is where the tool is.
                        None if words.place == [None; 3] => self.machine.at[axis],
                        None => self.centre[axis],
                    };
                }
            }
            "RND" | "CHF" => self.machine.note(line),
            "CT" | "CP" | "LP" => self.other(line, &words),
            _ => self.line_or_arc(line, kind, words, &beside)?,
        }
        if beside.cycle {
            self.machine.elsewhere("cycle that is called by M99", true);
        }
        if beside.control_off {
            self.machine.follow_tip(false);
        }
        Ok(beside.ends)
    }

    fn line_or_arc(
        &mut self,
        line: &str,
        kind: &str,
        mut words: Words,
        beside: &Beside,
    ) -> Result<(), String> {
        if !words.moves() {
            return Ok(());
        }
        let vector = words.vector != [None; 3];
        if vector && kind != "LN" {
            return Err(format!("a tool vector in {line}, where the control takes none"));
        }
        let along_normal = beside.normal && words.vector == [None; 3];
        if beside.machine || along_normal {
            let named = words.place.map(|say| along_normal || say.is_some());
            self.machine.some_elsewhere(line, along_normal, named);
            return Ok(());
        }
        self.machine.mode = match kind {
            "C" | "CR" if beside.anticlockwise => Mode::Anticlockwise,
            "C" | "CR" => Mode::Clockwise,
            _ if beside.rapid => Mode::Rapid,
            _ => Mode::Line,
        };
        words.circle = match kind {
            "C" => {
                // The arc lies about the centre, whatever its start.
                let known = self.centre[0].zip(self.centre[1]);
                Some(match known {
                    Some((x, y)) => Circle::Pole([x, y, 0.0]),
                    None => Circle::Centre([None; 3]),
                })
            }
            "CR" => Some(Circle::Radius(beside.radius.ok_or(line)?)),
            _ => None,
        };
        self.machine.go(words);
        if vector {
            // No other block can say again how the axes that turn the tool stand now.
            self.machine.turn = Turn::Unknown;
        }
        Ok(())
    }

    /// A path that is not followed; its end is where its words say.
    fn other(&mut self, line: &str, words: &Words) {
        let (at, turn) = (self.machine.at, self.machine.turn);
        self.machine.elsewhere(line, true);
        if line.starts_with("CT") {
            (self.machine.at, self.machine.turn) = (at, turn);
            for (axis, say) in words.place.iter().enumerate() {
                match say {
                    Some(Say::To(value)) => self.machine.at[axis] = Some(*value),
                    Some(Say::By(value)) => self.machine.at[axis] = at[axis].map(|at| at + value),
                    None => {}
                }
            }
        }
    }

    fn word(&mut self, part: &str, words: &mut Words, beside: &mut Beside) -> Result<(), String> {
        let unit = self.machine.unit;
        match part {
            "R0" => self.machine.side = 40,
            "RL" => self.machine.side = 41,
            "RR" => self.machine.side = 42,
            "FMAX" => beside.rapid = true,
            "DR+" => beside.anticlockwise = true,
            "DR-" => beside.anticlockwise = false,
            "M128" => {
                self.machine.follow_tip(true);
            }
            "M129" => beside.control_off = true,
            "M91" => beside.machine = true,
            "M99" => beside.cycle = true,
            "M2" | "M30" => beside.ends = true,
            _ if part.starts_with('M') => self.machine.note(part),
            _ if part.starts_with('F') => self.machine.feed = part[1..].to_owned(),
            _ if part.starts_with('S') => self.machine.note(part),
            _ => {
                let (by, rest) = match part.strip_prefix('I') {
                    Some(rest) => (true, rest),
                    None => (false, part),
                };
                for (list, scale, what) in [
                    (["X", "Y", "Z"], unit, 0),
                    (["A", "B", "C"], 1.0, 1),
                    (["TX", "TY", "TZ"], 1.0, 2),
                    (["NX", "NY", "NZ"], 1.0, 3),
                ] {
                    for (axis, name) in list.iter().enumerate() {
                        let Some(text) = rest.strip_prefix(name) else { continue };
                        let value = self.value(text)? * scale;
                        let say = if by { Say::By(value) } else { Say::To(value) };
                        match what {
                            0 => words.place[axis] = Some(say),
                            1 => words.turn[axis] = Some(say),
                            2 => words.vector[axis] = Some(value),
                            _ => beside.normal = true,
                        }
                        return Ok(());
                    }
                }
                if let Some(text) = rest.strip_prefix('R') {
                    beside.radius = Some(self.value(text)? * unit);
                } else if rest.starts_with("PR") || rest.starts_with("PA") {
                    beside.polar = true;
                } else {
                    return Err(format!("{part} is not known"));
                }
            }
        }
        Ok(())
    }
}
