//! What a control keeps from block to block, and the record of what it did.
//!
//! Places are kept in the coordinates of the program. Where those change (another work offset, a shift, a turn) the tip
//! stays where it is and its coordinates follow. What the text does not tell is `None` from then on.

use std::fmt::Write as _;

use nalgebra::{Point3, Translation3, UnitQuaternion};

use super::arc::{Arc, Circle, arc};
use super::setting::{Pose, Setting, by_vector};

/// How a block moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// Nothing has been said, or a cycle has ended.
    Unset,
    /// As fast as it goes.
    Rapid,
    /// Along a line.
    Line,
    /// Clockwise.
    Clockwise,
    /// Anticlockwise.
    Anticlockwise,
    /// On a path that is neither line nor arc; its word.
    Other(u16),
}

/// A value that a block says of an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Say {
    /// Where the axis shall stand.
    To(f64),
    /// How far it shall go.
    By(f64),
}

/// The words of a block that move.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Words {
    /// X, Y and Z; mm.
    pub place: [Option<Say>; 3],
    /// A, B and C; °.
    pub turn: [Option<Say>; 3],
    /// A tool vector.
    pub vector: [Option<f64>; 3],
    /// The turn about a tool vector; °.
    pub spin: Option<f64>,
    /// How the circle is said.
    pub circle: Option<Circle>,
}

impl Words {
    /// Whether any of them moves.
    pub fn moves(&self) -> bool {
        self.place.iter().chain(&self.turn).any(Option::is_some)
            || self.vector.iter().any(Option::is_some)
            || self.spin.is_some()
            || self.circle.is_some()
    }
}

/// How the tool is turned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Turn {
    /// By three angles (°).
    Angles([Option<f64>; 3]),
    /// By a vector and the turn about it (°).
    Vector([f64; 3], f64),
    /// Not known.
    Unknown,
}

/// One executed motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Move {
    /// The line of its block, from 0.
    pub line: usize,
    /// How it goes.
    pub mode: Mode,
    /// All that holds in it, but for where the coordinates of the program are.
    pub state: String,
    /// The coordinates of the program in the robot's base; `None` where they are bent or not known.
    pub chain: Option<Pose>,
    /// The same where what goes there is not the tip, but the centre of a cutter beside it or the axes themselves.
    pub origin: Option<Pose>,
    /// The tool on the flange.
    pub tool: Option<Pose>,
    /// Where it begins and ends, in the coordinates of the program.
    pub from: [Option<f64>; 3],
    /// See `from`.
    pub to: [Option<f64>; 3],
    /// How the tool is turned at its begin and end.
    pub turns: [Option<UnitQuaternion<f64>>; 2],
    /// The angles at its end, where they are told by angles.
    pub angles: [Option<f64>; 3],
    /// The words of its block.
    pub words: Words,
    /// Its arc, where it is one and known.
    pub arc: Option<Arc>,
}

impl Move {
    /// Where the tip goes, in the base.
    pub fn pose(&self) -> Option<Pose> {
        let [x, y, z] = self.to;
        let place = Translation3::new(x?, y?, z?);
        Some(self.chain? * Pose::from_parts(place, self.turns[1]?))
    }

    /// Where the tip is half way along an arc, in the base.
    pub fn mid(&self) -> Option<Pose> {
        let [x, y, z] = self.arc?.mid;
        let turn = self.turns[0]?.try_slerp(&self.turns[1]?, 0.5, 1e-9)?;
        Some(self.chain? * Pose::from_parts(Translation3::new(x?, y?, z?), turn))
    }
}

/// What a run leaves behind, in order.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// A motion.
    Move(Box<Move>),
    /// A path, cycle or return that is not followed: what the block says, and where it begins where that matters.
    Elsewhere(usize, String, Option<([Option<f64>; 3], Option<Pose>)>),
    /// A switch, a dwell, a tool, a message.
    Note(String),
}

