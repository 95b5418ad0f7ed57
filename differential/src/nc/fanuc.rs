//! Fanuc style programs with tool centre point control and custom macros.

mod codes;

use std::collections::HashMap;

use super::formula::value;
use super::machine::{Event, Machine};
use super::setting::{Pose, Setting};
use super::words::{bare, words};
use super::{Control, End};

/// Runs a program.
pub fn run(text: &str, setting: &Setting, budget: usize) -> (Vec<Event>, End) {
    let mut control = Fanuc::new(text, setting);
    let end = control.run(budget);
    (control.machine.trace, end)
}

/// A block with its words worked out.
pub(super) struct Block {
    /// G codes in tenths.
    pub codes: Vec<i32>,
    /// M codes.
    pub switches: Vec<i32>,
    /// All other words, and whether their text had a point or was computed.
    pub words: Vec<(char, f64, bool)>,
    /// The text.
    pub text: String,
}

impl Block {
    fn has(&self, code: i32) -> bool {
        self.codes.contains(&code)
    }

    fn get(&self, letter: char) -> Option<f64> {
        self.words.iter().rev().find(|(other, ..)| *other == letter).map(|word| word.1)
    }
}

/// What comes after a block.
enum Next {
    Line(usize),
    End,
}

/// A call that runs: where it comes back to, its program's begin, how often it is still to run, the variables of the
/// caller where it has its own.
type Call = (usize, usize, i32, Option<HashMap<i32, f64>>);

pub(super) struct Fanuc<'s> {
    pub machine: Machine<'s>,
    lines: Vec<String>,
    variables: HashMap<i32, f64>,
    calls: Vec<Call>,
    programs: HashMap<i32, usize>,
    /// Work offsets as they are now.
    pub frames: HashMap<String, Pose>,
    pub frame: String,
    /// G92 and G52 (mm), where the program's zero lies in the work offset.
    pub preset: [Option<f64>; 3],
    pub local: [f64; 3],
    waiting: Option<i32>,
}

