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
use super::flow::control;
use super::predefined;
use super::symbol::Unit;
use super::syntax::{RapidTree, Syntax, arguments};
use super::task::Task;
use super::token::{Token, same_name};
use super::value::Value;
use crate::dataflow::{Callees, Control, Edge, Exits, FiniteLattice, Lattice, Nesting, Transfer, propagate};
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

/// Two loads that differ are unknown.
impl Lattice for Grip {
    fn join(&mut self, other: &Self) {
        if self != other {
            *self = Grip::Unknown;
        }
    }
}

impl FiniteLattice for Grip {
    const HEIGHT: usize = 1;
}

/// Gripped load at a statement of a routine. `None`: as at its entry.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Gripped(Option<Grip>);

impl Gripped {
    const UNKNOWN: Gripped = Gripped(Some(Grip::Unknown));
    const AS_AT_ENTRY: Gripped = Gripped(None);
}

impl Lattice for Gripped {
    fn join(&mut self, other: &Self) {
        if self != other {
            *self = Self::UNKNOWN;
        }
    }
}

/// Abstract interpretation of all statements of a task.
struct GripAnalysis<'t, 's> {
    task: &'t Task<'s>,
    evaluator: Evaluator<'t, 's>,
    /// Motions by file and first byte of their statement.
    motions: HashMap<(u32, u32), usize>,
    /// Each visited motion: its index, the state and the unit.
    met: Vec<(usize, Gripped, u32)>,
    /// Calls: calling unit, called unit, state at the call.
    calls: Vec<Edge<Gripped>>,
    /// State at the end of each unit.
    exits: Exits<Gripped>,
    totals: HashMap<usize, Load>,
}

/// Mass of `load0`, which means no load (kg).
const NOTHING_KG: f64 = 0.001;

impl<'t, 's> GripAnalysis<'t, 's> {
    fn new(task: &'t Task<'s>) -> Self {
        let motions = task.listing.motions.iter().enumerate();
        Self {
            task,
            evaluator: Evaluator::new(&task.trees, &task.symbols),
            motions: motions.map(|(i, m)| ((m.place.file, m.statement.start), i)).collect(),
            met: Vec::new(),
            calls: Vec::new(),
            exits: Exits { known: vec![None; task.symbols.units.len()], depth: 0 },
            totals: HashMap::new(),
        }
    }

    fn run(mut self) -> Loads {
        for unit in 0..self.task.symbols.units.len() as u32 {
            let exit = self.interpret(unit);
            self.exits.known[unit as usize] = Some(exit);
            if self.is_main(unit as usize) {
                // The next cycle starts with the load of this one.
                self.calls.push((unit, unit, exit));
            }
        }
        let mut grips = vec![Grip::Unknown; self.task.listing.motions.len()];
        if self.task.symbols.interrupt_routines.iter().any(|routine| self.may_grip_in(*routine)) {
            return Loads { grips, totals: self.totals };
        }
        let entries = self.entries();
        for (motion, state, unit) in &self.met {
            grips[*motion] = state.0.unwrap_or(entries[*unit as usize]);
        }
        Loads { grips, totals: self.totals }
    }

    /// Gripped load at entry of each unit: none at the start of main; elsewhere the join over all calls.
    fn entries(&mut self) -> Vec<Grip> {
        let symbols = &self.task.symbols;
        let units = &symbols.units;
        let begins = |unit: usize| units[unit].routine.is_none() || self.is_main(unit);
        let mut entries: Vec<Option<Grip>> =
            (0..units.len()).map(|unit| begins(unit).then_some(Grip::Empty)).collect();
        // Computed calls and interrupts can occur with any load.
        let late = symbols.late_list.iter().flat_map(|list| &symbols.late_lists[*list as usize]);
        for routine in late.chain(&symbols.interrupt_routines) {
            entries[symbols.unit_of(*routine) as usize] = Some(Grip::Unknown);
        }
        propagate(&mut entries, &mut self.calls, |state, entry| state.0.or(*entry));
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
}

impl Callees for GripAnalysis<'_, '_> {
    type Exit = Gripped;

    fn exits(&mut self) -> &mut Exits<Gripped> {
        &mut self.exits
    }

    fn any_exit(&self, _unit: u32) -> Gripped {
        Gripped::UNKNOWN
    }

    fn interpret(&mut self, index: u32) -> Gripped {
        let unit = self.task.symbols.units[index as usize];
        let state = Some(Gripped::AS_AT_ENTRY);
        let mut walk = GripWalk { analysis: self, unit, index, state, end: None };
        walk.walk(unit.node, Nesting::default());
        let GripWalk { state, mut end, .. } = walk;
        end.join(&state);
        end.unwrap_or(Gripped::AS_AT_ENTRY)
    }
}

/// Interpretation of one unit.
struct GripWalk<'w, 't, 's> {
    analysis: &'w mut GripAnalysis<'t, 's>,
    unit: Unit,
    index: u32,
    /// `None` where control does not continue.
    state: Option<Gripped>,
    /// The state where the unit is left before its end.
    end: Option<Gripped>,
}

