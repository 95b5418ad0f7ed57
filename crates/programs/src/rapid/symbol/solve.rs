//! Interprocedural side effects: fixpoints over the call graph, on the facts of each unit.
//!
//! Method: flow-insensitive may-analysis. Two fixpoints, callees first so that one pass suffices without recursion: which
//! parameters by reference each routine writes, then the side-effect summary of each routine. Both only grow. Unknown code (a
//! routine that no file declares) and a call by a computed name may write everything outside their caller. A third step marks
//! volatile data: what an interrupt routine, an error handler that resumes, or the controller may write between any two
//! statements.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use super::effects::{SideEffects, SwitchExit, Write, WriteKind};
use super::facts::{UnitFacts, is_resuming_handler};
use super::late_binding::ProcedureIndex;
use super::writes::component_path;
use super::{Symbol, SymbolKind, Symbols, Unit};
use crate::motion::Reason;
use crate::rapid::modal::SwitchSet;
use crate::rapid::syntax::{RapidTree, Syntax};
use crate::rapid::token::folded;

/// Types without components.
const SIMPLE: [&[u8]; 8] = [b"num", b"dnum", b"bool", b"string", b"byte", b"intnum", b"errnum", b"clock"];

impl Symbols {
    /// Solves the side effects of all routines, and what may write each symbol.
    pub(super) fn solve_effects(&mut self, trees: &[RapidTree<'_>]) {
        let mut seen: HashSet<Vec<u8>> = HashSet::new();
        for symbol in self.symbols.iter().filter(|symbol| matches!(symbol.kind, SymbolKind::Record(_))) {
            let name = folded(trees[symbol.file as usize].text(symbol.name));
            if !seen.insert(name.clone()) {
                self.duplicate_records.insert(name);
            }
        }
        let mut all = self.collect_facts(trees);
        self.callees_first = self.order_callees_first(&all);
        if self.solve_parameter_writes(trees) {
            // Calls write more than their own text shows.
            all = self.collect_facts(trees);
        }
        for facts in &all {
            let mut written: Vec<u32> = facts.writes.iter().map(|write| write.symbol).collect();
            written.sort_unstable();
            written.dedup();
            self.written.push(written);
        }
        for (facts, unit) in all.iter().zip(self.units.clone()) {
            for write in &facts.writes {
                self.record_write(&trees[unit.file as usize], write);
            }
        }
        self.record_writes_by_name(&all);
        let mut procedures = ProcedureIndex::of(self, trees);
        self.late_callees = all.iter().map(|facts| procedures.matches(&facts.late_calls)).collect();
        self.interrupts = self.routines.iter().map(|routine| routine.head.kind == Syntax::Trap).collect();
        for facts in &all {
            for &routine in procedures.matches(&facts.interrupts).iter() {
                self.interrupts[routine as usize] = true;
            }
            self.all_switches = self.all_switches.join(facts.switches);
            self.restarts_main |= facts.restarts_main;
        }
        let interrupting = (0..).zip(&self.interrupts).filter(|&(_, &interrupts)| interrupts);
        self.interrupt_routines = interrupting.map(|(routine, _)| routine).collect();
        self.solve_side_effects(&all);
        self.interrupts_move_robot = self.find_moving_interrupts(trees);
        self.late_switches = self.late_call_effects().into_iter().map(|(_, switches)| switches).collect();
        self.solve_volatile_data(trees, &all);
        let mut called = vec![false; all.len()];
        for &routine in all.iter().flat_map(|facts| &facts.calls) {
            called[self.routines[routine as usize].unit as usize] = true;
        }
        for (at, facts) in all.into_iter().enumerate() {
            let unchanged = match self.units[at].routine {
                Some(routine) => self.effects_of(routine).switches == SwitchSet::EMPTY,
                None => facts.switch_calls.is_empty(),
            };
            let exit =
                if unchanged { SwitchExit::Unchanged } else { SwitchExit::Changed { called: called[at] } };
            self.switch_exits.push(exit);
            self.switch_calls.push(facts.switch_calls);
        }
    }

    /// The side-effect summary of a routine.
    pub(super) fn effects_of(&self, routine: u32) -> &SideEffects {
        &self.routines[routine as usize].effects
    }

    /// Post-order of the call graph: each unit after its callees, except along recursive calls.
    fn order_callees_first(&self, all: &[UnitFacts]) -> Vec<u32> {
        let mut out = Vec::with_capacity(all.len());
        let mut seen = vec![false; all.len()];
        let mut stack: Vec<(u32, usize)> = Vec::new();
        for root in 0..all.len() as u32 {
            if std::mem::replace(&mut seen[root as usize], true) {
                continue;
            }
            stack.push((root, 0));
            while let Some((unit, next)) = stack.last_mut() {
                match all[*unit as usize].calls.get(*next) {
                    Some(&routine) => {
                        *next += 1;
                        let callee = self.routines[routine as usize].unit;
                        if !std::mem::replace(&mut seen[callee as usize], true) {
                            stack.push((callee, 0));
                        }
                    }
                    None => {
                        out.push(*unit);
                        stack.pop();
                    }
                }
            }
        }
        out
    }

    fn record_write(&mut self, tree: &RapidTree<'_>, write: &Write) {
        let symbol = &mut self.symbols[write.symbol as usize];
        let handed_over = write.kind == WriteKind::HandedOver;
        if !symbol.assigned {
            symbol.unknown_reason = if handed_over { Reason::HandedOver } else { Reason::Assigned };
        } else if !handed_over {
            symbol.unknown_reason = Reason::Assigned;
        }
        symbol.assigned = true;
        match write.kind {
            WriteKind::Part(place) if !symbol.written_whole => {
                let path = component_path(tree, place);
                if !symbol.written_parts.contains(&path) {
                    symbol.written_parts.push(path);
                }
            }
            _ => symbol.written_whole = true,
        }
    }

    /// SetDataVal with a computed name may write any data, SetAllDataVal any data of its type.
    fn record_writes_by_name(&mut self, all: &[UnitFacts]) {
        let by_name: Vec<&Option<Vec<u8>>> = all.iter().flat_map(|facts| &facts.writes_by_name).collect();
        if by_name.is_empty() {
            return;
        }
        let may_be_written = |symbol: &Symbol| {
            let type_name = self.resolved_type(symbol.scope, &symbol.type_name);
            symbol.is_variable_data()
                && by_name.iter().any(|wanted| wanted.as_deref().is_none_or(|wanted| wanted == type_name))
        };
        let written: Vec<bool> = self.symbols.iter().map(may_be_written).collect();
        for (symbol, _) in self.symbols.iter_mut().zip(written).filter(|(_, written)| *written) {
            (symbol.assigned, symbol.written_whole) = (true, true);
        }
    }

    /// Fixpoint: the parameters by reference that each routine writes, itself or through its callees. Whether there is any.
    fn solve_parameter_writes(&mut self, trees: &[RapidTree<'_>]) -> bool {
        let by_reference =
            |routine: u32| self.routines[routine as usize].head.parameters.iter().any(|p| p.by_reference);
        let units = self.callees_first.iter().map(|&unit| self.units[unit as usize]);
        let units: Vec<(Unit, u32)> =
            units.filter_map(|unit| Some((unit, unit.routine.filter(|&r| by_reference(r))?))).collect();
        let mut any = false;
        loop {
            let mut grown = false;
            for &(unit, routine) in &units {
                for (index, reason) in self.parameters_written_by(&trees[unit.file as usize], unit, routine) {
                    let written = &mut self.routines[routine as usize].parameter_writes[index];
                    if *written != Some(Reason::Assigned) && *written != Some(reason) {
                        *written = Some(reason);
                        grown = true;
                    }
                }
            }
            any |= grown;
            if !grown {
                return any;
            }
        }
    }

    /// The parameters that the statements of a routine write.
    fn parameters_written_by(&self, tree: &RapidTree<'_>, unit: Unit, routine: u32) -> Vec<(usize, Reason)> {
        let parameters = &self.routines[routine as usize].head.parameters;
        let mut out = Vec::new();
        for node in unit.node + 1..unit.node + tree.nodes[unit.node as usize].size {
            if !tree.nodes[node as usize].kind.may_change() {
                continue;
            }
            self.for_each_write(tree, unit.scope, node, &mut |write| {
                let symbol = &self.symbols[write.symbol as usize];
                if symbol.kind != SymbolKind::Parameter || symbol.scope != unit.scope {
                    return;
                }
                let index = parameters.iter().position(|p| p.name == symbol.name && p.by_reference);
                let handed_over = write.kind == WriteKind::HandedOver;
                let reason = if handed_over { Reason::HandedOver } else { Reason::Assigned };
                out.extend(index.map(|index| (index, reason)));
            });
        }
        out
    }

    /// For each unit, the joined effects of the routines that it may call by a computed name: whether they grip, and the
    /// switches that they set.
    fn late_call_effects(&self) -> Vec<(bool, SwitchSet)> {
        // Many units share one list.
        let mut known: HashMap<*const u32, (bool, SwitchSet)> = HashMap::new();
        let joined = |callees: &Arc<[u32]>| {
            let effects = callees.iter().map(|&routine| self.effects_of(routine));
            effects.fold((false, SwitchSet::EMPTY), |(grips, switches), effects| {
                (grips || effects.grips, switches.join(effects.switches))
            })
        };
        let callees = self.late_callees.iter();
        callees.map(|callees| *known.entry(callees.as_ptr()).or_insert_with(|| joined(callees))).collect()
    }

    /// Fixpoint: the side-effect summary of each routine.
    fn solve_side_effects(&mut self, all: &[UnitFacts]) {
        for (facts, unit) in all.iter().zip(&self.units) {
            let Some(routine) = unit.routine else { continue };
            let outside = |symbol: u32| self.symbols[symbol as usize].scope != unit.scope;
            let writes: Vec<u32> =
                facts.writes.iter().map(|write| write.symbol).filter(|&s| outside(s)).collect();
            // A parameter by reference is data of the caller.
            let writes_parameter =
                self.routines[routine as usize].parameter_writes.iter().any(Option::is_some);
            let mut effects = SideEffects {
                impure: facts.impure || facts.calls_unknown || writes_parameter || !writes.is_empty(),
                writes,
                writes_anything: facts.calls_unknown,
                moves: facts.moves,
                waits: facts.waits,
                grips: facts.grips,
                uses_position: facts.uses_position,
                switches: facts.switches,
            };
            effects.normalise();
            self.routines[routine as usize].effects = effects;
        }
        loop {
            let mut grown = false;
            let late = self.late_call_effects();
            for &unit in &self.callees_first {
                let Some(routine) = self.units[unit as usize].routine else { continue };
                let mut effects = std::mem::take(&mut self.routines[routine as usize].effects);
                // All but the writes, of which the number tells whether they grew.
                let size = |effects: &SideEffects| {
                    let count = effects.writes.len();
                    (count, SideEffects { writes: Vec::new(), ..*effects })
                };
                let before = size(&effects);
                let (grips, switches) = late[unit as usize];
                effects.grips |= grips;
                effects.switches = effects.switches.join(switches);
                for &callee in &all[unit as usize].calls {
                    effects.join(self.effects_of(callee));
                }
                effects.normalise();
                grown |= before != size(&effects);
                self.routines[routine as usize].effects = effects;
            }
            if !grown {
                return;
            }
        }
    }

    /// Marks volatile data: written by an interrupt routine, an error handler that resumes, or the controller.
    fn solve_volatile_data(&mut self, trees: &[RapidTree<'_>], all: &[UnitFacts]) {
        let later = all.iter().flat_map(|facts| &facts.writes).filter(|w| w.kind == WriteKind::Later);
        let mut writes: Vec<u32> = later.map(|write| write.symbol).collect();
        let mut writes_anything = false;
        let mut add = |effects: &SideEffects| {
            writes.extend_from_slice(&effects.writes);
            writes_anything |= effects.writes_anything;
        };
        for unit in &self.units {
            let Some(routine) = unit.routine else { continue };
            if self.interrupts[routine as usize] {
                add(self.effects_of(routine));
                continue;
            }
            let tree = &trees[unit.file as usize];
            for clause in tree.child_nodes(unit.node).filter(|&clause| is_resuming_handler(tree, clause)) {
                let end = clause + tree.nodes[clause as usize].size;
                let facts = self.facts_of(trees, *unit, clause + 1..end);
                let writes = facts.writes.iter().map(|write| write.symbol).collect();
                let writes_anything = facts.calls_unknown;
                add(&SideEffects { writes, writes_anything, ..SideEffects::default() });
                for callee in facts.calls {
                    add(self.effects_of(callee));
                }
            }
        }
        for &symbol in &writes {
            self.symbols[symbol as usize].volatile = true;
        }
        // A parameter that the controller keeps a reference to may be any data of its type.
        let kept = writes.iter().filter(|&&s| self.symbols[s as usize].kind == SymbolKind::Parameter);
        let kept: HashSet<Vec<u8>> = kept.map(|&symbol| self.type_of_symbol(symbol)).collect();
        if !kept.is_empty() {
            for symbol in 0..self.symbols.len() as u32 {
                let variable = self.symbols[symbol as usize].is_variable_data();
                if variable && kept.contains(&self.type_of_symbol(symbol)) {
                    let found = &mut self.symbols[symbol as usize];
                    (found.volatile, found.assigned, found.written_whole) = (true, true, true);
                }
            }
        }
        if writes_anything {
            let routines: HashSet<u32> = self.routines.iter().map(|routine| routine.scope).collect();
            for symbol in &mut self.symbols {
                symbol.volatile |= symbol.assigned && !routines.contains(&symbol.scope);
            }
        }
        self.mark_volatile_references();
    }

    /// A parameter by reference may alias volatile data of its type, or of a type with such a component.
    fn mark_volatile_references(&mut self) {
        let volatile = (0..self.symbols.len() as u32).filter(|&symbol| {
            let found = &self.symbols[symbol as usize];
            found.volatile && matches!(found.kind, SymbolKind::Data(_))
        });
        let types: HashSet<Vec<u8>> = volatile.map(|symbol| self.type_of_symbol(symbol)).collect();
        if types.is_empty() {
            return;
        }
        let any = !types.iter().all(|name| SIMPLE.contains(&&**name));
        let referred: HashSet<(u32, u32)> = (self.routines.iter())
            .flat_map(|routine| {
                routine.head.parameters.iter().map(move |parameter| (routine.file, parameter))
            })
            .filter(|(_, parameter)| parameter.by_reference)
            .map(|(file, parameter)| (file, parameter.name))
            .collect();
        for symbol in 0..self.symbols.len() as u32 {
            let found = &self.symbols[symbol as usize];
            let reference =
                found.kind == SymbolKind::Parameter && referred.contains(&(found.file, found.name));
            if reference && (any || types.contains(&self.type_of_symbol(symbol))) {
                self.symbols[symbol as usize].volatile = true;
            }
        }
    }

    /// The type of data or of a parameter, aliases resolved.
    fn type_of_symbol(&self, symbol: u32) -> Vec<u8> {
        let symbol = &self.symbols[symbol as usize];
        self.resolved_type(symbol.scope, &symbol.type_name).to_vec()
    }
}
