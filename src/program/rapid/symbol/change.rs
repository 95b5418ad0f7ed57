//! What statements change: which data, how, and what a call of each routine may bring about.
//!
//! Method: one look at every assignment, call and function of a task. What a routine does with its parameters, and what
//! it changes outside, is carried along the calls until nothing is added; both only grow. A routine that is declared in
//! none of the files, and one that is called by a computed name, may change everything that is not its caller's own.

use std::collections::HashSet;
use std::ops::Range;

use super::{Symbols, Unit, What};
use crate::program::motion::Reason;
use crate::program::rapid::instruction::{self, INSTRUCTIONS, Slot};
use crate::program::rapid::modal::setting;
use crate::program::rapid::predefined::{self, Effect};
use crate::program::rapid::syntax::{Argument, RapidTree, Syntax, arguments, parts, token_kind};
use crate::program::rapid::token::{Token, folded};
use crate::program::tree::Child;

/// How a statement changes data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum How {
    /// As a whole, or in a way that the text does not tell.
    Whole,
    /// One component: the node of the place that is assigned.
    Part(u32),
    /// It is given to a routine that is declared in none of the files, or called by a computed name.
    HandedOver,
}

/// A change of data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Change {
    /// The data.
    pub symbol: u32,
    /// How.
    pub how: How,
}

/// What a call of a routine may bring about.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Reach {
    /// Data declared outside the routine that it may change, in order.
    pub changes: Vec<u32>,
    /// Whether it calls what is not known here, which may change everything that is declared outside routines.
    pub anything: bool,
    /// Whether it may move the robot.
    pub moves: bool,
}

impl Reach {
    /// In order, each once; and anything where it is too much.
    fn settle(&mut self) {
        self.changes.sort_unstable();
        self.changes.dedup();
        if self.changes.len() > REACH {
            self.anything = true;
        }
        if self.anything {
            self.changes.clear();
        }
    }
}

/// How a unit leaves the switches that act in execution order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ends {
    /// As they were at its entry.
    AsItBegins,
    /// As its statements set them.
    Set {
        /// Whether anything calls it.
        called: bool,
    },
}

/// What is gone through once for each unit.
#[derive(Default)]
struct Found {
    changes: Vec<Change>,
    calls: Vec<u32>,
    unknown: bool,
    moves: bool,
    /// Whether data is changed by a name that is computed.
    by_name: bool,
    /// The calls that set a switch or call a routine of the program.
    switches: Vec<u32>,
}

/// A routine that changes more data outside than this may as well change anything.
const REACH: usize = 1024;

