//! Heidenhain conversational programs: L, LN, C about CC, CR, Q parameters, labels, datum shifts, M128.

mod flow;
mod paths;

use std::collections::HashMap;

use super::formula::value;
use super::machine::{Event, Machine, Mode};
use super::setting::{Pose, Setting};
use super::{Control, End};

/// Runs a program.
pub fn run(text: &str, setting: &Setting, budget: usize) -> (Vec<Event>, End) {
    let mut control = Heidenhain::new(text, setting);
    let end = control.run(budget);
    (control.machine.trace, end)
}

pub(super) struct Heidenhain<'s> {
    pub machine: Machine<'s>,
    lines: Vec<String>,
    values: HashMap<String, f64>,
    /// Where calls come back to.
    calls: Vec<usize>,
    /// How often a section is still to be repeated, by the line of its call.
    repeats: HashMap<usize, i64>,
    pub preset: String,
    /// The datum shift (mm); `None` where it is not known.
    pub shift: [Option<f64>; 3],
    /// The cycle whose lines come.
    cycle: u32,
    /// The centre of circles.
    pub centre: [Option<f64>; 3],
}

impl<'s> Heidenhain<'s> {
    fn new(text: &str, setting: &'s Setting) -> Heidenhain<'s> {
        let mut machine = Machine::new(setting);
        machine.chain = setting.frame("G54");
        machine.mode = Mode::Line;
        Heidenhain {
            machine,
            lines: text.lines().map(bare).collect(),
            values: HashMap::new(),
            calls: Vec::new(),
            repeats: HashMap::new(),
            preset: "G54".to_owned(),
            shift: [Some(0.0); 3],
            cycle: 0,
            centre: [None; 3],
        }
    }

    fn run(&mut self, budget: usize) -> End {
        let mut at = 0;
        for _ in 0..budget {
            if at >= self.lines.len() {
                return End::Done;
            }
            self.machine.line = at;
            match self.block(at) {
                Ok(Some(next)) => at = next,
                Ok(None) => return End::Done,
                Err(what) => return End::Fault(at, what),
            }
        }
        End::Budget
    }

    /// The value of a formula or of a number with a sign.
    pub fn value(&self, text: &str) -> Result<f64, String> {
        let look = |name: &str| {
            let digits = name.strip_prefix('Q')?.trim_start_matches(['L', 'R']);
            let parameter = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
            parameter.then(|| self.values.get(name).copied().unwrap_or(0.0))
        };
        value(Control::Heidenhain, text, &look).map_err(|none| none.0)
    }

    /// A block without its number; `None` where it is passed over.
    fn statement(&self, at: usize) -> Option<&str> {
        let mut line = self.lines[at].as_str();
        for _ in 0..2 {
            if let Some(rest) = line.strip_prefix('/') {
                if self.machine.setting.skip {
                    return None;
                }
                line = rest.trim_start();
            }
            line = line.trim_start_matches(|c: char| c.is_ascii_digit()).trim_start();
        }
        Some(line)
    }

    /// Runs a block; the line to go on with, or the end.
    fn block(&mut self, at: usize) -> Result<Option<usize>, String> {
        let next = Ok(Some(at + 1));
        let Some(line) = self.statement(at).map(str::to_owned) else { return next };
        if line.is_empty() || line.starts_with('*') || line.starts_with("BLK FORM") {
            return next;
        }
        if line.starts_with("BEGIN PGM") {
            self.machine.unit = if line.ends_with("INCH") { 25.4 } else { 1.0 };
            return next;
        }
        if line.starts_with("END PGM") {
            return Ok(None);
        }
        if let Some(there) = self.flow(at, &line)? {
            return Ok(Some(there));
        }
        if self.parameter(&line)? || self.definition(&line)? {
            return next;
        }
        let ends = self.path(&line)?;
        Ok(if ends { None } else { Some(at + 1) })
    }

    /// Q parameters: formulas and FN 0 to FN 7. True where the block is one.
    fn parameter(&mut self, line: &str) -> Result<bool, String> {
        if let Some(rest) = line.strip_prefix("FN ") {
            let (number, rest) = rest.split_once(':').ok_or(line)?;
            let (name, text) = rest.split_once('=').ok_or(line)?;
            let text = text.trim();
            let formula = match number.trim() {
                "0" | "1" | "2" | "3" => text.to_owned(),
                "4" => text.replace("DIV", "/"),
                "5" | "6" | "7" => text.to_owned(),
                _ => return Err(line.to_owned()),
            };
            let value = self.value(&formula)?;
            self.values.insert(name.trim().to_owned(), value);
            return Ok(true);
        }
        if line.starts_with('Q')
            && let Some((name, text)) = line.split_once('=')
        {
            let value = self.value(text)?;
            self.values.insert(name.trim().to_owned(), value);
            return Ok(true);
        }
        Ok(false)
    }

    /// Tools, datum shifts, cycles, planes. True where the block is one.
    fn definition(&mut self, line: &str) -> Result<bool, String> {
        let parts: Vec<&str> = line.split_whitespace().collect();
        if line.starts_with("TOOL CALL") {
            let numbered = parts.get(2).filter(|part| part.bytes().all(|byte| byte.is_ascii_digit()));
            if let Some(number) = numbered {
                let longer =
                    parts.iter().any(|part| part.starts_with("DL") && self.value(&part[2..]) != Ok(0.0));
                self.machine.tool = (!longer).then(|| format!("T{number}"));
                self.machine.lost();
            }
            self.machine.note(line);
            return Ok(true);
        }
        if line.starts_with("TRANS DATUM") {
            if line.ends_with("RESET") {
                self.shift = [Some(0.0); 3];
            } else {
                self.shift_words(&parts[3..])?;
            }
            self.recount();
            return Ok(true);
        }
        if line.starts_with("PLANE") {
            let reset = line.starts_with("PLANE RESET");
            if line.contains("STAY") {
                self.machine.bend("tilted", !reset);
            } else {
                self.machine.elsewhere(line, true);
                self.machine.bend("tilted", !reset);
            }
            return Ok(true);
        }
        if line.starts_with("CYCL CALL") {
            self.machine.elsewhere(line, true);
            return Ok(true);
        }
        if let Some(rest) = line.strip_prefix("CYCL DEF ") {
            self.cycle_line(line, rest)?;
            return Ok(true);
        }
        if line.starts_with("STOP") || line.starts_with("FUNCTION MODE MILL") {
            self.machine.note(line);
            return Ok(!line.contains('M') || line.starts_with("FUNCTION"));
        }
        Ok(false)
    }

    fn cycle_line(&mut self, line: &str, rest: &str) -> Result<(), String> {
        let mut parts = rest.split_whitespace();
        let number = parts.next().ok_or(line)?;
        let words: Vec<&str> = parts.collect();
        let (cycle, part) = number.split_once('.').unwrap_or((number, ""));
        self.cycle = cycle.parse().map_err(|_| line.to_owned())?;
        let told = part != "0" && !part.is_empty();
        match self.cycle {
            7 if told => {
                self.shift_words(&words)?;
                self.recount();
            }
            8 if told => self.machine.bend("mirrored", words.iter().any(|word| "XYZABC".contains(*word))),
            10 if told => {
                let turn = words.iter().find_map(|word| word.strip_prefix("ROT")).ok_or(line)?;
                let turn = self.value(turn)?;
                self.machine.bend("turned", turn != 0.0);
            }
            247 => {
                let number = rest.split_once("Q339=").ok_or(line)?.1;
                let number = self.value(number.split_whitespace().next().unwrap_or_default())?;
                self.preset = format!("PRESET{number}");
                self.shift = [Some(0.0); 3];
                self.recount();
            }
            7 | 8 | 10 => {}
            _ => self.machine.note(line),
        }
        Ok(())
    }

    /// `X+10 IY-5`
    fn shift_words(&mut self, words: &[&str]) -> Result<(), String> {
        for word in words {
            let (more, rest) = word.strip_prefix('I').map_or((false, *word), |rest| (true, rest));
            let axis = rest.chars().next().and_then(|letter| "XYZ".find(letter));
            let Some(axis) = axis else { continue };
            let value = self.value(&rest[1..])? * self.machine.unit;
            let old = if more { self.shift[axis] } else { Some(0.0) };
            self.shift[axis] = old.map(|old| old + value);
        }
        Ok(())
    }

    pub fn recount(&mut self) {
        let frame = self.machine.setting.frame(&self.preset);
        let [x, y, z] = self.shift;
        let chain = frame.zip(x).zip(y).zip(z).map(|(((frame, x), y), z)| frame * Pose::translation(x, y, z));
        self.machine.recount(chain);
        // A centre is kept in coordinates that hold no more.
        self.centre = [None; 3];
    }
}

/// A line without its comment, in upper case.
fn bare(line: &str) -> String {
    line.split(';').next().unwrap_or_default().trim().to_uppercase()
}
