//! What statements change: which data, how, and what a call of each routine may bring about.
//!
//! Method: one look at every assignment, call and function of a task. What a routine does with its parameters, and what
//! it changes outside, is carried along the calls until nothing is added; both only grow. A routine that is declared in
//! none of the files, and one that is called by a computed name, may change everything that is not its caller's own.
//! Which routines of the files a computed name may call is told by the text at its beginning and end, and by the number
//! of arguments.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use super::named::{Named, Names};
use super::reach::{Change, Ends, How, REACH, Reach};
use super::{RoutineScope, Symbol, Symbols, Unit, What};
use crate::motion::Reason;
use crate::rapid::instruction::{self, Also, INSTRUCTIONS, Instruction, Slot};
use crate::rapid::modal::{States, setting};
use crate::rapid::predefined::{self, Effect};
use crate::rapid::syntax::{Argument, RapidTree, Syntax, arguments, parts, token_kind};
use crate::rapid::token::{Token, folded, same_name};
use crate::tree::Child;

/// What is gone through once for each unit.
#[derive(Default)]
struct Found {
    changes: Vec<Change>,
    calls: Vec<u32>,
    unknown: bool,
    moves: bool,
    waits: bool,
    grips: bool,
    acts: bool,
    places: bool,
    /// Of which types data is changed by a name that is computed; `None` for any type.
    by_name: Vec<Option<Vec<u8>>>,
    /// The calls that set a switch or call a routine of the program.
    switches: Vec<u32>,
    /// What they set by themselves.
    sets: States,
    /// The routines that it may call by a computed name.
    late: BTreeSet<Named>,
    /// The procedures that it has called while the robot moves.
    interrupts: BTreeSet<Named>,
    /// Whether it begins the next cycle.
    cycles: bool,
}

impl Found {
    /// This, and what the next nodes of the same unit do.
    fn and(mut self, next: Found) -> Found {
        self.changes.extend(next.changes);
        self.calls.extend(next.calls);
        self.switches.extend(next.switches);
        self.interrupts.extend(next.interrupts);
        self.late.extend(next.late);
        self.unknown |= next.unknown;
        self.moves |= next.moves;
        self.waits |= next.waits;
        self.grips |= next.grips;
        self.acts |= next.acts;
        self.places |= next.places;
        self.by_name.extend(next.by_name);
        self.cycles |= next.cycles;
        self.sets = self.sets.or(next.sets);
        self
    }

    fn switch(&mut self, node: u32) {
        if self.switches.last() != Some(&node) {
            self.switches.push(node);
        }
    }
}

/// Types without components.
const SIMPLE: [&[u8]; 8] = [b"num", b"dnum", b"bool", b"string", b"byte", b"intnum", b"errnum", b"clock"];

/// Nodes that one thread goes through at a time.
const PORTION: u32 = 1 << 16;

