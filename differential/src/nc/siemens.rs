//! Siemens 840D programs: R parameters, names, control structures, frames, TRAORI.

mod codes;
mod flow;

use std::collections::HashMap;

use super::formula::value;
use super::machine::{Event, Machine};
use super::setting::{Pose, Setting};
use super::{Control, End};

/// Runs a program.
pub fn run(text: &str, setting: &Setting, budget: usize) -> (Vec<Event>, End) {
    let mut control = Siemens::new(text, setting);
    let end = control.run(budget);
    (control.machine.trace, end)
}

/// One word of a block.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Word {
    /// A letter and a number: `X10`.
    Letter(char, f64),
    /// A name and the text of its value: `A3=0`, `X=IC(5)`.
    Sets(String, String),
    /// A name, with arguments or without: `TRAORI`, `CYCLE81(50,0,2,-5)`.
    Name(String),
}

/// A loop that runs: the line of its begin, and how often it is still to run (REPEAT with P).
#[derive(Debug, Clone, Copy)]
struct Section {
    call: usize,
    last: usize,
    begin: usize,
    left: i64,
}

pub(super) struct Siemens<'s> {
    pub machine: Machine<'s>,
    lines: Vec<String>,
    variables: HashMap<String, f64>,
    sections: Vec<Section>,
    pub frames: HashMap<String, Pose>,
    pub frame: String,
    /// The programmable frame; `None` where it is no rigid motion or not known.
    pub programmed: Option<Pose>,
    waiting: Option<i32>,
}

impl<'s> Siemens<'s> {
    fn new(text: &str, setting: &'s Setting) -> Siemens<'s> {
        let frames: HashMap<String, Pose> = setting.frames.iter().cloned().collect();
        let mut machine = Machine::new(setting);
        machine.chain = frames.get("G500").copied();
        Siemens {
            machine,
            lines: text.lines().map(bare).collect(),
            variables: HashMap::new(),
            sections: Vec::new(),
            frames,
            frame: "G500".to_owned(),
            programmed: Some(Pose::identity()),
            waiting: None,
        }
    }

    fn run(&mut self, budget: usize) -> End {
        let mut at = 0;
        for _ in 0..budget {
            if at >= self.lines.len() {
                return End::Done;
            }
            self.machine.line = at;
            let next = match self.block(at) {
                Ok(Some(next)) => next,
                Ok(None) => return End::Done,
                Err(what) => return End::Fault(at, what),
            };
            at = self.section_end(at, next);
        }
        End::Budget
    }

    fn value(&self, text: &str) -> Result<f64, String> {
        let look = |name: &str| {
            let found = self.variables.get(name).copied();
            let parameter = name.strip_prefix('R').is_some_and(|n| n.bytes().all(|b| b.is_ascii_digit()));
            if parameter { Some(found.unwrap_or(0.0)) } else { found }
        };
        value(Control::Siemens, text, &look).map_err(|none| none.0)
    }

    /// Runs a block; the line to go on with, or the end.
    fn block(&mut self, at: usize) -> Result<Option<usize>, String> {
        let Some(line) = self.statement(at) else { return Ok(Some(at + 1)) };
        if line.is_empty() {
            return Ok(Some(at + 1));
        }
        if let Some(next) = self.flow(at, &line)? {
            return Ok(Some(next));
        }
        if let Some(rest) = line.strip_prefix("DEF ") {
            self.define(rest.trim())?;
            return Ok(Some(at + 1));
        }
        let words = words(&line);
        self.act(&words, &line)?;
        let ends =
            words.iter().any(|word| matches!(word, Word::Letter('M', m) if matches!(*m as i32, 2 | 17 | 30)));
        Ok(if ends { None } else { Some(at + 1) })
    }

    /// A block without its number and label; `None` where it is passed over.
    fn statement(&self, at: usize) -> Option<String> {
        let mut line = self.lines[at].trim();
        if let Some(rest) = line.strip_prefix('/') {
            if self.machine.setting.skip {
                return None;
            }
            line = rest.trim_start();
        }
        Some(after_label(after_number(line)).to_owned())
    }

    /// `DEF REAL A=5, B`
    fn define(&mut self, text: &str) -> Result<(), String> {
        let (_, list) = text.split_once(' ').ok_or(text)?;
        for part in list.split(',') {
            let (name, value) = part.split_once('=').unwrap_or((part, "0"));
            let value = self.value(value)?;
            self.variables.insert(name.trim().to_owned(), value);
        }
        Ok(())
    }
}

/// A line without its comment, in upper case.
fn bare(line: &str) -> String {
    let mut inside = false;
    let end = line
        .char_indices()
        .find(|(_, letter)| {
            inside ^= *letter == '"';
            *letter == ';' && !inside
        })
        .map_or(line.len(), |(at, _)| at);
    line[..end].trim().to_uppercase()
}

pub(super) fn after_number(line: &str) -> &str {
    match line.strip_prefix('N') {
        Some(rest) if rest.starts_with(|c: char| c.is_ascii_digit()) => {
            rest.trim_start_matches(|c: char| c.is_ascii_digit()).trim_start()
        }
        _ => line,
    }
}

/// The label with which a block begins.
pub(super) fn label(line: &str) -> Option<&str> {
    let line = after_number(line.strip_prefix('/').unwrap_or(line).trim());
    let end = line.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_'))?;
    (end > 1 && line[end..].starts_with(':') && !line[end..].starts_with(":=")).then(|| &line[..end])
}

fn after_label(line: &str) -> &str {
    match label(line) {
        Some(label) => line[label.len() + 1..].trim_start(),
        None => line,
    }
}

/// The words of a block: what stands between white space outside parentheses and quotes.
pub(super) fn words(line: &str) -> Vec<Word> {
    let mut parts: Vec<String> = vec![String::new()];
    let (mut depth, mut quoted) = (0, false);
    for letter in line.chars() {
        match letter {
            '(' | '[' => depth += 1,
            ')' | ']' => depth -= 1,
            '"' => quoted = !quoted,
            _ => {}
        }
        if letter.is_whitespace() && depth == 0 && !quoted {
            parts.push(String::new());
        } else if let Some(last) = parts.last_mut() {
            last.push(letter);
        }
    }
    parts.retain(|part| !part.is_empty());
    parts.iter().map(|part| word(part)).collect()
}

fn word(part: &str) -> Word {
    let mut letters = part.chars();
    if let (Some(letter), Ok(number)) =
        (letters.next().filter(char::is_ascii_alphabetic), letters.as_str().parse())
    {
        return Word::Letter(letter, number);
    }
    match part.find('=').filter(|at| !part[..*at].contains('(')) {
        Some(at) => Word::Sets(part[..at].to_owned(), part[at + 1..].to_owned()),
        None => Word::Name(part.to_owned()),
    }
}