impl Transfer for GripWalk<'_, '_, '_> {
    type State = Option<Gripped>;

    fn state(&mut self) -> &mut Self::State {
        &mut self.state
    }

    fn size(&self, node: u32) -> u32 {
        self.analysis.tree(self.unit).nodes[node as usize].size
    }

    fn control(&self, node: u32) -> Control {
        control(self.analysis.tree(self.unit), self.unit, node)
    }

    fn transfer(&mut self, node: u32, _nesting: Nesting) {
        match self.analysis.tree(self.unit).nodes[node as usize].kind {
            Syntax::Call => self.call(node),
            Syntax::Return | Syntax::Raise | Syntax::Leave => {
                self.end.join(&self.state);
                self.state = None;
            }
            Syntax::Goto => self.state = None,
            Syntax::LateCall | Syntax::Opaque | Syntax::Unwritten => self.state = Some(Gripped::UNKNOWN),
            _ => self.evaluate(node),
        }
    }

    fn join_any_point(&mut self) {
        let gripped = match self.analysis.statements_may_grip(self.unit, self.unit.node) {
            true => Gripped::UNKNOWN,
            false => Gripped::AS_AT_ENTRY,
        };
        self.state.join(&Some(gripped));
    }

    fn evaluate(&mut self, node: u32) {
        if self.analysis.function_may_grip(self.unit, node) {
            self.state = Some(Gripped::UNKNOWN);
        }
    }

    /// On re-entry the load gripped in the loop may or may not be held.
    fn enter_loop(&mut self, node: u32) {
        if self.analysis.statements_may_grip(self.unit, node) {
            self.state = Some(Gripped::UNKNOWN);
        }
    }

    fn leave_loop(&mut self, node: u32, _before: &Self::State) {
        self.conditions(node);
    }
}

impl GripWalk<'_, '_, '_> {
    fn load(&self, value: Child) -> Option<Load> {
        let known = Known::new();
        let context = Context::new(self.unit.file, self.unit.scope, &known);
        load_of(&self.analysis.evaluator.value(context, value))
    }

    fn call(&mut self, node: u32) {
        let Some(mut state) = self.state else { return };
        let unit = self.unit;
        let tree = self.analysis.tree(unit);
        let name = tree.text(tree.nodes[node as usize].first);
        if predefined::grips(name) {
            let value = arguments(tree, node).find(|a| !a.optional).and_then(|a| a.value);
            self.state = Some(Gripped(Some(match value.and_then(|value| self.load(value)) {
                Some(load) if load.mass_kg > NOTHING_KG => Grip::Holds(load),
                Some(_) => Grip::Empty,
                None => Grip::Unknown,
            })));
            return;
        }
        let recorded = self.analysis.exits.depth == 0;
        let start = tree.node_span(node).start;
        if let Some(&motion) = self.analysis.motions.get(&(unit.file, start))
            && recorded
        {
            self.analysis.met.push((motion, state, self.index));
            let option = arguments(tree, node)
                .find(|a| a.optional && a.name.is_some_and(|name| same_name(tree.text(name), b"TLoad")));
            let total = option.and_then(|a| a.value).and_then(|value| self.load(value));
            // load0 leaves the tool's own load in force.
            if let Some(total) = total.filter(|total| total.mass_kg > NOTHING_KG) {
                self.analysis.totals.insert(motion, total);
            }
        }
        if self.analysis.function_may_grip(unit, node) {
            state = Gripped::UNKNOWN;
        }
        let symbols = &self.analysis.task.symbols;
        let called = symbols.callees(unit.scope, name);
        if recorded {
            let calls = called.iter().map(|routine| (self.index, symbols.unit_of(*routine), state));
            self.analysis.calls.extend(calls);
        }
        self.state = Some(match *called {
            [routine] => match self.analysis.exit_of(symbols.unit_of(routine)) {
                Gripped::AS_AT_ENTRY => state,
                known => known,
            },
            // None of the program, or one of several.
            _ if self.analysis.may_grip(unit, node) => Gripped::UNKNOWN,
            _ => state,
        });
    }
}

/// A loaddata.
fn load_of(value: &Value) -> Option<Load> {
    let Value::List(parts) = value else { return None };
    let [mass, centre, ..] = parts.as_slice() else { return None };
    Some(Load { mass_kg: mass.number().ok()?, centre_mm: centre.numbers().ok()? })
}
