//! The statements of a routine in the order in which they run: what assigned data holds, how the switches stand, and
//! which motion went before.
//!
//! One pass per routine. Straight-line assignments are followed exactly; where ways join, only what they agree on
//! stays known; what a loop assigns is unknown at its beginning; a label or an error handler can be reached from
//! anywhere in the routine. What a called routine or function may change is forgotten, and what a trap routine or an
//! error handler may change is never known. What is not known from the statements before has, as far as nothing
//! assigns its components, its initial value.

use super::evaluate::{Context, Evaluator, Known};
use super::instruction::{self, INSTRUCTIONS};
use super::modal::{States, Which, setting};
use super::predefined;
use super::symbol::{Unit, What};
use super::syntax::{Syntax, arguments, expressions, parts, token_kind};
use super::token::{Token, folded, same_name};
use super::value::Value;
use crate::program::motion::{Frame, Reason};
use crate::program::tree::Child;

/// The key in [`Known`] under which the program displacement stands: no name of the program has it. Where it is absent
/// the displacement is as at the entry of the routine.
pub(super) const DISPLACEMENT: u32 = u32::MAX;

/// Longer arrays are not followed element by element.
const ELEMENTS: f64 = 64.0;

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
        for (key, value) in &self.known {
            if let Some(other) = other.known.get(key) {
                known.insert(*key, agreed(value, other));
            }
        }
        // What one way alone tells is, where the ways join, as if no way told it.
        if self.known.contains_key(&DISPLACEMENT) != other.known.contains_key(&DISPLACEMENT) {
            known.insert(DISPLACEMENT, Value::Unknown(Reason::Displacement));
        }
        State {
            known,
            modal: self.modal.or(other.modal),
            previous: self.previous.filter(|_| self.previous == other.previous),
            reached: true,
        }
    }
}

