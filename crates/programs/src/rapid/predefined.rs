//! The predefined instructions and functions that are no motions, and what they do; `predefined.txt` lists them with the source.
//!
//! Whatever is not there and is declared in none of the given files may change what it is given and everything that it
//! sees.

use std::sync::LazyLock;

use super::token::fold;
use crate::motion::Reason;

/// A predefined instruction or function.
#[derive(Debug, PartialEq, Eq)]
pub struct Predefined {
    /// In lower case.
    pub name: &'static str,
    /// What it does with its arguments.
    pub effect: Effect,
    /// Whether it computes and does no more.
    pub answers: bool,
    /// Whether it waits, for another task, an operator or a device.
    pub waits: bool,
    /// Whether the robot stands somewhere else after it, and why it is left where it is a motion of its own.
    pub displaces: Option<Option<Reason>>,
}

/// What a predefined instruction or function does with its arguments.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Effect {
    /// Reads them.
    Reads,
    /// Writes some.
    Writes(Written),
}

/// The arguments that a predefined instruction or function writes.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Written {
    /// The required ones, counted from 0.
    pub required: Vec<usize>,
    /// The optional ones, in lower case.
    pub optional: Vec<&'static str>,
    /// Whether it keeps them and writes at any time after: sensors, cyclic conditions.
    pub later: bool,
}

static LISTED: LazyLock<Vec<Predefined>> = LazyLock::new(|| {
    let lines = include_str!("predefined.txt").lines();
    lines.filter(|line| !line.starts_with('#')).filter_map(predefined).collect()
});

/// All of them, in order.
pub fn all() -> &'static [Predefined] {
    &LISTED
}

/// One line of the list.
fn predefined(line: &'static str) -> Option<Predefined> {
    let (name, facts) = line.split_once(' ')?;
    let mut found = Predefined { name, effect: Effect::Reads, answers: false, waits: false, displaces: None };
    for fact in facts.split(',') {
        let mut words = fact.split_whitespace();
        match words.next()? {
            "reads" => {}
            "answers" => found.answers = true,
            "waits" => found.waits = true,
            "displaces" => found.displaces = Some(None),
            "moves-without-target" => found.displaces = Some(Some(Reason::NoTarget)),
            "moves-by-sensor" => found.displaces = Some(Some(Reason::SensorGuided)),
            kind @ ("writes" | "later") => {
                let mut written = Written { later: kind == "later", ..Written::default() };
                for argument in words {
                    match argument.strip_prefix('\\') {
                        Some(optional) => written.optional.push(optional),
                        None => written.required.push(argument.parse().ok()?),
                    }
                }
                found.effect = Effect::Writes(written);
            }
            _ => return None,
        }
    }
    Some(found)
}

/// The predefined instruction or function of this name, in any case.
fn listed(name: &[u8]) -> Option<&'static Predefined> {
    let mut buffer = [0_u8; 32];
    let folded = buffer.get_mut(..name.len())?;
    for (to, &byte) in folded.iter_mut().zip(name) {
        *to = fold(byte);
    }
    let folded = &*folded;
    let found = LISTED.binary_search_by(|one| one.name.as_bytes().cmp(folded)).ok()?;
    LISTED.get(found)
}

/// What the predefined instruction or function of this name, in any case, does; `None` where there is none.
pub fn effect(name: &[u8]) -> Option<&'static Effect> {
    listed(name).map(|found| &found.effect)
}

/// Whether it is predefined, is no motion, and leaves its arguments as they are.
pub fn only_reads(name: &[u8]) -> bool {
    effect(name) == Some(&Effect::Reads)
}

/// Whether it is a function that computes and does no more: asked once, twice or never, nothing else is changed.
pub fn only_answers(name: &[u8]) -> bool {
    listed(name).is_some_and(|found| found.answers)
}

/// Whether it calls a procedure whose name is computed: `CallByVar Name, Number`.
pub fn calls_by_name(name: &[u8]) -> bool {
    name.eq_ignore_ascii_case(b"CallByVar")
}

/// Whether it goes back to the statements from an error handler, as RETRY does.
pub fn retries(name: &[u8]) -> bool {
    name.eq_ignore_ascii_case(b"StartMoveRetry")
}

/// Whether it waits: for something that another task may bring about, with data that tasks share, for an operator, who may
/// change them, or for a device.
pub fn waits(name: &[u8]) -> bool {
    listed(name).is_some_and(|found| found.waits)
}

/// Whether it tells what the gripper holds.
pub fn grips(name: &[u8]) -> bool {
    name.eq_ignore_ascii_case(b"GripLoad")
}

/// Whether it begins the next cycle at main with everything set as it is.
pub fn begins_cycle(name: &[u8]) -> bool {
    name.eq_ignore_ascii_case(b"ExitCycle")
}

/// Whether the robot stands somewhere else after it, as far as the text tells; `Some(Some(reason))` where it is a
/// motion of its own, left for that reason: it moves the robot without a target in the text, lets something else move it, or drops
/// or changes the path that is under way.
pub fn displaces(name: &[u8]) -> Option<Option<Reason>> {
    listed(name)?.displaces
}
