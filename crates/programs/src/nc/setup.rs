//! What an NC file does not hold: its control, the convention of A, B and C, work offsets, tools, and the joints in which the arm starts.
//!
//! A cell or robot file may state it, or comment lines of the program, which the control ignores:
//!
//! ```text
//! ; truegrind control linuxcnc
//! ; truegrind angles wpr
//! ; truegrind tool T1 tGrind [[0,0,150],[1,0,0,0]]
//! ; truegrind frame G54 wPart [[500,0,300],[1,0,0,0]]
//! ; truegrind start [0,10,-5,0,85,0]
//! ```

use std::collections::BTreeSet;

use super::called::program_of;
use super::dialect::{Dialect, SAMPLE, lines};
use super::orientation::Angles;
use crate::motion::{Frame, MAX_POSITION_MM, ToolValue};

pub use crate::label::{plain, same};

/// What is known from other sources than the program. It overrides comments of the program.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Setup {
    /// The control; a comment of the program states it, or it is detected, if omitted.
    pub dialect: Option<Dialect>,
    /// The convention of A, B and C.
    pub angles: Option<Angles>,
    /// Tools by name (`T1`).
    pub tools: Vec<(String, Frame)>,
    /// Work offsets by name (`G54`).
    pub frames: Vec<(String, Frame)>,
    /// Programs that others of the same run call, by [`called_programs`](super::called::called_programs): what holds at their start is
    /// the caller's.
    pub called: BTreeSet<String>,
}

impl Setup {
    /// Whether others call this file.
    pub(super) fn is_called(&self, file: &str) -> bool {
        !self.called.is_empty() && self.called.contains(&*String::from_utf8_lossy(&program_of(file)))
    }

    /// The tool frame of a name.
    pub fn tool(&self, name: &str) -> Option<Frame> {
        find(&self.tools, name)
    }

    /// The work offset of a name.
    pub fn frame(&self, name: &str) -> Option<Frame> {
        find(&self.frames, name)
    }
}

/// The last frame of a name. Names ignore case, T08 is T8, `G54.1 P1` is G54.1P1.
fn find(list: &[(String, Frame)], name: &str) -> Option<Frame> {
    let name = plain(name);
    list.iter().rev().find(|(other, _)| plain(other) == name).map(|(_, frame)| *frame)
}

/// A tool on the flange with a known frame and no mass.
pub(super) fn flange_tool(frame: Frame) -> ToolValue {
    ToolValue { robhold: true, frame, mass_kg: 0.0, centre_of_gravity_mm: [0.0; 3] }
}

/// A statement in a comment.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Statement {
    /// `control fanuc`
    Control(Dialect),
    /// `angles wpr`
    Angles(Angles),
    /// `tool T1 name [[…],[…]]`
    Tool(StatedFrame),
    /// `frame G54 name [[…],[…]]`
    Frame(StatedFrame),
    /// `start [q1,…,q6]` (°)
    Start([f64; 6]),
}

/// A tool or work offset that a comment states.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct StatedFrame {
    /// Its name in blocks: `T1`, `G54`.
    pub(super) number: String,
    /// Its name for people and cell files.
    pub(super) name: String,
    pub(super) frame: Frame,
}

/// The control of a file: the one that a comment states, else by its words and its name.
pub fn control_of(name: &str, source: &[u8]) -> Dialect {
    stated_control(source).unwrap_or_else(|| Dialect::of_named(name, source))
}

/// The control that a comment of a file states.
pub(super) fn stated_control(source: &[u8]) -> Option<Dialect> {
    lines(&source[..source.len().min(SAMPLE)]).find_map(|line| {
        let comment = line.iter().position(|byte| matches!(byte, b';' | b'('))?;
        match statement(&line[comment..]) {
            Ok(Some(Statement::Control(dialect))) => Some(dialect),
            _ => None,
        }
    })
}

/// Largest plausible joint angle (°).
pub const MAX_JOINT_DEG: f64 = 3600.0;

/// Whether joints at which an arm starts may be degrees. All within a turn in radians and with decimals they are radians: a start is stated
/// roughly, and for one in degrees so near to zero whole degrees do.
///
/// ```
/// use truegrind_programs::nc::setup::may_be_degrees;
///
/// assert!(may_be_degrees(&[0.0, 10.5, -5.0, 0.0, 85.0, 180.0]) && may_be_degrees(&[0.0, 0.0, 0.0, 0.0, 5.0, 0.0]));
/// assert!(!may_be_degrees(&[0.0, 0.17, -0.09, 0.0, 1.48, 3.14]));
/// ```
pub fn may_be_degrees(joints: &[f64; 6]) -> bool {
    let largest = joints.iter().map(|angle| angle.abs()).fold(0.0, f64::max);
    let looks_like_radians = largest > SMALL_DEG && largest <= std::f64::consts::TAU;
    let are_whole = joints.iter().all(|angle| angle.fract() == 0.0);
    joints.iter().all(|angle| angle.abs() <= MAX_JOINT_DEG) && (are_whole || !looks_like_radians)
}

