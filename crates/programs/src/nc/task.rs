//! From a file to the listing: every block that moves, with what holds in it.
//!
//! Blocks are followed in the order of the text. Where they can be reached from elsewhere (labels, loops, the begin of a
//! subprogram), what went before holds no more, but for groups that the whole file sets to one thing only. A block that
//! may be skipped leaves known only what it does not change.

mod modal_codes;
mod siemens_commands;
mod invalidation;
mod control_flow;
mod file_effects;
mod frames;
mod heidenhain;
mod g_codes;
mod m_words;
mod motion;
mod siemens_names;
mod one_shot;
mod block;
mod shift;
mod prescan;
mod tools;
mod words;
mod block_context;

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::sync::Arc as Shared;

use super::dialect::Dialect;
use super::expression::{LARGEST, Variable, literal};
use super::mark;
use super::modal_state::{ModalGroup, ModalState, MotionMode, WordSemantics};
use super::orientation::Angles;
use super::parser::parse;
use super::setup::{self, Setup, Stated, Statement, held, statement};
use super::syntax::{NcTree, Word, WordValue};
use super::token::Token;
use crate::motion::{
    Frame, Listing, Misstated, Motion, MotionKind, OpaqueReason, OpaqueRegion, Place, Reason, Tool,
};
use block::Block;
pub(super) use block_context::{BlockArc, BlockContext, StartDependency, StateEvent};
use file_effects::FileEffects;

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
    pub(super) events: Vec<StateEvent>,
    /// How each motion is written; by motion.
    pub(super) contexts: Vec<BlockContext>,
}

impl Task<'_> {
    /// What the way of a motion hangs on, where it stays or does not.
    pub(super) fn start_dependency(&self, motion: usize, stays: bool) -> StartDependency {
        let own = self.contexts[motion].start_dependency;
        match self.listing.motions[motion].kind {
            _ if !stays => StartDependency::Independent,
            MotionKind::Circular => own.max(StartDependency::Position),
            _ => own,
        }
    }
}

