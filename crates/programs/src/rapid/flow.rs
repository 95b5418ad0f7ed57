//! The statements of a routine in the order in which they run: what assigned data holds, how the switches stand, and
//! which motion went before.
//!
//! One pass per routine. Straight-line assignments are followed exactly; where ways join, only what they agree on
//! stays known; what a loop assigns is unknown at its beginning; a label or an error handler can be reached from
//! anywhere in the routine. What a called routine or function may change is forgotten, and what a trap routine, an
//! error handler or the controller itself may change at any time is never known. A parameter by reference may be another
//! name of data outside or of another parameter: where one changes, the others are forgotten. What is not known from the statements before has, as far as nothing
//! assigns its components, its initial value.

mod assign;
mod forget;

use super::evaluate::{Context, Evaluator, Known};
use super::instruction::{self, Also, INSTRUCTIONS};
use super::modal::{States, Which, setting};
use super::predefined;
use super::standing::Standing;
use super::symbol::change::{places, resumes};
use super::symbol::{Unit, What};
use super::syntax::{Syntax, arguments, parts, token_kind};
use super::token::{Token, same_name};
use super::value::Value;
use crate::motion::{Frame, Reason};
use crate::tree::Child;

/// The key in [`Known`] under which the program displacement stands: no name of the program has it. Where it is absent
/// the displacement is as at the entry of the routine.
pub(super) const DISPLACEMENT: u32 = u32::MAX;

/// Data that holds more numbers and texts is not followed.
const KEPT: usize = 4096;

/// Longer arrays are not followed element by element.
const ELEMENTS: f64 = 64.0;

/// What holds before a statement.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct State {
    pub(super) known: Known,
    pub(super) modal: States,
    pub(super) previous: Option<u32>,
    /// Where the robot may stand, where anything counts from there.
    standing: Standing,
    /// Whether any way leads here.
    reached: bool,
}

impl State {
    /// The program displacement: `None` as at the entry of the routine, an error where it is not known.
    pub(super) fn displacement(&self) -> Option<Result<Frame, Reason>> {
        self.known.get(&DISPLACEMENT).map(|value| value.frame())
    }

