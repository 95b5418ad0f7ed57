//! From a file to the listing: every block that moves, with what holds in it.
//!
//! Blocks are followed in the order of the text. Where they can be reached from elsewhere (labels, loops, the begin of a
//! subprogram), what went before holds no more, but for groups that the whole file sets to one thing only. A block that
//! may be skipped leaves known only what it does not change.

mod codes;
mod flow;
mod frames;
mod heidenhain;
mod motion;
mod names;
mod survey;

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc as Shared;

use super::arc::Arc;
use super::dialect::Dialect;
use super::expression::{Reader, Variable, Worth, literal, numbered};
use super::machine::{Group, State, Turn};
use super::mark;
use super::orientation::Angles;
use super::parser::{parse, word};
use super::setup::{Setup, Statement, statement};
use super::syntax::{Belongs, NcTree, Syntax, Word};
use super::token::Token;
use crate::program::motion::{Frame, Listing, OpaqueRegion, Place, Reason};

/// NC files, read together: each runs on its own, the setup holds for all.
#[derive(Debug)]
pub struct Task<'s> {
    /// The names of the files, as given.
    pub names: Vec<String>,
    /// The files, as trees.
    pub trees: Vec<NcTree<'s>>,
    /// Their dialects.
    pub dialects: Vec<Dialect>,
    /// What A, B and C mean in each.
    pub angles: Vec<Option<Angles>>,
    /// What they tell the machine to do.
    pub listing: Listing,
    /// What happens to the position, in the order of files and lines.
    pub(super) events: Vec<Event>,
    /// How each motion is written; by motion.
    pub(super) written: Vec<Written>,
}

/// What a rewrite must know of the order of blocks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Event {
    /// A motion of the listing.
    Motion(u32),
    /// These axes are not known from here on: bits 0 to 2 X Y Z, 3 to 5 A B C.
    Lost(u8),
    /// Position and orientation are not known from here on.
    Unknown,
    /// The place where the tool stands gets these values (G92).
    Shift([Option<f64>; 3]),
    /// The shift ends.
    NoShift,
}

/// How a motion is written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Written {
    /// Its block.
    pub(super) node: u32,
    pub(super) absolute: bool,
    pub(super) unit_mm: f64,
    /// Where it starts (mm, shifts included), as far as known.
    pub(super) start: [Option<f64>; 3],
    /// A, B, C (or A2, B2, C2) before it.
    pub(super) start_angles: [Option<f64>; 3],
    /// The same after it.
    pub(super) angles: [Option<f64>; 3],
    /// The tool vector and the turn about it before it.
    pub(super) start_vector: Option<([f64; 3], f64)>,
    /// The same after it.
    pub(super) vector: Option<([f64; 3], f64)>,
    pub(super) shift: [Option<f64>; 3],
    pub(super) turn: Turn,
    pub(super) vector_words: bool,
    /// The arc, with whether it turns positively and whether its centre is absolute.
    pub(super) arc: Option<(Arc, bool, bool)>,
    /// Whether a block may stand before it.
    pub(super) insertable: bool,
}

