//! What a RAPID program grips and carries at each motion.
//!
//! `GripLoad` adds the gripped load until the next `GripLoad`, with its centre in the tool frame (in the work object where the robot
//! holds that); `\TLoad` of a motion replaces tool load and gripped load, unless it is `load0`. The gripped load is followed as
//! abstract state through branches, loops, calls and functions, and from the end of main to its next cycle; where the states of a
//! join differ it is unknown.
//!
//! Source: ABB RAPID instruction reference (RobotWare 6), GripLoad, MoveL, loaddata, tooldata.

use std::collections::HashMap;

use rayon::prelude::*;

use super::evaluate::{Context, Evaluator, Known};
use super::predefined;
use super::symbol::Unit;
use super::syntax::{RapidTree, Syntax, arguments, parts, token_kind};
use super::task::Task;
use super::token::{Token, same_name};
use super::value::Value;
use crate::motion::load::{Grip, Load, Loads};
use crate::tree::Child;

impl Task<'_> {
    /// The loads that the modules state.
    pub fn loads(&self) -> Loads {
        if states_no_load(self) { Loads::default() } else { GripAnalysis::new(self).run() }
    }
}

/// Whether no statement grips anything and no motion states its load.
fn states_no_load(task: &Task<'_>) -> bool {
    const PORTION: usize = 1 << 16;
    let names = |tree: &RapidTree<'_>, token: usize| {
        let text = tree.text(token as u32);
        same_name(text, b"GripLoad") || same_name(text, b"TLoad")
    };
    task.trees.iter().all(|tree| {
        tree.kinds().par_chunks(PORTION).enumerate().all(|(portion, kinds)| {
            let named = kinds.iter().enumerate().filter(|(_, kind)| **kind == Token::Ident);
            named.into_iter().all(|(index, _)| !names(tree, portion * PORTION + index))
        })
    })
}

/// Gripped load at a statement of a routine. `None`: as at entry of the routine.
type State = Option<Grip>;

/// Join of two states.
fn joined(a: State, b: State) -> State {
    if a == b { a } else { Some(Grip::Unknown) }
}

/// Abstract interpretation of all statements of a task.
struct GripAnalysis<'t, 's> {
    task: &'t Task<'s>,
    evaluator: Evaluator<'t, 's>,
    /// Motions by file and first byte of their statement.
    motions: HashMap<(u32, u32), usize>,
    /// Each visited motion: its index, the state and the unit.
    met: Vec<(usize, State, usize)>,
    /// Calls: called unit, state at the call, calling unit.
    calls: Vec<(usize, State, usize)>,
    /// State at the end of each unit; unknown while it is being computed.
    exits: Vec<Option<State>>,
    totals: HashMap<usize, Load>,
    unit: usize,
    dry_run: bool,
}

/// Mass of `load0`, which means no load (kg).
const NOTHING_KG: f64 = 0.001;

/// Largest call depth.
const DEPTH: usize = 12;

impl<'t, 's> GripAnalysis<'t, 's> {
    fn new(task: &'t Task<'s>) -> Self {
        let motions = task.listing.motions.iter().enumerate();
        Self {
            task,
            evaluator: Evaluator::new(&task.trees, &task.symbols),
            motions: motions.map(|(i, m)| ((m.place.file, m.statement.start), i)).collect(),
            met: Vec::new(),
            calls: Vec::new(),
            exits: vec![None; task.symbols.units.len()],
            totals: HashMap::new(),
            unit: 0,
            dry_run: false,
        }
    }

    fn run(mut self) -> Loads {
        for unit in 0..self.task.symbols.units.len() {
            self.unit = unit;
            let exit = self.walk(self.task.symbols.units[unit], 0);
            self.exits[unit] = Some(exit);
        }
        for unit in 0..self.exits.len() {
            // The next cycle starts with the load of this one.
            if let Some(exit) = self.exits[unit].filter(|_| self.is_main(unit)) {
                self.calls.push((unit, exit, unit));
            }
        }
        let mut grips = vec![Grip::Unknown; self.task.listing.motions.len()];
        if self.task.symbols.interrupt_routines.iter().any(|routine| self.may_grip_in(*routine)) {
            return Loads { grips, totals: self.totals };
        }
        let entries = self.entries();
        for (motion, state, unit) in &self.met {
            grips[*motion] = state.unwrap_or(entries[*unit]);
        }
        Loads { grips, totals: self.totals }
    }

