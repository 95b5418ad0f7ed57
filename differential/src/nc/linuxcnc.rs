//! LinuxCNC programs: parameters, O words, and blocks whose words act in a fixed order.

mod codes;
mod flow;

use std::collections::HashMap;

use nalgebra::UnitQuaternion;

use super::formula::value;
use super::machine::{Event, Machine};
use super::setting::{Pose, Setting};
use super::words::{bare, value_end};
use super::{Control, End};

/// Runs a program.
pub fn run(text: &str, setting: &Setting, budget: usize) -> (Vec<Event>, End) {
    let mut control = LinuxCnc::new(text, setting);
    let end = control.run(budget);
    (control.machine.trace, end)
}

/// A block with its words worked out.
pub(super) struct Block {
    pub codes: Vec<i32>,
    pub switches: Vec<i32>,
    pub words: Vec<(char, f64)>,
    pub text: String,
}

impl Block {
    fn has(&self, code: i32) -> bool {
        self.codes.contains(&code)
    }

    fn get(&self, letter: char) -> Option<f64> {
        self.words.iter().rev().find(|(other, _)| *other == letter).map(|word| word.1)
    }
}

/// What M70 keeps.
type Kept = (super::machine::Mode, u8, f64, bool, bool, String, String);

/// A call that runs: where it comes back to, and the parameters of the caller.
struct Call {
    back: usize,
    own: HashMap<String, f64>,
}

pub(super) struct LinuxCnc<'s> {
    pub machine: Machine<'s>,
    lines: Vec<String>,
    parameters: HashMap<String, f64>,
    calls: Vec<Call>,
    /// How often each REPEAT is still to run, by its line.
    repeats: HashMap<usize, i64>,
    /// Whether each IF has taken a branch, by its label.
    taken: HashMap<String, bool>,
    pub frames: HashMap<String, Pose>,
    /// How offsets are turned about Z of which it is not known where they lie.
    pub unplaced: HashMap<String, UnitQuaternion<f64>>,
    /// Offsets of rotary axes (°), where they are not 0.
    pub rotary: HashMap<String, [f64; 3]>,
    pub frame: String,
    /// The zero of G92 and G52 (mm).
    pub shift: [Option<f64>; 3],
    /// What G92.2 keeps for G92.3.
    pub kept_shift: [Option<f64>; 3],
    pub arcs_absolute: bool,
    /// The tool in the spindle, and the one whose length G43 has taken.
    pub spindle: String,
    waiting: Option<i32>,
    kept: Option<Kept>,
}

impl<'s> LinuxCnc<'s> {
    fn new(text: &str, setting: &'s Setting) -> LinuxCnc<'s> {
        let frames: HashMap<String, Pose> = setting.frames.iter().cloned().collect();
        let mut machine = Machine::new(setting);
        machine.chain = frames.get("G54").copied();
        // Kinematics of a robot: X, Y and Z are always the tip's.
        machine.tip = true;
        LinuxCnc {
            machine,
            lines: text.lines().map(bare).collect(),
            parameters: HashMap::new(),
            calls: Vec::new(),
            repeats: HashMap::new(),
            taken: HashMap::new(),
            frames,
            unplaced: HashMap::new(),
            rotary: HashMap::new(),
            frame: "G54".to_owned(),
            shift: [Some(0.0); 3],
            kept_shift: [Some(0.0); 3],
            arcs_absolute: false,
            spindle: "T0".to_owned(),
            waiting: None,
            kept: None,
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

    fn value(&self, text: &str) -> Result<f64, String> {
        let look = |name: &str| {
            let found = self.parameters.get(name).copied();
            // Numbered parameters begin at 0.
            if name.starts_with("#<") { found } else { Some(found.unwrap_or(0.0)) }
        };
        value(Control::LinuxCnc, text, &look).map_err(|none| none.0)
    }

    /// Runs a block; the line to go on with, or the end.
    fn block(&mut self, at: usize) -> Result<Option<usize>, String> {
        let mut line: String = self.lines[at].split_whitespace().collect::<Vec<_>>().join(" ");
        if let Some(rest) = line.strip_prefix('/') {
            if self.machine.setting.skip {
                return Ok(Some(at + 1));
            }
            line = rest.trim().to_owned();
        }
        if line.starts_with('N') {
            line = line[1..].trim_start_matches(|c: char| c.is_ascii_digit()).trim_start().to_owned();
        }
        if line.is_empty() || line.starts_with('%') {
            return Ok(Some(at + 1));
        }
        if line.starts_with('O') {
            return self.o_word(at, &line).map(Some);
        }
        let (block, sets) = self.words(&line)?;
        // The whole line is read before anything is set.
        for (name, value) in sets {
            self.parameters.insert(name, value);
        }
        self.act(&block)?;
        Ok(if block.switches.iter().any(|m| matches!(m, 2 | 30)) { None } else { Some(at + 1) })
    }

    /// The words of a block, and the parameters that it sets.
    #[allow(clippy::type_complexity)]
    fn words(&self, line: &str) -> Result<(Block, Vec<(String, f64)>), String> {
        let bytes: Vec<u8> = line.bytes().filter(|byte| !byte.is_ascii_whitespace()).collect();
        let mut block =
            Block { codes: Vec::new(), switches: Vec::new(), words: Vec::new(), text: line.to_owned() };
        let mut sets = Vec::new();
        let mut at = 0;
        while at < bytes.len() {
            let unread = || format!("cannot read {line}");
            let text = |from: usize, to: usize| String::from_utf8_lossy(&bytes[from..to]).into_owned();
            if bytes[at] == b'#' {
                let name_end = value_end(&bytes, at).ok_or_else(unread)?;
                let end = value_end(&bytes, name_end + 1).ok_or_else(unread)?;
                if bytes.get(name_end) != Some(&b'=') {
                    return Err(unread());
                }
                sets.push((self.name(&text(at, name_end))?, self.value(&text(name_end + 1, end))?));
                at = end;
                continue;
            }
            let letter = bytes[at] as char;
            if !letter.is_ascii_alphabetic() {
                return Err(unread());
            }
            let end = value_end(&bytes, at + 1).ok_or_else(unread)?;
            let value = self.value(&text(at + 1, end))?;
            match letter {
                'G' => block.codes.push((value * 10.0).round() as i32),
                'M' => block.switches.push(value.round() as i32),
                _ => block.words.push((letter, value)),
            }
            at = end;
        }
        Ok((block, sets))
    }

    /// The name under which a parameter is kept.
    fn name(&self, text: &str) -> Result<String, String> {
        if text.starts_with("#<") {
            return Ok(text.to_owned());
        }
        let number = self.value(&text[1..])?;
        Ok(format!("#{}", number.round() as i64))
    }
}