/// What holds on from block to block in every control.
#[derive(Debug, Clone)]
pub struct Machine<'s> {
    /// What stands beside the program.
    pub setting: &'s Setting,
    /// What was done.
    pub trace: Vec<Event>,
    /// The line of the block that runs.
    pub line: usize,
    /// Where the tip is, in the coordinates of the program.
    pub at: [Option<f64>; 3],
    /// How the tool is turned.
    pub turn: Turn,
    /// The last turn about a tool vector (°).
    pub spin: f64,
    /// The coordinates of the program in the base.
    pub chain: Option<Pose>,
    /// The tool in use.
    pub tool: Option<String>,
    /// Whether X, Y and Z are the tip's.
    pub tip: bool,
    /// The last word of motion.
    pub mode: Mode,
    /// 17, 18 or 19.
    pub plane: u8,
    /// mm of a unit.
    pub unit: f64,
    /// Whether axes are told absolute.
    pub absolute: bool,
    /// The side of a radius compensation; 40, 41 or 42.
    pub side: u8,
    /// The feed as written.
    pub feed: String,
    /// What bends coordinates, by name.
    pub bent: Vec<&'static str>,
}

impl<'s> Machine<'s> {
    /// A control that has just been switched on.
    pub fn new(setting: &'s Setting) -> Machine<'s> {
        Machine {
            setting,
            trace: Vec::new(),
            line: 0,
            at: [None; 3],
            turn: Turn::Unknown,
            spin: 0.0,
            chain: None,
            tool: Some("T0".to_owned()),
            tip: false,
            mode: Mode::Unset,
            plane: 17,
            unit: 1.0,
            absolute: true,
            side: 40,
            feed: String::new(),
            bent: Vec::new(),
        }
    }

    /// Coordinates are counted from elsewhere; the tip stays where it is.
    pub fn recount(&mut self, chain: Option<Pose>) {
        let step = self.chain.zip(chain).map(|(old, new)| new.inverse() * old);
        self.chain = chain;
        let Some(step) = step else {
            self.lost();
            return;
        };
        if step.rotation.angle() < 1e-12 {
            for (at, by) in self.at.iter_mut().zip(step.translation.vector.iter()) {
                *at = at.map(|at| at + by);
            }
            return;
        }
        self.at = match self.at {
            [Some(x), Some(y), Some(z)] => {
                let moved = step * Point3::new(x, y, z);
                [Some(moved.x), Some(moved.y), Some(moved.z)]
            }
            _ => [None; 3],
        };
        self.turn = Turn::Unknown;
    }

    /// The zero of the coordinates moves along their own axes, by so much; `None` where that is not told. Nothing turns, so
    /// what is not told of one axis takes nothing from the others.
    pub fn move_zero(&mut self, by: [Option<f64>; 3], chain: Option<Pose>) {
        self.chain = chain;
        for (at, by) in self.at.iter_mut().zip(by) {
            *at = at.zip(by).map(|(at, by)| at - by);
        }
    }

    /// Where the tool stands is not known any more.
    pub fn lost(&mut self) {
        self.at = [None; 3];
        self.turn = Turn::Unknown;
    }

    /// Something that bends coordinates begins or ends.
    pub fn bend(&mut self, what: &'static str, on: bool) {
        let was = self.bent.contains(&what);
        self.bent.retain(|other| *other != what);
        if on {
            self.bent.push(what);
            self.bent.sort_unstable();
        }
        if on || was {
            self.lost();
        }
    }

    /// Notes what is no motion.
    pub fn note(&mut self, text: impl Into<String>) {
        self.trace.push(Event::Note(text.into()));
    }

    /// A motion that is not followed: it leaves the tip elsewhere, turned as it was. `begins` where it matters where it
    /// starts.
    pub fn elsewhere(&mut self, text: impl Into<String>, begins: bool) {
        self.some_elsewhere(text, begins, [true; 3]);
    }

    /// A motion that is not followed, of some of the axes.
    pub fn some_elsewhere(&mut self, text: impl Into<String>, begins: bool, named: [bool; 3]) {
        let start = begins.then_some((self.at, self.chain));
        self.trace.push(Event::Elsewhere(self.line, text.into(), start));
        for (at, named) in self.at.iter_mut().zip(named) {
            *at = at.filter(|_| !named);
        }
    }

    /// X, Y and Z become the tip's, or are no more; the axes that turn the tool stay.
    pub fn follow_tip(&mut self, on: bool) {
        if self.tip != on {
            self.at = [None; 3];
        }
        self.tip = on;
    }

    /// Another length counts: the axes stay where they are, and those that turn the tool keep their values. Of tools that are
    /// turned against each other the text does not tell whether angles keep their values or the flange stays.
    pub fn measure(&mut self, tool: Option<String>) {
        if self.tool != tool {
            self.at = [None; 3];
            let turn = |tool: &Option<String>| {
                tool.as_ref()
                    .and_then(|name| self.setting.tool(name))
                    .map_or_else(UnitQuaternion::identity, |t| t.rotation)
            };
            if turn(&self.tool).angle_to(&turn(&tool)) > 1e-9 {
                self.turn = Turn::Unknown;
            }
        }
        self.tool = tool;
    }

    /// A motion of lines and arcs.
    pub fn go(&mut self, words: Words) {
        let (from, before) = (self.at, self.rotation());
        for (axis, say) in words.place.iter().enumerate() {
            self.at[axis] = said(self.at[axis], *say);
        }
        self.turn_to(&words);
        let arc = match (self.mode, words.circle) {
            (Mode::Clockwise | Mode::Anticlockwise, Some(circle)) => {
                arc(from, self.at, circle, self.mode == Mode::Anticlockwise, self.plane)
            }
            _ => None,
        };
        let follows = self.tip && self.bent.is_empty() && self.side == 40;
        let done = Move {
            line: self.line,
            mode: self.mode,
            state: self.state(),
            chain: self.chain.filter(|_| follows),
            origin: self.chain.filter(|_| self.bent.is_empty()),
            tool: self.tool.as_ref().and_then(|name| self.setting.tool(name)),
            from,
            to: self.at,
            turns: [before, self.rotation()],
            angles: if let Turn::Angles(angles) = self.turn { angles } else { [None; 3] },
            words,
            arc,
        };
        self.trace.push(Event::Move(Box::new(done)));
    }

    /// How the words of a block turn the tool.
    pub fn turn_to(&mut self, words: &Words) {
        if words.turn.iter().any(Option::is_some) {
            let mut angles = if let Turn::Angles(angles) = self.turn { angles } else { [None; 3] };
            for (angle, say) in angles.iter_mut().zip(words.turn) {
                *angle = said(*angle, say);
            }
            self.turn = Turn::Angles(angles);
        } else if words.vector.iter().any(Option::is_some) {
            self.spin = words.spin.unwrap_or(self.spin);
            self.turn = Turn::Vector(words.vector.map(|part| part.unwrap_or(0.0)), self.spin);
        } else if let Some(new) = words.spin {
            // It holds on, whether a vector is in force or not.
            self.spin = new;
            if let Turn::Vector(_, spin) = &mut self.turn {
                *spin = new;
            }
        }
    }

    /// How the tool is turned, where it is known.
    pub fn rotation(&self) -> Option<UnitQuaternion<f64>> {
        match self.turn {
            Turn::Angles([a, b, c]) => Some(self.setting.angles.turned([a?, b?, c?])),
            Turn::Vector(vector, spin) => by_vector(vector, spin),
            Turn::Unknown => None,
        }
    }

    fn state(&self) -> String {
        let mut text = String::new();
        let tool = self.tool.as_deref().unwrap_or("?");
        let _ = write!(
            text,
            "{tool} tip{} G{} side{} F{} {:?}",
            self.tip, self.plane, self.side, self.feed, self.bent
        );
        text
    }
}

fn said(before: Option<f64>, say: Option<Say>) -> Option<f64> {
    match say {
        None => before,
        Some(Say::To(value)) => Some(value),
        Some(Say::By(value)) => before.map(|before| before + value),
    }
}