impl<'s> Task<'s> {
    /// Reads files, given by name and bytes. Never fails: what cannot be read is listed.
    pub fn read(files: &[(&str, &'s [u8])], setup: &Setup) -> Task<'s> {
        let dialects: Vec<Dialect> =
            files.iter().map(|(_, bytes)| setup.dialect.unwrap_or_else(|| Dialect::of(bytes))).collect();
        let trees: Vec<_> = files.iter().zip(&dialects).map(|((_, bytes), &d)| parse(bytes, d)).collect();
        let mut task = Task {
            names: files.iter().map(|(name, _)| (*name).to_owned()).collect(),
            trees,
            dialects,
            angles: Vec::new(),
            listing: Listing::default(),
            events: Vec::new(),
            written: Vec::new(),
        };
        for file in 0..files.len() {
            let mut lister = Lister::new(&task.trees[file], file as u32, task.dialects[file], setup);
            lister.listing = std::mem::take(&mut task.listing);
            lister.events = std::mem::take(&mut task.events);
            lister.written = std::mem::take(&mut task.written);
            lister.file();
            task.angles.push(lister.angles);
            let Lister { listing, events, written, .. } = lister;
            (task.listing, task.events, task.written) = (listing, events, written);
        }
        task
    }
}

pub(super) struct Lister<'t, 's> {
    tree: &'t NcTree<'s>,
    file: u32,
    dialect: Dialect,
    setup: &'t Setup,
    angles: Option<Angles>,
    tools: Vec<(String, Frame)>,
    frames: Vec<(String, Frame)>,
    state: State,
    /// Groups that the file sets to more than one thing.
    several: u32,
    /// Groups that the file sets to exactly one thing.
    once: u32,
    /// Groups that have been set so far.
    seen: u32,
    /// Whether synchronised actions may set variables.
    actions: bool,
    /// What held before the subprogram that is being passed.
    passed: Option<(State, u32)>,
    /// Whether tools come in with M6.
    changes_tools: bool,
    next_tool: Option<String>,
    /// Work offsets and tools that the program has set, by name; `None` where the text does not tell to what.
    set_frames: Vec<(String, Option<Frame>)>,
    set_tools: Vec<(String, Option<Frame>)>,
    /// Whether it has set some that the text does not name.
    sets_frames: bool,
    sets_tools: bool,
    /// Blocks that jumps go to.
    targets: BTreeSet<u64>,
    /// Whether a jump goes to a computed block.
    anywhere: bool,
    listing: Listing,
    events: Vec<Event>,
    written: Vec<Written>,
    instructions: BTreeMap<String, Shared<str>>,
    speeds: BTreeMap<u64, u32>,
    tool_index: HashMap<String, u32>,
    frame_index: Option<(String, Option<crate::math::se3::Pose>, u32)>,
}

/// What a block says, word by word.
#[derive(Default)]
struct Said<'s> {
    node: u32,
    words: Vec<Word<'s>>,
    axes: [Option<usize>; 3],
    abc: [Option<usize>; 3],
    rpy: [Option<usize>; 3],
    vector: [Option<usize>; 3],
    centre: [Option<usize>; 3],
    spin: Option<usize>,
    radius: Option<usize>,
    g: Vec<u32>,
    m: Vec<u32>,
    p: Option<usize>,
    l: Option<usize>,
    q: Option<usize>,
    feed: Option<usize>,
    opaque: bool,
    skippable: bool,
    /// G53, SUPA, M91.
    machine: bool,
    /// FMAX.
    rapid: bool,
    turns: bool,
    /// Corners that are rounded or cut: `,R5`, `,C2`, RND=, CHF=, CHR=.
    corner: bool,
    /// Why it does not go, or not only, where its axis words say.
    odd: Option<Reason>,
    /// Whether it moves other axes: U, V, W.
    others: bool,
}

impl Said<'_> {
    fn moves(&self) -> bool {
        let any = |list: &[Option<usize>]| list.iter().any(Option::is_some);
        any(&self.axes) || any(&self.abc) || any(&self.rpy) || any(&self.vector) || self.spin.is_some()
    }
}

impl<'t, 's> Lister<'t, 's> {
    fn new(tree: &'t NcTree<'s>, file: u32, dialect: Dialect, setup: &'t Setup) -> Self {
        let state = State::start(if dialect == Dialect::Siemens { "G500" } else { "G54" }, "T0");
        Lister {
            tree,
            file,
            dialect,
            setup,
            angles: setup.angles,
            tools: Vec::new(),
            frames: Vec::new(),
            state,
            several: 0,
            once: 0,
            seen: 0,
            actions: false,
            passed: None,
            changes_tools: false,
            next_tool: None,
            set_frames: Vec::new(),
            set_tools: Vec::new(),
            sets_frames: false,
            sets_tools: false,
            targets: BTreeSet::new(),
            anywhere: false,
            listing: Listing::default(),
            events: Vec::new(),
            written: Vec::new(),
            instructions: BTreeMap::new(),
            speeds: BTreeMap::new(),
            tool_index: HashMap::new(),
            frame_index: None,
        }
    }

