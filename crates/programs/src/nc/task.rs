//! Abstract interpretation of NC files: every motion block, with the modal state in which it runs.
//!
//! Blocks are interpreted in the order of the text ([`crate::dataflow`]); one that may be skipped is joined with the state
//! before it. At a label, a loop or the start of a subprogram the states of all paths that lead there are joined ([`paths`]). Where
//! they do not follow from the text, the state is joined with states of unseen predecessors, so that only modal groups which the
//! whole file sets to one value stay known.

mod arrivals;
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
mod paths;
mod block;
mod shift;
mod turn;
mod unstated;
mod file_scan;
mod prescan;
mod tools;
mod words;
mod block_context;
mod call_edges;

use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::Arc as Shared;

use super::dialect::Dialect;
use super::expression::{MAX_NUMBER, Variable, literal};
use super::mark;
use super::modal_group::ModalGroup;
use super::modal_state::{ModalState, MotionMode, OrientationMode, WordSemantics};
use super::orientation::Angles;
use super::parser::parse;
use super::setup::{self, Setup, StatedFrame, Statement, flange_tool, statement};
use super::syntax::{NcTree, Syntax, Word, WordValue};
use super::token::Token;
use crate::dataflow::{Control, Nesting, Transfer};
use crate::motion::{
    Frame, InvalidStatement, Listing, Motion, MotionKind, OpaqueReason, OpaqueRegion, Place, Reason, Tool,
};
use arrivals::{Paths, Structure};
use block::Block;
pub(super) use block_context::{BlockArc, BlockContext, StartDependency, StateEvent};
use call_edges::{CallEdges, FlowPoint};
use file_effects::FileEffects;
use file_scan::FileScan;

/// NC files that are read together: each runs on its own, the setup is common to all.
#[derive(Debug)]
pub struct Task<'s> {
    /// The names of the files, as given.
    pub names: Vec<String>,
    /// The syntax trees of the files.
    pub trees: Vec<NcTree<'s>>,
    /// The dialects of the files.
    pub dialects: Vec<Dialect>,
    /// The convention of A, B and C in each file.
    pub angles: Vec<Option<Angles>>,
    /// The motions of all files.
    pub listing: Listing,
    /// Events that concern positions and origins, in the order of files and lines.
    pub(super) events: Vec<StateEvent>,
    /// The context of each motion's block, by motion.
    pub(super) contexts: Vec<BlockContext>,
}