    /// Gripped load at entry of each unit: none at the start of main; elsewhere the join over all calls.
    fn entries(&self) -> Vec<Grip> {
        let symbols = &self.task.symbols;
        let units = &symbols.units;
        let begins = |unit: usize| units[unit].routine.is_none() || self.is_main(unit);
        let mut entries: Vec<Option<Grip>> =
            (0..units.len()).map(|unit| begins(unit).then_some(Grip::Empty)).collect();
        // Computed calls and interrupts can occur with any load.
        let late = symbols.late_callees.iter().flat_map(|late| late.iter().copied());
        let interrupting = (0..).zip(&symbols.interrupts).filter(|(_, interrupts)| **interrupts);
        for routine in late.chain(interrupting.map(|(routine, _)| routine)) {
            entries[symbols.routines[routine as usize].unit as usize] = Some(Grip::Unknown);
        }
        for _ in 0..=units.len() {
            let mut changed = false;
            for (callee, state, caller) in &self.calls {
                let Some(arriving) = state.or(entries[*caller]) else { continue };
                let new = match entries[*callee] {
                    None => arriving,
                    Some(old) if old == arriving => old,
                    Some(_) => Grip::Unknown,
                };
                changed |= entries[*callee] != Some(new);
                entries[*callee] = Some(new);
            }
            if !changed {
                break;
            }
        }
        // Never called in these files.
        entries.into_iter().map(|entry| entry.unwrap_or(Grip::Unknown)).collect()
    }

    fn is_main(&self, unit: usize) -> bool {
        let routine = self.task.symbols.units[unit].routine;
        routine.is_some_and(|routine| self.task.symbols.is_main(&self.task.trees, routine))
    }

    fn tree(&self, unit: Unit) -> &'t RapidTree<'s> {
        &self.task.trees[unit.file as usize]
    }

    fn walk(&mut self, unit: Unit, depth: usize) -> State {
        let mut exits: Vec<State> = Vec::new();
        let end = self.block(unit, unit.node, Some(None), &mut exits, depth);
        let all = exits.into_iter().chain(end);
        all.reduce(joined).flatten()
    }

    /// The statements under a node; the state is `None` where control does not continue.
    fn block(
        &mut self,
        unit: Unit,
        node: u32,
        mut state: Option<State>,
        exits: &mut Vec<State>,
        depth: usize,
    ) -> Option<State> {
        let tree = self.tree(unit);
        let (mut child, end) = (node + 1, node + tree.nodes[node as usize].size);
        while child < end {
            let kind = tree.nodes[child as usize].kind;
            if !(unit.routine.is_none() && (kind.is_routine() || kind == Syntax::Module)) {
                state = self.statement(unit, child, state, exits, depth);
            }
            child += tree.nodes[child as usize].size;
        }
        state
    }

    fn statement(
        &mut self,
        unit: Unit,
        node: u32,
        state: Option<State>,
        exits: &mut Vec<State>,
        depth: usize,
    ) -> Option<State> {
        let tree = self.tree(unit);
        let either = |a: Option<State>, b: Option<State>| match (a, b) {
            (Some(a), Some(b)) => Some(joined(a, b)),
            (a, b) => a.or(b),
        };
        let unsure =
            |statements_may_grip: bool| if statements_may_grip { Some(Some(Grip::Unknown)) } else { state };
        match tree.nodes[node as usize].kind {
            Syntax::Body => self.block(unit, node, state, exits, depth),
            Syntax::Call => self.call(unit, node, state, depth),
            Syntax::LateCall => unsure(true),
            Syntax::CompactIf => {
                let state = unsure(self.condition_may_grip(unit, node));
                either(self.block(unit, node, state, exits, depth), state)
            }
            Syntax::If | Syntax::Test => {
                let (mut out, mut complete) = (None, false);
                // Conditions are evaluated first.
                let function_may_grip = |node: u32| self.condition_may_grip(unit, node);
                let state = unsure(function_may_grip(node) || tree.child_nodes(node).any(function_may_grip));
                for branch in tree.child_nodes(node) {
                    if !matches!(tree.nodes[branch as usize].kind, Syntax::Branch | Syntax::Case) {
                        continue;
                    }
                    let first = parts(tree, branch).next().and_then(|first| token_kind(tree, first));
                    complete |= matches!(first, Some(Token::Else | Token::Default));
                    out = either(out, self.block(unit, branch, state, exits, depth));
                }
                if complete { out } else { either(out, state) }
            }
            Syntax::For | Syntax::While => {
                // On re-entry the load gripped in the loop may or may not be held.
                let entry = unsure(self.statements_may_grip(unit, node));
                let passed = if self.condition_may_grip(unit, node) { entry } else { state };
                either(self.block(unit, node, entry, exits, depth), passed)
            }
            Syntax::ErrorClause | Syntax::UndoClause | Syntax::BackwardClause => {
                let anywhere =
                    if self.statements_may_grip(unit, unit.node) { Some(Some(Grip::Unknown)) } else { state };
                self.block(unit, node, anywhere, exits, depth);
                state
            }
            Syntax::Label => {
                if self.statements_may_grip(unit, unit.node) {
                    Some(Some(Grip::Unknown))
                } else {
                    state.or(Some(None))
                }
            }
            Syntax::Return | Syntax::Raise | Syntax::Leave => {
                exits.extend(state);
                None
            }
            Syntax::Goto => None,
            Syntax::Opaque | Syntax::Unwritten => unsure(true),
            _ => unsure(self.function_may_grip(unit, node)),
        }
    }

    /// Whether evaluating a condition or bound of a statement may change the gripped load.
    fn condition_may_grip(&self, unit: Unit, node: u32) -> bool {
        let tree = self.tree(unit);
        tree.child_nodes(node).any(|child| {
            tree.nodes[child as usize].kind.is_expression() && self.function_may_grip(unit, child)
        })
    }