    fn place(&self, token: u32) -> Place {
        let (line, column) = self.tree.line_column(self.tree.start(token));
        Place { file: self.file, line, column }
    }

    fn file(&mut self) {
        self.events.push(Event::Unknown);
        self.listing.marks.push(mark::find(self.tree));
        for opaque in &self.tree.opaque {
            self.listing.opaque.push(OpaqueRegion {
                place: self.place(opaque.at.min(self.tree.len() as u32)),
                span: self.tree.span(opaque.first, opaque.end),
                reason: opaque.reason,
            });
        }
        self.comments();
        self.survey();
        let mut said = Said::default();
        let blocks: Vec<u32> = self.tree.child_nodes(0).collect();
        for block in blocks {
            self.block(block, &mut said);
        }
    }

    /// Frames, tools and conventions that comments state.
    fn comments(&mut self) {
        for token in 0..self.tree.len() as u32 {
            if self.tree.kind(token) != Some(Token::Comment) {
                continue;
            }
            match statement(self.tree.text(token)) {
                Some(Statement::Angles(angles)) => self.angles = self.setup.angles.or(Some(angles)),
                Some(Statement::Tool(name, frame)) => self.tools.push((name, frame)),
                Some(Statement::Frame(name, frame)) => self.frames.push((name, frame)),
                None => {}
            }
        }
    }

    // ---- blocks ----

    fn block(&mut self, node: u32, said: &mut Said<'s>) {
        self.gather(node, said);
        if !said.skippable {
            self.run(said);
            return;
        }
        let before = self.state.clone();
        self.run(said);
        let after = std::mem::replace(&mut self.state, before);
        self.state = after.joined(&self.state);
    }

    fn gather(&mut self, node: u32, said: &mut Said<'s>) {
        let mut words = std::mem::take(&mut said.words);
        let (mut g, mut m) = (std::mem::take(&mut said.g), std::mem::take(&mut said.m));
        words.clear();
        g.clear();
        m.clear();
        *said = Said { node, words, g, m, ..Said::default() };
        let kind = self.tree.nodes[node as usize].kind;
        said.skippable = kind == Syntax::Skippable;
        said.opaque = kind == Syntax::Opaque;
        for child in self.tree.child_nodes(node) {
            if self.tree.nodes[child as usize].kind == Syntax::Opaque {
                said.opaque = true;
                continue;
            }
            let found = word(self.tree, child);
            said.words.push(found);
        }
        for index in 0..said.words.len() {
            let word = said.words[index];
            let at = Some(index);
            match word.address() {
                Some(b'G') => match self.literal(&word) {
                    Some(number) => said.g.push(code(number)),
                    None => said.opaque = true,
                },
                Some(b'M') => match self.literal(&word) {
                    Some(number) => said.m.push(number.round() as u32),
                    None if self.dialect == Dialect::Siemens => {}
                    None => said.opaque = true,
                },
                Some(b'X') => said.axes[0] = at,
                Some(b'Y') => said.axes[1] = at,
                Some(b'Z') => said.axes[2] = at,
                Some(b'C') if self.dialect == Dialect::Heidenhain && word.belongs == Belongs::Nothing => {}
                Some(b'C') if index > 0 && said.words[index - 1].name == b"," => said.corner = true,
                // The angle of the line.
                Some(b'A') if index > 0 && said.words[index - 1].name == b"," => {
                    said.odd = Some(Reason::NotFollowed);
                }
                Some(letter @ (b'A' | b'B' | b'C')) => said.abc[usize::from(letter - b'A')] = at,
                Some(letter @ (b'I' | b'J' | b'K')) => said.centre[usize::from(letter - b'I')] = at,
                Some(b'R') if self.dialect == Dialect::Heidenhain => match word.belongs {
                    Belongs::Literal { sign: None, .. } => self.state.radius = false,
                    _ => said.radius = at,
                },
                Some(b'R') if index > 0 && said.words[index - 1].name == b"," => said.corner = true,
                Some(b'R') => said.radius = at,
                Some(b'F') => said.feed = at,
                Some(b'P') => said.p = at,
                Some(b'L') => said.l = at,
                Some(b'Q') => said.q = at,
                Some(b'U'..=b'W') => said.others = true,
                Some(_) => {}
                None => self.gather_name(said, index),
            }
        }
        // X1.2.3, and blanks within a number.
        let stray = |word: &Word<'_>| word.name.first().is_some_and(|b| b.is_ascii_digit() || *b == b'.');
        let heidenhain = self.dialect == Dialect::Heidenhain;
        said.opaque |= !heidenhain && said.moves() && said.words.iter().any(stray);
        // M118 X1: what follows is no way to go.
        let limits = said.words.iter().position(|word| {
            heidenhain
                && word.address() == Some(b'M')
                && matches!(self.literal(word), Some(94.0 | 114.0 | 116.0 | 118.0 | 138.0))
        });
        if let Some(limits) = limits {
            let words = said.axes.iter().chain(&said.abc).flatten();
            said.opaque |= words.copied().any(|at| at > limits);
        }
    }