impl<'s> Fanuc<'s> {
    fn new(text: &str, setting: &'s Setting) -> Fanuc<'s> {
        let lines: Vec<String> = text.lines().map(bare).collect();
        let program = |(at, line): (usize, &String)| {
            let digits: String = line.strip_prefix('O')?.chars().take_while(char::is_ascii_digit).collect();
            Some((digits.parse().ok()?, at))
        };
        let programs = lines.iter().enumerate().filter_map(program).collect();
        let frames: HashMap<String, Pose> = setting.frames.iter().cloned().collect();
        let mut machine = Machine::new(setting);
        machine.chain = frames.get("G54").copied();
        Fanuc {
            machine,
            lines,
            variables: HashMap::new(),
            calls: Vec::new(),
            programs,
            frames,
            frame: "G54".to_owned(),
            preset: [Some(0.0); 3],
            local: [0.0; 3],
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
            match self.block(at) {
                Ok(Next::Line(next)) => at = next,
                Ok(Next::End) => return End::Done,
                Err(what) => return End::Fault(at, what),
            }
        }
        End::Budget
    }

    /// The value of a formula.
    fn value(&self, text: &str) -> Result<f64, String> {
        let look = |name: &str| {
            let number: i32 = name[1..].parse().ok()?;
            self.offset(number).or_else(|| self.variables.get(&number).copied())
        };
        value(Control::Fanuc, text, &look).map_err(|none| none.0)
    }

    /// The offset of G54 to G59 that a variable is.
    fn offset(&self, number: i32) -> Option<f64> {
        let (which, axis) = (number.checked_sub(5221)? / 20, (number - 5221) % 20);
        let frame = self.frames.get(&format!("G{}", 54 + which))?;
        (number >= 5221 && axis < 3).then(|| frame.translation.vector[axis as usize])
    }

    fn block(&mut self, at: usize) -> Result<Next, String> {
        let mut line = self.lines[at].clone();
        let next = Ok(Next::Line(at + 1));
        if let Some(rest) = line.strip_prefix('/') {
            if self.machine.setting.skip {
                return next;
            }
            line = rest.trim().to_owned();
        }
        if line.starts_with('N') {
            line = line[1..]
                .trim_start()
                .trim_start_matches(|c: char| c.is_ascii_digit())
                .trim_start()
                .to_owned();
        }
        if line.is_empty() || line.starts_with('%') || line.starts_with('O') {
            return next;
        }
        if let Some(there) = self.flow(at, &line)? {
            return Ok(Next::Line(there));
        }
        if line.starts_with('#') {
            self.assign(&line)?;
            return next;
        }
        let block = self.words(&line)?;
        if let Some(there) = self.call(at, &block)? {
            return Ok(there);
        }
        self.machine_block(&block)?;
        Ok(if block.switches.iter().any(|m| matches!(m, 2 | 30)) { Next::End } else { Next::Line(at + 1) })
    }

    /// IF, GOTO, WHILE and END; where to go on.
    fn flow(&mut self, at: usize, line: &str) -> Result<Option<usize>, String> {
        if let Some(rest) = line.strip_prefix("IF") {
            let (condition, then) = split_bracket(rest.trim())?;
            let holds = self.value(condition)? != 0.0;
            let then = then.trim();
            if let Some(aim) = then.strip_prefix("GOTO") {
                return if holds { self.aim(at, aim).map(Some) } else { Ok(Some(at + 1)) };
            }
            let what = then.strip_prefix("THEN").ok_or(line)?.trim();
            if holds {
                self.assign(what)?;
            }
            return Ok(Some(at + 1));
        }
        if let Some(aim) = line.strip_prefix("GOTO") {
            return self.aim(at, aim).map(Some);
        }
        if let Some(rest) = line.strip_prefix("WHILE") {
            let (condition, then) = split_bracket(rest.trim())?;
            let number = then.trim().strip_prefix("DO").ok_or(line)?.trim();
            if self.value(condition)? != 0.0 {
                return Ok(Some(at + 1));
            }
            let ends = |line: &String| plain_end(line) == Some(number);
            let end = self.lines.iter().skip(at + 1).position(ends).ok_or("no END")?;
            return Ok(Some(at + end + 2));
        }
        if let Some(number) = plain_end(line) {
            let begins = |line: &String| {
                let line = after_number(line);
                line.starts_with("WHILE") && line.replace(' ', "").ends_with(&format!("DO{number}"))
            };
            let begin = self.lines[..at].iter().rposition(begins).ok_or("no WHILE")?;
            return Ok(Some(begin));
        }
        Ok(None)
    }

    /// The block of a number: the next one, or the first of the program.
    fn aim(&self, at: usize, number: &str) -> Result<usize, String> {
        let number = self.value(number.trim())?.round() as i64;
        let is = |line: &str| {
            let digits = line.trim_start_matches('/').trim().strip_prefix('N').map(str::trim_start);
            digits.is_some_and(|d| {
                d.chars().take_while(char::is_ascii_digit).collect::<String>().parse() == Ok(number)
            })
        };
        let found: Vec<usize> = (0..self.lines.len()).filter(|&line| is(&self.lines[line])).collect();
        found.iter().find(|&&line| line > at).or(found.first()).copied().ok_or(format!("no N{number}"))
    }

    fn assign(&mut self, text: &str) -> Result<(), String> {
        let (left, right) = text.split_once('=').ok_or(text)?;
        let number = self.value(left.trim().trim_start_matches('#'))?.round() as i32;
        let value = self.value(right)?;
        self.variables.insert(number, value);
        // The offsets of G54 to G59 are variables.
        if (5221..5340).contains(&number) {
            let (which, axis) = ((number - 5221) / 20, ((number - 5221) % 20) as usize);
            let name = format!("G{}", 54 + which);
            if let Some(frame) = self.frames.get_mut(&name)
                && axis < 3
            {
                frame.translation.vector[axis] = value;
                self.recount();
            }
        }
        Ok(())
    }

    /// A block as words; a variable that was never set makes its word void.
    fn words(&self, line: &str) -> Result<Block, String> {
        let read = words(Control::Fanuc, line).ok_or_else(|| format!("cannot read {line}"))?;
        let mut block =
            Block { codes: Vec::new(), switches: Vec::new(), words: Vec::new(), text: line.to_owned() };
        for (letter, text) in read {
            let number = text.strip_prefix('#').and_then(|digits| digits.parse::<i32>().ok());
            if number.is_some_and(|number| !self.variables.contains_key(&number)) {
                continue;
            }
            let value = self.value(&text)?;
            match letter {
                'G' => block.codes.push((value * 10.0).round() as i32),
                'M' => block.switches.push(value.round() as i32),
                _ => {
                    let whole = text.bytes().all(|byte| byte.is_ascii_digit() || matches!(byte, b'+' | b'-'));
                    block.words.push((letter, value, !whole));
                }
            }
        }
        Ok(block)
    }

    /// M98, G65 and M99.
    fn call(&mut self, at: usize, block: &Block) -> Result<Option<Next>, String> {
        let macro_call = block.has(650);
        if block.switches.contains(&98) || macro_call {
            let number = block.get('P').ok_or("P")? as i32;
            let times = block.get('L').unwrap_or(1.0) as i32;
            let Some(&begin) = self.programs.get(&number) else {
                self.machine.elsewhere(format!("call {number}"), true);
                self.machine.lost();
                return Ok(Some(Next::Line(at + 1)));
            };
            let own = macro_call.then(|| {
                let mut inner: HashMap<i32, f64> =
                    self.variables.iter().filter(|(n, _)| **n > 33).map(|(n, v)| (*n, *v)).collect();
                for (letter, value, _) in &block.words {
                    if let Some(number) = argument(*letter) {
                        inner.insert(number, *value);
                    }
                }
                std::mem::replace(&mut self.variables, inner)
            });
            self.calls.push((at + 1, begin + 1, times - 1, own));
            return Ok(Some(Next::Line(begin + 1)));
        }
        if block.switches.contains(&99) {
            let Some((back, begin, left, _)) = self.calls.last_mut() else { return Ok(Some(Next::End)) };
            if *left > 0 {
                *left -= 1;
                return Ok(Some(Next::Line(*begin)));
            }
            let mut back = *back;
            if let Some(number) = block.get('P') {
                back = self.aim(0, &format!("{number}"))?;
            }
            if let Some((.., Some(own))) = self.calls.pop() {
                let common: Vec<(i32, f64)> =
                    self.variables.iter().filter(|(n, _)| **n > 33).map(|(n, v)| (*n, *v)).collect();
                self.variables = own;
                self.variables.extend(common);
            }
            return Ok(Some(Next::Line(back)));
        }
        Ok(None)
    }
}

/// The local variable of an argument of G65 (first list).
fn argument(letter: char) -> Option<i32> {
    const NUMBERS: [(char, i32); 18] = [
        ('A', 1),
        ('B', 2),
        ('C', 3),
        ('D', 7),
        ('E', 8),
        ('F', 9),
        ('H', 11),
        ('I', 4),
        ('J', 5),
        ('K', 6),
        ('Q', 17),
        ('R', 18),
        ('S', 19),
        ('T', 20),
        ('U', 21),
        ('X', 24),
        ('Y', 25),
        ('Z', 26),
    ];
    NUMBERS.iter().find(|(other, _)| *other == letter).map(|found| found.1)
}

/// A condition in brackets, and what follows.
fn split_bracket(text: &str) -> Result<(&str, &str), String> {
    let mut depth = 0;
    for (at, letter) in text.char_indices() {
        match letter {
            '[' => depth += 1,
            ']' => depth -= 1,
            _ => {}
        }
        if depth == 0 && letter == ']' {
            return Ok((&text[..=at], &text[at + 1..]));
        }
    }
    Err(format!("no bracket in {text}"))
}

fn after_number(line: &str) -> &str {
    match line.strip_prefix('N') {
        Some(rest) => rest.trim_start_matches(|c: char| c.is_ascii_digit()).trim_start(),
        None => line,
    }
}

/// The number of `END1`.
fn plain_end(line: &str) -> Option<&str> {
    let number = after_number(line).strip_prefix("END")?.trim();
    (!number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit())).then_some(number)
}