/// What two values agree on.
fn agreed(a: &Value, b: &Value) -> Value {
    match (a, b) {
        _ if a == b => a.clone(),
        (Value::List(a), Value::List(b)) if a.len() == b.len() => {
            Value::List(a.iter().zip(b).map(|(a, b)| agreed(a, b)).collect())
        }
        _ => Value::Unknown(Reason::Assigned),
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
        Walk { evaluator, unit, visitor, exits: States::NONE, any: States::NONE, handled: States::NONE };
    walk.any = walk.settings(unit.node).or(States::ENTRY);
    walk.handled = walk.handled();
    let mut state = State { known: Known::new(), modal: States::ENTRY, previous: None, reached: true };
    if unit.routine.is_some() {
        for &id in evaluator.symbols.changed_in(unit) {
            // A variable of the routine has its initial value at every call.
            let symbol = &evaluator.symbols.symbols[id as usize];
            if symbol.scope == unit.scope
                && !symbol.volatile
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
    /// What an error handler may set before it goes back to the statements.
    handled: States,
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
                let displaces = self.displaces(node);
                let forget = |walk: &Self, state: &mut State| {
                    walk.forget_changed(node, state);
                    if displaces {
                        state.known.insert(DISPLACEMENT, Value::Unknown(Reason::Displacement));
                    }
                };
                forget(self, &mut entry);
                let inside = Surroundings { in_loop: true, guarded: false, ..place };
                let mut after = self.block(node, entry.clone(), inside).joined(entry);
                forget(self, &mut after);
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
                State { previous: None, known: self.anywhere().known, ..state }
            }
            // Conditions and bounds: the functions in them.
            _ => {
                self.forget_changed(node, &mut state);
                state
            }
        }
    }

    fn branches(&mut self, node: u32, mut state: State, place: Surroundings, otherwise: Token) -> State {
        let tree = &self.evaluator.trees[self.unit.file as usize];
        let mut joined: Option<State> = None;
        let mut complete = false;
        for branch in tree.child_nodes(node) {
            if !matches!(tree.nodes[branch as usize].kind, Syntax::Branch | Syntax::Case) {
                self.forget_changed(branch, &mut state);
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
        let mut known = Known::new();
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

    /// Forgets what anything under a node may change: assignments, arguments that come back changed, what called
    /// routines and functions do.
    fn forget_changed(&self, node: u32, state: &mut State) {
        let tree = &self.evaluator.trees[self.unit.file as usize];
        let symbols = self.evaluator.symbols;
        for node in node..node + tree.nodes[node as usize].size {
            let kind = tree.nodes[node as usize].kind;
            if !kind.may_change() {
                continue;
            }
            symbols.changed_by(tree, self.unit.scope, node, &mut |change| {
                state.known.remove(&change.symbol);
            });
            if kind == Syntax::LateCall {
                self.forget_outside(state);
            } else if matches!(kind, Syntax::Call | Syntax::Function) {
                let name = tree.text(tree.nodes[node as usize].first);
                self.forget_called(name, kind, state);
            }
        }
    }

    /// Forgets what the routine or instruction of this name may change apart from its arguments.
    fn forget_called(&self, name: &[u8], kind: Syntax, state: &mut State) {
        let symbols = self.evaluator.symbols;
        if kind == Syntax::Call && symbols.is_motion(self.unit.scope, name) {
            return;
        }
        let moves = match symbols.routine(self.unit.scope, name) {
            Some(routine) => {
                let reach = &symbols.routines[routine as usize].reach;
                for symbol in &reach.changes {
                    state.known.remove(symbol);
                }
                if reach.anything {
                    self.forget_outside(state);
                }
                reach.moves
            }
            None if predefined::effect(name).is_some() => false,
            None => {
                self.forget_outside(state);
                true
            }
        };
        if moves {
            state.previous = None;
        }
    }

    /// A routine that is not known here may change everything that is declared outside this one.
    fn forget_outside(&self, state: &mut State) {
        let symbols = &self.evaluator.symbols.symbols;
        state.known.retain(|&id, _| symbols.get(id as usize).is_none_or(|s| s.scope == self.unit.scope));
    }

    /// What the error handlers of the unit set before they go back to the statements.
    fn handled(&mut self) -> States {
        let tree = &self.evaluator.trees[self.unit.file as usize];
        let clauses = tree.child_nodes(self.unit.node);
        let clauses: Vec<u32> =
            clauses.filter(|&clause| tree.nodes[clause as usize].kind == Syntax::ErrorClause).collect();
        clauses.into_iter().fold(States::NONE, |all, clause| all.or(self.settings(clause)))
    }

    /// Everything that statements under a node may set.
    fn settings(&mut self, node: u32) -> States {
        let tree = &self.evaluator.trees[self.unit.file as usize];
        let end = node + tree.nodes[node as usize].size;
        let symbols = self.evaluator.symbols;
        let mut out = States::NONE;
        for &node in symbols.switches_in(self.unit, node..end) {
            let name = tree.text(tree.nodes[node as usize].first);
            if let Some((which, on)) = setting(tree, node, name) {
                out = out.or(States::NONE.set(which, on));
            } else if let Some(routine) = symbols.routine(self.unit.scope, name) {
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
        for inside in tree.child_nodes(node) {
            self.forget_changed(inside, &mut state);
        }
        state.modal = state.modal.or(self.handled);
        if !self.handled.leaves(Which::Displacement) {
            state.known.insert(DISPLACEMENT, Value::Unknown(Reason::Displacement));
        }
        let motion = self.visitor.call(self.unit, node, &state, place);
        let known = if late || symbols.hides_instruction { None } else { instruction::find(name) };
        if known.is_none_or(|known| INSTRUCTIONS[known].searches()) {
            symbols.changed_by(tree, self.unit.scope, node, &mut |change| {
                state.known.remove(&change.symbol);
            });
        }
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
                self.forget_called(name, Syntax::Call, &mut state);
            }
            None if late => self.forget_outside(&mut state),
            None if predefined::effect(name).is_some() => return state,
            None => {
                self.forget_outside(&mut state);
                if motion.is_some() {
                    state.previous = motion;
                    return state;
                }
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
        for inside in tree.child_nodes(node) {
            self.forget_changed(inside, state);
        }
        let Some(root) = symbols.root(tree, self.unit.scope, place) else { return };
        let context = Context::new(self.unit.file, self.unit.scope, &state.known);
        let value = self.evaluator.value(context, expression);
        let new = match place {
            Child::Token(_) => value,
            Child::Node(place) => {
                let path: Vec<Child> = parts(tree, place).skip(1).collect();
                let mut old = self.evaluator.symbol_value(context, root);
                if let (Value::Unknown(reason), Some(Child::Node(_))) = (&old, path.first()) {
                    old = self.elements(context, root, *reason);
                }
                let type_name = symbols.symbols[root as usize].type_name.clone();
                self.replaced(context, old, &type_name, &path, value)
            }
        };
        // A big array that is filled element by element is not worth keeping.
        if size(&new, 0) > 4096 || symbols.symbols[root as usize].volatile {
            state.known.remove(&root);
        } else {
            state.known.insert(root, new);
        }
    }

    /// An array of which nothing is known, element by element, so that those that are assigned are.
    fn elements(&self, context: Context<'_>, root: u32, reason: Reason) -> Value {
        let symbol = &self.evaluator.symbols.symbols[root as usize];
        let tree = &self.evaluator.trees[symbol.file as usize];
        let dimensions = match &symbol.what {
            What::Data(data) => data.dimensions,
            _ => None,
        };
        let Some(dimensions) = dimensions else { return Value::Unknown(reason) };
        let mut sizes = expressions(tree, dimensions);
        let (Some(size), None) = (sizes.next(), sizes.next()) else { return Value::Unknown(reason) };
        let there = Context::new(symbol.file, symbol.scope, context.known);
        match self.evaluator.value(there, size).number() {
            Ok(size) if (1.0..=ELEMENTS).contains(&size) => {
                Value::List(vec![Value::Unknown(reason); size as usize])
            }
            _ => Value::Unknown(reason),
        }
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