    fn gather_name(&mut self, said: &mut Said<'s>, index: usize) {
        let word = said.words[index];
        let at = Some(index);
        let name = word.name.to_ascii_uppercase();
        match (self.dialect, &*name) {
            (Dialect::Siemens, [letter @ b'A'..=b'C', b'3']) => said.vector[usize::from(letter - b'A')] = at,
            (Dialect::Siemens, [letter @ b'A'..=b'C', b'2']) => said.rpy[usize::from(letter - b'A')] = at,
            (Dialect::Siemens, b"THETA") => said.spin = at,
            (Dialect::Siemens, b"CR") => said.radius = at,
            (Dialect::Siemens, b"TURN" | b"AR" | b"I1" | b"J1" | b"K1") => said.turns = true,
            (Dialect::Siemens, b"RND" | b"RNDM" | b"CHF" | b"CHR") => said.corner = true,
            (Dialect::Siemens, b"SUPA" | b"G153") => said.machine = true,
            (Dialect::Siemens, b"AP" | b"RP") => said.odd = Some(Reason::Transformed),
            (Dialect::Siemens, b"ANG" | b"PO" | b"POS" | b"POSA" | b"POSP") => {
                said.odd = Some(Reason::NotFollowed);
            }
            (Dialect::Siemens, b"MEAS" | b"MEAW" | b"MEASA" | b"MEAWA" | b"MEAC") => {
                said.odd = Some(Reason::Probe);
            }
            // Surface normals, cones, angles to the path.
            (Dialect::Siemens, [b'A'..=b'C', b'4'..=b'7'] | b"LEAD" | b"TILT" | b"NUT" | b"PHI" | b"PSI")
                if word.assigned =>
            {
                said.odd = Some(Reason::OrientationUnknown);
            }
            // An axis of the machine.
            (Dialect::Siemens, [b'X'..=b'Z' | b'A'..=b'C', b'1']) if word.assigned => {
                said.odd = Some(Reason::MachineCoordinates);
            }
            (Dialect::Siemens | Dialect::Heidenhain, _) => {
                self.gather_heidenhain(said, index, &name);
            }
            // XY5: two axes and one number.
            (_, name) => said.opaque |= name.iter().all(|byte| b"XYZABCUVW".contains(byte)),
        }
    }

    fn gather_heidenhain(&mut self, said: &mut Said<'s>, index: usize, name: &[u8]) {
        let at = Some(index);
        match (self.dialect, name) {
            (Dialect::Heidenhain, [b'I', letter @ b'X'..=b'Z']) => said.axes[usize::from(letter - b'X')] = at,
            (Dialect::Heidenhain, [b'I', letter @ b'A'..=b'C']) => said.abc[usize::from(letter - b'A')] = at,
            (Dialect::Heidenhain, [b'T', letter @ b'X'..=b'Z']) => {
                said.vector[usize::from(letter - b'X')] = at
            }
            (Dialect::Heidenhain, b"FMAX") => said.rapid = true,
            (Dialect::Heidenhain, b"RL" | b"RR") => self.state.radius = true,
            _ => {}
        }
    }

