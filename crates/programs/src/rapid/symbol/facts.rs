//! Facts about each body that need no fixpoint: one pass over every assignment, call and function, callees not included.

use std::collections::BTreeSet;
use std::ops::Range;

use rayon::prelude::*;

use super::computed_name::NamePattern;
use super::effects::{SideEffects, Write};
use super::writes::literal_data_name;
use super::{Body, Symbols};
use crate::dataflow::Lattice;
use crate::rapid::instruction::{self, INSTRUCTIONS, SideEffect};
use crate::rapid::modal::switches_set_by;
use crate::rapid::predefined;
use crate::rapid::syntax::{Argument, RapidTree, Syntax, arguments};
use crate::rapid::token::{Token, folded, same_name};

/// What the statements of one body do themselves.
#[derive(Default)]
pub(super) struct BodyFacts {
    pub(super) writes: Vec<Write>,
    /// The routines that it calls: its edges in the call graph.
    pub(super) calls: Vec<u32>,
    /// What they do besides; the writes are above.
    pub(super) effects: SideEffects,
    /// Types whose data it writes by a computed name; `None` for any type.
    pub(super) writes_by_name: Vec<Option<Vec<u8>>>,
    /// The calls that set a switch or call a routine of the program.
    pub(super) switch_calls: Vec<u32>,
    /// Name patterns of its calls by a computed name.
    pub(super) late_calls: BTreeSet<NamePattern>,
    /// Name patterns of the procedures that it lets the controller call while the robot moves.
    pub(super) interrupts: BTreeSet<NamePattern>,
    /// Whether it restarts main (ExitCycle).
    pub(super) restarts_main: bool,
}

impl BodyFacts {
    /// These facts and those of the next nodes of the same body.
    fn merge(mut self, next: BodyFacts) -> BodyFacts {
        self.writes.extend(next.writes);
        self.calls.extend(next.calls);
        self.switch_calls.extend(next.switch_calls);
        self.interrupts.extend(next.interrupts);
        self.late_calls.extend(next.late_calls);
        self.effects.join(&next.effects);
        self.writes_by_name.extend(next.writes_by_name);
        self.restarts_main |= next.restarts_main;
        self
    }

    fn add_switch_call(&mut self, node: u32) {
        if self.switch_calls.last() != Some(&node) {
            self.switch_calls.push(node);
        }
    }
}

/// Nodes that one thread processes at a time.
const CHUNK: u32 = 1 << 16;