/// Below this an angle in degrees or in radians is about zero.
const SMALL_DEG: f64 = 0.3;

/// Parses a comment as a statement of a frame, tool, convention or start; the error is what was expected.
pub(super) fn statement(comment: &[u8]) -> Result<Option<Statement>, String> {
    // Fast exit for nearly every comment.
    let text = comment.trim_ascii();
    let text = text.strip_prefix(b";").or_else(|| text.strip_prefix(b"(")).unwrap_or(text).trim_ascii();
    if text.len() < 12 || !text[..10].eq_ignore_ascii_case(b"truegrind ") {
        return Ok(None);
    }
    let text = String::from_utf8_lossy(text);
    let text = text.strip_suffix(')').unwrap_or(&text);
    // `frame G54.1 P1 name [[` has a name of two words.
    let (head, tail) = text.split_at(text.find("[[").unwrap_or(text.len()));
    let words: Vec<&str> = head.split_ascii_whitespace().skip(1).collect();
    let Some(what) = words.first().map(|what| what.to_ascii_lowercase()) else { return Ok(None) };
    if what == "angles" {
        let expected = || format!("`truegrind angles` with one of {}: what A, B and C mean", Angles::words());
        let [_, angles] = words[..] else { return Err(expected()) };
        return Angles::of(angles).map(|angles| Some(Statement::Angles(angles))).ok_or_else(expected);
    }
    if what == "control" {
        let known = || Dialect::WORDS.map(|(word, _)| word).join(", ");
        let expected =
            || format!("`truegrind control` with one of {}: the control that runs the program", known());
        let [_, word] = words[..] else { return Err(expected()) };
        return Dialect::stated(word).map(|dialect| Some(Statement::Control(dialect))).ok_or_else(expected);
    }
    if what == "start" {
        let (_, list) = text.split_at(text.find('[').unwrap_or(text.len()));
        return numbers(list).filter(may_be_degrees).map(|joints| Some(Statement::Start(joints))).ok_or_else(|| {
            "`truegrind start [q1,q2,q3,q4,q5,q6]`: the joints in which the arm starts, in degrees (multiply radians by 57.3; whole degrees do)"
                .to_owned()
        });
    }
    if !matches!(&*what, "tool" | "frame") {
        // A misspelt statement must not be ignored like any comment.
        let words = ["control", "angles", "tool", "frame", "start"];
        let misspelt = words.into_iter().find(|word| what.starts_with(&word[..3]));
        let known = "`truegrind control …`, `truegrind angles …`, `truegrind tool …`, `truegrind frame …` or `truegrind start …`";
        return misspelt.map_or(Ok(None), |_| Err(known.to_owned()));
    }
    let expected = || {
        let (number, name) = if what == "tool" { ("T1", "tGrind") } else { ("G54", "wPart") };
        format!(
            "`truegrind {what} {number} {name} [[x,y,z],[q1,q2,q3,q4]]`: number, name, place in mm, unit quaternion"
        )
    };
    let (number, name) = match words[1..] {
        [number, name] => (number.to_owned(), name),
        [first, second, name] => (format!("{first} {second}"), name),
        _ => return Err(expected()),
    };
    let stated = StatedFrame { number, name: name.to_owned(), frame: frame(tail).ok_or_else(expected)? };
    Ok(Some(if what == "tool" { Statement::Tool(stated) } else { Statement::Frame(stated) }))
}

/// `[[x,y,z],[q1,q2,q3,q4]]`
fn frame(text: &str) -> Option<Frame> {
    let [x, y, z, w, i, j, k] = numbers(text)?;
    let square = w * w + i * i + j * j + k * k;
    let near = [x, y, z].iter().all(|coordinate| coordinate.abs() <= MAX_POSITION_MM);
    (near && (square - 1.0).abs() < 1e-3)
        .then_some(Frame { position_mm: [x, y, z], quaternion: [w, i, j, k] })
}

/// As many finite numbers, in brackets and between commas.
fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let mut numbers = [0.0_f64; N];
    let mut found = 0;
    for part in text.split(['[', ']', ',', ' ']).filter(|part| !part.is_empty()) {
        *numbers.get_mut(found)? = part.parse().ok().filter(|number: &f64| number.is_finite())?;
        found += 1;
    }
    (found == N).then_some(numbers)
}