    /// The number of a word that is a plain literal.
    fn literal(&self, word: &Word<'_>) -> Option<f64> {
        match word.belongs {
            Belongs::Literal { sign, number } => {
                let value = literal(self.tree.text(number))?;
                let minus = sign.is_some_and(|sign| self.tree.kind(sign) == Some(Token::Minus));
                Some(if minus { -value } else { value })
            }
            _ => None,
        }
    }

    /// What a word is worth, and whether it says that it is an increment (IC, IX) or not (AC).
    fn worth(&self, word: &Word<'_>) -> (Worth, Option<bool>) {
        let increment =
            (self.dialect == Dialect::Heidenhain && word.name.len() == 2 && word.name[0] | 32 == b'i')
                .then_some(true);
        match word.belongs {
            Belongs::Nothing | Belongs::Arguments { .. } => (Err(Reason::MissingArgument), increment),
            Belongs::Literal { number, .. } => {
                let value = self.literal(word).ok_or(Reason::WrongShape);
                // Fanuc counts increments or mm where no point is written, by a parameter of the control.
                let counted = self.dialect == Dialect::Fanuc
                    && !self.tree.text(number).contains(&b'.')
                    && value != Ok(0.0);
                (if counted { Err(Reason::AmbiguousNumber) } else { value }, increment)
            }
            Belongs::Expression { first, end } => {
                let mut range = (first, end);
                let mut said = increment;
                if self.dialect == Dialect::Siemens && self.tree.kind(first) == Some(Token::Name) {
                    match &*self.tree.text(first).to_ascii_uppercase() {
                        b"IC" => (range.0, said) = (first + 1, Some(true)),
                        b"AC" | b"DC" | b"ACP" | b"ACN" => (range.0, said) = (first + 1, Some(false)),
                        _ => {}
                    }
                }
                (self.evaluated(range), said)
            }
        }
    }

    fn evaluated(&self, range: (u32, u32)) -> Worth {
        let variables = |name: &Variable| -> Worth {
            self.state.variables.get(name).copied().unwrap_or(Err(Reason::Variable))
        };
        let mut reader = Reader::new(self.tree, self.dialect, range, &variables);
        match reader.expression() {
            Ok(value) if reader.at >= range.1 => value,
            _ => Err(Reason::WrongShape),
        }
    }

    fn forget(&mut self) {
        // A group that the file sets to one thing only keeps that once it has been set, and one that it never sets
        // keeps what the control starts with.
        let constant = !self.several & (self.seen | !self.once);
        self.state.forget(constant);
        self.events.push(Event::Unknown);
    }

    fn set(&mut self, group: Group) {
        self.seen |= 1 << group as u32;
        self.state.certain(group);
    }

    /// What a block does.
    fn run(&mut self, said: &Said<'s>) {
        if self.is_reached_by_jumps(said) {
            self.forget();
        }
        if self.dialect == Dialect::Heidenhain && self.heidenhain(said) {
            return;
        }
        if self.is_action(said) {
            // What it sets, it sets at any time from here on.
            self.actions = true;
            self.state.variables.values_mut().for_each(|value| *value = Err(Reason::Variable));
            self.forget();
            return;
        }
        // LinuxCNC gives variables their values after the words of the block have been read.
        let later = if self.dialect == Dialect::LinuxCnc {
            self.assigned(said)
        } else {
            self.assignments(said);
            Vec::new()
        };
        self.words(said);
        for (name, value) in later {
            self.assign(name, value);
        }
    }

