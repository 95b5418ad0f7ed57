//! From files to the listing: every motion with its targets, speed, zone, tool and work object.

mod frames;
mod literals;
mod uses;

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use rayon::prelude::*;

use super::evaluate::{Context, Evaluator, Source};
use super::flow::{AbstractState, CallSite, Nesting, Visitor, interpret_unit};
use super::instruction::{self, Also, Between, INSTRUCTIONS, Instruction, Slot};
use super::mark;
use super::modal::{Switch, SwitchSet};
use super::parser::parse;
use super::predefined;
use super::reaching_motions::ReachingMotions;
use super::symbol::{SwitchExit, SymbolKind, Symbols, Unit};
use super::syntax::{Argument, RapidTree, Syntax, arguments, expressions, parts, text_of, tokens_of};
use super::token::{display, folded, same_name};
use crate::motion::{
    Declaration, Listing, Motion, MotionKind, MotionTarget, OpaqueRegion, Origin, Place, Reason, Role,
    Routine, Switch as SwitchState,
};
use crate::tree::Child;
use literals::Literals;

/// The RAPID modules of one task, read together.
#[derive(Debug)]
pub struct Task<'s> {
    /// The names of the files, as given.
    pub names: Vec<String>,
    /// Their bytes.
    pub sources: Vec<&'s [u8]>,
    /// The files, as trees; none any more after [`Task::forget_trees`].
    pub trees: Vec<RapidTree<'s>>,
    /// Their names.
    pub symbols: Box<Symbols>,
    /// What they tell the robot to do.
    pub listing: Listing,
    /// Whether a compact IF guards each motion alone.
    pub(super) guarded: Vec<bool>,
    /// Where the marks of each file stand and go.
    pub(super) marks: Vec<mark::Places>,
}