    fn joined(self, other: State) -> State {
        if !self.reached {
            return other;
        }
        if !other.reached {
            return self;
        }
        let mut known =
            self.known.joined(&other.known, &|a: Option<&Value>, b: Option<&Value>| Some(agreed(a?, b?)));
        // What one way alone tells is, where the ways join, as if no way told it.
        if self.known.contains_key(&DISPLACEMENT) != other.known.contains_key(&DISPLACEMENT) {
            known.insert(DISPLACEMENT, Value::Unknown(Reason::Displacement));
        }
        State {
            known,
            modal: self.modal.or(other.modal),
            previous: self.previous.filter(|_| self.previous == other.previous),
            standing: self.standing.or(other.standing),
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
    /// A call by a computed name, with the switches as they stand there.
    fn called_late(&mut self, modal: States);
    /// A call of a routine that is in none of the files, which may call those that are.
    fn called_outside(&mut self, modal: States);
    /// A displacement is counted from where the robot stands.
    fn placed_from(&mut self, standing: &Standing);
    /// The next cycle begins at main with the switches as they stand here.
    fn cycled(&mut self, modal: States);
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
    let symbols = evaluator.symbols;
    let tree = &evaluator.trees[unit.file as usize];
    let resumes = tree.child_nodes(unit.node).any(|clause| resumes(tree, clause));
    let (exits, any, handled) = (States::NONE, States::NONE, States::NONE);
    let aliases = aliases(evaluator, unit);
    let wanders = symbols.wanders(evaluator.trees, unit);
    let counts = symbols.places();
    let mut walk = Walk { evaluator, unit, visitor, exits, any, handled, resumes, wanders, counts, aliases };
    walk.handled = walk.handled();
    walk.any = walk.settings(unit.node).or(walk.handled).or(States::ENTRY);
    if let Some(routine) = unit.routine
        && tree.child_nodes(unit.node).any(|clause| catches(tree.nodes[clause as usize].kind))
    {
        // An error leaves what is called anywhere.
        walk.any = walk.any.or(symbols.routines[routine as usize].reach.sets);
    }
    let standing = if counts { Standing::at_entry() } else { Standing::default() };
    let mut state =
        State { known: Known::new(), modal: States::ENTRY, previous: None, standing, reached: true };
    // Where ExitCycle begins main anew, its variables may be as they were.
    if unit.routine.is_some_and(|routine| !(symbols.cycles && symbols.is_main(evaluator.trees, routine))) {
        for &id in symbols.changed_in(unit) {
            // A variable of the routine has its initial value at every call.
            let symbol = &symbols.symbols[id as usize];
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

/// The parameters of a unit that may be other names of data outside it, or of each other.
fn aliases(evaluator: &Evaluator<'_, '_>, unit: Unit) -> Vec<u32> {
    let Some(routine) = unit.routine else { return Vec::new() };
    let tree = &evaluator.trees[unit.file as usize];
    let parameters = &evaluator.symbols.routines[routine as usize].head.parameters;
    let referred = parameters.iter().filter(|parameter| parameter.by_reference);
    referred.filter_map(|parameter| evaluator.symbols.find(unit.scope, tree.text(parameter.name))).collect()
}

struct Walk<'w, 'a, 's> {
    evaluator: &'w Evaluator<'a, 's>,
    unit: Unit,
    visitor: &'w mut dyn Visitor,
    exits: States,
    /// What any statement of the unit may set.
    any: States,
    /// What an error handler may set before it goes back to the statements, and what trap routines leave set.
    handled: States,
    /// Whether an error handler goes back to the statements, so that what they call may end anywhere.
    resumes: bool,
    /// Whether an error handler that goes back to the statements, or a trap routine, moves the robot.
    wanders: bool,
    /// Whether anything in the program counts from where the robot stands.
    counts: bool,
    /// The parameters that may be other names of data outside, or of each other.
    aliases: Vec<u32>,
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
                // The condition is asked before the ways part.
                self.forget_asked(node, &mut state);
                let before = state.clone();
                let guarded = Surroundings { guarded: true, ..conditional };
                self.block(node, state, guarded).joined(before)
            }
            Syntax::For | Syntax::While => self.repeated(node, kind, state, place),
            Syntax::ErrorClause | Syntax::UndoClause | Syntax::BackwardClause => {
                let entry = self.anywhere();
                let end = self.block(node, entry, conditional);
                if end.reached && kind == Syntax::ErrorClause {
                    self.exits = self.exits.or(end.modal);
                }
                if end.reached && kind == Syntax::UndoClause && self.evaluator.symbols.cycles {
                    self.visitor.cycled(end.modal);
                }
                // The handler is no continuation of the statements before it.
                state
            }
            Syntax::Label => state.joined(self.anywhere()),
            Syntax::Return => {
                self.forget_changed(node, &mut state);
                self.exits = self.exits.or(state.modal);
                State { reached: false, ..state }
            }
            Syntax::Raise if self.resumes => {
                // The handler of the routine goes on behind it.
                self.may_set(self.handled, &mut state);
                State { previous: None, standing: self.elsewhere(), ..state }
            }
            // Where a caller catches the error, it counts with all that is set here.
            Syntax::Goto | Syntax::Raise => State { reached: false, ..state },
            Syntax::Leave => {
                self.exits = self.exits.or(state.modal);
                State { reached: false, ..state }
            }
            Syntax::Opaque | Syntax::Unwritten => {
                // What could not be read may do anything to what the routine assigns.
                State { previous: None, standing: self.elsewhere(), known: self.anywhere().known, ..state }
            }
            // Conditions and bounds: the functions in them.
            _ => {
                self.forget_changed(node, &mut state);
                state
            }
        }
    }

    /// A loop: what holds in it and behind it holds on every way round.
    fn repeated(&mut self, node: u32, kind: Syntax, mut entry: State, place: Surroundings) -> State {
        entry.modal = entry.modal.or(self.settings(node));
        entry.previous = None;
        let outside = std::mem::take(&mut entry.standing);
        entry.standing = outside.in_loop();
        let displaces = self.displaces(node);
        let forget = |walk: &mut Self, state: &mut State| {
            walk.forget_changed(node, state);
            if kind == Syntax::While {
                // It may wait for another task.
                walk.forget_shared(state);
            }
            if displaces {
                state.known.insert(DISPLACEMENT, Value::Unknown(Reason::Displacement));
            }
        };
        forget(self, &mut entry);
        let inside = Surroundings { in_loop: true, guarded: false, ..place };
        let mut after = self.block(node, entry.clone(), inside).joined(entry);
        forget(self, &mut after);
        after.previous = None;
        after.standing = after.standing.behind_loop(&outside);
        after
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
            // A condition is asked before the branches that follow, whether they are gone or not.
            self.forget_asked(branch, &mut state);
            let first = parts(tree, branch).next();
            complete |= first.and_then(|first| token_kind(tree, first)) == Some(otherwise);
            let end = self.block(branch, state.clone(), place);
            joined = Some(match joined {
                Some(joined) => joined.joined(end),
                None => end,
            });
        }
        match joined {
            // TRYNEXT passes all branches where a condition fails.
            Some(joined) if complete && !self.resumes => joined,
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
        State { known, modal: self.any, previous: None, standing: self.elsewhere(), reached: true }
    }

    /// The robot may stand at the end of any motion.
    fn elsewhere(&self) -> Standing {
        if self.counts { Standing::anywhere() } else { Standing::default() }
    }

    /// Where the robot stands after a motion.
    fn gone(&self, motion: Option<u32>, before: &mut Standing) {
        if !self.counts {
            return;
        }
        // A handler goes on behind a motion that has failed, or from elsewhere.
        let also = if self.resumes { std::mem::take(before) } else { Standing::default() };
        *before = Standing::at(motion).or(also);
        before.anywhere |= self.wanders;
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
        let context = Context::new(self.unit.file, self.unit.scope, &state.known);
        let first =
            arguments(tree, node).find(|argument| !argument.optional).and_then(|argument| argument.value);
        let option = |wanted: &[u8]| {
            arguments(tree, node)
                .filter(|argument| argument.optional)
                .find(|argument| argument.name.is_some_and(|name| same_name(tree.text(name), wanted)))
        };
        let target = |value: Child| {
            let value = self.evaluator.value(context, value).target(false).ok()?;
            value.cartesian().copied()
        };
        let frame = if same_name(name, b"PDispSet") {
            first.and_then(|frame| self.evaluator.value(context, frame).frame().ok())
        } else if same_name(name, b"PDispOn") {
            // From the programmed point to the executed one; without \ExeP from where the robot stands.
            let executed = option(b"ExeP").and_then(|argument| argument.value).and_then(target);
            let programmed = first.and_then(target);
            executed.zip(programmed).map(|(executed, programmed)| match option(b"Rot") {
                Some(_) => Frame::from_pose(&(executed.pose() * programmed.pose().inverse())),
                None => {
                    let (to, from) = (executed.position_mm, programmed.position_mm);
                    let position_mm = [to[0] - from[0], to[1] - from[1], to[2] - from[2]];
                    Frame { position_mm, ..Frame::IDENTITY }
                }
            })
        } else {
            // PDispAdd counts from what a search found.
            None
        };
        frame.map_or(Value::Unknown(Reason::Displacement), |frame| Value::from_frame(&frame))
    }

    /// What the error handlers of the unit set before they go back to the statements, and what trap routines leave set.
    fn handled(&mut self) -> States {
        let tree = &self.evaluator.trees[self.unit.file as usize];
        let clauses = tree.child_nodes(self.unit.node);
        let clauses: Vec<u32> =
            clauses.filter(|&clause| tree.nodes[clause as usize].kind == Syntax::ErrorClause).collect();
        let handled = clauses.into_iter().fold(States::NONE, |all, clause| all.or(self.settings(clause)));
        let symbols = self.evaluator.symbols;
        // One trap routine waits for the other.
        if self.unit.routine.is_some_and(|routine| symbols.interrupts[routine as usize]) {
            return handled;
        }
        let left = |all: States, routine: &u32| all.or(self.visitor.exit_of(*routine).entered(States::NONE));
        symbols.interrupting.iter().fold(handled, left)
    }

    /// Everything that statements under a node may set.
    fn settings(&mut self, node: u32) -> States {
        let tree = &self.evaluator.trees[self.unit.file as usize];
        let end = node + tree.nodes[node as usize].size;
        let symbols = self.evaluator.symbols;
        let mut out = States::NONE;
        for &node in symbols.switches_in(self.unit, node..end) {
            let name = tree.text(tree.nodes[node as usize].first);
            let late = tree.nodes[node as usize].kind == Syntax::LateCall;
            let called = if late { &[] } else { symbols.called(self.unit.scope, name) };
            if let Some(sets) = (!late && called.is_empty()).then(|| setting(tree, node, name)).flatten() {
                out = out.or(sets);
            } else if called.is_empty() {
                out = out.or(symbols.late_sets_of(self.unit));
            }
            for &routine in called {
                out = out.or(self.visitor.exit_of(routine));
                if self.resumes || tree.nodes[node as usize].kind == Syntax::Function {
                    out = out.or(symbols.routines[routine as usize].reach.sets);
                }
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
        self.may_set(self.handled, &mut state);
        for inside in tree.child_nodes(node) {
            self.forget_changed(inside, &mut state);
        }
        let motion = self.visitor.call(self.unit, node, &state, place);
        let known = if late { None } else { instruction::find(name).map(|known| &INSTRUCTIONS[known]) };
        let hidden = symbols.hides_instruction && symbols.routine(self.unit.scope, name).is_some();
        let known = known.filter(|_| !hidden);
        if let Some(known) = known {
            if !known.only_moves() {
                self.forget_written(node, &mut state);
            }
            if known.also == Also::Stiffens {
                state.modal = state.modal.set(Which::Soft, false);
            }
            if motion.is_some() {
                // A search stops where its signal comes, and a handler may go on from elsewhere.
                state.previous = motion.filter(|_| !known.ends_early() && !self.wanders);
                self.gone(motion, &mut state.standing);
            }
            return state;
        }
        let stepped = self.stepped(node, &state, name);
        self.forget_written(node, &mut state);
        if !late && symbols.writes_any(tree, self.unit.scope, node, name) {
            state.known.retain(|&id, _| id == DISPLACEMENT);
        }
        if let Some((place, value)) = stepped {
            self.put(place, value, &mut state);
        }
        if predefined::waits(name) {
            self.forget_shared(&mut state);
        }
        let own = symbols.routine(self.unit.scope, name).is_some();
        if let Some(sets) = (!late && !own).then(|| setting(tree, node, name)).flatten() {
            self.set_by_call(node, name, sets, motion, &mut state);
            return state;
        }
        let called = if late { &[] } else { symbols.called(self.unit.scope, name) };
        if late || called.is_empty() && predefined::calls_by_name(name) {
            self.call_late(&mut state);
            return state;
        }
        match called {
            [_, ..] => self.call_own(called, name, &mut state),
            [] if predefined::effect(name).is_some() => {
                if predefined::begins_cycle(name) {
                    self.visitor.cycled(state.modal);
                    return State { reached: false, ..state };
                }
                if predefined::displaces(name).is_some() {
                    state.previous = None;
                    self.gone(motion, &mut state.standing);
                }
                return state;
            }
            [] => {
                self.visitor.called_outside(state.modal);
                self.forget_outside(&mut state);
                if motion.is_some() {
                    state.previous = motion;
                    self.gone(motion, &mut state.standing);
                    return state;
                }
                state.standing = self.elsewhere();
            }
        }
        state.previous = None;
        state
    }

    /// A call of what sets switches (ConfL, PDispOn): these hold from here on.
    fn set_by_call(&mut self, node: u32, name: &[u8], sets: States, motion: Option<u32>, state: &mut State) {
        let tree = &self.evaluator.trees[self.unit.file as usize];
        state.modal = state.modal.then(sets);
        if places(tree, node, name) {
            self.visitor.placed_from(&state.standing);
        }
        // One that also moves.
        state.previous = motion.or(state.previous);
        if motion.is_some() {
            self.gone(motion, &mut state.standing);
        }
        if !sets.leaves(Which::Displacement) {
            let value = self.displaced(node, state, name);
            state.known.insert(DISPLACEMENT, value);
        }
        if predefined::displaces(name).is_some() {
            state.previous = None;
            self.gone(motion, &mut state.standing);
        }
    }

    /// A call of a routine whose name is worked out while the program runs.
    fn call_late(&mut self, state: &mut State) {
        let symbols = self.evaluator.symbols;
        if self.counts {
            self.visitor.placed_from(&state.standing);
        }
        if self.resumes {
            // It may be called once more after an error in it.
            self.may_set(symbols.late_sets_of(self.unit), state);
        }
        self.visitor.called_late(state.modal);
        if symbols.late_of(self.unit).is_empty() {
            self.visitor.called_outside(state.modal);
        }
        self.may_set(symbols.late_sets_of(self.unit), state);
        self.forget_outside(state);
        state.previous = None;
        state.standing = self.elsewhere();
    }

    /// A call of a routine of the program: of one of these, where modules declare several of the name.
    fn call_own(&mut self, called: &[u32], name: &[u8], state: &mut State) {
        let symbols = self.evaluator.symbols;
        let sets = |all: States, routine: &u32| all.or(symbols.routines[*routine as usize].reach.sets);
        let sets = called.iter().fold(States::NONE, sets);
        if self.resumes {
            // It may have been left anywhere by an error, and be called once more.
            self.may_set(sets, state);
        }
        if called.iter().any(|routine| symbols.routines[*routine as usize].reach.places) {
            self.visitor.placed_from(&state.standing);
        }
        if self.counts && called.iter().any(|routine| symbols.routines[*routine as usize].reach.moves) {
            state.standing.anywhere = true;
        }
        let mut exit = States::NONE;
        for &routine in called {
            self.visitor.called(CallSite { routine, modal: state.modal });
            exit = exit.or(self.visitor.exit_of(routine));
        }
        if exit == States::NONE {
            state.reached = self.resumes;
            return;
        }
        state.modal = exit.entered(state.modal);
        if !exit.keeps(Which::Displacement) {
            let value = if exit.is_off(Which::Displacement) {
                Value::from_frame(&Frame::IDENTITY)
            } else {
                Value::Unknown(Reason::Displacement)
            };
            state.known.insert(DISPLACEMENT, value);
        }
        if self.resumes {
            self.may_set(sets, state);
        }
        self.forget_called(name, Syntax::Call, state);
    }
}

/// Whether a clause of a routine is gone into from any of its statements.
fn catches(clause: Syntax) -> bool {
    matches!(clause, Syntax::ErrorClause | Syntax::UndoClause)
}
