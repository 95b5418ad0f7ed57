//! The statements of a routine in the order in which they run: what assigned data holds, how the switches stand, and
//! which motion went before.
//!
//! One pass per routine. Straight-line assignments are followed exactly; where ways join, only what they agree on
//! stays known; what a loop assigns is unknown at its beginning; a label or an error handler can be reached from
//! anywhere in the routine.

use super::evaluate::{Context, Evaluator, Known};
use super::instruction::{self, INSTRUCTIONS};
use super::modal::{States, Which, setting};
use super::symbol::{Unit, What, only_reads};
use super::syntax::{Syntax, arguments, expressions, parts, token_kind};
use super::token::{Token, folded, same_name};
use super::value::Value;
use crate::program::motion::{Frame, Reason};
use crate::program::tree::Child;

/// The key in [`Known`] under which the program displacement stands: no name of the program has it. Where it is absent
/// the displacement is as at the entry of the routine.
pub(super) const DISPLACEMENT: u32 = u32::MAX;

/// What holds before a statement.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct State {
    pub(super) known: Known,
    pub(super) modal: States,
    pub(super) previous: Option<u32>,
    /// Whether any way leads here.
    reached: bool,
}

impl State {
    fn joined(self, other: State) -> State {
        if !self.reached {
            return other;
        }
        if !other.reached {
            return self;
        }
        let mut known = Known::new();
        for key in self.known.keys().chain(other.known.keys()) {
            if known.contains_key(key) {
                continue;
            }
            let value = match (self.known.get(key), other.known.get(key)) {
                (Some(a), Some(b)) if a == b => a.clone(),
                _ => Value::Unknown(Reason::Assigned),
            };
            known.insert(*key, value);
        }
        State {
            known,
            modal: self.modal.or(other.modal),
            previous: self.previous.filter(|_| self.previous == other.previous),
            reached: true,
        }
    }
}

/// A call of a routine of the program, with the switches as they stand there.
#[derive(Debug, Clone, Copy)]
pub(super) struct CallSite {
    pub(super) routine: u32,
    pub(super) modal: States,
}

/// What the walk hands to its owner at each statement that may move the robot.
pub(super) trait Visitor {
    /// A call; answers the index of the motion, where it is one.
    fn call(&mut self, unit: Unit, node: u32, state: &State, place: Surroundings) -> Option<u32>;
    /// The states of switches with which a routine ends, "as at the entry" included.
    fn exit_of(&mut self, routine: u32) -> States;
    /// A call of a routine of the program.
    fn called(&mut self, site: CallSite);
}

/// In what a statement stands.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Surroundings {
    pub(super) in_loop: bool,
    pub(super) conditional: bool,
    /// Whether a compact IF guards the statement alone.
    pub(super) guarded: bool,
}

/// Walks one unit; hands back the states of the switches at its end.
pub(super) fn walk(evaluator: &Evaluator<'_, '_>, unit: Unit, visitor: &mut dyn Visitor) -> States {
    let mut walk =
        Walk { evaluator, unit, visitor, exits: States::NONE, any: States::NONE, assigned: Vec::new() };
    walk.assigned = walk.assigned_in(unit.node);
    walk.any = walk.settings(unit.node).or(States::ENTRY);
    let mut state = State { known: Known::new(), modal: States::ENTRY, previous: None, reached: true };
    if unit.routine.is_some() {
        for &id in &walk.assigned {
            // A variable of the routine has its initial value at every call.
            let symbol = &evaluator.symbols.symbols[id as usize];
            if symbol.scope == unit.scope
                && matches!(&symbol.what, What::Data(data) if data.storage == Token::Var)
            {
                let context = Context::new(unit.file, unit.scope, &state.known);
                if let Some(value) = evaluator.initial_value(context, id) {
                    state.known.insert(id, value);
                }
            }
        }
    }
    let end = walk.block(unit.node, state, Surroundings::default());
    if end.reached { walk.exits.or(end.modal) } else { walk.exits }
}

struct Walk<'w, 'a, 's> {
    evaluator: &'w Evaluator<'a, 's>,
    unit: Unit,
    visitor: &'w mut dyn Visitor,
    exits: States,
    /// What any statement of the unit may set.
    any: States,
    /// What any statement of the unit may assign.
    assigned: Vec<u32>,
}