impl<'s> Task<'s> {
    /// Reads files, given by name and bytes. Never fails: what cannot be read is listed.
    pub fn read(files: &[(&str, &'s [u8])], setup: &Setup) -> Task<'s> {
        let dialects: Vec<Dialect> = files
            .iter()
            .map(|(name, bytes)| setup.dialect.unwrap_or_else(|| Dialect::of_named(name, bytes)))
            .collect();
        let trees: Vec<_> = files.iter().zip(&dialects).map(|((_, bytes), &d)| parse(bytes, d)).collect();
        let mut task = Task {
            names: files.iter().map(|(name, _)| (*name).to_owned()).collect(),
            trees,
            dialects,
            angles: Vec::new(),
            listing: Listing { numbered: true, ..Listing::default() },
            events: Vec::new(),
            contexts: Vec::new(),
        };
        for file in 0..files.len() {
            let mut interpreter =
                Interpreter::new(&task.trees[file], file as u32, task.dialects[file], setup);
            // Siemens: a subprogram by the ending of its name.
            interpreter.is_subprogram = task.names[file].to_ascii_lowercase().ends_with(".spf");
            interpreter.listing = std::mem::take(&mut task.listing);
            interpreter.events = std::mem::take(&mut task.events);
            interpreter.contexts = std::mem::take(&mut task.contexts);
            interpreter.file();
            task.angles.push(interpreter.angles);
            let open = interpreter.listing.misstated.iter_mut().filter(|comment| comment.file.is_empty());
            open.for_each(|comment| comment.file.clone_from(&task.names[file]));
            let Interpreter { listing, events, contexts, .. } = interpreter;
            (task.listing, task.events, task.contexts) = (listing, events, contexts);
        }
        task.leave_pinned_ends();
        task
    }
}

pub(super) struct Interpreter<'t, 's> {
    tree: &'t NcTree<'s>,
    file: u32,
    dialect: Dialect,
    setup: &'t Setup,
    angles: Option<Angles>,
    /// Tools and work offsets as setup and comments state them, by name.
    tools: HashMap<String, Frame>,
    frames: HashMap<String, Frame>,
    /// Variables that the file sets before here.
    assigned_variables: HashSet<Variable>,
    state: ModalState,
    /// What the file sets; found while it is followed.
    effects: FileEffects,
    /// What the whole file sets, where it has been followed before.
    file_effects: Option<FileEffects>,
    /// Groups that are set before the way can first part.
    set_before_branch: u32,
    /// Whether the way has parted: jumps, calls, labels.
    branched: bool,
    /// Whether the block that is being followed may be skipped.
    in_skippable_block: bool,
    /// Whether the program has ended (M30): what comes next belongs to another.
    program_ended: bool,
    /// Whether synchronised actions may set variables.
    synchronised_actions: bool,
    /// What numbers and words meant before the block that is being followed.
    meaning: WordSemantics,
    /// What held before the subprogram that is being state_before_subprogram.
    state_before_subprogram: Option<ModalState>,
    /// Whether tools come in with M6.
    tool_change_by_m6: bool,
    /// Whether a cycle that is called may be a program (cycle 12 of Heidenhain).
    cycle_is_program: bool,
    /// Whether a block has words of NC and no others.
    has_nc_blocks: bool,
    /// Whether the program begins again at its end.
    restarts_at_end: bool,
    /// Whether the file is a subprogram and no more: what holds at its begin is its caller's.
    is_subprogram: bool,
    /// Whether the file is of a control of which no reader here knows the words (DIN/ISO of Heidenhain).
    unknown_control: bool,
    /// Contours that cycles of lathes read, from block to block.
    contours: HashMap<u64, u64>,
    /// The block that ends the contour which is being read.
    contour_end: Option<u64>,
    /// Names that the file declares (Siemens).
    declared: BTreeSet<Vec<u8>>,
    /// Those of them that hold whole numbers only.
    integer_variables: BTreeSet<Vec<u8>>,
    /// The programs and subprograms that stand in the file, by their O.
    programs: BTreeSet<Variable>,
    /// Blocks that jumps go to.
    jump_targets: BTreeSet<u64>,
    /// Whether a jump goes to a computed block.
    computed_jump: bool,
    listing: Listing,
    events: Vec<StateEvent>,
    contexts: Vec<BlockContext>,
    instructions: BTreeMap<String, Shared<str>>,
    speeds: BTreeMap<u64, u32>,
    tool_index: HashMap<String, u32>,
    frame_index: Option<(String, Option<truegrind_math::se3::Pose>, u32)>,
}

/// How long the lists were before a file.
struct Lengths([usize; 7]);

impl<'t, 's> Interpreter<'t, 's> {
    fn new(tree: &'t NcTree<'s>, file: u32, dialect: Dialect, setup: &'t Setup) -> Self {
        let state = ModalState::start(if dialect == Dialect::Siemens { "G500" } else { "G54" }, "T0");
        Interpreter {
            tree,
            file,
            dialect,
            setup,
            angles: setup.angles,
            tools: HashMap::new(),
            frames: HashMap::new(),
            assigned_variables: HashSet::new(),
            state,
            effects: FileEffects::default(),
            file_effects: None,
            set_before_branch: 0,
            branched: false,
            in_skippable_block: false,
            program_ended: false,
            synchronised_actions: false,
            meaning: WordSemantics::default(),
            state_before_subprogram: None,
            tool_change_by_m6: false,
            cycle_is_program: false,
            has_nc_blocks: false,
            restarts_at_end: false,
            is_subprogram: false,
            unknown_control: false,
            contours: HashMap::new(),
            contour_end: None,
            declared: BTreeSet::new(),
            integer_variables: BTreeSet::new(),
            programs: BTreeSet::new(),
            jump_targets: BTreeSet::new(),
            computed_jump: false,
            listing: Listing { numbered: true, ..Listing::default() },
            events: Vec::new(),
            contexts: Vec::new(),
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
        self.listing.marks.push(mark::find(self.tree));
        for opaque in &self.tree.opaque {
            self.listing.opaque.push(OpaqueRegion {
                place: self.place(opaque.at.min(self.tree.len() as u32)),
                span: self.tree.span(opaque.first, opaque.end),
                reason: opaque.reason,
            });
        }
        self.comments();
        self.prescan();
        let lengths = self.lengths();
        let start = self.state.clone();
        self.interpret_file();
        if self.branched {
            // Now it is known what the whole file sets, which tells what still holds where ways meet.
            self.back_to(&lengths);
            self.state = start;
            self.file_effects = Some(std::mem::take(&mut self.effects));
            (self.set_before_branch, self.branched, self.program_ended, self.synchronised_actions) =
                (0, false, false, false);
            (self.state_before_subprogram, self.contour_end) = (None, None);
            self.interpret_file();
        }
        // A text of which not one block is NC is no program: nothing in it moves.
        let unread = |motion: &Motion| matches!(motion.left, Some(Reason::Unread | Reason::UnknownWord));
        if !self.has_nc_blocks && self.listing.motions[lengths.0[0]..].iter().all(unread) {
            self.back_to(&lengths);
            self.events.push(StateEvent::FileStart);
        }
    }

    fn interpret_file(&mut self) {
        self.events.push(StateEvent::FileStart);
        if self.is_subprogram {
            self.enter_subprogram();
        } else if self.restarts_at_end() {
            self.join_unseen_predecessors();
        }
        let mut block = Block::default();
        let blocks: Vec<u32> = self.tree.child_nodes(0).collect();
        for node in blocks {
            self.block(node, &mut block);
        }
    }

    fn lengths(&self) -> Lengths {
        let listing = &self.listing;
        Lengths([
            listing.motions.len(),
            listing.speeds.len(),
            listing.zones.len(),
            listing.tools.len(),
            listing.work_objects.len(),
            self.events.len(),
            self.contexts.len(),
        ])
    }

    fn back_to(&mut self, &Lengths([motions, speeds, zones, tools, objects, events, contexts]): &Lengths) {
        self.listing.motions.truncate(motions);
        self.listing.outside.retain(|call| (*call as usize) < motions);
        self.listing.speeds.truncate(speeds);
        self.listing.zones.truncate(zones);
        self.listing.tools.truncate(tools);
        self.listing.work_objects.truncate(objects);
        self.events.truncate(events);
        self.contexts.truncate(contexts);
        self.speeds.clear();
        self.tool_index.clear();
        self.frame_index = None;
    }

    /// Frames, tools and conventions that comments state.
    fn comments(&mut self) {
        let (mut tools, mut frames) = (Vec::new(), Vec::new());
        for token in 0..self.tree.len() as u32 {
            if self.tree.kind(token) != Some(Token::Comment) {
                continue;
            }
            match statement(self.tree.text(token)) {
                Ok(Some(Statement::Angles(angles))) => self.angles = self.setup.angles.or(Some(angles)),
                Ok(Some(Statement::Tool(stated))) => tools.push((token, stated)),
                Ok(Some(Statement::Frame(stated))) => frames.push((token, stated)),
                Ok(None) => {}
                Err(expected) => {
                    self.unread_comment(token);
                    self.misstated(token, expected);
                }
            }
        }
        let tool = |(name, frame): &(String, Frame)| {
            let value = frame.within_reach().map(held);
            Tool { name: name.clone(), value, place: None }
        };
        self.tools = self.stated(&tools);
        self.frames = self.stated(&frames);
        let told = tools.iter().map(|(_, stated)| (stated.number.clone(), stated.frame));
        let beforehand: HashSet<String> =
            self.setup.tools.iter().map(|(name, _)| setup::plain(name)).collect();
        let kept = told.filter(|(name, _)| {
            let name = setup::plain(name);
            self.tools.contains_key(&name) && !beforehand.contains(&name)
        });
        let declared: Vec<Tool> =
            self.setup.tools.iter().cloned().chain(kept).map(|one| tool(&one)).collect();
        self.listing.declared_tools.extend(declared);
        let labels = tools.into_iter().chain(frames).map(|(_, stated)| (stated.number, stated.name));
        self.listing.labels.extend(labels);
        // What is known beside the program goes before.
        let beside = |list: &[(String, Frame)]| -> Vec<(String, Frame)> {
            list.iter().map(|(name, frame)| (setup::plain(name), *frame)).collect()
        };
        self.tools.extend(beside(&self.setup.tools));
        self.frames.extend(beside(&self.setup.frames));
    }

    /// Tools or work offsets that comments state, by plain name. One that is stated with two frames is not known.
    fn stated(&mut self, all: &[(u32, Stated)]) -> HashMap<String, Frame> {
        let mut found: HashMap<String, Frame> = HashMap::new();
        let mut contradicted = Vec::new();
        for (token, stated) in all {
            let name = setup::plain(&stated.number);
            match found.get(&name) {
                Some(before) if *before != stated.frame => {
                    self.unread_comment(*token);
                    contradicted.push(name);
                }
                _ => drop(found.insert(name, stated.frame)),
            }
        }
        for name in &contradicted {
            found.remove(name);
        }
        found
    }

    fn misstated(&mut self, token: u32, expected: String) {
        let text = String::from_utf8_lossy(self.tree.text(token)).trim().to_owned();
        // The file is named where all are read.
        let (file, line) = (String::new(), self.place(token).line);
        self.listing.misstated.push(Misstated { file, line, text, expected });
    }

    /// A comment that was meant for this program and cannot be used is listed, not state_before_subprogram over.
    fn unread_comment(&mut self, token: u32) {
        self.listing.opaque.push(OpaqueRegion {
            place: self.place(token),
            span: self.tree.span(token, token + 1),
            reason: OpaqueReason::Unexpected,
        });
    }

    // ---- blocks ----

    fn block(&mut self, node: u32, block: &mut Block<'s>) {
        self.gather(node, block);
        self.has_nc_blocks |=
            !block.opaque && (!block.g.is_empty() || !block.m.is_empty() || block.has_motion_words());
        if !block.skippable {
            self.interpret(block);
            return;
        }
        let before = self.state.clone();
        self.in_skippable_block = true;
        self.interpret(block);
        self.in_skippable_block = false;
        // What ends the program or goes elsewhere does so only where it is not skipped.
        self.program_ended = false;
        let after = std::mem::replace(&mut self.state, before);
        self.state = after.join(&self.state);
        self.frame_index = None;
        self.tool_index.clear();
    }

    /// What a block does.
    fn interpret(&mut self, block: &Block<'s>) {
        if std::mem::take(&mut self.program_ended) {
            self.join_unseen_predecessors();
        }
        if self.is_reached_by_jumps(block) {
            self.join_unseen_predecessors();
            self.state.mode = MotionMode::Unknown(Reason::UnknownFlow);
        }
        self.contour_of(block);
        self.mark_position_reads(block);
        let values = self.values(block);
        let before = self.effects.joins;
        self.meaning = self.state.word_semantics();
        self.transfer(block);
        self.assign(values, self.effects.joins != before);
    }

    fn transfer(&mut self, block: &Block<'s>) {
        if let Some(on) = block.radius_compensation {
            self.state.radius_compensation = on;
            self.set_group(ModalGroup::RadiusCompensation, u64::from(on));
        }
        if self.dialect == Dialect::Heidenhain && self.heidenhain(block) {
            return;
        }
        if self.is_action(block) {
            // What it sets, it sets at any time from here on.
            self.synchronised_actions = true;
            self.state.variables.invalidate(Reason::Variable);
            self.join_unseen_predecessors();
            return;
        }
        if self.unknown_control {
            if !block.words.is_empty() {
                self.list_unknown_word(block, "?", Reason::UnknownWord);
            }
            return;
        }
        if self.control_flow(block) {
            return;
        }
        if let Some((word, reason)) = self.unknown_word(block) {
            self.list_unknown_word(block, &word, reason);
            self.end_of_block(block);
            return;
        }
        if block.opaque && block.opaque_may_set {
            self.list_unknown_word(block, "?", Reason::Unread);
            self.end_of_block(block);
            return;
        }
        self.m_words(block);
        self.tool_words(block);
        let machine = block.machine_coordinates
            || block.g.contains(&530)
            || self.dialect == Dialect::Siemens && block.g.contains(&1530)
            || self.dialect == Dialect::Heidenhain && block.m.iter().any(|m| matches!(m, 91 | 92));
        self.select_tool(block);
        if self.named_commands(block) || self.modal_codes(block) || self.one_shot_codes(block) {
            self.end_of_block(block);
            return;
        }
        if let Some(index) = block.feed {
            let feed = self.evaluate_word(&block.words[index]).0;
            // A feed has no decimals on any control.
            let feed = self.literal(&block.words[index]).ok_or(Reason::Variable).or(feed);
            let feed = feed.and_then(|feed| match feed > 0.0 && feed < LARGEST {
                true => Ok(feed),
                // F0 and F-5 go nowhere, and what is too large is read as something else.
                false => Err(Reason::NumberRange),
            });
            self.state.feed = self.length_in_mm(feed).map(|feed| feed / 60.0);
        }
        self.motion(block, machine);
        self.end_of_block(block);
    }

    /// M2, M30, M99, M17 of Siemens: what comes after belongs to another program. M6 goes to change the tool.
    fn end_of_block(&mut self, block: &Block<'s>) {
        let dialect = self.dialect;
        let end = |m: &u32| match m {
            2 | 30 => true,
            17 => dialect == Dialect::Siemens,
            99 => dialect != Dialect::Heidenhain,
            _ => false,
        };
        // M99 P100 jumps, perhaps over what comes next, and so do M96 and M46 of Haas.
        if block.m.iter().any(|m| matches!(m, 46 | 96 | 99)) {
            self.branch();
        }
        if self.dialect == Dialect::Heidenhain && block.m.contains(&129) {
            // It acts at the end of its block.
            self.set_tcp_mode(false, false);
        }
        if block.m.iter().any(end) || block.words.iter().any(|word| word.is("RET")) {
            self.program_ended = true;
        } else if block.m.contains(&6) {
            self.invalidate_pose();
        }
    }

    /// Tools: T, with M6 where the file changes them so.
    fn select_tool(&mut self, block: &Block<'s>) {
        for word in &block.words {
            if word.address() != Some(b'T') {
                continue;
            }
            let name = match (self.literal(word), word.value) {
                (Some(number), _) => format!("T{}", number.round()),
                (None, WordValue::Expression { first, .. })
                    if self.tree.kind(first) == Some(Token::String) =>
                {
                    let text = self.tree.text(first);
                    String::from_utf8_lossy(text).trim_matches(['"', '\'']).to_owned()
                }
                _ => "T?".to_owned(),
            };
            self.state.next_tool = Some(name);
        }
        // LinuxCNC: M61 says which tool is in; T alone only makes one ready, whatever else the file has.
        let linux = self.dialect == Dialect::LinuxCnc;
        if linux && block.m.contains(&61) {
            let number = block.q.and_then(|index| self.literal(&block.words[index]));
            self.change_tool(number.map_or("T?".to_owned(), |number| format!("T{}", number.round())));
        }
        if (block.m.contains(&6) || !self.tool_change_by_m6 && !linux)
            && let Some(name) = self.state.next_tool.take()
        {
            self.change_tool(name);
        }
        if self.dialect == Dialect::Siemens
            && let Some(index) = block.d
        {
            let edge = self.literal(&block.words[index]).map_or(u32::MAX, |edge| edge.round() as u32);
            self.length_is(|state| state.cutting_edge = edge);
        }
    }
}

/// Whether a letter is that of an axis or of what goes with one.
fn is_axis(letter: u8) -> bool {
    b"XYZABCIJKRUVWEF".contains(&letter.to_ascii_uppercase())
}

/// The axes that a block names, as bits.
fn named_axes(block: &Block<'_>) -> u8 {
    block
        .axes
        .iter()
        .chain(&block.abc)
        .enumerate()
        .fold(0, |all, (axis, word)| all | u8::from(word.is_some()) << axis)
}

/// The name of an axis, with or without the I of an increment.
fn is_axis_name(name: &[u8]) -> bool {
    match name {
        [letter] | [b'I' | b'i', letter] => b"XYZABCUVW".contains(&letter.to_ascii_uppercase()),
        _ => false,
    }
}

/// All axes, for the same and for [`Event::Held`].
const EVERYWHERE: u8 = POSITION | ORIENTATION;

/// All of X, Y and Z, for [`Event::Lost`].
const POSITION: u8 = 7;

/// All of A, B and C, for the same.
const ORIENTATION: u8 = 7 << 3;

/// A G number in tenths: 540 for G54, 434 for G43.4.
fn code(number: f64) -> u32 {
    (number * 10.0).round().clamp(0.0, 1e6) as u32
}
