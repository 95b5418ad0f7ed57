//! Side effects of the predefined instructions and functions other than motions; `predefined.txt` lists them with the source.
//!
//! Anything else that no file declares may write its arguments and all visible data.

use std::sync::LazyLock;

use super::token::fold;
use crate::motion::Reason;

/// A predefined instruction or function.
#[derive(Debug, PartialEq, Eq)]
pub struct Predefined {
    /// In lower case.
    pub name: &'static str,
    /// Its effect on its arguments.
    pub effect: Effect,
    /// Whether it is pure: it only computes.
    pub answers: bool,
    /// Whether it waits, for another task, an operator or a device.
    pub waits: bool,
    /// Whether it moves the robot, and the reason to refuse it where it is a motion itself.
    pub displaces: Option<Option<Reason>>,
}

/// Effect of a predefined instruction or function on its arguments.
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
    /// Whether it keeps a reference and writes at any later time: sensors, cyclic conditions.
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

/// Effect of the predefined instruction or function of this name, in any case; `None` where there is none.
pub fn effect(name: &[u8]) -> Option<&'static Effect> {
    listed(name).map(|found| &found.effect)
}

/// Whether it is a pure function: it may be evaluated any number of times.
pub fn is_pure(name: &[u8]) -> bool {
    listed(name).is_some_and(|found| found.answers)
}

/// Whether it calls a procedure whose name is computed: `CallByVar Name, Number`.
pub fn calls_by_name(name: &[u8]) -> bool {
    name.eq_ignore_ascii_case(b"CallByVar")
}

/// Whether it resumes from an error handler, as RETRY does.
pub fn retries(name: &[u8]) -> bool {
    name.eq_ignore_ascii_case(b"StartMoveRetry")
}

/// Whether it puts the current path aside or brings it back: unless something moves in between, the robot stays where it is on it.
pub fn keeps_path(name: &[u8]) -> bool {
    [&b"StorePath"[..], b"RestoPath"].iter().any(|known| name.eq_ignore_ascii_case(known))
}

/// Whether it waits for another task, an operator or a device: shared data may change meanwhile.
pub fn waits(name: &[u8]) -> bool {
    listed(name).is_some_and(|found| found.waits)
}

/// Whether it states the gripped load.
pub fn grips(name: &[u8]) -> bool {
    name.eq_ignore_ascii_case(b"GripLoad")
}

/// Whether it restarts main without resetting anything (ExitCycle).
pub fn begins_cycle(name: &[u8]) -> bool {
    name.eq_ignore_ascii_case(b"ExitCycle")
}

/// Whether it may change the position of the robot; `Some(Some(reason))` where it is a motion itself, refused for that reason: it
/// moves the robot without a target in the text, lets something else move it, or drops or changes the current path.
pub fn displaces(name: &[u8]) -> Option<Option<Reason>> {
    listed(name)?.displaces
}
