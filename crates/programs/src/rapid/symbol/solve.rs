//! Interprocedural side effects: fixpoints over the call graph, on the facts of each body.
//!
//! Method: flow-insensitive may-analysis. Two least fixpoints ([`propagate`]): which parameters by reference are written, then the
//! side-effect summary of each routine. Unknown code (a routine that no file declares) and a call by a computed name may write
//! everything outside their caller. A third step marks volatile data: what an interrupt routine, an error handler that resumes,
//! or the controller may write between any two statements.

use std::collections::HashSet;

use super::effects::{SideEffects, Write, WriteKind};
use super::facts::{BodyFacts, is_resuming_handler, name_loads};
use super::late_binding::ProcedureIndex;
use super::writes::component_path;
use super::{Body, Symbol, SymbolKind, Symbols};
use crate::dataflow::{Edge, Lattice, post_order, propagate};
use crate::motion::Reason;
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
        let calls =
            (0..).zip(&all).flat_map(|(body, facts)| facts.calls.iter().map(move |&callee| (body, callee)));
        let calls: Vec<Edge<()>> = calls.map(|(body, callee)| (body, self.body_of(callee), ())).collect();
        self.callees_first = post_order(all.len(), &calls);
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
        for (facts, body) in all.iter().zip(self.bodies.clone()) {
            for write in &facts.writes {
                self.record_write(&trees[body.file as usize], write);
            }
        }
        self.record_writes_by_name(&all);
        let mut procedures = ProcedureIndex::of(self, trees);
        self.late_list = all.iter().map(|facts| procedures.matches(&facts.late_calls)).collect();
        self.missing_callees = procedures.without_match(all.iter().flat_map(|facts| &facts.late_calls));
        self.interrupts = self.routines.iter().map(|routine| routine.head.kind == Syntax::Trap).collect();
        for facts in &all {
            let called = procedures.matches(&facts.interrupts) as usize;
            procedures.lists[called].iter().for_each(|&routine| self.interrupts[routine as usize] = true);
            self.all_switches = self.all_switches.join(facts.effects.switches);
            self.restarts_main |= facts.restarts_main;
        }
        self.late_lists = procedures.lists;
        let interrupting = (0..).zip(&self.interrupts).filter(|&(_, &interrupts)| interrupts);
        self.interrupt_routines = interrupting.map(|(routine, _)| routine).collect();
        self.solve_side_effects(&all);
        self.states_loads = name_loads(trees);
        self.interrupts_move_robot = self.find_moving_interrupts(trees);
        self.solve_volatile_data(trees, &all);
        self.called = vec![false; all.len()];
        calls.iter().for_each(|(_, callee, ())| self.called[*callee as usize] = true);
        self.switch_calls = all.into_iter().map(|facts| facts.switch_calls).collect();
    }

    /// The side-effect summary of a routine.
    pub(in crate::rapid) fn effects_of(&self, routine: u32) -> &SideEffects {
        &self.routines[routine as usize].effects
    }

    fn record_write(&mut self, tree: &RapidTree<'_>, write: &Write) {
        let symbol = &mut self.symbols[write.symbol as usize];
        let escaped = write.kind == WriteKind::Escaped;
        if !symbol.assigned {
            symbol.unknown_reason = if escaped { Reason::Escaped } else { Reason::Assigned };
        } else if !escaped {
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
    fn record_writes_by_name(&mut self, all: &[BodyFacts]) {
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

    /// Fixpoint: the parameters by reference that each routine writes, itself or by passing them on. Whether there is any.
    fn solve_parameter_writes(&mut self, trees: &[RapidTree<'_>]) -> bool {
        // The parameters of all routines, one after another.
        let mut firsts = Vec::with_capacity(self.routines.len());
        let mut written: Vec<Option<Reason>> = Vec::new();
        for routine in &self.routines {
            firsts.push(written.len());
            written.resize(written.len() + routine.head.parameters.len(), None);
        }
        let mut passed: Vec<Edge<()>> = Vec::new();
        for body in &self.bodies {
            let Some(routine) = body.routine else { continue };
            let parameters = &self.routines[routine as usize].head.parameters;
            if !parameters.iter().any(|parameter| parameter.by_reference) {
                continue;
            }
            let own = |symbol: u32| {
                let symbol = &self.symbols[symbol as usize];
                let is_own = symbol.kind == SymbolKind::Parameter && symbol.scope == body.scope;
                let mut all = parameters.iter();
                let at = all.position(|p| is_own && p.name == symbol.name && p.by_reference)?;
                Some(firsts[routine as usize] + at)
            };
            let tree = &trees[body.file as usize];
            for node in body.node + 1..tree.nodes.subtree_end(body.node) {
                let found = tree.nodes.get(node);
                if !found.kind.may_change() {
                    continue;
                }
                self.for_each_write(tree, body.scope, node, &mut |write| {
                    let escaped = write.kind == WriteKind::Escaped;
                    let reason = if escaped { Reason::Escaped } else { Reason::Assigned };
                    if let Some(at) = own(write.symbol) {
                        written[at].join(&Some(reason));
                    }
                });
                let is_call = matches!(found.kind, Syntax::Call | Syntax::Function);
                if is_call && !self.is_plain_motion(tree, body.scope, node) {
                    let callees = self.callees(body.scope, tree.text(found.first));
                    self.for_each_passed(tree, node, callees, &mut |callee, index, argument| {
                        let data = argument.value.and_then(|value| self.root(tree, body.scope, value));
                        let from = firsts[callee as usize] + index;
                        passed.extend(data.and_then(own).map(|at| (from as u32, at as u32, ())));
                    });
                }
            }
        }
        propagate(&mut written, 2, &mut passed, |(), reason| *reason);
        for (routine, first) in self.routines.iter_mut().zip(firsts) {
            let count = routine.head.parameters.len();
            routine.parameter_writes = written[first..first + count].to_vec();
        }
        written.iter().any(Option::is_some)
    }

    /// Fixpoint: the side-effect summary of each routine.
    fn solve_side_effects(&mut self, all: &[BodyFacts]) {
        let own = |(facts, body): (&BodyFacts, &Body)| {
            let outside = |symbol: u32| self.symbols[symbol as usize].scope != body.scope;
            let writes: Vec<u32> =
                facts.writes.iter().map(|write| write.symbol).filter(|&s| outside(s)).collect();
            // A parameter by reference is data of the caller.
            let writes_parameter = body.routine.is_some_and(|routine| {
                self.routines[routine as usize].parameter_writes.iter().any(Option::is_some)
            });
            let mut effects = SideEffects { writes, ..facts.effects };
            effects.impure |= effects.writes_anything || writes_parameter || !effects.writes.is_empty();
            effects.normalise();
            effects
        };
        let mut effects: Vec<SideEffects> = all.iter().zip(&self.bodies).map(own).collect();
        // After the bodies a node for each list of routines that a computed name may call; what else such a call may do is a fact
        // of its caller.
        let lists = all.len() as u32;
        effects.resize(all.len() + self.late_lists.len(), SideEffects::default());
        let mut edges: Vec<Edge<bool>> = Vec::new();
        for ((caller, facts), list) in (0..).zip(all).zip(&self.late_list) {
            edges.extend(facts.calls.iter().map(|&callee| (self.body_of(callee), caller, false)));
            edges.push((lists + list, caller, false));
        }
        for (list, callees) in (lists..).zip(&self.late_lists) {
            edges.extend(callees.iter().map(|&callee| (self.body_of(callee), list, true)));
        }
        edges.sort_unstable();
        edges.dedup();
        propagate(&mut effects, SideEffects::HEIGHT, &mut edges, |&late, callee| match late {
            true => SideEffects { grips: callee.grips, switches: callee.switches, ..SideEffects::default() },
            false => callee.clone(),
        });
        self.late_switches = effects.split_off(all.len()).iter().map(|effects| effects.switches).collect();
        for (body, effects) in self.bodies.iter().zip(effects) {
            if let Some(routine) = body.routine {
                self.routines[routine as usize].effects = effects;
            }
        }
    }

    /// Marks volatile data: written by an interrupt routine, an error handler that resumes, or the controller.
    fn solve_volatile_data(&mut self, trees: &[RapidTree<'_>], all: &[BodyFacts]) {
        let later = all.iter().flat_map(|facts| &facts.writes).filter(|w| w.kind == WriteKind::Later);
        let mut writes: Vec<u32> = later.map(|write| write.symbol).collect();
        let mut writes_anything = false;
        let mut add = |effects: &SideEffects| {
            writes.extend_from_slice(&effects.writes);
            writes_anything |= effects.writes_anything;
        };
        for body in &self.bodies {
            let Some(routine) = body.routine else { continue };
            if self.interrupts[routine as usize] {
                add(self.effects_of(routine));
                continue;
            }
            let tree = &trees[body.file as usize];
            for clause in tree.child_nodes(body.node).filter(|&clause| is_resuming_handler(tree, clause)) {
                let end = tree.nodes.subtree_end(clause);
                let facts = self.facts_of(trees, *body, clause + 1..end);
                let writes = facts.writes.iter().map(|write| write.symbol).collect();
                add(&SideEffects { writes, ..facts.effects });
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