impl Symbols {
    /// The facts of every body.
    pub(super) fn collect_facts(&self, trees: &[RapidTree<'_>]) -> Vec<BodyFacts> {
        let facts = |&body: &Body| {
            let nodes = body.node + 1..trees[body.file as usize].nodes.subtree_end(body.node);
            // The parts of a long routine in parallel; a fragment skips whole routines, so it stays in one piece.
            let parts = if body.routine.is_some() { nodes.len().div_ceil(CHUNK as usize).max(1) } else { 1 };
            if parts == 1 {
                return self.facts_of(trees, body, nodes);
            }
            let part = |index: usize| {
                let first = nodes.start + index as u32 * CHUNK;
                self.facts_of(trees, body, first..(first + CHUNK).min(nodes.end))
            };
            let mut parts: Vec<BodyFacts> = (0..parts).into_par_iter().map(part).collect();
            let rest = parts.split_off(1);
            rest.into_iter().fold(parts.swap_remove(0), BodyFacts::merge)
        };
        self.bodies.iter().map(facts).collect()
    }

    /// The facts of some nodes of a body.
    pub(super) fn facts_of(&self, trees: &[RapidTree<'_>], body: Body, nodes: Range<u32>) -> BodyFacts {
        let tree = &trees[body.file as usize];
        let mut facts = BodyFacts::default();
        let mut node = nodes.start;
        while node < nodes.end {
            let kind = tree.nodes.kind(node);
            if body.routine.is_none() && (kind.is_routine() || kind == Syntax::Module) {
                node = tree.nodes.subtree_end(node);
                continue;
            }
            if kind == Syntax::Call && self.is_plain_motion(tree, body.scope, node) {
                (facts.effects.moves, facts.effects.impure) = (true, true);
                node += 1;
                continue;
            }
            if kind.may_change() {
                self.for_each_write(tree, body.scope, node, &mut |write| facts.writes.push(write));
            }
            match kind {
                Syntax::LateCall => add_late_call(tree, node, &mut facts),
                Syntax::Call | Syntax::Function => self.add_call(tree, body, (node, kind), &mut facts),
                // The condition may depend on another task.
                Syntax::While => facts.effects.waits = true,
                _ => {}
            }
            facts.effects.decides_by_position |= self.position_decisions.contains(&(body.file, node));
            facts.effects.impure |= self.is_node_impure(tree, body.scope, node);
            node += 1;
        }
        facts
    }

    /// A call or function, other than an instruction that only moves the robot.
    fn add_call(&self, tree: &RapidTree<'_>, body: Body, (node, kind): (u32, Syntax), facts: &mut BodyFacts) {
        let name = tree.text(tree.nodes.first(node));
        let is_call = kind == Syntax::Call;
        let callees = self.callees(body.scope, name);
        if is_call
            && callees.is_empty()
            && let Some(switches) = switches_set_by(tree, node, name)
        {
            facts.add_switch_call(node);
            facts.effects.switches = facts.effects.switches.join(switches);
        }
        if is_call && self.is_motion(body.scope, name) {
            facts.effects.moves = true;
            if instruction::find(name)
                .is_some_and(|known| INSTRUCTIONS[known].side_effect == SideEffect::Calls)
            {
                let name = arguments(tree, node).filter(|argument| !argument.optional).last();
                facts.interrupts.insert(NamePattern::of(tree, (name.and_then(|name| name.value), 0, false)));
            }
            return;
        }
        match callees {
            [_, ..] => {
                facts.add_switch_call(node);
                facts.calls.extend_from_slice(callees);
            }
            [] if is_call && predefined::calls_by_name(name) => add_late_call(tree, node, facts),
            [] if predefined::effect(name).is_none() => {
                (facts.effects.writes_anything, facts.effects.moves) = (true, true)
            }
            [] => {
                facts.effects.moves |= predefined::displaces(name).is_some();
                facts.restarts_main |= predefined::begins_cycle(name);
                facts.effects.uses_position |= counts_from_position(tree, node, name);
                facts.effects.waits |= predefined::waits(name);
                facts.effects.grips |= predefined::grips(name);
                // It may write data of any caller.
                facts.effects.writes_anything |= self.writes_unknown_data(tree, body.scope, node, name);
                if name.eq_ignore_ascii_case(b"SetAllDataVal") {
                    let type_name = |name| self.resolved_type(body.scope, &folded(name)).to_vec();
                    facts.writes_by_name.push(literal_data_name(tree, node).map(type_name));
                } else if name.eq_ignore_ascii_case(b"SetDataVal") && literal_data_name(tree, node).is_none()
                {
                    facts.writes_by_name.push(None);
                }
            }
        }
    }

    /// Whether a call writes data by a name that the text does not state.
    pub fn writes_unknown_data(&self, tree: &RapidTree<'_>, scope: u32, call: u32, name: &[u8]) -> bool {
        let by_name = name.eq_ignore_ascii_case(b"SetAllDataVal")
            || name.eq_ignore_ascii_case(b"SetDataVal") && literal_data_name(tree, call).is_none();
        by_name && self.routine(scope, name).is_none()
    }

    /// Whether the robot may move between two statements of a body: by an error handler that resumes, or by an interrupt
    /// routine that does not store the path.
    pub fn may_move_between_statements(&self, trees: &[RapidTree<'_>], body: Body) -> bool {
        if self.interrupts_move_robot {
            return true;
        }
        let tree = &trees[body.file as usize];
        let moves = |node: u32| {
            let name = tree.text(tree.nodes.first(node));
            match tree.nodes.kind(node) {
                Syntax::LateCall => true,
                Syntax::Call if self.is_motion(body.scope, name) => true,
                Syntax::Call | Syntax::Function => match self.callees(body.scope, name) {
                    callees @ [_, ..] => callees.iter().any(|callee| self.effects_of(*callee).moves),
                    [] => {
                        predefined::displaces(name).is_some() && !predefined::keeps_path(name)
                            || predefined::effect(name).is_none()
                    }
                },
                _ => false,
            }
        };
        let mut clauses = tree.child_nodes(body.node).filter(|&clause| is_resuming_handler(tree, clause));
        clauses.any(|clause| (clause..tree.nodes.subtree_end(clause)).any(moves))
    }

    /// Whether an interrupt routine moves the robot without storing the path.
    pub(super) fn find_moving_interrupts(&self, trees: &[RapidTree<'_>]) -> bool {
        let stores_path = |body: Body| {
            let tree = &trees[body.file as usize];
            (body.node..tree.nodes.subtree_end(body.node)).any(|node| {
                let node = tree.nodes.get(node);
                node.kind == Syntax::Call && same_name(tree.text(node.first), b"StorePath")
            })
        };
        self.interrupt_routines.iter().any(|&routine| {
            let routine = &self.routines[routine as usize];
            routine.effects.moves && !stores_path(self.bodies[routine.body as usize])
        })
    }

    /// Whether a call by this name is a motion instruction of the table.
    pub fn is_motion(&self, scope: u32, name: &[u8]) -> bool {
        instruction::find(name).is_some() && !(self.hides_instruction && self.routine(scope, name).is_some())
    }

    /// Whether a call is a motion instruction that writes no argument, as nearly every statement of a long program is.
    pub fn is_plain_motion(&self, tree: &RapidTree<'_>, scope: u32, node: u32) -> bool {
        let name = tree.text(tree.nodes.first(node));
        instruction::find(name).is_some_and(|known| INSTRUCTIONS[known].only_moves())
            && !(self.hides_instruction && self.routine(scope, name).is_some())
    }
}

/// A call by a computed name.
fn add_late_call(tree: &RapidTree<'_>, node: u32, facts: &mut BodyFacts) {
    (facts.effects.writes_anything, facts.effects.moves) = (true, true);
    facts.add_switch_call(node);
    facts.late_calls.insert(NamePattern::of_call(tree, node));
}

/// Whether a call counts a displacement from the robot's current position: PDispOn without \ExeP.
pub(crate) fn counts_from_position(tree: &RapidTree<'_>, call: u32, name: &[u8]) -> bool {
    let executed = |argument: Argument| argument.name.is_some_and(|name| same_name(tree.text(name), b"ExeP"));
    same_name(name, b"PDispOn") && !arguments(tree, call).any(executed)
}

/// Whether a clause is an error handler that resumes the statements (RETRY, TRYNEXT, StartMoveRetry).
pub(crate) fn is_resuming_handler(tree: &RapidTree<'_>, clause: u32) -> bool {
    let resumes = |node: u32| {
        let first = tree.nodes.first(node);
        match tree.nodes.kind(node) {
            Syntax::Leave => matches!(tree.kind(first), Some(Token::Retry | Token::TryNext)),
            Syntax::Call => predefined::retries(tree.text(first)),
            _ => false,
        }
    };
    let end = tree.nodes.subtree_end(clause);
    tree.nodes.kind(clause) == Syntax::ErrorClause && (clause..end).any(resumes)
}

/// Whether anything in the files has the name of GripLoad or of the option TLoad.
pub(super) fn name_loads(trees: &[RapidTree<'_>]) -> bool {
    trees.iter().any(|tree| {
        tree.kinds().par_chunks(CHUNK as usize).enumerate().any(|(chunk, kinds)| {
            let names = (chunk as u32 * CHUNK..).zip(kinds).filter(|(_, kind)| **kind == Token::Ident);
            let mut texts = names.map(|(token, _)| tree.text(token));
            texts.any(|text| same_name(text, b"GripLoad") || same_name(text, b"TLoad"))
        })
    })
}