    /// Whether a function call under a node may change the gripped load.
    fn function_may_grip(&self, unit: Unit, node: u32) -> bool {
        let tree = self.tree(unit);
        (node..node + tree.nodes[node as usize].size)
            .any(|node| tree.nodes[node as usize].kind == Syntax::Function && self.may_grip(unit, node))
    }

    /// Whether a call may change the gripped load.
    fn may_grip(&self, unit: Unit, node: u32) -> bool {
        let tree = self.tree(unit);
        let name = tree.text(tree.nodes[node as usize].first);
        let own = self.task.symbols.callees(unit.scope, name);
        own.iter().any(|routine| self.may_grip_in(*routine))
            || own.is_empty()
                && predefined::calls_by_name(name)
                && self.task.symbols.late_callees_of(unit).iter().any(|routine| self.may_grip_in(*routine))
    }

    /// Whether a routine may change the gripped load, directly or in what it calls.
    fn may_grip_in(&self, routine: u32) -> bool {
        self.task.symbols.routines[routine as usize].effects.grips
    }

    /// Whether statements under a node may change the gripped load.
    fn statements_may_grip(&self, unit: Unit, node: u32) -> bool {
        let tree = self.tree(unit);
        let end = node + tree.nodes[node as usize].size;
        (node..end).any(|node| match tree.nodes[node as usize].kind {
            Syntax::LateCall | Syntax::Opaque => true,
            Syntax::Call => {
                predefined::grips(tree.text(tree.nodes[node as usize].first)) || self.may_grip(unit, node)
            }
            Syntax::Function => self.may_grip(unit, node),
            _ => false,
        })
    }

    fn load(&self, unit: Unit, value: Child) -> Option<Load> {
        let known = Known::new();
        let context = Context::new(unit.file, unit.scope, &known);
        load_of(&self.evaluator.value(context, value))
    }

    fn call(&mut self, unit: Unit, node: u32, state: Option<State>, depth: usize) -> Option<State> {
        let state = state?;
        let tree = self.tree(unit);
        let name = tree.text(tree.nodes[node as usize].first);
        if predefined::grips(name) {
            let value = arguments(tree, node).find(|a| !a.optional).and_then(|a| a.value);
            return Some(Some(match value.and_then(|value| self.load(unit, value)) {
                Some(load) if load.mass_kg > NOTHING_KG => Grip::Holds(load),
                Some(_) => Grip::Empty,
                None => Grip::Unknown,
            }));
        }
        let start = tree.node_span(node).start;
        if let Some(&motion) = self.motions.get(&(unit.file, start))
            && !self.dry_run
        {
            self.met.push((motion, state, self.unit));
            let option = arguments(tree, node)
                .find(|a| a.optional && a.name.is_some_and(|name| same_name(tree.text(name), b"TLoad")));
            let total = option.and_then(|a| a.value).and_then(|value| self.load(unit, value));
            // load0 leaves the tool's own load in force.
            if let Some(total) = total.filter(|total| total.mass_kg > NOTHING_KG) {
                self.totals.insert(motion, total);
            }
        }
        let state = if self.function_may_grip(unit, node) { Some(Grip::Unknown) } else { state };
        let routine = match *self.task.symbols.callees(unit.scope, name) {
            [] if self.may_grip(unit, node) => return Some(Some(Grip::Unknown)),
            [] => return Some(state),
            [routine] => routine,
            // One of several possible callees.
            ref several if !self.dry_run => {
                for routine in several {
                    let callee = self.task.symbols.routines[*routine as usize].unit as usize;
                    self.calls.push((callee, state, self.unit));
                }
                return Some(if self.may_grip(unit, node) { Some(Grip::Unknown) } else { state });
            }
            _ => return Some(if self.may_grip(unit, node) { Some(Grip::Unknown) } else { state }),
        };
        let callee = self.task.symbols.units.iter().position(|unit| unit.routine == Some(routine));
        let Some(callee) = callee else { return Some(Some(Grip::Unknown)) };
        if !self.dry_run {
            self.calls.push((callee, state, self.unit));
        }
        Some(match self.exit_of(callee, depth) {
            None => state,
            known => known,
        })
    }

    /// State at the end of a unit.
    fn exit_of(&mut self, unit: usize, depth: usize) -> State {
        if let Some(exit) = self.exits[unit] {
            return exit;
        }
        if depth >= DEPTH {
            return Some(Grip::Unknown);
        }
        // Recursive calls are not followed further.
        self.exits[unit] = Some(Some(Grip::Unknown));
        let dry_run = std::mem::replace(&mut self.dry_run, true);
        let exit = self.walk(self.task.symbols.units[unit], depth + 1);
        self.dry_run = dry_run;
        self.exits[unit] = Some(exit);
        exit
    }
}

/// A loaddata.
fn load_of(value: &Value) -> Option<Load> {
    let Value::List(parts) = value else { return None };
    let [mass, centre, ..] = parts.as_slice() else { return None };
    Some(Load { mass_kg: mass.number().ok()?, centre_mm: centre.numbers().ok()? })
}