impl Task<'_> {
    /// What the path of a motion depends on, if it is not modified (`stays`).
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
    /// Reads files, given by name and bytes. Never fails: unreadable regions are listed.
    pub fn read(files: &[(&str, &'s [u8])], setup: &Setup) -> Task<'s> {
        let dialects: Vec<Dialect> = files
            .iter()
            .map(|(name, bytes)| setup.dialect.unwrap_or_else(|| setup::control_of(name, bytes)))
            .collect();
        let trees: Vec<_> = files.iter().zip(&dialects).map(|((_, bytes), &d)| parse(bytes, d)).collect();
        let mut task = Task {
            names: files.iter().map(|(name, _)| (*name).to_owned()).collect(),
            trees,
            dialects,
            angles: Vec::new(),
            listing: Listing {
                numbered: true,
                files: files.iter().map(|(name, _)| (*name).to_owned()).collect(),
                ..Listing::default()
            },
            events: Vec::new(),
            contexts: Vec::new(),
        };
        let mut call_edges = CallEdges::default();
        let may_increment = task.trees.iter().zip(&task.dialects).any(|(tree, d)| may_increment(tree, *d));
        for file in 0..files.len() {
            let mut interpreter =
                Interpreter::new(&task.trees[file], file as u32, task.dialects[file], setup);
            // Siemens: the extension of a subprogram.
            interpreter.scan.is_subprogram = task.names[file].to_ascii_lowercase().ends_with(".spf");
            interpreter.is_called = setup.is_called(&task.names[file]);
            interpreter.may_increment = may_increment || interpreter.is_called;
            interpreter.files = files.len();
            interpreter.listing = std::mem::take(&mut task.listing);
            interpreter.events = std::mem::take(&mut task.events);
            interpreter.contexts = std::mem::take(&mut task.contexts);
            interpreter.call_edges = std::mem::take(&mut call_edges);
            interpreter.file();
            task.angles.push(interpreter.angles);
            let open =
                interpreter.listing.invalid_statements.iter_mut().filter(|comment| comment.file.is_empty());
            open.for_each(|comment| comment.file.clone_from(&task.names[file]));
            let Interpreter { listing, events, contexts, .. } = interpreter;
            call_edges = interpreter.call_edges;
            (task.listing, task.events, task.contexts) = (listing, events, contexts);
        }
        task.listing.across_calls = call_edges.solve(&task.names, task.listing.motions.len() as u32);
        task.leave_pinned_ends();
        let is_stated =
            |file: &usize| setup.dialect.is_some() || setup::stated_control(files[*file].1).is_some();
        let open = (0..files.len()).filter(|file| task.dialects[*file] == Dialect::Iso && !is_stated(file));
        let first = |file: usize| {
            let mut motions = task.listing.motions.iter().filter(|motion| motion.place.file as usize == file);
            motions.find(|motion| motion.reason().is_none()).map(|motion| motion.place)
        };
        task.listing.nc.open_controls = open.filter_map(first).collect();
        task.listing.nc.unstated_lengths = task.unstated_lengths();
        task.listing.nc.unstated_turns = task.unstated_turns();
        task.keep_contradictions();
        task
    }

    /// Of the frames that the program sets otherwise than they are stated, keeps those that a motion uses and none used before as stated: there
    /// the program changes them on purpose.
    fn keep_contradictions(&mut self) {
        let mut replaced = std::mem::take(&mut self.listing.nc.replaced_frames);
        if replaced.is_empty() {
            return;
        }
        let stated: HashMap<(u32, &str), Frame> =
            replaced.iter().map(|(place, one)| ((place.file, &*one.name), one.stated)).collect();
        // By file and name, where a motion first used it as stated; nothing where it was used otherwise alone.
        let mut used: HashMap<(u32, String), Option<Place>> = HashMap::new();
        let listing = &self.listing;
        let alike = |a: &Motion, b: &Motion| a.same_frames(b) && a.place.file == b.place.file;
        for run in listing.motions.chunk_by(alike) {
            let motion = &run[0];
            let tool = listing.tool(motion);
            let tool = tool.map(|tool| (&*tool.name, tool.value.as_ref().ok().map(|value| value.frame)));
            let object = listing.work_object(motion);
            let object = object
                .map(|object| (&*object.name, object.value.as_ref().ok().map(|value| value.user_frame)));
            let file = motion.place.file;
            for (name, frame) in tool.into_iter().chain(object) {
                let Some(stated) = stated.get(&(file, name)) else { continue };
                let first = used.entry((file, name.to_owned())).or_default();
                if frame == Some(*stated) {
                    *first = first.or(Some(motion.place));
                }
            }
        }
        drop(stated);
        replaced.retain(|place, one| match used.get(&(place.file, one.name.clone())) {
            Some(first) => first.is_none_or(|first| first > *place),
            None => false,
        });
        self.listing.nc.replaced_frames = replaced;
    }

    /// See [`crate::motion::NcFacts::unstated_turns`].
    fn unstated_turns(&self) -> Vec<Place> {
        let states_none = |file: &usize| {
            let tree = &self.trees[*file];
            !(0..tree.len() as u32).any(|token| tree.text(token).eq_ignore_ascii_case(b"THETA"))
        };
        let motions = || self.listing.motions.iter().zip(&self.contexts);
        let first = |file: usize| {
            let mut of_file = motions().filter(|(motion, _)| motion.place.file as usize == file);
            let mut under_vector = |(motion, context): &(&Motion, &BlockContext)| {
                context.orientation_mode == OrientationMode::Vector && motion.reason().is_none()
            };
            of_file.find(&mut under_vector).map(|(motion, _)| motion.place)
        };
        (0..self.trees.len()).filter(states_none).filter_map(first).collect()
    }

    /// See [`crate::motion::NcFacts::unstated_lengths`].
    fn unstated_lengths(&self) -> Vec<Place> {
        let of_linuxcnc = |file: &usize| self.dialects[*file] == Dialect::LinuxCnc;
        let mut files = (0..self.trees.len()).filter(of_linuxcnc);
        if files.any(|file| states_length(&self.trees[file])) {
            return Vec::new();
        }
        let motions = &self.listing.motions;
        let has_length = |motion: &Motion| {
            let tool = self.listing.tool(motion).and_then(|tool| tool.value.as_ref().ok());
            tool.is_some_and(|tool| tool.frame.position_mm != [0.0; 3])
        };
        let first = |file: usize| {
            let mut of_file = motions.iter().filter(|motion| motion.place.file as usize == file);
            of_file.find(|motion| motion.reason().is_none() && has_length(motion)).map(|motion| motion.place)
        };
        (0..self.trees.len()).filter(of_linuxcnc).filter_map(first).collect()
    }
}

/// The abstract interpreter of one file. More than twenty fields: its input, its state and each list that it writes.
pub(super) struct Interpreter<'t, 's> {
    tree: &'t NcTree<'s>,
    file: u32,
    dialect: Dialect,
    setup: &'t Setup,
    scan: FileScan,
    angles: Option<Angles>,
    /// Tools and work offsets that the setup and comments state, by name.
    tools: HashMap<String, Frame>,
    frames: HashMap<String, Frame>,
    state: ModalState,
    /// The side effects of the whole file, from a first pass.
    file_effects: Option<FileEffects>,
    /// What arrives at the places to which control comes from elsewhere; `None` where the text does not determine it.
    paths: Option<Box<Paths>>,
    /// Whether labels are also reached by jumps: the return of any may then end any other (Heidenhain).
    returns_are_common: bool,
    /// How many files are read together.
    files: usize,
    /// Whether a program outside these files calls this one.
    is_called: bool,
    /// Whether a word may be an increment, in these files or in one that calls them.
    may_increment: bool,
    pass: Pass,
    /// Variables that the file has assigned so far.
    assigned_variables: HashSet<Variable>,
    /// Memory for the words of a block.
    block: Option<Box<Block<'s>>>,
    /// Whether the current block may be skipped.
    in_skippable_block: bool,
    /// The semantics of words before the current block.
    word_semantics: WordSemantics,
    /// Whether the active cycle may be a program (cycle 12 of Heidenhain).
    cycle_is_program: bool,
    /// Whether a block has been read completely.
    has_nc_blocks: bool,
    listing: Listing,
    events: Vec<StateEvent>,
    contexts: Vec<BlockContext>,
    call_edges: CallEdges,
    instructions: BTreeMap<String, Shared<str>>,
    speeds: BTreeMap<u64, u32>,
    tool_index: HashMap<String, u32>,
    frame_index: Option<(String, Option<truegrind_math::se3::Pose>, u32)>,
}

/// What one pass over the blocks of a file has found so far.
#[derive(Default)]
struct Pass {
    /// The side effects of the blocks.
    effects: FileEffects,
    /// Groups that are set before the first branch or join, as bits.
    set_before_branch: u32,
    /// Whether control flow has branched or joined: jumps, calls, labels.
    branched: bool,
    /// Whether the program has ended (M30): the next block belongs to another one.
    program_ended: bool,
    /// Whether synchronised actions may assign variables.
    synchronised_actions: bool,
    /// The state before the subprogram that is being read, and whether no path reaches it.
    before_subprogram: Option<(ModalState, bool)>,
    /// Whether no path that is known so far reaches the block.
    unreached: bool,
    /// The loops and branches around the block.
    structures: Vec<Structure>,
    /// The program that is being read, where it has a name.
    program: Variable,
    /// The labels that the next LBL 0 ends.
    labels: Vec<Variable>,
    /// The program that a modal call calls after each motion.
    modal_callee: Option<Variable>,
    /// The last block of the contour that is being read.
    contour_end: Option<u64>,
}

/// The lengths of the lists before a file.
struct Lengths([usize; 8]);

impl Transfer for Interpreter<'_, '_> {
    type State = ModalState;

    fn state(&mut self) -> &mut ModalState {
        &mut self.state
    }

    fn size(&self, node: u32) -> u32 {
        self.tree.nodes.get(node).size
    }

    fn control(&self, block: u32) -> Control {
        match self.tree.nodes.kind(block) {
            Syntax::Skippable => Control::Skippable,
            _ => Control::Simple,
        }
    }

    fn transfer(&mut self, node: u32, nesting: Nesting) {
        let mut block = self.block.take().unwrap_or_default();
        self.collect_words(node, &mut block);
        self.has_nc_blocks |=
            !block.flags.opaque && (!block.g.is_empty() || !block.m.is_empty() || block.has_motion_words());
        self.in_skippable_block = nesting.guarded;
        let unreached = self.pass.unreached;
        self.interpret(&block);
        self.note_unreached(&block);
        self.block = Some(block);
        if nesting.guarded {
            self.in_skippable_block = false;
            self.pass.unreached &= unreached;
            // A program end or jump in it happens only where it is not skipped.
            self.pass.program_ended = false;
            self.frame_index = None;
            self.tool_index.clear();
        }
    }

    fn join_any_point(&mut self) {
        self.join_unseen_predecessors();
    }
}

impl<'t, 's> Interpreter<'t, 's> {
    fn new(tree: &'t NcTree<'s>, file: u32, dialect: Dialect, setup: &'t Setup) -> Self {
        let state = ModalState::start(start_offset(dialect), START_TOOL);
        Interpreter {
            tree,
            file,
            dialect,
            setup,
            scan: FileScan::default(),
            angles: setup.angles,
            tools: HashMap::new(),
            frames: HashMap::new(),
            state,
            file_effects: None,
            paths: None,
            returns_are_common: false,
            files: 1,
            is_called: false,
            may_increment: false,
            pass: Pass::default(),
            assigned_variables: HashSet::new(),
            block: None,
            in_skippable_block: false,
            word_semantics: WordSemantics::default(),
            cycle_is_program: false,
            has_nc_blocks: false,
            listing: Listing { numbered: true, ..Listing::default() },
            events: Vec::new(),
            contexts: Vec::new(),
            call_edges: CallEdges::default(),
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
        self.scan.is_subprogram |= self.is_called;
        let lengths = self.lengths();
        let start = self.state.clone();
        self.interpret_file();
        if self.pass.branched {
            // The side effects of the whole file are known now; they determine what stays known at joins.
            self.file_effects = Some(std::mem::take(&mut self.pass).effects);
            if !self.interpret_paths(&lengths, &start) {
                self.truncate_to(&lengths);
                (self.state, self.pass) = (start, Pass::default());
                self.interpret_file();
            }
        }
        // A text without one readable NC block is no program and has no motions.
        let unread =
            |motion: &Motion| matches!(motion.own_reason, Some(Reason::Unreadable | Reason::UnknownWord));
        if !self.has_nc_blocks && self.listing.motions[lengths.0[0]..].iter().all(unread) {
            self.truncate_to(&lengths);
            self.events.push(StateEvent::FileStart);
            self.flow(FlowPoint::File { restarts: false });
        }
    }

    fn interpret_file(&mut self) {
        self.events.push(StateEvent::FileStart);
        self.flow(FlowPoint::File { restarts: self.scan.restarts_at_end });
        if self.scan.is_subprogram {
            self.start_subprogram();
        } else if self.scan.restarts_at_end {
            self.join_unseen_predecessors();
        }
        self.walk(0, Nesting::default());
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
            self.call_edges.len(),
        ])
    }

    fn truncate_to(
        &mut self,
        &Lengths([motions, speeds, zones, tools, objects, events, contexts, points]): &Lengths,
    ) {
        self.listing.motions.truncate(motions);
        self.listing.nc.external_calls.retain(|call| (*call as usize) < motions);
        self.listing.nc.unstated.retain(|motion, _| (*motion as usize) < motions);
        self.listing.nc.at_poles.split_off(&(motions as u32));
        let file = self.file;
        self.listing.nc.replaced_frames.retain(|place, _| place.file != file);
        self.listing.predecessors.split_off(&(motions as u32));
        self.listing.speeds.truncate(speeds);
        self.listing.zones.truncate(zones);
        self.listing.tools.truncate(tools);
        self.listing.work_objects.truncate(objects);
        self.events.truncate(events);
        self.contexts.truncate(contexts);
        self.call_edges.truncate(points);
        self.speeds.clear();
        self.tool_index.clear();
        self.frame_index = None;
    }

    /// Reads frames, tools, conventions and the start that comments state.
    fn comments(&mut self) {
        let (mut tools, mut frames) = (Vec::new(), Vec::new());
        for token in 0..self.tree.len() as u32 {
            if self.tree.kind(token) != Some(Token::Comment) {
                continue;
            }
            match statement(self.tree.text(token)) {
                Ok(Some(Statement::Control(stated)))
                    if stated == self.dialect || self.setup.dialect.is_some() => {}
                Ok(Some(Statement::Control(_))) => {
                    let expected =
                        format!("{}, as stated before: one control runs the file", self.dialect.text());
                    self.list_unusable_comment(token);
                    self.list_invalid_statement(token, expected);
                }
                Ok(Some(Statement::Angles(angles))) => self.angles = self.setup.angles.or(Some(angles)),
                Ok(Some(Statement::Tool(stated))) => tools.push((token, stated)),
                Ok(Some(Statement::Frame(stated))) => frames.push((token, stated)),
                Ok(Some(Statement::Start(stated))) => {
                    let first = *self.listing.nc.start_deg.get_or_insert(stated);
                    if first != stated {
                        let expected = format!("{first:?}, as stated before: the arm starts once");
                        self.list_unusable_comment(token);
                        self.list_invalid_statement(token, expected);
                    }
                }
                Ok(None) => {}
                Err(expected) => {
                    self.list_unusable_comment(token);
                    self.list_invalid_statement(token, expected);
                }
            }
        }
        let tool = |(name, frame): &(String, Frame)| {
            let value = frame.within_reach().map(flange_tool);
            Tool { name: name.clone(), value, place: None, assigned: false }
        };
        self.tools = self.frames_by_name(&tools);
        self.frames = self.frames_by_name(&frames);
        let stated = tools.iter().map(|(_, stated)| (stated.number.clone(), stated.frame));
        let in_setup: HashSet<String> = self.setup.tools.iter().map(|(name, _)| setup::plain(name)).collect();
        let used = stated.filter(|(name, _)| {
            let name = setup::plain(name);
            self.tools.contains_key(&name) && !in_setup.contains(&name)
        });
        let declared: Vec<Tool> =
            self.setup.tools.iter().cloned().chain(used).map(|one| tool(&one)).collect();
        self.listing.declared_tools.extend(declared);
        let labels = tools.into_iter().chain(frames).map(|(_, stated)| (stated.number, stated.name));
        self.listing.nc.labels.extend(labels);
        // The setup overrides comments.
        let beside = |list: &[(String, Frame)]| -> Vec<(String, Frame)> {
            list.iter().map(|(name, frame)| (setup::plain(name), *frame)).collect()
        };
        self.tools.extend(beside(&self.setup.tools));
        self.frames.extend(beside(&self.setup.frames));
    }

    /// Tools or work offsets that comments state, by plain name. Contradicting statements make a name unknown.
    fn frames_by_name(&mut self, all: &[(u32, StatedFrame)]) -> HashMap<String, Frame> {
        let mut found: HashMap<String, Frame> = HashMap::new();
        let mut contradicted = Vec::new();
        for (token, stated) in all {
            let name = setup::plain(&stated.number);
            match found.get(&name) {
                Some(before) if *before != stated.frame => {
                    self.list_unusable_comment(*token);
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

    fn list_invalid_statement(&mut self, token: u32, expected: String) {
        let text = String::from_utf8_lossy(self.tree.text(token)).trim().to_owned();
        // [`Task::read`] fills in the name of the file.
        let (file, line) = (String::new(), self.place(token).line);
        self.listing.invalid_statements.push(InvalidStatement { file, line, text, expected });
    }

    /// Lists a comment that states something for this program and cannot be used.
    fn list_unusable_comment(&mut self, token: u32) {
        self.listing.opaque.push(OpaqueRegion {
            place: self.place(token),
            span: self.tree.span(token, token + 1),
            reason: OpaqueReason::Unexpected,
        });
    }

    /// Interprets a block in the state before it.
    fn interpret(&mut self, block: &Block<'s>) {
        if std::mem::take(&mut self.pass.program_ended) {
            self.join_unseen_predecessors();
        }
        if self.is_reached_by_jumps(block) {
            self.arrive_at_label(block);
            let is_number = block.words.first().is_some_and(|word| word.address() == Some(b'N'));
            // REPEAT repeats up to a label.
            self.flow(if is_number { FlowPoint::Arrives } else { FlowPoint::Joins });
            self.state.mode = MotionMode::Unknown(Reason::UnknownFlow);
        }
        self.contour_of(block);
        self.mark_position_reads(block);
        let values = self.evaluate_assignments(block);
        let before = self.pass.effects.joins;
        self.word_semantics = self.state.word_semantics();
        self.transfer_words(block);
        self.apply_assignments(values, self.pass.effects.joins != before);
    }

    /// The transfer function of a block.
    fn transfer_words(&mut self, block: &Block<'s>) {
        if let Some(on) = block.flags.radius_compensation {
            self.set_group(ModalGroup::RadiusCompensation, u64::from(on));
        }
        if self.dialect == Dialect::Heidenhain && self.heidenhain(block) {
            return;
        }
        if self.jumps_in_passing(block) {
            self.leads_anywhere();
        }
        if self.is_action(block) {
            self.leads_anywhere();
            // A synchronised action may set its variables at any time from here on.
            self.pass.synchronised_actions = true;
            self.state.variables.invalidate(Reason::UnknownVariable);
            self.join_unseen_predecessors();
            self.flow(FlowPoint::Joins);
            return;
        }
        if self.scan.unknown_control {
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
        if block.flags.opaque && block.flags.opaque_may_set {
            self.list_unknown_word(block, "?", Reason::Unreadable);
            self.end_of_block(block);
            return;
        }
        self.m_words(block);
        self.tool_words(block);
        let machine = block.flags.machine_coordinates
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
            // F words are literals: a whole number needs no decimal point on any control.
            let feed = self.literal(&block.words[index]).ok_or(Reason::UnknownVariable).or(feed);
            let feed = feed.and_then(|feed| match feed > 0.0 && feed < MAX_NUMBER {
                true => Ok(feed),
                // Controls reject F0 and F-5, and read a number that is too large differently.
                false => Err(Reason::NumberRange),
            });
            self.state.feed.rate = self.length_in_mm(feed).map(|feed| feed / 60.0);
        }
        self.motion(block, machine);
        self.end_of_block(block);
    }

    /// M2, M30, M99, M17 of Siemens: the blocks after them belong to another program. M6 moves to the tool change
    /// position.
    fn end_of_block(&mut self, block: &Block<'s>) {
        let dialect = self.dialect;
        let end = |m: &u32| match m {
            2 | 30 => true,
            17 => dialect == Dialect::Siemens,
            99 => dialect != Dialect::Heidenhain,
            _ => false,
        };
        // M99 P100, and M96 and M46 of Haas, jump, perhaps past the next blocks.
        if block.m.iter().any(|m| matches!(m, 46 | 96 | 99)) {
            let returns = block.m.contains(&99) && block.p.is_none();
            self.branch_by(if returns { FlowPoint::Return } else { FlowPoint::Leaves });
            if returns && !block.m.iter().any(|m| matches!(m, 46 | 96)) {
                self.returns_from(vec![self.pass.program.clone()]);
            } else if dialect != Dialect::Heidenhain {
                self.leads_anywhere();
            }
        }
        if self.dialect == Dialect::Heidenhain && block.m.contains(&129) {
            // It takes effect at the end of its block.
            self.set_tcp_mode(false, false);
        }
        if block.m.iter().any(end) || block.words.iter().any(|word| word.is("RET")) {
            self.pass.program_ended = true;
            self.stop();
            if !block.m.contains(&99) {
                self.flow(FlowPoint::Return);
            }
        } else if block.m.contains(&6) {
            self.invalidate_pose();
        }
    }

    /// T, with M6 where the file changes tools by it.
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
            self.state.tool.next = Some(name);
        }
        // LinuxCNC: M61 sets the current tool; T alone only prepares one, whatever else the file has.
        let linux = self.dialect == Dialect::LinuxCnc;
        if linux && block.m.contains(&61) {
            let number = block.q.and_then(|index| self.literal(&block.words[index]));
            self.change_tool(number.map_or("T?".to_owned(), |number| format!("T{}", number.round())));
        }
        if (block.m.contains(&6) || !self.scan.tool_change_by_m6 && !linux)
            && let Some(name) = self.state.tool.next.take()
        {
            self.change_tool(name);
        }
        if self.dialect == Dialect::Siemens
            && let Some(index) = block.d
        {
            let edge = self.literal(&block.words[index]).map_or(u32::MAX, |edge| edge.round() as u32);
            self.change_tool_length(|tool| tool.cutting_edge = edge);
        }
    }
}

/// The tool after power-on.
const START_TOOL: &str = "T0";

/// The work offset after power-on.
fn start_offset(dialect: Dialect) -> &'static str {
    if dialect == Dialect::Siemens { "G500" } else { "G54" }
}

/// Whether a letter is an axis address or one that accompanies it.
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

/// Whether this is the name of an axis, with or without the I of an increment.
pub(super) fn is_axis_name(name: &[u8]) -> bool {
    match name {
        [letter] | [b'I' | b'i', letter] => b"XYZABCUVW".contains(&letter.to_ascii_uppercase()),
        _ => false,
    }
}

/// All axes, for [`StateEvent::PositionUsed`].
const EVERYWHERE: u8 = POSITION | ORIENTATION;

/// X, Y and Z, for [`StateEvent::AxesUnknown`].
const POSITION: u8 = 7;

/// A, B and C, for the same.
const ORIENTATION: u8 = 7 << 3;

/// A G code in tenths: 540 for G54, 434 for G43.4.
fn code(number: f64) -> u32 {
    (number * 10.0).round().clamp(0.0, 1e6) as u32
}

/// Whether a word of a file may be an increment: G91, a G code that is computed, IC( ), IX of Heidenhain.
fn may_increment(tree: &NcTree<'_>, dialect: Dialect) -> bool {
    let mut tokens =
        (0..tree.len() as u32).filter(|token| tree.kind(*token) != Some(Token::Space)).peekable();
    while let Some(token) = tokens.next() {
        let may = match (dialect, tree.text(token)) {
            (_, b"G" | b"g") => tokens.peek().is_some_and(|code| {
                let number =
                    std::str::from_utf8(tree.text(*code)).ok().and_then(|text| text.parse::<f64>().ok());
                number.is_none_or(|number| number == 91.0)
            }),
            (Dialect::Siemens, name) => name.eq_ignore_ascii_case(b"IC"),
            (Dialect::Heidenhain, [b'I' | b'i', _] | [b'I' | b'i', b'P' | b'p', _]) => true,
            _ => false,
        };
        if may {
            return true;
        }
    }
    false
}

/// Whether a file takes over or cancels the length of a tool (G43, G43.1, G43.2, G49).
fn states_length(tree: &NcTree<'_>) -> bool {
    let mut tokens =
        (0..tree.len() as u32).filter(|token| tree.kind(*token) != Some(Token::Space)).peekable();
    while let Some(token) = tokens.next() {
        let is_g = tree.text(token).eq_ignore_ascii_case(b"g");
        let code = tokens.peek().filter(|_| is_g).map(|number| tree.text(*number));
        if code.is_some_and(|code| matches!(code, b"43" | b"43.1" | b"43.2" | b"49")) {
            return true;
        }
    }
    false
}