impl Symbols {
    /// Finds what the program changes.
    pub(super) fn settle(&mut self, trees: &[RapidTree<'_>]) {
        let mut seen: HashSet<Vec<u8>> = HashSet::new();
        for symbol in self.symbols.iter().filter(|symbol| matches!(symbol.what, What::Record(_))) {
            let name = folded(trees[symbol.file as usize].text(symbol.name));
            if !seen.insert(name.clone()) {
                self.records_twice.insert(name);
            }
        }
        let mut all = self.gone_through(trees);
        self.callees_first = self.order(&all);
        if self.settle_parameters(trees) {
            // Calls change more than their own text says.
            all = self.gone_through(trees);
        }
        for found in &mut all {
            let mut changed: Vec<u32> = found.changes.iter().map(|change| change.symbol).collect();
            changed.sort_unstable();
            changed.dedup();
            self.changed.push(changed);
        }
        for (found, unit) in all.iter().zip(self.units.clone()) {
            for change in &found.changes {
                self.note(&trees[unit.file as usize], change);
            }
        }
        let by_name: Vec<&Option<Vec<u8>>> = all.iter().flat_map(|found| &found.by_name).collect();
        if !by_name.is_empty() {
            // SetDataVal with a computed name may mean any data, SetAllDataVal any of the type that it states.
            let meant = |symbol: &Symbol| {
                let written = self.resolved_type(symbol.scope, &symbol.type_name);
                let data = matches!(symbol.what, What::Data(_)) && !symbol.is_constant();
                data && by_name.iter().any(|wanted| wanted.as_deref().is_none_or(|wanted| wanted == written))
            };
            let meant: Vec<bool> = self.symbols.iter().map(meant).collect();
            for (symbol, _) in self.symbols.iter_mut().zip(meant).filter(|(_, meant)| *meant) {
                (symbol.assigned, symbol.whole) = (true, true);
            }
        }
        let mut names = Names::of(self, trees);
        self.late = all.iter().map(|found| names.all(&found.late)).collect();
        self.interrupts = self.routines.iter().map(|routine| routine.head.kind == Syntax::Trap).collect();
        for found in &all {
            for &routine in names.all(&found.interrupts).iter() {
                self.interrupts[routine as usize] = true;
            }
            self.everything = self.everything.or(found.sets);
            self.cycles |= found.cycles;
        }
        let interrupting = (0..).zip(&self.interrupts).filter(|&(_, &interrupts)| interrupts);
        self.interrupting = interrupting.map(|(routine, _)| routine).collect();
        self.settle_reaches(&all);
        self.led_away = self.leads_away(trees);
        self.late_sets = self.reached_late().into_iter().map(|(_, sets)| sets).collect();
        self.settle_volatile(trees, &all);
        let mut called = vec![false; all.len()];
        for &routine in all.iter().flat_map(|found| &found.calls) {
            called[self.routines[routine as usize].unit as usize] = true;
        }
        for (at, found) in all.into_iter().enumerate() {
            let quiet = match self.units[at].routine {
                Some(routine) => self.routines[routine as usize].reach.sets == States::NONE,
                None => found.switches.is_empty(),
            };
            self.ends.push(if quiet { Ends::AsItBegins } else { Ends::Set { called: called[at] } });
            self.switches.push(found.switches);
        }
    }

    fn gone_through(&self, trees: &[RapidTree<'_>]) -> Vec<Found> {
        let found = |&unit: &Unit| {
            let nodes = unit.node + 1..unit.node + trees[unit.file as usize].nodes[unit.node as usize].size;
            // The parts of a long routine side by side; outside routines whole ones are passed over.
            let parts =
                if unit.routine.is_some() { nodes.len().div_ceil(PORTION as usize).max(1) } else { 1 };
            if parts == 1 {
                return self.found(trees, unit, nodes);
            }
            let part = |index: usize| {
                let first = nodes.start + index as u32 * PORTION;
                self.found(trees, unit, first..(first + PORTION).min(nodes.end))
            };
            let mut parts: Vec<Found> = (0..parts).into_par_iter().map(part).collect();
            let rest = parts.split_off(1);
            rest.into_iter().fold(parts.swap_remove(0), Found::and)
        };
        self.units.iter().map(found).collect()
    }

    /// The units in such an order that what a routine calls stands before it, as far as none calls itself.
    fn order(&self, all: &[Found]) -> Vec<u32> {
        let mut out = Vec::with_capacity(all.len());
        let mut seen = vec![false; all.len()];
        let mut open: Vec<(u32, usize)> = Vec::new();
        for begin in 0..all.len() as u32 {
            if std::mem::replace(&mut seen[begin as usize], true) {
                continue;
            }
            open.push((begin, 0));
            while let Some((unit, next)) = open.last_mut() {
                match all[*unit as usize].calls.get(*next) {
                    Some(&routine) => {
                        *next += 1;
                        let called = self.routines[routine as usize].unit;
                        if !std::mem::replace(&mut seen[called as usize], true) {
                            open.push((called, 0));
                        }
                    }
                    None => {
                        out.push(*unit);
                        open.pop();
                    }
                }
            }
        }
        out
    }

    /// Notes a change of data.
    fn note(&mut self, tree: &RapidTree<'_>, change: &Change) {
        let symbol = &mut self.symbols[change.symbol as usize];
        let handed = change.how == How::HandedOver;
        if !symbol.assigned {
            symbol.unknown = if handed { Reason::HandedOver } else { Reason::Assigned };
        } else if !handed {
            symbol.unknown = Reason::Assigned;
        }
        symbol.assigned = true;
        match change.how {
            How::Part(place) if !symbol.whole => {
                let path = path(tree, place);
                if !symbol.parts.contains(&path) {
                    symbol.parts.push(path);
                }
            }
            _ => symbol.whole = true,
        }
    }

    /// Which parameters routines change, by themselves or through what they call; whether any does.
    fn settle_parameters(&mut self, trees: &[RapidTree<'_>]) -> bool {
        let by_reference =
            |routine: u32| self.routines[routine as usize].head.parameters.iter().any(|p| p.by_reference);
        let units = self.callees_first.iter().map(|&unit| self.units[unit as usize]);
        let units: Vec<(Unit, u32)> =
            units.filter_map(|unit| Some((unit, unit.routine.filter(|&r| by_reference(r))?))).collect();
        let mut any = false;
        loop {
            let mut grown = false;
            for &(unit, routine) in &units {
                for (at, reason) in self.written_by(&trees[unit.file as usize], unit, routine) {
                    let written = &mut self.routines[routine as usize].written[at];
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

    /// The parameters that the statements of a routine change.
    fn written_by(&self, tree: &RapidTree<'_>, unit: Unit, routine: u32) -> Vec<(usize, Reason)> {
        let parameters = &self.routines[routine as usize].head.parameters;
        let mut out = Vec::new();
        for node in unit.node + 1..unit.node + tree.nodes[unit.node as usize].size {
            if !tree.nodes[node as usize].kind.may_change() {
                continue;
            }
            self.changed_by(tree, unit.scope, node, &mut |change| {
                let symbol = &self.symbols[change.symbol as usize];
                if symbol.what != What::Parameter || symbol.scope != unit.scope {
                    return;
                }
                let at = parameters.iter().position(|p| p.name == symbol.name && p.by_reference);
                let handed = change.how == How::HandedOver;
                out.extend(at.map(|at| (at, if handed { Reason::HandedOver } else { Reason::Assigned })));
            });
        }
        out
    }

    /// What the statements of some nodes do by themselves.
    fn found(&self, trees: &[RapidTree<'_>], unit: Unit, nodes: Range<u32>) -> Found {
        let tree = &trees[unit.file as usize];
        let mut found = Found::default();
        let mut node = nodes.start;
        while node < nodes.end {
            let kind = tree.nodes[node as usize].kind;
            if unit.routine.is_none() && (kind.is_routine() || kind == Syntax::Module) {
                node += tree.nodes[node as usize].size;
                continue;
            }
            if kind == Syntax::Call && self.moves_only(tree, unit.scope, node) {
                (found.moves, found.acts) = (true, true);
                node += 1;
                continue;
            }
            if kind.may_change() {
                self.changed_by(tree, unit.scope, node, &mut |change| found.changes.push(change));
            }
            match kind {
                Syntax::LateCall => {
                    let name = parts(tree, node).nth(1);
                    self.found_late(tree, (node, name), &mut found);
                }
                Syntax::Call | Syntax::Function => self.found_call(tree, unit, (node, kind), &mut found),
                // It may wait for another task.
                Syntax::While => found.waits = true,
                _ => {}
            }
            found.acts |= self.acts_itself(tree, unit.scope, node);
            node += 1;
        }
        found
    }

    /// A call or function that does more than move the robot.
    fn found_call(&self, tree: &RapidTree<'_>, unit: Unit, (node, kind): (u32, Syntax), found: &mut Found) {
        let name = tree.text(tree.nodes[node as usize].first);
        let is_call = kind == Syntax::Call;
        let own = self.called(unit.scope, name);
        if let Some(sets) = if is_call && own.is_empty() { setting(tree, node, name) } else { None } {
            found.switch(node);
            found.sets = found.sets.or(sets);
        }
        if is_call && self.is_motion(unit.scope, name) {
            found.moves = true;
            if instruction::find(name).is_some_and(|known| INSTRUCTIONS[known].also == Also::Calls) {
                let name = arguments(tree, node).filter(|argument| !argument.optional).last();
                found.interrupts.insert(Named::by(tree, (name.and_then(|name| name.value), 0, false)));
            }
            return;
        }
        match own {
            [_, ..] => {
                found.switch(node);
                found.calls.extend_from_slice(own);
            }
            [] if is_call && predefined::calls_by_name(name) => {
                let name = arguments(tree, node).find(|argument| !argument.optional);
                self.found_late(tree, (node, name.and_then(|name| name.value)), found);
            }
            [] if predefined::effect(name).is_none() => (found.unknown, found.moves) = (true, true),
            [] => {
                found.moves |= predefined::displaces(name).is_some();
                found.cycles |= predefined::begins_cycle(name);
                found.places |= places(tree, node, name);
                found.waits |= predefined::waits(name);
                found.grips |= predefined::grips(name);
                // What it writes may be data of any routine's caller.
                found.unknown |= self.writes_any(tree, unit.scope, node, name);
                if name.eq_ignore_ascii_case(b"SetAllDataVal") {
                    found.by_name.push(named(tree, node).map(|name| self.type_named(unit.scope, name)));
                } else if name.eq_ignore_ascii_case(b"SetDataVal") && named(tree, node).is_none() {
                    found.by_name.push(None);
                }
            }
        }
    }

    /// Whether a call writes data by a name that the text does not tell.
    pub fn writes_any(&self, tree: &RapidTree<'_>, scope: u32, call: u32, name: &[u8]) -> bool {
        let by_name = name.eq_ignore_ascii_case(b"SetAllDataVal")
            || name.eq_ignore_ascii_case(b"SetDataVal") && named(tree, call).is_none();
        by_name && self.routine(scope, name).is_none()
    }

    /// Whether the robot may be moved between the statements of a unit: by an error handler that goes back to them, or by a
    /// routine that interrupts it and does not store the path to come back to.
    pub fn wanders(&self, trees: &[RapidTree<'_>], unit: Unit) -> bool {
        if self.led_away {
            return true;
        }
        let tree = &trees[unit.file as usize];
        let moves = |node: u32| {
            let name = tree.text(tree.nodes[node as usize].first);
            match tree.nodes[node as usize].kind {
                Syntax::LateCall => true,
                Syntax::Call if self.is_motion(unit.scope, name) => true,
                Syntax::Call | Syntax::Function => match self.called(unit.scope, name) {
                    own @ [_, ..] => own.iter().any(|routine| self.routines[*routine as usize].reach.moves),
                    [] => predefined::displaces(name).is_some() || predefined::effect(name).is_none(),
                },
                _ => false,
            }
        };
        let mut clauses = tree.child_nodes(unit.node).filter(|&clause| resumes(tree, clause));
        clauses.any(|clause| (clause..clause + tree.nodes[clause as usize].size).any(moves))
    }

    /// Whether a routine that interrupts others moves the robot and does not store the path to come back to.
    fn leads_away(&self, trees: &[RapidTree<'_>]) -> bool {
        let stores = |unit: Unit| {
            let tree = &trees[unit.file as usize];
            (unit.node..unit.node + tree.nodes[unit.node as usize].size).any(|node| {
                let node = tree.nodes[node as usize];
                node.kind == Syntax::Call && same_name(tree.text(node.first), b"StorePath")
            })
        };
        self.interrupting.iter().any(|&routine| {
            let routine = &self.routines[routine as usize];
            routine.reach.moves && !stores(self.units[routine.unit as usize])
        })
    }

    fn type_named(&self, scope: u32, name: &[u8]) -> Vec<u8> {
        self.resolved_type(scope, &folded(name)).to_vec()
    }

    /// A call by a computed name.
    fn found_late(&self, tree: &RapidTree<'_>, (node, name): (u32, Option<Child>), found: &mut Found) {
        (found.unknown, found.moves) = (true, true);
        found.switch(node);
        // CallByVar adds a number to the name that it is given.
        let numbered = tree.nodes[node as usize].kind == Syntax::Call;
        let given = arguments(tree, node).filter(|argument| !argument.optional).count();
        let given = if numbered { 0 } else { given };
        found.late.insert(Named::by(tree, (name, given, numbered)));
    }

    /// Whether a call by this name is a motion instruction of the table.
    pub fn is_motion(&self, scope: u32, name: &[u8]) -> bool {
        instruction::find(name).is_some() && !(self.hides_instruction && self.routine(scope, name).is_some())
    }

    /// Whether a call is a motion instruction that writes no argument: nearly every statement of a long program is one.
    pub fn moves_only(&self, tree: &RapidTree<'_>, scope: u32, node: u32) -> bool {
        let name = tree.text(tree.nodes[node as usize].first);
        instruction::find(name).is_some_and(|known| INSTRUCTIONS[known].only_moves())
            && !(self.hides_instruction && self.routine(scope, name).is_some())
    }

    /// What the calls by computed names of each unit may bring about: whether they grip, and what they set.
    fn reached_late(&self) -> Vec<(bool, States)> {
        let mut known: HashMap<*const u32, (bool, States)> = HashMap::new();
        let both = |late: &Arc<[u32]>| {
            late.iter()
                .map(|&routine| &self.routines[routine as usize].reach)
                .fold((false, States::NONE), |(grips, sets), reach| {
                    (grips || reach.grips, sets.or(reach.sets))
                })
        };
        // Many units share one list.
        self.late.iter().map(|late| *known.entry(late.as_ptr()).or_insert_with(|| both(late))).collect()
    }

    /// What a call of each routine may change, through what it calls.
    fn settle_reaches(&mut self, all: &[Found]) {
        for (found, unit) in all.iter().zip(&self.units) {
            let Some(routine) = unit.routine else { continue };
            let outside = |symbol: u32| self.symbols[symbol as usize].scope != unit.scope;
            let changes: Vec<u32> =
                found.changes.iter().map(|change| change.symbol).filter(|&s| outside(s)).collect();
            // A parameter by reference is data of the caller.
            let written = self.routines[routine as usize].written.iter().any(Option::is_some);
            let mut reach = Reach {
                acts: found.acts || found.unknown || written || !changes.is_empty(),
                changes,
                anything: found.unknown,
                moves: found.moves,
                waits: found.waits,
                grips: found.grips,
                places: found.places,
                sets: found.sets,
            };
            reach.settle();
            self.routines[routine as usize].reach = reach;
        }
        loop {
            let mut grown = false;
            let late = self.reached_late();
            for &unit in &self.callees_first {
                let Some(routine) = self.units[unit as usize].routine else { continue };
                let mut reach = std::mem::take(&mut self.routines[routine as usize].reach);
                let said = |reach: &Reach| {
                    let Reach { anything, moves, waits, grips, acts, places, sets, .. } = *reach;
                    (reach.changes.len(), anything, moves, waits, (grips, acts, places), sets)
                };
                let before = said(&reach);
                let (grips, sets) = late[unit as usize];
                reach.grips |= grips;
                reach.sets = reach.sets.or(sets);
                for &called in &all[unit as usize].calls {
                    let other = &self.routines[called as usize].reach;
                    reach.anything |= other.anything;
                    reach.moves |= other.moves;
                    reach.waits |= other.waits;
                    reach.grips |= other.grips;
                    reach.acts |= other.acts;
                    reach.places |= other.places;
                    reach.sets = reach.sets.or(other.sets);
                    reach.changes.extend_from_slice(&other.changes);
                    if reach.changes.len() > 4 * REACH {
                        reach.settle();
                    }
                }
                reach.settle();
                grown |= before != said(&reach);
                self.routines[routine as usize].reach = reach;
            }
            if !grown {
                return;
            }
        }
    }

    /// Data that a trap routine, an error handler that goes back to the statements, or the controller may change at any
    /// time.
    fn settle_volatile(&mut self, trees: &[RapidTree<'_>], all: &[Found]) {
        let later = all.iter().flat_map(|found| &found.changes).filter(|change| change.how == How::Later);
        let mut changes: Vec<u32> = later.map(|change| change.symbol).collect();
        let mut anything = false;
        let mut take = |reach: &Reach| {
            changes.extend_from_slice(&reach.changes);
            anything |= reach.anything;
        };
        for unit in &self.units {
            let Some(routine) = unit.routine else { continue };
            if self.interrupts[routine as usize] {
                take(&self.routines[routine as usize].reach);
                continue;
            }
            let tree = &trees[unit.file as usize];
            for clause in tree.child_nodes(unit.node) {
                let end = clause + tree.nodes[clause as usize].size;
                if !resumes(tree, clause) {
                    continue;
                }
                let found = self.found(trees, *unit, clause + 1..end);
                let changes = found.changes.iter().map(|change| change.symbol).collect();
                take(&Reach { changes, anything: found.unknown, ..Reach::default() });
                for called in found.calls {
                    take(&self.routines[called as usize].reach);
                }
            }
        }
        for &symbol in &changes {
            self.symbols[symbol as usize].volatile = true;
        }
        // A parameter that is kept and written later stands for whatever is given for it.
        let kept = changes.iter().filter(|&&symbol| self.symbols[symbol as usize].what == What::Parameter);
        let kept: HashSet<Vec<u8>> = kept.map(|&symbol| self.type_of_symbol(symbol)).collect();
        for symbol in 0..self.symbols.len() as u32 {
            let found = &self.symbols[symbol as usize];
            let data = matches!(found.what, What::Data(_)) && !found.is_constant();
            if data && !kept.is_empty() && kept.contains(&self.type_of_symbol(symbol)) {
                let found = &mut self.symbols[symbol as usize];
                (found.volatile, found.assigned, found.whole) = (true, true, true);
            }
        }
        if anything {
            let routines: HashSet<u32> = self.routines.iter().map(|routine| routine.scope).collect();
            for symbol in &mut self.symbols {
                symbol.volatile |= symbol.assigned && !routines.contains(&symbol.scope);
            }
        }
        self.settle_references();
    }

    /// A parameter by reference may be another name of data that changes at any time: of its type, or of a component of it.
    fn settle_references(&mut self) {
        let volatile = (0..self.symbols.len() as u32).filter(|&symbol| {
            let found = &self.symbols[symbol as usize];
            found.volatile && matches!(found.what, What::Data(_))
        });
        let types: HashSet<Vec<u8>> = volatile.map(|symbol| self.type_of_symbol(symbol)).collect();
        if types.is_empty() {
            return;
        }
        let simple = |name: &Vec<u8>| SIMPLE.contains(&&**name);
        let any = !types.iter().all(simple);
        let referred: HashSet<(u32, u32)> = (self.routines.iter())
            .flat_map(|routine| {
                routine.head.parameters.iter().map(move |parameter| (routine.file, parameter))
            })
            .filter(|(_, parameter)| parameter.by_reference)
            .map(|(file, parameter)| (file, parameter.name))
            .collect();
        for symbol in 0..self.symbols.len() as u32 {
            let found = &self.symbols[symbol as usize];
            let reference = found.what == What::Parameter && referred.contains(&(found.file, found.name));
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

    // ---- one statement ----

    /// The data that a statement or function call may change by itself, not by what the called routine does. Constants
    /// never change.
    pub fn changed_by(&self, tree: &RapidTree<'_>, scope: u32, node: u32, report: &mut dyn FnMut(Change)) {
        let mut give = |symbol: Option<u32>, how: How| {
            if let Some(symbol) = symbol
                && !self.symbols[symbol as usize].is_constant()
            {
                report(Change { symbol, how });
            }
        };
        match tree.nodes[node as usize].kind {
            Syntax::Assignment => {
                if let Some(place) = parts(tree, node).next() {
                    give(self.root(tree, scope, place), how_assigned(tree, place));
                }
            }
            Syntax::For => {
                let name = parts(tree, node).find(|&part| token_kind(tree, part) == Some(Token::Ident));
                give(name.and_then(|name| self.root(tree, scope, name)), How::Whole);
            }
            Syntax::Connect => {
                let name = parts(tree, node).find(|&part| token_kind(tree, part) != Some(Token::Connect));
                give(name.and_then(|name| self.root(tree, scope, name)), How::Whole);
            }
            Syntax::Call | Syntax::Function => {
                let name = tree.text(tree.nodes[node as usize].first);
                self.changed_by_call(tree, scope, (node, name), &mut give);
            }
            Syntax::LateCall => {
                for argument in arguments(tree, node) {
                    give(argument.value.and_then(|value| self.root(tree, scope, value)), How::HandedOver);
                }
            }
            _ => {}
        }
    }

    fn changed_by_call(
        &self,
        tree: &RapidTree<'_>,
        scope: u32,
        (node, name): (u32, &[u8]),
        give: &mut dyn FnMut(Option<u32>, How),
    ) {
        let is_call = tree.nodes[node as usize].kind == Syntax::Call;
        let known = if is_call { instruction::find(name).map(|known| &INSTRUCTIONS[known]) } else { None };
        // Nearly all motions write none.
        if !self.hides_instruction && known.is_some_and(Instruction::only_moves) {
            return;
        }
        let root = |argument: &Argument| self.root(tree, scope, argument.value?);
        let called = self.called(scope, name);
        for routine in called.iter().map(|&routine| &self.routines[routine as usize]) {
            self.changed_by_routine(tree, scope, node, routine, give);
        }
        if !called.is_empty() {
            return;
        }
        if let Some(known) = known {
            return changed_by_instruction(tree, node, known, &mut |argument| {
                give(root(argument), How::Whole)
            });
        }
        match predefined::effect(name) {
            Some(Effect::Reads) => {
                if name.eq_ignore_ascii_case(b"SetDataVal")
                    && let Some(named) = named(tree, node)
                {
                    // With \Block it may be the data of another module or routine.
                    let key = folded(named);
                    for found in self.scopes.iter().filter_map(|scope| scope.names.get(&key)) {
                        give(Some(*found), How::Whole);
                    }
                }
            }
            Some(Effect::Writes(written)) => {
                let mut index = 0;
                for argument in arguments(tree, node) {
                    let writes = match argument.name.filter(|_| argument.optional) {
                        Some(name) => {
                            let name = folded(tree.text(name));
                            written.optional.iter().any(|option| option.as_bytes() == name)
                        }
                        None => {
                            index += 1;
                            written.required.contains(&(index - 1))
                        }
                    };
                    if writes {
                        give(root(&argument), if written.later { How::Later } else { How::Whole });
                    }
                }
            }
            // Not known here: it may change what it is given.
            None => arguments(tree, node).for_each(|argument| give(root(&argument), How::HandedOver)),
        }
    }

    /// What a routine of the program changes of the data that it is given.
    fn changed_by_routine(
        &self,
        tree: &RapidTree<'_>,
        scope: u32,
        node: u32,
        routine: &RoutineScope,
        give: &mut dyn FnMut(Option<u32>, How),
    ) {
        let root = |argument: &Argument| self.root(tree, scope, argument.value?);
        let mut required = (0..).zip(&routine.head.parameters).filter(|(_, parameter)| !parameter.optional);
        for argument in arguments(tree, node) {
            let at: Option<usize> = match argument.name {
                None => required.next().map(|(at, _)| at),
                Some(name) => self.parameter(routine.scope, tree.text(name)).and_then(|name| {
                    routine.head.parameters.iter().position(|parameter| parameter.name == name)
                }),
            };
            match at.and_then(|at| routine.written[at]) {
                Some(Reason::HandedOver) => give(root(&argument), How::HandedOver),
                Some(_) => give(root(&argument), How::Whole),
                None => {}
            }
        }
    }

    /// The token of a parameter of a routine, by its name.
    fn parameter(&self, scope: u32, name: &[u8]) -> Option<u32> {
        let symbol = self.scopes[scope as usize].names.get(&folded(name))?;
        Some(self.symbols[*symbol as usize].name)
    }
}

/// The arguments that a motion instruction of the table writes to.
fn changed_by_instruction(
    tree: &RapidTree<'_>,
    node: u32,
    known: &Instruction,
    give: &mut dyn FnMut(&Argument),
) {
    let count = arguments(tree, node).filter(|argument| !argument.optional).count();
    let required = arguments(tree, node).filter(|argument| !argument.optional).enumerate();
    for (_, argument) in required.filter(|&(index, _)| known.slot(index, count) == Some(Slot::Output)) {
        give(&argument);
    }
    for argument in arguments(tree, node).filter(|argument| argument.optional) {
        let returned = |name: u32| tree.text(name).get(..3).is_some_and(|n| same_name(n, b"Ret"));
        if known.also == Also::Returns && argument.name.is_some_and(returned) {
            give(&argument);
        }
    }
}

/// Whether a call counts a displacement from where the robot stands: PDispOn without the point to which it has gone.
pub(crate) fn places(tree: &RapidTree<'_>, call: u32, name: &[u8]) -> bool {
    let executed = |argument: Argument| argument.name.is_some_and(|name| same_name(tree.text(name), b"ExeP"));
    same_name(name, b"PDispOn") && !arguments(tree, call).any(executed)
}

/// How an assignment to this place changes its data.
fn how_assigned(tree: &RapidTree<'_>, place: Child) -> How {
    match place {
        Child::Node(node) if parts(tree, node).all(|part| matches!(part, Child::Token(_))) => How::Part(node),
        _ => How::Whole,
    }
}

/// The components that a place names, in lower case with a point between.
fn path(tree: &RapidTree<'_>, place: u32) -> Vec<u8> {
    let mut out = Vec::new();
    for part in parts(tree, place).skip(1) {
        if let Child::Token(token) = part
            && tree.kind(token) == Some(Token::Ident)
        {
            if !out.is_empty() {
                out.push(b'.');
            }
            out.extend(folded(tree.text(token)));
        }
    }
    out
}

/// The name that SetDataVal states as a plain string.
fn named<'s>(tree: &RapidTree<'s>, call: u32) -> Option<&'s [u8]> {
    let first = arguments(tree, call).find(|argument| !argument.optional)?;
    let Some(Child::Token(token)) = first.value else { return None };
    let text = tree.text(token);
    (tree.kind(token) == Some(Token::String)).then(|| &text[1..text.len() - 1])
}

/// Whether a clause is an error handler that goes back to the statements.
pub(crate) fn resumes(tree: &RapidTree<'_>, clause: u32) -> bool {
    let end = clause + tree.nodes[clause as usize].size;
    tree.nodes[clause as usize].kind == Syntax::ErrorClause && (clause..end).any(|node| goes_back(tree, node))
}

/// Whether a statement goes from an error handler back to the statements.
fn goes_back(tree: &RapidTree<'_>, node: u32) -> bool {
    let first = tree.nodes[node as usize].first;
    match tree.nodes[node as usize].kind {
        Syntax::Leave => matches!(tree.kind(first), Some(Token::Retry | Token::TryNext)),
        Syntax::Call => predefined::retries(tree.text(first)),
        _ => false,
    }
}
