//! From files to the listing: every motion with its targets, speed, zone, tool and work object.
//!
//! [`ListingBuilder`] runs the abstract interpreter ([`super::flow`]) over every body, lists the motions that it visits, and
//! solves which switches each body may be entered with.

mod call_edges;
mod entries;
mod frames;
mod literals;
mod motions;
mod parameters;
mod uses;
mod wrappers;

use std::cell::Cell;
use std::collections::HashMap;
use std::sync::Arc;

use rayon::prelude::*;

use super::evaluate::{Context, Evaluator};
use super::flow::{AbstractState, CallSite, Exit, Visitor, interpret_body};
use super::instruction::INSTRUCTIONS;
use super::mark;
use super::modal::SwitchSet;
use super::parser::parse;
use super::payload::{self, Gripped};
use super::reaching_motions::ReachingMotions;
use super::symbol::{Body, Symbols};
use super::syntax::RapidTree;
use super::token::same_name;
use crate::dataflow::Nesting;
use crate::motion::load::{Load, Loads};
use crate::motion::{Listing, MotionTarget, OpaqueRegion, Place, Reason, Role};
use call_edges::CallEdges;
use literals::{Literals, NODES_PER_MOTION};
use wrappers::{Inlined, Wrappers};

/// The RAPID modules of one task, read together.
#[derive(Debug)]
pub struct Task<'s> {
    /// The names of the files, as given.
    pub names: Vec<String>,
    /// Their bytes.
    pub sources: Vec<&'s [u8]>,
    /// The files as trees; empty after [`Task::drop_trees`].
    pub trees: Vec<RapidTree<'s>>,
    /// The symbol table.
    pub symbols: Box<Symbols>,
    /// The motions that they command.
    pub listing: Listing,
    /// The loads that they state.
    loads: Loads,
    /// Whether a compact IF guards each motion alone.
    pub(super) guarded: Vec<bool>,
    /// Present and future places of each file's marks.
    pub(super) marks: Vec<mark::Places>,
}