impl Symbols {
    /// Finds what the program changes.
    pub(super) fn settle(&mut self, trees: &[RapidTree<'_>]) {
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
        if all.iter().any(|found| found.by_name) {
            // SetDataVal with a computed name may mean any data.
            for symbol in &mut self.symbols {
                if matches!(symbol.what, What::Data(_)) && !symbol.is_constant() {
                    (symbol.assigned, symbol.whole) = (true, true);
                }
            }
        }
        self.settle_reaches(&all);
        self.settle_volatile(trees);
        let mut called = vec![false; all.len()];
        for &routine in all.iter().flat_map(|found| &found.calls) {
            called[self.routines[routine as usize].unit as usize] = true;
        }
        for (at, found) in all.into_iter().enumerate() {
            let quiet = found.switches.is_empty();
            self.ends.push(if quiet { Ends::AsItBegins } else { Ends::Set { called: called[at] } });
            self.switches.push(found.switches);
        }
    }

    fn gone_through(&self, trees: &[RapidTree<'_>]) -> Vec<Found> {
        let found = |&unit: &Unit| {
            let tree = &trees[unit.file as usize];
            self.found(tree, unit, unit.node + 1..unit.node + tree.nodes[unit.node as usize].size)
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
    fn found(&self, tree: &RapidTree<'_>, unit: Unit, nodes: Range<u32>) -> Found {
        let mut found = Found::default();
        let mut node = nodes.start;
        while node < nodes.end {
            let kind = tree.nodes[node as usize].kind;
            if unit.routine.is_none() && (kind.is_routine() || kind == Syntax::Module) {
                node += tree.nodes[node as usize].size;
                continue;
            }
            if kind == Syntax::Call && self.moves_only(tree, unit.scope, node) {
                found.moves = true;
                node += 1;
                continue;
            }
            if kind.may_change() {
                self.changed_by(tree, unit.scope, node, &mut |change| found.changes.push(change));
            }
            match kind {
                Syntax::LateCall => (found.unknown, found.moves) = (true, true),
                Syntax::Call | Syntax::Function => {
                    let name = tree.text(tree.nodes[node as usize].first);
                    if kind == Syntax::Call && self.is_motion(unit.scope, name) {
                        found.moves = true;
                        node += 1;
                        continue;
                    }
                    let routine = self.routine(unit.scope, name);
                    if kind == Syntax::Call && (routine.is_some() || setting(tree, node, name).is_some()) {
                        found.switches.push(node);
                    }
                    if let Some(routine) = routine {
                        found.calls.push(routine);
                    } else if predefined::effect(name).is_none() {
                        (found.unknown, found.moves) = (true, true);
                    } else if name.eq_ignore_ascii_case(b"SetAllDataVal")
                        || name.eq_ignore_ascii_case(b"SetDataVal") && named(tree, node).is_none()
                    {
                        found.by_name = true;
                    }
                }
                _ => {}
            }
            node += 1;
        }
        found
    }

    /// Whether a call by this name is a motion instruction of the table.
    pub fn is_motion(&self, scope: u32, name: &[u8]) -> bool {
        instruction::find(name).is_some() && !(self.hides_instruction && self.routine(scope, name).is_some())
    }

    /// Whether a call is a motion instruction that writes no argument: nearly every statement of a long program is one.
    pub fn moves_only(&self, tree: &RapidTree<'_>, scope: u32, node: u32) -> bool {
        let name = tree.text(tree.nodes[node as usize].first);
        instruction::find(name).is_some_and(|known| !INSTRUCTIONS[known].searches())
            && !(self.hides_instruction && self.routine(scope, name).is_some())
    }

    /// What a call of each routine may change, through what it calls.
    fn settle_reaches(&mut self, all: &[Found]) {
        for (found, unit) in all.iter().zip(&self.units) {
            let Some(routine) = unit.routine else { continue };
            let outside = |symbol: u32| self.symbols[symbol as usize].scope != unit.scope;
            let changes = found.changes.iter().map(|change| change.symbol).filter(|&s| outside(s)).collect();
            let mut reach = Reach { changes, anything: found.unknown, moves: found.moves };
            reach.settle();
            self.routines[routine as usize].reach = reach;
        }
        loop {
            let mut grown = false;
            for &unit in &self.callees_first {
                let Some(routine) = self.units[unit as usize].routine else { continue };
                let mut reach = std::mem::take(&mut self.routines[routine as usize].reach);
                let before = (reach.changes.len(), reach.anything, reach.moves);
                for &called in &all[unit as usize].calls {
                    let other = &self.routines[called as usize].reach;
                    reach.anything |= other.anything;
                    reach.moves |= other.moves;
                    reach.changes.extend_from_slice(&other.changes);
                    if reach.changes.len() > 4 * REACH {
                        reach.settle();
                    }
                }
                reach.settle();
                grown |= before != (reach.changes.len(), reach.anything, reach.moves);
                self.routines[routine as usize].reach = reach;
            }
            if !grown {
                return;
            }
        }
    }

    /// Data that a trap routine, or an error handler that goes back to the statements, may change at any time.
    fn settle_volatile(&mut self, trees: &[RapidTree<'_>]) {
        let mut changes: Vec<u32> = Vec::new();
        let mut anything = false;
        let mut take = |reach: &Reach| {
            changes.extend_from_slice(&reach.changes);
            anything |= reach.anything;
        };
        for unit in &self.units {
            let Some(routine) = unit.routine else { continue };
            if self.routines[routine as usize].head.kind == Syntax::Trap {
                take(&self.routines[routine as usize].reach);
                continue;
            }
            let tree = &trees[unit.file as usize];
            for clause in tree.child_nodes(unit.node) {
                let end = clause + tree.nodes[clause as usize].size;
                if tree.nodes[clause as usize].kind != Syntax::ErrorClause
                    || !(clause..end).any(|node| goes_back(tree, node))
                {
                    continue;
                }
                let found = self.found(tree, *unit, clause + 1..end);
                let own = found.changes.iter().map(|change| change.symbol).collect();
                take(&Reach { changes: own, anything: found.unknown, moves: false });
                for called in found.calls {
                    take(&self.routines[called as usize].reach);
                }
            }
        }
        for symbol in changes {
            self.symbols[symbol as usize].volatile = true;
        }
        if anything {
            let routines: HashSet<u32> = self.routines.iter().map(|routine| routine.scope).collect();
            for symbol in &mut self.symbols {
                symbol.volatile |= symbol.assigned && !routines.contains(&symbol.scope);
            }
        }
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
        // Only searches write an argument.
        if !self.hides_instruction && known.is_some_and(|known| !known.searches()) {
            return;
        }
        let root = |argument: &Argument| self.root(tree, scope, argument.value?);
        if let Some(routine) = self.routine(scope, name) {
            let routine = &self.routines[routine as usize];
            let mut required =
                (0..).zip(&routine.head.parameters).filter(|(_, parameter)| !parameter.optional);
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
            return;
        }
        if let Some(known) = known {
            let count = arguments(tree, node).filter(|argument| !argument.optional).count();
            let required = arguments(tree, node).filter(|argument| !argument.optional).enumerate();
            for (_, argument) in required.filter(|&(index, _)| known.slot(index, count) == Some(Slot::Output))
            {
                give(root(&argument), How::Whole);
            }
            return;
        }
        match predefined::effect(name) {
            Some(Effect::Reads) => {
                if name.eq_ignore_ascii_case(b"SetDataVal")
                    && let Some(named) = named(tree, node)
                {
                    give(self.find(scope, named), How::Whole);
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
                        give(root(&argument), How::Whole);
                    }
                }
            }
            // Not known here: it may change what it is given.
            None => arguments(tree, node).for_each(|argument| give(root(&argument), How::HandedOver)),
        }
    }

    /// The token of a parameter of a routine, by its name.
    fn parameter(&self, scope: u32, name: &[u8]) -> Option<u32> {
        let symbol = self.scopes[scope as usize].names.get(&folded(name))?;
        Some(self.symbols[*symbol as usize].name)
    }
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

/// Whether a statement goes from an error handler back to the statements.
fn goes_back(tree: &RapidTree<'_>, node: u32) -> bool {
    tree.nodes[node as usize].kind == Syntax::Leave
        && matches!(tree.kind(tree.nodes[node as usize].first), Some(Token::Retry | Token::TryNext))
}