    /// What the words of a block do.
    fn words(&mut self, said: &Said<'s>) {
        if self.control_flow(said) {
            return;
        }
        for &m in &said.m {
            match m {
                128 if self.dialect == Dialect::Heidenhain => self.tip(true, false),
                129 if self.dialect == Dialect::Heidenhain => self.tip(false, false),
                89 if self.dialect == Dialect::Heidenhain => self.state.calls = Some(Reason::Cycle),
                // What was stored by M70 holds again.
                72 | 73 if self.dialect == Dialect::LinuxCnc => {
                    self.forget();
                    self.state.uncertain = u32::MAX;
                }
                _ => {}
            }
        }
        let machine = said.machine
            || said.g.contains(&530)
            || self.dialect == Dialect::Siemens && said.g.contains(&1530)
            || self.dialect == Dialect::Heidenhain && said.m.iter().any(|m| matches!(m, 91 | 92));
        self.tools_of(said);
        if self.unknown_code(said)
            || self.named_commands(said)
            || self.modal_codes(said)
            || self.unmodal_codes(said)
        {
            self.ends(said);
            return;
        }
        if let Some(index) = said.feed {
            let feed = self.worth(&said.words[index]).0;
            // A feed has no decimals on any control.
            let feed = self.literal(&said.words[index]).ok_or(Reason::Variable).or(feed);
            self.state.feed = feed.map(|feed| feed * self.state.unit_mm / 60.0);
        }
        let limits = self.dialect == Dialect::Heidenhain
            && said.words.first().is_some_and(|word| word.address() == Some(b'M'));
        // M118 X1 Y1 alone goes nowhere.
        if !limits {
            self.motion(said, machine);
        }
        self.ends(said);
    }

    /// M2, M17, M30, M99: what comes after belongs to another program. M6 goes to change the tool.
    fn ends(&mut self, said: &Said<'s>) {
        let cycle = self.dialect == Dialect::Heidenhain && said.m.contains(&99);
        if cycle {
            self.state.calls = None;
            self.state.lose_position();
            self.events.push(Event::Lost(POSITION));
        } else if said.m.iter().any(|m| matches!(m, 2 | 17 | 30 | 99))
            || said.words.iter().any(|word| word.is("RET"))
        {
            self.forget();
        } else if said.m.contains(&6) {
            self.state.lose_position();
            self.events.push(Event::Lost(POSITION));
        }
    }

    /// Tools: T, with M6 where the file changes them so.
    fn tools_of(&mut self, said: &Said<'s>) {
        for word in &said.words {
            if word.address() != Some(b'T') {
                continue;
            }
            let name = match (self.literal(word), word.belongs) {
                (Some(number), _) => format!("T{}", number.round()),
                (None, Belongs::Expression { first, .. }) if self.tree.kind(first) == Some(Token::String) => {
                    let text = self.tree.text(first);
                    String::from_utf8_lossy(text).trim_matches(['"', '\'']).to_owned()
                }
                _ => "T?".to_owned(),
            };
            self.next_tool = Some(name);
        }
        if (said.m.contains(&6) || !self.changes_tools)
            && let Some(name) = self.next_tool.take()
        {
            self.state.tool = name;
            self.set(Group::Tool);
        }
        if self.dialect != Dialect::Siemens {
            return;
        }
        // The edge of the tool, and offsets of its length.
        for word in &said.words {
            let base = codes::base(&self.state.tool).to_owned();
            if word.address() == Some(b'D') {
                self.state.tool = match self.literal(word) {
                    Some(1.0) => base,
                    Some(number) => format!("{base} +D{}", number.round()),
                    None => format!("{base} +D?"),
                };
                self.set(Group::Tool);
            } else if word.is("TOFFL") || word.is("TOFF") {
                self.state.tool = format!("{base} +TOFF");
                self.set(Group::Tool);
            }
        }
    }
}

/// All of X, Y and Z, for [`Event::Lost`].
const POSITION: u8 = 7;

/// A G number in tenths: 540 for G54, 434 for G43.4.
fn code(number: f64) -> u32 {
    (number * 10.0).round().clamp(0.0, 1e6) as u32
}