impl Walk<'_, '_, '_> {
    /// The children of a node that are statements or hold statements.
    fn block(&mut self, node: u32, mut state: State, place: Surroundings) -> State {
        let tree = &self.evaluator.trees[self.unit.file as usize];
        let (mut child, end) = (node + 1, node + tree.nodes[node as usize].size);
        while child < end {
            let kind = tree.nodes[child as usize].kind;
            if !(self.unit.routine.is_none() && (kind.is_routine() || kind == Syntax::Module)) {
                state = self.statement(child, kind, state, place);
            }
            child += tree.nodes[child as usize].size;
        }
        state
    }

    fn statement(&mut self, node: u32, kind: Syntax, mut state: State, place: Surroundings) -> State {
        let conditional = Surroundings { conditional: true, guarded: false, ..place };
        match kind {
            Syntax::Body => self.block(node, state, place),
            Syntax::Call | Syntax::LateCall => self.call(node, state, place),
            Syntax::Assignment => {
                self.assignment(node, &mut state);
                state
            }
            Syntax::If => self.branches(node, state, conditional, Token::Else),
            Syntax::Test => self.branches(node, state, conditional, Token::Default),
            Syntax::CompactIf => {
                let before = state.clone();
                let guarded = Surroundings { guarded: true, ..conditional };
                self.block(node, state, guarded).joined(before)
            }
            Syntax::For | Syntax::While => {
                let mut entry = state;
                entry.modal = entry.modal.or(self.settings(node));
                entry.previous = None;
                let assigned = self.assigned_in(node);
                let displaces = self.displaces(node);
                let forget = |state: &mut State| {
                    for &id in &assigned {
                        state.known.insert(id, Value::Unknown(Reason::Assigned));
                    }
                    if displaces {
                        state.known.insert(DISPLACEMENT, Value::Unknown(Reason::Displacement));
                    }
                };
                forget(&mut entry);
                let inside = Surroundings { in_loop: true, guarded: false, ..place };
                let mut after = self.block(node, entry.clone(), inside).joined(entry);
                forget(&mut after);
                after.previous = None;
                after
            }
            Syntax::ErrorClause | Syntax::UndoClause | Syntax::BackwardClause => {
                let entry = self.anywhere();
                self.block(node, entry, conditional);
                // The handler is no continuation of the statements before it.
                state
            }
            Syntax::Label => state.joined(self.anywhere()),
            Syntax::Return => {
                self.exits = self.exits.or(state.modal);
                State { reached: false, ..state }
            }
            Syntax::Goto | Syntax::Raise | Syntax::Leave => {
                self.exits = if kind == Syntax::Goto { self.exits } else { self.exits.or(state.modal) };
                State { reached: false, ..state }
            }
            Syntax::Opaque | Syntax::Unwritten => {
                // What could not be read may do anything to what the routine assigns.
                State { previous: None, known: self.forgotten(&state.known), ..state }
            }
            _ => state,
        }
    }

    fn branches(&mut self, node: u32, state: State, place: Surroundings, otherwise: Token) -> State {
        let tree = &self.evaluator.trees[self.unit.file as usize];
        let mut joined: Option<State> = None;
        let mut complete = false;
        for branch in tree.child_nodes(node) {
            if !matches!(tree.nodes[branch as usize].kind, Syntax::Branch | Syntax::Case) {
                continue;
            }
            let first = parts(tree, branch).next();
            complete |= first.and_then(|first| token_kind(tree, first)) == Some(otherwise);
            let end = self.block(branch, state.clone(), place);
            joined = Some(match joined {
                Some(joined) => joined.joined(end),
                None => end,
            });
        }
        match joined {
            Some(joined) if complete => joined,
            Some(joined) => joined.joined(state),
            None => state,
        }
    }

    /// What holds at a place that can be reached from anywhere in the routine.
    fn anywhere(&self) -> State {
        let known = self.assigned.iter().map(|&id| (id, Value::Unknown(Reason::Assigned)));
        let mut known: Known = known.collect();
        if !self.any.keeps(Which::Displacement) {
            known.insert(DISPLACEMENT, Value::Unknown(Reason::Displacement));
        }
        State { known, modal: self.any, previous: None, reached: true }
    }

    /// Whether statements under a node may set or end a program displacement.
    fn displaces(&mut self, node: u32) -> bool {
        !self.settings(node).leaves(Which::Displacement)
    }

    /// The displacement after PDispSet, PDispOn, PDispAdd or PDispOff.
    fn displaced(&self, node: u32, state: &State, name: &[u8]) -> Value {
        let tree = &self.evaluator.trees[self.unit.file as usize];
        if same_name(name, b"PDispOff") {
            return Value::from_frame(&Frame::IDENTITY);
        }
        let frame =
            arguments(tree, node).find(|argument| !argument.optional).and_then(|argument| argument.value);
        match frame.filter(|_| same_name(name, b"PDispSet")) {
            Some(frame) => {
                let context = Context::new(self.unit.file, self.unit.scope, &state.known);
                match self.evaluator.value(context, frame).frame() {
                    Ok(frame) => Value::from_frame(&frame),
                    Err(_) => Value::Unknown(Reason::Displacement),
                }
            }
            // PDispOn counts from where the robot stands, PDispAdd from what a search found.
            None => Value::Unknown(Reason::Displacement),
        }
    }

    fn forgotten(&self, known: &Known) -> Known {
        known.keys().map(|&id| (id, Value::Unknown(Reason::Assigned))).collect()
    }

    /// Everything that statements under a node may assign.
    fn assigned_in(&self, node: u32) -> Vec<u32> {
        let tree = &self.evaluator.trees[self.unit.file as usize];
        let end = node + tree.nodes[node as usize].size;
        let mut out: Vec<u32> = Vec::new();
        for node in node..end {
            if tree.nodes[node as usize].kind.may_change() {
                out.extend(self.evaluator.symbols.changed_by(tree, self.unit.scope, node));
            }
        }
        out.sort_unstable();
        out.dedup();
        out
    }

    /// Everything that statements under a node may set.
    fn settings(&mut self, node: u32) -> States {
        let tree = &self.evaluator.trees[self.unit.file as usize];
        let end = node + tree.nodes[node as usize].size;
        let mut out = States::NONE;
        for node in node..end {
            if tree.nodes[node as usize].kind != Syntax::Call {
                continue;
            }
            let name = tree.text(tree.nodes[node as usize].first);
            if instruction::find(name).is_some() {
                continue;
            }
            if let Some((which, on)) = setting(tree, node, name) {
                out = out.or(States::NONE.set(which, on));
            } else if let Some(routine) = self.evaluator.symbols.routine(self.unit.scope, name) {
                out = out.or(self.visitor.exit_of(routine));
            }
        }
        // "As at the entry" of a called routine is what holds here anyway.
        out.entered(States::NONE)
    }

    fn call(&mut self, node: u32, mut state: State, place: Surroundings) -> State {
        let tree = &self.evaluator.trees[self.unit.file as usize];
        let symbols = self.evaluator.symbols;
        let name = tree.text(tree.nodes[node as usize].first);
        let late = tree.nodes[node as usize].kind == Syntax::LateCall;
        let motion = self.visitor.call(self.unit, node, &state, place);
        for id in symbols.changed_by(tree, self.unit.scope, node) {
            state.known.insert(id, Value::Unknown(Reason::Assigned));
        }
        let known = if late || symbols.hides_instruction { None } else { instruction::find(name) };
        if let Some(known) = known {
            if motion.is_some() {
                // A search stops where its signal comes.
                state.previous = motion.filter(|_| !INSTRUCTIONS[known].searches());
            }
            return state;
        }
        if let Some((which, on)) = (!late).then(|| setting(tree, node, name)).flatten() {
            state.modal = state.modal.set(which, on);
            // One that also moves.
            state.previous = motion.or(state.previous);
            if which == Which::Displacement {
                let value = self.displaced(node, &state, name);
                state.known.insert(DISPLACEMENT, value);
            }
            return state;
        }
        let routine = if late { None } else { symbols.routine(self.unit.scope, name) };
        match routine {
            Some(routine) => {
                self.visitor.called(CallSite { routine, modal: state.modal });
                let exit = self.visitor.exit_of(routine);
                state.modal = exit.entered(state.modal);
                if !exit.keeps(Which::Displacement) {
                    let value = if exit.is_off(Which::Displacement) {
                        Value::from_frame(&Frame::IDENTITY)
                    } else {
                        Value::Unknown(Reason::Displacement)
                    };
                    state.known.insert(DISPLACEMENT, value);
                }
            }
            None if motion.is_some() && !late => {
                state.previous = motion;
                return state;
            }
            None if !late && only_reads(name) => return state,
            None => {}
        }
        // A routine may change everything that is declared outside this one.
        for (id, value) in &mut state.known {
            let outside =
                symbols.symbols.get(*id as usize).is_some_and(|symbol| symbol.scope != self.unit.scope);
            if outside {
                *value = Value::Unknown(Reason::Assigned);
            }
        }
        state.previous = None;
        state
    }

    /// `place := value;`
    fn assignment(&mut self, node: u32, state: &mut State) {
        let tree = &self.evaluator.trees[self.unit.file as usize];
        let mut sides = parts(tree, node)
            .filter(|&part| !matches!(token_kind(tree, part), Some(Token::Assign | Token::Semicolon)));
        let (Some(place), Some(expression)) = (sides.next(), sides.next()) else { return };
        let symbols = self.evaluator.symbols;
        let Some(root) = symbols.root(tree, self.unit.scope, place) else { return };
        let context = Context::new(self.unit.file, self.unit.scope, &state.known);
        let value = self.evaluator.value(context, expression);
        let new = match place {
            Child::Token(_) => value,
            Child::Node(place) => {
                let old = self.evaluator.symbol_value(context, root);
                let path: Vec<Child> = parts(tree, place).skip(1).collect();
                let type_name = symbols.symbols[root as usize].type_name.clone();
                self.replaced(context, old, &type_name, &path, value)
            }
        };
        // A big array that is filled element by element is not worth keeping.
        let new = if size(&new, 0) > 4096 { Value::Unknown(Reason::Assigned) } else { new };
        state.known.insert(root, new);
    }

    /// `old` with the component at `path` replaced.
    fn replaced(
        &self,
        context: Context<'_>,
        old: Value,
        type_name: &[u8],
        path: &[Child],
        value: Value,
    ) -> Value {
        let tree = &self.evaluator.trees[self.unit.file as usize];
        let Some((&step, rest)) = path.split_first() else { return value };
        match step {
            Child::Token(token) if tree.kind(token) == Some(Token::Ident) => {
                let name = folded(tree.text(token));
                let (Some((index, component_type)), Some(count)) = (
                    self.evaluator.component(context.scope, type_name, &name),
                    self.evaluator.component_count(context.scope, type_name),
                ) else {
                    return Value::Unknown(Reason::WrongShape);
                };
                let mut list = match old {
                    Value::List(list) if list.len() == count => list,
                    Value::Unknown(reason) => vec![Value::Unknown(reason); count],
                    _ => return Value::Unknown(Reason::WrongShape),
                };
                let part = std::mem::replace(&mut list[index], Value::Bool(false));
                list[index] = self.replaced(context, part, &component_type, rest, value);
                Value::List(list)
            }
            Child::Token(_) => self.replaced(context, old, type_name, rest, value),
            Child::Node(index) => {
                let Value::List(mut list) = old else { return Value::Unknown(Reason::Assigned) };
                let mut positions = expressions(tree, index);
                let (Some(position), None) = (positions.next(), positions.next()) else {
                    return Value::Unknown(Reason::Assigned);
                };
                let Ok(position) = self.evaluator.value(context, position).number() else {
                    return Value::Unknown(Reason::Assigned);
                };
                let Some(part) = (position as usize).checked_sub(1).and_then(|at| list.get_mut(at)) else {
                    return Value::Unknown(Reason::IndexOutOfRange);
                };
                let old = std::mem::replace(part, Value::Bool(false));
                *part = self.replaced(context, old, type_name, rest, value);
                Value::List(list)
            }
        }
    }
}

/// How many values a value holds, counted until it is too many.
fn size(value: &Value, so_far: usize) -> usize {
    match value {
        Value::List(list) if so_far <= 4096 => list.iter().fold(so_far, |sum, value| size(value, sum)),
        _ => so_far + 1,
    }
}