impl<'s> Task<'s> {
    /// Reads files, given by name and bytes, as one task. Never fails: unreadable text is listed.
    pub fn read(files: &[(&str, &'s [u8])]) -> Task<'s> {
        let trees: Vec<_> = files.par_iter().map(|(_, bytes)| parse(bytes)).collect();
        let symbols = Box::new(Symbols::collect(&trees));
        let ((listing, loads, guarded), marks) =
            rayon::join(|| listing(&trees, &symbols), || trees.iter().map(mark::Places::of).collect());
        let names: Vec<String> = files.iter().map(|(name, _)| (*name).to_owned()).collect();
        let listing = Listing { files: names.clone(), ..listing };
        let sources = files.iter().map(|(_, bytes)| *bytes).collect();
        Task { names, sources, trees, symbols, listing, loads, guarded, marks }
    }

    /// The loads that the modules state.
    pub fn loads(&self) -> Loads {
        self.loads.clone()
    }

    /// Drops the trees, which are larger than the files and which a rewrite does not need.
    pub fn drop_trees(&mut self) {
        self.trees = Vec::new();
    }
}

/// The listing, its loads, and whether a compact IF guards each motion alone.
fn listing(trees: &[RapidTree<'_>], symbols: &Symbols) -> (Listing, Loads, Vec<bool>) {
    let mut builder = ListingBuilder::new(trees, symbols);
    // Interpretation is sequential; targets written as numbers do not depend on it and are read on the other threads.
    let (mut builder, literals) = rayon::join(
        || {
            builder.interpret_bodies();
            builder
        },
        || Literals::of(trees, symbols),
    );
    builder.insert_literals(&literals);
    builder.resolve_entry_switches();
    builder.refuse_motions_before_displacement();
    builder.list_position_decisions();
    builder.other_uses();
    builder.declared_tools();
    (builder.listing.across_calls, builder.listing.predecessors) =
        builder.call_edges.solve(symbols, &builder.bodies, &builder.mains);
    let loads = if symbols.states_loads { builder.loads() } else { Loads::default() };
    (builder.listing, loads, builder.guarded)
}

/// Cache of look-ups by scope and name.
#[derive(Debug, Default)]
struct Cached<'s> {
    last: Option<(u32, &'s [u8], u32)>,
    all: HashMap<(u32, &'s [u8]), u32>,
}

impl<'s> Cached<'s> {
    fn get(&mut self, scope: u32, text: &'s [u8]) -> Option<u32> {
        if let Some((last_scope, last_text, index)) = self.last
            && last_scope == scope
            && last_text == text
        {
            return Some(index);
        }
        let index = *self.all.get(&(scope, text))?;
        self.last = Some((scope, text, index));
        Some(index)
    }

    fn put(&mut self, scope: u32, text: &'s [u8], index: u32) {
        self.all.insert((scope, text), index);
        self.last = Some((scope, text, index));
    }
}

/// Interprets all bodies and writes the listing. More than twenty fields: its input, each list that it writes, and indices
/// over them.
struct ListingBuilder<'a, 's> {
    trees: &'a [RapidTree<'s>],
    symbols: &'a Symbols,
    evaluator: Evaluator<'a, 's>,
    listing: Listing,
    guarded: Vec<bool>,
    /// The switches at each motion, "as at the entry" included.
    modal: Vec<SwitchSet>,
    /// Whether the program displacement of each motion is known, and so part of its work object.
    displaced: Vec<bool>,
    /// The body of each motion.
    bodies: Vec<u32>,
    body: u32,
    sites: Vec<(u32, CallSite)>,
    call_edges: CallEdges,
    /// What holds at the end of each routine.
    exits: Vec<Option<Exit>>,
    /// How deep the calls are whose ends alone are computed: nothing is listed in them.
    depth: u32,
    /// The load at each motion, "as at the entry" included, and those that motions state in total.
    grips: Vec<Gripped>,
    totals: HashMap<usize, Load>,
    /// Whether a displacement is counted from the end of any motion.
    position_used: bool,
    /// The bodies in which one is counted from the robot's position at their entry. A call determines that position; a new cycle,
    /// an interrupt and an unknown caller do not.
    position_used_at_entry: Vec<u32>,
    /// Decisions by the position whose motions are not all known: body, whether only those before the body are open, and place.
    position_decisions: Vec<(u32, bool, Place)>,
    names: Vec<Option<Arc<str>>>,
    /// The line of the last place.
    line: Cell<u32>,
    /// The index in the listing of each routine.
    routines: Vec<Option<u32>>,
    declarations: HashMap<u32, u32>,
    speeds: Cached<'s>,
    zones: Cached<'s>,
    tools: Cached<'s>,
    work_objects: Cached<'s>,
    /// For each body, the switches at its calls by computed names, and at its calls of undeclared routines.
    late: Vec<SwitchSet>,
    outside: Vec<SwitchSet>,
    /// The routines named main.
    mains: Vec<u32>,
    /// The data that every call hands over for a parameter.
    passed_data: parameters::PassedData,
    /// The calls that are motions.
    wrappers: Arc<Wrappers>,
    /// Whether a target expression of the current motion is impure, so that it must not be replaced.
    impure: bool,
    /// Whether the initial value of a declaration is impure.
    impure_initials: HashMap<u32, bool>,
    /// Targets written out as numbers, inserted at the end.
    literals: Vec<Literal>,
}

/// A target written in the instruction as an aggregate of numbers.
#[derive(Debug, Clone, Copy)]
struct Literal {
    motion: u32,
    /// Index among the targets of the motion.
    target: u32,
    role: Role,
    file: u32,
    /// The instruction.
    call: u32,
    node: u32,
    joints: bool,
}

/// Motions into which one thread inserts literals at a time.
const CHUNK: usize = 4096;

/// Greatest call depth to which the exit states of routines are computed; beyond it they may be anything that the routine sets.
const CALL_DEPTH: u32 = 12;

impl<'a, 's> ListingBuilder<'a, 's> {
    fn new(trees: &'a [RapidTree<'s>], symbols: &'a Symbols) -> Self {
        ListingBuilder {
            trees,
            symbols,
            evaluator: Evaluator::new(trees, symbols),
            listing: Listing::default(),
            guarded: Vec::new(),
            modal: Vec::new(),
            displaced: Vec::new(),
            bodies: Vec::new(),
            body: 0,
            sites: Vec::new(),
            call_edges: CallEdges::new(symbols.bodies.len() + symbols.late_lists.len()),
            exits: vec![None; symbols.routines.len()],
            depth: 0,
            grips: Vec::new(),
            totals: HashMap::new(),
            position_used: false,
            position_used_at_entry: Vec::new(),
            position_decisions: Vec::new(),
            names: vec![None; INSTRUCTIONS.len()],
            line: Cell::new(0),
            routines: vec![None; symbols.routines.len()],
            declarations: HashMap::new(),
            speeds: Cached::default(),
            zones: Cached::default(),
            tools: Cached::default(),
            work_objects: Cached::default(),
            late: vec![SwitchSet::EMPTY; symbols.bodies.len()],
            outside: vec![SwitchSet::EMPTY; symbols.bodies.len()],
            mains: Vec::new(),
            passed_data: parameters::PassedData::new(),
            wrappers: Arc::default(),
            impure: false,
            impure_initials: HashMap::new(),
            literals: Vec::new(),
        }
    }

    fn place(&self, file: u32, token: u32) -> Place {
        let tree = &self.trees[file as usize];
        let (line, column) = tree.line_column_after(tree.start(token), self.line.get());
        self.line.set(line);
        Place { file, line, column }
    }

    /// Room for so many motions: what is not used is never touched, so it costs no memory.
    fn reserve(&mut self, motions: usize) {
        self.listing.motions.reserve(motions);
        self.literals.reserve(motions);
        self.guarded.reserve(motions);
        self.modal.reserve(motions);
        self.displaced.reserve(motions);
        self.bodies.reserve(motions);
    }

    /// The load that a call which is a motion states for tool and grip together.
    fn inlined_load(&self, inlined: &Inlined, state: &AbstractState) -> Option<Load> {
        let is_load = |given: &&wrappers::Given| {
            let name = given.argument.name.map(|name| self.trees[given.named_in as usize].text(name));
            given.argument.optional && name.is_some_and(|name| same_name(name, b"TLoad"))
        };
        let given = inlined.given.iter().find(is_load)?;
        let context = Context::new(given.body.file, given.body.scope, &state.known);
        payload::total(&self.evaluator, context, given.argument.value?)
    }

    /// Interprets every body.
    fn interpret_bodies(&mut self) {
        self.reserve(
            self.trees.iter().map(|tree| tree.nodes.len() as usize).sum::<usize>() / NODES_PER_MOTION,
        );
        for (file, tree) in self.trees.iter().enumerate() {
            self.listing.marks.push(mark::find(tree));
            for opaque in &tree.opaque {
                self.listing.opaque.push(OpaqueRegion {
                    place: self.place(file as u32, opaque.at.min(tree.len() as u32)),
                    span: tree.span(opaque.first, opaque.end),
                    reason: opaque.reason,
                });
            }
        }
        let bodies = self.symbols.bodies.clone();
        let routines = 0..self.symbols.routines.len() as u32;
        self.mains = routines.filter(|&routine| self.symbols.is_main(self.trees, routine)).collect();
        if self.mains.len() > 1 {
            let head = |routine: &u32| {
                let scope = &self.symbols.routines[*routine as usize];
                self.place(scope.file, scope.head.name)
            };
            self.listing.mains = self.mains.iter().map(head).collect();
        }
        self.passed_data = parameters::of(self.trees, self.symbols, &self.mains);
        self.wrappers = Arc::new(Wrappers::of(self.trees, self.symbols, &self.mains));
        // Exit switches of callees first, however long the chain of calls is.
        for &body in &self.symbols.callees_first {
            let Some(routine) = bodies[body as usize].routine else { continue };
            if self.symbols.effects_of(routine).switches == SwitchSet::EMPTY {
                let gripped = match self.symbols.states_loads {
                    true => self.exit_of(routine).gripped,
                    false => Some(Gripped::default()),
                };
                self.exits[routine as usize] = Some(Exit { modal: SwitchSet::ENTRY, gripped });
            } else if self.symbols.called[body as usize] {
                self.exit_of(routine);
            }
        }
        for (index, body) in bodies.iter().enumerate() {
            self.body = index as u32;
            if let Some(routine) = body.routine.filter(|_| self.wrappers.is_unlisted(index as u32)) {
                self.exits[routine as usize] = Some(self.exit_of(routine));
                continue;
            }
            let evaluator = Evaluator::new(self.trees, self.symbols);
            let exit = interpret_body(&evaluator, *body, self);
            if let Some(routine) = body.routine {
                self.exits[routine as usize] = Some(exit);
                if self.mains.contains(&routine) {
                    // The next cycle begins with the switches and the load at the end of this one.
                    self.record_cycle_restart(exit.modal, exit.gripped.unwrap_or_default());
                }
            }
        }
    }

    /// Inserts the targets that are written in the instructions as numbers.
    fn insert_literals(&mut self, read: &Literals) {
        let (literals, trees, symbols) = (std::mem::take(&mut self.literals), self.trees, self.symbols);
        let chunks = self.listing.motions.par_chunks_mut(CHUNK).enumerate();
        chunks.for_each(|(chunk, motions)| {
            let evaluator = Evaluator::new(trees, symbols);
            // They are in the order of motions.
            let begin = chunk * CHUNK;
            let from = literals.partition_point(|literal| (literal.motion as usize) < begin);
            let mut last = 0;
            for literal in &literals[from..] {
                let Literal { motion, target, role, file, call, node, joints } = *literal;
                let Some(motion) = motions.get_mut(motion as usize - begin) else { break };
                let found = read.target(file, call, node, joints, &mut last);
                let found = found.unwrap_or_else(|| literals::target(&evaluator, file, node, joints));
                motion.targets.insert(target as usize, MotionTarget { role, ..found });
            }
        });
    }
}

impl Visitor for ListingBuilder<'_, '_> {
    fn visit_call(
        &mut self,
        body: Body,
        node: u32,
        known: Option<usize>,
        state: &AbstractState,
        nesting: Nesting,
    ) -> Option<u32> {
        if self.depth > 0 {
            return None;
        }
        let tree = &self.trees[body.file as usize];
        let motion = match known {
            Some(known) => Some(self.table_motion(body, node, state, nesting, known)),
            None => self
                .inlined_motion(body, node, state, nesting)
                .or_else(|| self.other_motion(body, node, state, nesting)),
        };
        let Some(motion) = motion else {
            self.record_outside_call(body, node);
            return None;
        };
        let index = self.listing.motions.len() as u32;
        self.call_edges.arrive(self.body, index, motion.previous.is_none(), &state.reaching);
        self.listing.motions.push(motion);
        self.guarded.push(nesting.guarded);
        self.modal.push(state.modal);
        self.displaced.push(matches!(state.displacement(), Some(Ok(_))));
        self.bodies.push(self.body);
        if self.symbols.states_loads {
            self.grips.push(if state.reachable { state.gripped } else { Gripped::UNKNOWN });
            let total = match self.wrappers.motion(body.file, node) {
                Some(inlined) => self.inlined_load(inlined, state),
                None => {
                    let context = Context::new(body.file, body.scope, &state.known);
                    payload::total_load(&self.evaluator, context, tree, node)
                }
            };
            let total = total.filter(|_| state.reachable);
            self.totals.extend(total.map(|total| (self.listing.motions.len() - 1, total)));
        }
        Some(self.listing.motions.len() as u32 - 1)
    }

    fn inlined_instruction(&self, body: Body, node: u32) -> Option<usize> {
        self.wrappers.motion(body.file, node).map(|inlined| inlined.known)
    }

    fn exit_of(&mut self, routine: u32) -> Exit {
        if let Some(exit) = self.exits[routine as usize] {
            return exit;
        }
        // As at the entry, or as any statement in it or its callees may set.
        let modal = SwitchSet::ENTRY.join(self.symbols.effects_of(routine).switches);
        let any = Exit { modal, gripped: Some(Gripped::UNKNOWN) };
        if self.depth >= CALL_DEPTH {
            return any;
        }
        // Assumed for recursive calls while the routine is interpreted.
        self.exits[routine as usize] = Some(any);
        self.depth += 1;
        let body = self.symbols.bodies[self.symbols.body_of(routine) as usize];
        let exit = interpret_body(&Evaluator::new(self.trees, self.symbols), body, self);
        self.depth -= 1;
        self.exits[routine as usize] = Some(exit);
        exit
    }

    fn record_call(&mut self, site: CallSite) {
        if self.depth == 0 {
            self.sites.push((self.body, site));
        }
    }

    fn record_moving_call(&mut self, routine: u32, before: &ReachingMotions) -> u32 {
        if self.depth > 0 {
            return 0;
        }
        self.call_edges.call(self.body, self.symbols.body_of(routine), before)
    }

    fn record_moving_late_call(&mut self, before: &ReachingMotions) -> u32 {
        if self.depth > 0 {
            return 0;
        }
        let list = self.symbols.bodies.len() as u32 + self.symbols.late_list[self.body as usize];
        self.call_edges.call(self.body, list, before)
    }

    fn record_loop(&mut self) -> u32 {
        if self.depth > 0 { 0 } else { self.call_edges.begin_loop(self.body) }
    }

    fn record_loop_end(&mut self, iteration: u32, reaching: &ReachingMotions) {
        if self.depth == 0 {
            self.call_edges.end_loop(iteration, reaching);
        }
    }

    fn record_end(&mut self, reaching: &ReachingMotions) {
        if self.depth == 0 {
            self.call_edges.end(self.body, reaching);
        }
    }

    fn record_late_call(&mut self, modal: SwitchSet) {
        if self.depth == 0 {
            let late = &mut self.late[self.body as usize];
            *late = late.join(modal);
        }
    }

    fn record_external_call(&mut self, modal: SwitchSet) {
        if self.depth == 0 {
            let outside = &mut self.outside[self.body as usize];
            *outside = outside.join(modal);
        }
    }

    fn record_position_use(&mut self, standing: &ReachingMotions) {
        if self.depth > 0 {
            return;
        }
        match standing.motions() {
            Some(motions) => {
                for motion in motions {
                    self.listing.motions[motion as usize]
                        .own_reason
                        .get_or_insert(Reason::BeforeDisplacement);
                }
            }
            None => self.position_used = true,
        }
        if standing.entry {
            self.position_used_at_entry.push(self.body);
        }
    }

    fn record_position_decision(&mut self, body: Body, node: u32, standing: &ReachingMotions) {
        if self.depth > 0 {
            return;
        }
        if let Some(motions) = standing.motions() {
            for motion in motions {
                self.listing.motions[motion as usize].own_reason.get_or_insert(Reason::BeforeDisplacement);
            }
        }
        if standing.motions().is_none() || standing.entry || standing.elsewhere {
            let tree = &self.trees[body.file as usize];
            let (line, column) = tree.line_column(tree.start(tree.nodes.first(node)));
            self.position_decisions.push((
                self.body,
                standing.entry,
                Place { file: body.file, line, column },
            ));
        }
    }

    fn record_cycle_restart(&mut self, modal: SwitchSet, gripped: Gripped) {
        for at in 0..self.mains.len() {
            self.record_call(CallSite { routine: self.mains[at], modal, gripped });
        }
    }
}