impl<'s> Task<'s> {
    /// Reads files, given by name and bytes, as one task. Never fails: what cannot be read is listed.
    pub fn read(files: &[(&str, &'s [u8])]) -> Task<'s> {
        let trees: Vec<_> = files.par_iter().map(|(_, bytes)| parse(bytes)).collect();
        let symbols = Box::new(Symbols::collect(&trees));
        let (listing, guarded) = listing(&trees, &symbols);
        let marks = trees.iter().map(mark::Places::of).collect();
        let names = files.iter().map(|(name, _)| (*name).to_owned()).collect();
        let sources = files.iter().map(|(_, bytes)| *bytes).collect();
        Task { names, sources, trees, symbols, listing, guarded, marks }
    }

    /// Lets go of the trees, which are larger than the files: a rewrite asks for them no more. What walks through the
    /// statements does (`truegrind-compensation`'s `Loads`), so it comes first.
    pub fn forget_trees(&mut self) {
        self.trees = Vec::new();
    }
}

/// What the files tell the robot to do, and whether a compact IF guards each motion alone.
fn listing(trees: &[RapidTree<'_>], symbols: &Symbols) -> (Listing, Vec<bool>) {
    let mut lister = Lister::new(trees, symbols);
    // The statements in their order on one thread, what does not depend on it on the others.
    let (mut lister, literals) = rayon::join(
        || {
            lister.walk_units();
            lister
        },
        || Literals::of(trees, symbols),
    );
    lister.put_literals(literals);
    lister.settle_modal();
    lister.settle_placed();
    lister.other_uses();
    lister.declared_tools();
    (lister.listing, lister.guarded)
}

/// What is looked up by name again and again.
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

struct Lister<'a, 's> {
    trees: &'a [RapidTree<'s>],
    symbols: &'a Symbols,
    evaluator: Evaluator<'a, 's>,
    listing: Listing,
    guarded: Vec<bool>,
    /// The switches at each motion, "as at the entry" included.
    modal: Vec<SwitchSet>,
    /// Whether the program displacement of each motion is known, and stands in its work object.
    displaced: Vec<bool>,
    /// The unit of each motion.
    units: Vec<u32>,
    unit: u32,
    sites: Vec<(u32, CallSite)>,
    exits: Vec<Option<SwitchSet>>,
    depth: u32,
    /// While only the exit of a routine is asked for.
    silent: bool,
    /// Whether a displacement is counted from where any motion may have ended.
    placed: bool,
    /// The units in which one is counted from where the robot stood at their begin. A call says where that is; a new cycle, an
    /// interrupt and what is not called here do not.
    placed_at_entry: Vec<u32>,
    names: Vec<Option<Arc<str>>>,
    routines: HashMap<u32, u32>,
    declarations: HashMap<u32, u32>,
    speeds: Cached<'s>,
    zones: Cached<'s>,
    tools: Cached<'s>,
    work_objects: Cached<'s>,
    /// The switches at the calls of each unit by computed names, and of routines that are in none of the files.
    late: Vec<SwitchSet>,
    outside: Vec<SwitchSet>,
    /// The routines named main.
    mains: Vec<u32>,
    /// Whether a target of the motion that is being read may not be replaced: its expression does more than answer.
    acting: bool,
    /// Whether the initial value of a declaration does more than answer.
    acting_initials: HashMap<u32, bool>,
    /// Targets written out as numbers, whose values are read last, on all threads.
    literals: Vec<Literal>,
}

/// A target that is written out in the instruction as an aggregate of numbers: no statement changes its value.
#[derive(Debug, Clone, Copy)]
struct Literal {
    motion: u32,
    /// Its place among the targets of the motion.
    target: u32,
    role: Role,
    file: u32,
    /// The instruction.
    call: u32,
    node: u32,
    joints: bool,
}

/// Greatest call depth to which the exit states of routines are computed; beyond it they may be anything that the routine sets.
const CALL_DEPTH: u32 = 12;

impl<'a, 's> Lister<'a, 's> {
    fn new(trees: &'a [RapidTree<'s>], symbols: &'a Symbols) -> Self {
        Lister {
            trees,
            symbols,
            evaluator: Evaluator::new(trees, symbols),
            listing: Listing::default(),
            guarded: Vec::new(),
            modal: Vec::new(),
            displaced: Vec::new(),
            units: Vec::new(),
            unit: 0,
            sites: Vec::new(),
            exits: vec![None; symbols.routines.len()],
            depth: 0,
            silent: false,
            placed: false,
            placed_at_entry: Vec::new(),
            names: vec![None; INSTRUCTIONS.len()],
            routines: HashMap::new(),
            declarations: HashMap::new(),
            speeds: Cached::default(),
            zones: Cached::default(),
            tools: Cached::default(),
            work_objects: Cached::default(),
            late: vec![SwitchSet::EMPTY; symbols.units.len()],
            outside: vec![SwitchSet::EMPTY; symbols.units.len()],
            mains: Vec::new(),
            acting: false,
            acting_initials: HashMap::new(),
            literals: Vec::new(),
        }
    }

    fn place(&self, file: u32, token: u32) -> Place {
        let tree = &self.trees[file as usize];
        let (line, column) = tree.line_column(tree.start(token));
        Place { file, line, column }
    }

    /// Follows the statements of every unit.
    fn walk_units(&mut self) {
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
        let units = self.symbols.units.clone();
        let routines = 0..self.symbols.routines.len() as u32;
        self.mains = routines.filter(|&routine| self.symbols.is_main(self.trees, routine)).collect();
        // What is called ends before its callers are followed, however long the chain of calls is.
        for &unit in &self.symbols.callees_first {
            let Some(routine) = units[unit as usize].routine else { continue };
            match self.symbols.switch_exits[unit as usize] {
                SwitchExit::Unchanged => self.exits[routine as usize] = Some(SwitchSet::ENTRY),
                SwitchExit::Changed { called: true } => {
                    self.exit_switches(routine);
                }
                SwitchExit::Changed { called: false } => {}
            }
        }
        for (index, unit) in units.iter().enumerate() {
            self.unit = index as u32;
            let evaluator = Evaluator::new(self.trees, self.symbols);
            let exit = interpret_unit(&evaluator, *unit, self);
            if let Some(routine) = unit.routine {
                self.exits[routine as usize] = Some(exit);
                if self.mains.contains(&routine) {
                    // The next cycle begins with the switches as this one leaves them.
                    self.record_cycle_restart(exit);
                }
            }
        }
    }

    /// The targets that stand in the instructions as numbers.
    fn put_literals(&mut self, mut read: Literals) {
        let evaluator = Evaluator::new(self.trees, self.symbols);
        for literal in std::mem::take(&mut self.literals) {
            let Literal { motion, target, role, file, call, node, joints } = literal;
            let mut found = read
                .take(file, call, node, joints)
                .unwrap_or_else(|| vec![literals::target(&evaluator, file, node, joints)]);
            found.iter_mut().for_each(|target| target.role = role);
            let targets = &mut self.listing.motions[motion as usize].targets;
            if targets.is_empty() {
                *targets = found;
            } else {
                // A hundred thousand motions: no room for targets that never come.
                targets.reserve_exact(1);
                let target = target as usize;
                targets.splice(target..target, found);
            }
        }
    }

    // ---- switches ----

    /// Leaves the motions behind which a displacement may be counted, where that may be any.
    fn settle_placed(&mut self) {
        let units = &self.symbols.units;
        let begins_anywhere = |unit: &u32| {
            let Some(routine) = units[*unit as usize].routine else { return true };
            let called = |(from, site): &(u32, CallSite)| site.routine == routine && from != unit;
            self.mains.contains(&routine)
                || self.symbols.interrupts[routine as usize]
                || !self.sites.iter().any(called)
        };
        if self.placed || self.placed_at_entry.iter().any(begins_anywhere) {
            for motion in &mut self.listing.motions {
                motion.left.get_or_insert(Reason::BeforeDisplacement);
            }
        }
    }

    /// Replaces "as at the entry" by what the entries are.
    fn settle_modal(&mut self) {
        let entries = self.entries();
        let motions = self.listing.motions.iter_mut().zip(&self.modal).zip(&self.units);
        for (((motion, modal), unit), displaced) in motions.zip(&self.displaced) {
            let states = modal.substitute_entry(entries[*unit as usize]);
            motion.modal = states.modal();
            if motion.left.is_none() {
                // A displacement that the text tells stands in the work object.
                let unknown = !displaced && states.state(Switch::Displacement) != SwitchState::Off;
                let offset = states.state(Switch::ExternalOffset) != SwitchState::Off;
                motion.left = left_by_modal(motion, unknown || offset);
            }
        }
    }

    /// The switches with which each unit may begin.
    fn entries(&self) -> Vec<SwitchSet> {
        let (units, symbols) = (&self.symbols.units, self.symbols);
        let unit_of = |routine: u32| symbols.routines[routine as usize].unit;
        let mut called = vec![false; units.len()];
        for (unit, site) in &self.sites {
            // A call of itself is not what begins it.
            called[unit_of(site.routine) as usize] |= *unit != unit_of(site.routine);
        }
        // What runs before a routine that none of the files calls: another routine, or nothing.
        let before = self.exits.iter().flatten().fold(SwitchSet::EMPTY, |all, exit| all.join(*exit));
        let alone = SwitchSet::START.join(before.substitute_entry(SwitchSet::EMPTY));
        let mut entries: Vec<SwitchSet> = Vec::with_capacity(units.len());
        for (unit, &called) in units.iter().zip(&called) {
            let routine = unit.routine.map(|routine| (routine, &symbols.routines[routine as usize]));
            entries.push(match routine {
                None => SwitchSet::START,
                Some((routine, _)) if symbols.interrupts[routine as usize] => {
                    SwitchSet::START.join(symbols.all_switches)
                }
                Some((routine, _)) if self.mains.contains(&routine) => SwitchSet::START,
                // A part of a program may be called from the rest of it.
                Some((_, scope)) if called && (!self.mains.is_empty() || scope.head.local) => {
                    SwitchSet::EMPTY
                }
                Some(_) => alone,
            });
        }
        // Callers first: then one pass settles what does not call itself.
        let mut rank = vec![0_u32; units.len()];
        for (at, &unit) in (0..).zip(&symbols.callees_first) {
            rank[unit as usize] = at;
        }
        let mut sites: Vec<&(u32, CallSite)> = self.sites.iter().collect();
        sites.sort_by_key(|(unit, _)| std::cmp::Reverse(rank[*unit as usize]));
        loop {
            let before = entries.clone();
            for (unit, site) in &sites {
                let arriving = site.modal.substitute_entry(entries[*unit as usize]);
                let callee = &mut entries[unit_of(site.routine) as usize];
                *callee = callee.join(arriving);
            }
            let mut outside = SwitchSet::EMPTY;
            // Many units share one list of routines.
            let mut late: BTreeMap<*const u32, (SwitchSet, &[u32])> = BTreeMap::new();
            for (unit, &entry) in entries.iter().enumerate().take(units.len()) {
                outside = outside.join(self.outside[unit].substitute_entry(entry));
                let called = &symbols.late_callees[unit];
                let arriving = &mut late.entry(called.as_ptr()).or_insert((SwitchSet::EMPTY, called)).0;
                *arriving = arriving.join(self.late[unit].substitute_entry(entry));
            }
            for (arriving, called) in late.into_values().filter(|(arriving, _)| *arriving != SwitchSet::EMPTY)
            {
                for &routine in called {
                    let callee = &mut entries[unit_of(routine) as usize];
                    *callee = callee.join(arriving);
                }
            }
            for routine in symbols.routines.iter().filter(|routine| !routine.head.local) {
                let callee = &mut entries[routine.unit as usize];
                *callee = callee.join(outside);
            }
            if before != entries {
                continue;
            }
            // What only calls itself, round about, has no beginning yet.
            if !entries.contains(&SwitchSet::EMPTY) {
                return entries;
            }
            entries.iter_mut().filter(|entry| **entry == SwitchSet::EMPTY).for_each(|entry| *entry = alone);
        }
    }

    // ---- motions ----

    fn name_of(&mut self, known: usize) -> Arc<str> {
        self.names[known].get_or_insert_with(|| INSTRUCTIONS[known].name.into()).clone()
    }

    fn routine_of(&mut self, unit: Unit) -> Option<u32> {
        let routine = unit.routine?;
        if let Some(&index) = self.routines.get(&routine) {
            return Some(index);
        }
        let scope = &self.symbols.routines[routine as usize];
        let tree = &self.trees[scope.file as usize];
        self.listing.routines.push(Routine {
            name: display(tree.text(scope.head.name)),
            module: scope.module.clone(),
            place: self.place(scope.file, scope.head.name),
        });
        let index = self.listing.routines.len() as u32 - 1;
        self.routines.insert(routine, index);
        Some(index)
    }

    fn motion(&mut self, unit: Unit, node: u32, state: &AbstractState, nesting: Nesting) -> Motion {
        let tree = &self.trees[unit.file as usize];
        Motion {
            place: self.place(unit.file, tree.nodes[node as usize].first),
            statement: tree.node_span(node),
            instruction: "".into(),
            kind: MotionKind::Unknown,
            targets: Vec::new(),
            speed: None,
            zone: None,
            tool: None,
            work_object: None,
            timed: false,
            insertable: false,
            straightens: false,
            rapid: false,
            configures: true,
            axis: None,
            by_radius: false,
            modal: crate::motion::Modal::START,
            in_loop: nesting.in_loop,
            conditional: nesting.conditional,
            previous: state.previous,
            routine: self.routine_of(unit),
            left: None,
        }
    }

    fn target(
        &mut self,
        unit: Unit,
        state: &AbstractState,
        argument: Child,
        joints: bool,
        role: Role,
    ) -> MotionTarget {
        let tree = &self.trees[unit.file as usize];
        let context = Context::new(unit.file, unit.scope, &state.known);
        let (value, source) = self.evaluator.target(context, argument, joints);
        self.acting |= self.evaluator.was_doubtful()
            || self.symbols.is_impure(tree, unit.scope, argument)
            || matches!(source, Source::Symbol(symbol) | Source::Element(symbol, _) if self.begins_acting(symbol));
        let (first, end) = tokens_of(tree, argument);
        let origin = match source {
            Source::Inline => Origin::Inline,
            Source::Computed => Origin::Computed,
            Source::Unknown => Origin::Unknown,
            Source::Symbol(symbol) => Origin::Declared(self.declaration(symbol)),
            Source::Element(symbol, literal) => {
                Origin::Element { declaration: self.declaration(symbol), literal }
            }
        };
        MotionTarget { role, value, origin, argument: tree.span(first, end) }
    }

    /// A target of the next motion, the one after `before` others; one that stands there as numbers is put in later.
    fn take(
        &mut self,
        motion: &mut Motion,
        (unit, call, state): (Unit, u32, &AbstractState),
        argument: Child,
        joints: bool,
        (role, before): (Role, u32),
    ) {
        match literals::plain(&self.trees[unit.file as usize], argument) {
            Some(node) => {
                let motion = self.listing.motions.len() as u32;
                let file = unit.file;
                self.literals.push(Literal { motion, target: before, role, file, call, node, joints });
            }
            None => {
                motion.targets.reserve_exact(1);
                motion.targets.push(self.target(unit, state, argument, joints, role));
            }
        }
    }

    /// Whether the initial value of data does more than answer.
    fn begins_acting(&mut self, symbol: u32) -> bool {
        let (trees, symbols) = (self.trees, self.symbols);
        *self.acting_initials.entry(symbol).or_insert_with(|| {
            let found = &symbols.symbols[symbol as usize];
            let SymbolKind::Data(data) = &found.kind else { return false };
            let initial = |value| symbols.is_impure(&trees[found.file as usize], found.scope, value);
            data.value.is_some_and(initial)
        })
    }

    fn declaration(&mut self, symbol: u32) -> u32 {
        if let Some(&index) = self.declarations.get(&symbol) {
            return index;
        }
        let found = &self.symbols.symbols[symbol as usize];
        let tree = &self.trees[found.file as usize];
        let data = match &found.kind {
            SymbolKind::Data(data) => Some(data),
            _ => None,
        };
        self.listing.declarations.push(Declaration {
            name: display(tree.text(found.name)),
            place: self.place(found.file, found.name),
            statement: data.map(|data| tree.node_span(data.node)).unwrap_or_default(),
            literal: data.and_then(|data| data.value).map(|value| {
                let (first, end) = tokens_of(tree, value);
                tree.span(first, end)
            }),
            array: data.is_some_and(|data| data.dimensions.is_some()),
            uses: Vec::new(),
            other_uses: Vec::new(),
        });
        let index = self.listing.declarations.len() as u32 - 1;
        self.declarations.insert(symbol, index);
        index
    }

    /// A motion instruction of the table.
    fn known(
        &mut self,
        unit: Unit,
        node: u32,
        state: &AbstractState,
        nesting: Nesting,
        known: usize,
    ) -> Motion {
        let tree = &self.trees[unit.file as usize];
        let instruction: &Instruction = &INSTRUCTIONS[known];
        let mut motion = self.motion(unit, node, state, nesting);
        self.acting = false;
        motion.instruction = self.name_of(known);
        motion.kind = instruction.kind;
        let count = arguments(tree, node).filter(|argument| !argument.optional).count();
        let (mut index, mut work_object, mut has_tool) = (0, None, false);
        let (mut velocity, mut time) = (None, None);
        let (mut targets, mut to, mut via) = (0, false, instruction.kind != MotionKind::Circular);
        let mut options = Options::default();
        for argument in arguments(tree, node) {
            if argument.optional {
                options.note(tree, argument);
                match argument.name.map(|name| tree.text(name)) {
                    Some(name) if same_name(name, b"WObj") => work_object = argument.value,
                    Some(name) if same_name(name, b"V") => velocity = argument.value,
                    Some(name) if same_name(name, b"T") => time = argument.value,
                    _ => {}
                }
                continue;
            }
            let slot = match argument.name.map(|name| tree.text(name)) {
                None => instruction.slot(index, count),
                Some(name) => named_slot(name),
            };
            index += 1;
            let Some(value) = argument.value else { continue };
            match slot {
                Some(Slot::To) => {
                    let joints = instruction.takes_joints();
                    self.take(&mut motion, (unit, node, state), value, joints, (Role::To, targets));
                    (targets, to) = (targets + 1, true);
                }
                Some(Slot::Via) => {
                    self.take(&mut motion, (unit, node, state), value, false, (Role::Via, targets));
                    (targets, via) = (targets + 1, true);
                }
                Some(Slot::Speed) => motion.speed = Some(self.speed(unit, state, value)),
                Some(Slot::Zone) => motion.zone = Some(self.zone(unit, state, value)),
                Some(Slot::Tool) => {
                    has_tool = true;
                    motion.tool = Some(self.tool(unit, state, value));
                }
                _ => {}
            }
        }
        motion.timed = options.timed;
        if let (Some(speed), Some(velocity)) = (motion.speed, velocity) {
            motion.speed = Some(self.overridden(speed, unit, state, velocity));
        }
        if let Some(time) = time {
            let duration_s = self.evaluated(unit, state, time).number();
            self.listing.durations_s.insert(self.listing.motions.len() as u32, duration_s);
        }
        let free = !options.timed && !options.whole && !nesting.guarded && !self.asks(unit, node);
        let splits = instruction.between != Between::Nothing && instruction.also != Also::Triggers;
        motion.insertable = free && splits;
        motion.straightens = free
            && instruction.kind == MotionKind::Circular
            // What is triggered at a distance along the movement would be triggered along its last piece.
            && instruction
                .line_form()
                .is_some_and(|line| line.between != Between::Nothing && line.also != Also::Triggers);
        if has_tool {
            motion.work_object = Some(self.work_object(unit, state, work_object));
        }
        let complete = to && via && count >= instruction.least();
        motion.left = self.left_because(&motion, instruction, &options, complete);
        // Whatever is written in place of an expression that acts, or instead of the circle point, would act no more.
        // A target that is not known stays for that reason.
        let known = motion.targets.iter().all(|target| target.value.is_ok());
        motion.left = motion.left.or((self.acting && known).then_some(Reason::SideEffect));
        motion
    }

    /// Why a motion instruction is left as it is: for what it does itself, its frames or its speed. `complete` is whether it
    /// has all arguments.
    fn left_because(
        &self,
        motion: &Motion,
        instruction: &Instruction,
        options: &Options,
        complete: bool,
    ) -> Option<Reason> {
        let own = if instruction.kind == MotionKind::External {
            Some(Reason::ExternalOnly)
        } else if !complete {
            Some(Reason::MissingArgument)
        } else if instruction.sensor_guided || options.corrected {
            Some(Reason::SensorGuided)
        } else if options.synchronised {
            Some(Reason::Synchronised)
        } else if instruction.kind == MotionKind::AbsoluteJoint {
            None
        } else {
            self.listing.left_by_frames(motion)
        };
        let speed = self.listing.speed(motion).map(|speed| &speed.value);
        own.or((speed == Some(&Err(Reason::NumberRange))).then_some(Reason::NumberRange))
    }

    /// Whether an argument calls a function of the program, or one that does more than compute: it would be asked once more
    /// for each target that is put in.
    fn asks(&self, unit: Unit, node: u32) -> bool {
        let tree = &self.trees[unit.file as usize];
        let nodes = node..node + tree.nodes[node as usize].size;
        let mut functions = nodes.filter(|&node| tree.nodes[node as usize].kind == Syntax::Function);
        functions.any(|function| {
            let name = tree.text(tree.nodes[function as usize].first);
            self.symbols.routine(unit.scope, name).is_some() || !predefined::only_answers(name)
        })
    }

    /// A call that is no motion instruction of the table but takes a target.
    fn other(&mut self, unit: Unit, node: u32, state: &AbstractState, nesting: Nesting) -> Option<Motion> {
        let tree = &self.trees[unit.file as usize];
        let late = tree.nodes[node as usize].kind == Syntax::LateCall;
        let name = match parts(tree, node).nth(1).filter(|_| late) {
            Some(expression) => text_of(tree, expression),
            None => tree.text(tree.nodes[node as usize].first),
        };
        let routine = if late { None } else { self.symbols.routine(unit.scope, name) };
        let mut found: Vec<(Child, bool)> = Vec::new();
        if let Some(routine) = routine {
            let routine = &self.symbols.routines[routine as usize];
            let home = &self.trees[routine.file as usize];
            let mut required = routine.head.parameters.iter().filter(|parameter| !parameter.optional);
            for argument in arguments(tree, node) {
                let parameter = match argument.name {
                    None => required.next(),
                    Some(option) => routine
                        .head
                        .parameters
                        .iter()
                        .find(|parameter| same_name(home.text(parameter.name), tree.text(option))),
                };
                let (Some(parameter), Some(value)) = (parameter, argument.value) else { continue };
                if parameter.by_reference || parameter.array {
                    continue;
                }
                let type_name = folded(home.text(parameter.type_name));
                match self.symbols.resolved_type(routine.scope, &type_name) {
                    b"robtarget" => found.push((value, false)),
                    b"jointtarget" => found.push((value, true)),
                    _ => {}
                }
            }
        } else if let Some(moves) = predefined::displaces(name).filter(|_| !late) {
            let mut motion = self.motion(unit, node, state, nesting);
            motion.instruction = display(name).into();
            motion.left = Some(moves?);
            return Some(motion);
        } else if predefined::effect(name).is_none() || late {
            for argument in arguments(tree, node) {
                let Some(value) = argument.value else { continue };
                if let Some(joints) = self.looks_like_target(unit, value) {
                    found.push((value, joints));
                }
            }
        }
        if found.is_empty() {
            return None;
        }
        let mut motion = self.motion(unit, node, state, nesting);
        motion.instruction = display(name).into();
        for (value, joints) in found {
            let mut target = self.target(unit, state, value, joints, Role::To);
            // Never rewritten here, so no declaration counts it as a motion's own use.
            if let Origin::Declared(_) | Origin::Element { .. } = target.origin {
                target.origin = Origin::Computed;
            }
            motion.targets.push(target);
        }
        motion.left = Some(match (late, routine) {
            (true, _) => Reason::LateBinding,
            (false, Some(_)) => Reason::OwnRoutine,
            (false, None) => Reason::UnknownInstruction,
        });
        Some(motion)
    }

    /// Whether an argument is a target by its type; says whether it is one of joints.
    fn looks_like_target(&self, unit: Unit, value: Child) -> Option<bool> {
        let tree = &self.trees[unit.file as usize];
        if let Child::Node(node) = value {
            let mut inside = expressions(tree, node);
            match tree.nodes[node as usize].kind {
                Syntax::Paren => return self.looks_like_target(unit, inside.next()?),
                Syntax::Aggregate => {
                    let parts: Vec<Child> = inside.collect();
                    let fits = |types: &[(&[u8], usize)]| {
                        parts.len() == types.len()
                            && parts.iter().zip(types).all(|(&part, of)| self.fits(unit, part, *of))
                    };
                    let joints = fits(&[(b"robjoint", 6), (b"extjoint", 6)]);
                    let pose = fits(&[(b"pos", 3), (b"orient", 4), (b"confdata", 4), (b"extjoint", 6)]);
                    return (joints || pose).then_some(joints);
                }
                _ => {}
            }
        }
        match &*self.evaluator.type_of((unit.file, unit.scope), value)? {
            b"robtarget" => Some(false),
            b"jointtarget" => Some(true),
            _ => None,
        }
    }

    /// Whether a value may be of a type that has so many components.
    fn fits(&self, unit: Unit, value: Child, (type_name, count): (&[u8], usize)) -> bool {
        let tree = &self.trees[unit.file as usize];
        match value {
            Child::Node(node) if tree.nodes[node as usize].kind == Syntax::Aggregate => {
                expressions(tree, node).count() == count
            }
            _ => self.evaluator.type_of((unit.file, unit.scope), value).is_some_and(|t| t == type_name),
        }
    }
}

impl Visitor for Lister<'_, '_> {
    fn visit_call(&mut self, unit: Unit, node: u32, state: &AbstractState, nesting: Nesting) -> Option<u32> {
        if self.silent {
            return None;
        }
        let tree = &self.trees[unit.file as usize];
        let late = tree.nodes[node as usize].kind == Syntax::LateCall;
        let name = tree.text(tree.nodes[node as usize].first);
        let hidden = self.symbols.hides_instruction && self.symbols.routine(unit.scope, name).is_some();
        let known = if late || hidden { None } else { instruction::find(name) };
        let motion = match known {
            Some(known) => self.known(unit, node, state, nesting, known),
            None => self.other(unit, node, state, nesting)?,
        };
        self.listing.motions.push(motion);
        self.guarded.push(nesting.guarded);
        self.modal.push(state.modal);
        self.displaced.push(matches!(state.displacement(), Some(Ok(_))));
        self.units.push(self.unit);
        Some(self.listing.motions.len() as u32 - 1)
    }

    fn exit_switches(&mut self, routine: u32) -> SwitchSet {
        if let Some(exit) = self.exits[routine as usize] {
            return exit;
        }
        let found = &self.symbols.routines[routine as usize];
        // As it begins, or as anything in it or in what it calls may set.
        let anyhow = SwitchSet::ENTRY.join(found.effects.switches);
        if self.depth >= CALL_DEPTH {
            return anyhow;
        }
        // While it is being followed, a routine that calls itself may have ended so.
        self.exits[routine as usize] = Some(anyhow);
        let unit = self.symbols.units[found.unit as usize];
        let was = std::mem::replace(&mut self.silent, true);
        self.depth += 1;
        let evaluator = Evaluator::new(self.trees, self.symbols);
        let exit = interpret_unit(&evaluator, unit, self);
        self.depth -= 1;
        self.silent = was;
        self.exits[routine as usize] = Some(exit);
        exit
    }

    fn record_call(&mut self, site: CallSite) {
        if !self.silent {
            self.sites.push((self.unit, site));
        }
    }

    fn record_late_call(&mut self, modal: SwitchSet) {
        if !self.silent {
            let late = &mut self.late[self.unit as usize];
            *late = late.join(modal);
        }
    }

    fn record_external_call(&mut self, modal: SwitchSet) {
        if !self.silent {
            let outside = &mut self.outside[self.unit as usize];
            *outside = outside.join(modal);
        }
    }

    fn record_position_use(&mut self, standing: &ReachingMotions) {
        if self.silent {
            return;
        }
        match standing.motions() {
            Some(motions) => {
                for motion in motions {
                    self.listing.motions[*motion as usize].left.get_or_insert(Reason::BeforeDisplacement);
                }
            }
            None => self.placed = true,
        }
        if standing.entry {
            self.placed_at_entry.push(self.unit);
        }
    }

    fn record_cycle_restart(&mut self, modal: SwitchSet) {
        for at in 0..self.mains.len() {
            self.record_call(CallSite { routine: self.mains[at], modal });
        }
    }
}

/// The slot of an argument that is given by its name.
fn named_slot(name: &[u8]) -> Option<Slot> {
    const NAMES: [(&[u8], Slot); 6] = [
        (b"ToPoint", Slot::To),
        (b"ToJointPos", Slot::To),
        (b"CirPoint", Slot::Via),
        (b"Speed", Slot::Speed),
        (b"Zone", Slot::Zone),
        (b"Tool", Slot::Tool),
    ];
    NAMES.iter().find(|(known, _)| same_name(name, known)).map(|&(_, slot)| slot)
}

/// The optional arguments that decide whether a motion may be changed.
#[derive(Default)]
struct Options {
    corrected: bool,
    synchronised: bool,
    timed: bool,
    /// Whether something hangs on this one instruction: a process begins or ends with it, or the statements after it run
    /// while the robot goes to it.
    whole: bool,
}

impl Options {
    fn note(&mut self, tree: &RapidTree<'_>, argument: Argument) {
        let Some(name) = argument.name.map(|name| tree.text(name)) else { return };
        self.corrected |= same_name(name, b"Corr") || same_name(name, b"Track");
        self.synchronised |= same_name(name, b"ID");
        self.timed |= same_name(name, b"T") || same_name(name, b"Time");
        self.whole |= [&b"On"[..], b"Off", b"Conc"].iter().any(|whole| same_name(name, whole));
    }
}

fn left_by_modal(motion: &Motion, displaced: bool) -> Option<Reason> {
    if motion.modal.synchronised != SwitchState::Off {
        Some(Reason::Synchronised)
    } else if motion.modal.sensor_guided != SwitchState::Off {
        Some(Reason::SensorGuided)
    } else if motion.modal.axis_apart != SwitchState::Off {
        Some(Reason::AxisApart)
    } else if displaced && motion.kind != MotionKind::AbsoluteJoint {
        Some(Reason::Displacement)
    } else {
        None
    }
}
