//! The statements of a routine in the order in which they run: what assigned data holds, how the switches stand, and
//! which motion went before.
//!
//! One pass per routine. Straight-line assignments are followed exactly; where ways join, only what they agree on
//! stays known; what a loop assigns is unknown at its beginning; a label or an error handler can be reachable from
//! anywhere in the routine. What a called routine or function may change is forgotten, and what a trap routine, an
//! error handler or the controller itself may change at any time is never known. A parameter by reference may be another
//! name of data outside or of another parameter: where one changes, the others are forgotten. What is not known from the statements before has, as far as nothing
//! assigns its components, its initial value.

mod assign;
mod invalidate;

use super::evaluate::{Context, Evaluator, Known};
use super::instruction::{self, Also, INSTRUCTIONS};
use super::modal::{Switch, SwitchSet, switches_set_by};
use super::predefined;
use super::reaching_motions::ReachingMotions;
use super::symbol::facts::{counts_from_position, is_resuming_handler};
use super::symbol::{SymbolKind, Unit};
use super::syntax::{Syntax, arguments, parts, token_kind};
use super::token::{Token, same_name};
use super::value::Value;
use crate::motion::{Frame, Reason};
use crate::tree::Child;

/// The key in [`Known`] under which the program displacement stands: no name of the program has it. Where it is absent
/// the displacement is as at the entry of the routine.
pub(super) const DISPLACEMENT: u32 = u32::MAX;

/// Data that holds more numbers and texts is not followed.
const MAX_VALUE_SIZE: usize = 4096;

/// Longer arrays are not followed element by element.
const MAX_ELEMENTS: f64 = 64.0;

/// What holds before a statement.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct AbstractState {
    pub(super) known: Known,
    pub(super) modal: SwitchSet,
    pub(super) previous: Option<u32>,
    /// Where the robot may stand, where anything tracks_motions from there.
    reaching: ReachingMotions,
    /// Whether any way leads here.
    reachable: bool,
}

impl AbstractState {
    /// The program displacement: `None` as at the entry of the routine, an error where it is not known.
    pub(super) fn displacement(&self) -> Option<Result<Frame, Reason>> {
        self.known.get(&DISPLACEMENT).map(|value| value.frame())
    }

    fn join(self, other: AbstractState) -> AbstractState {
        if !self.reachable {
            return other;
        }
        if !other.reachable {
            return self;
        }
        let mut known = self
            .known
            .joined(&other.known, &|a: Option<&Value>, b: Option<&Value>| Some(join_values(a?, b?)));
        // What one way alone tells is, where the ways join, as if no way told it.
        if self.known.contains_key(&DISPLACEMENT) != other.known.contains_key(&DISPLACEMENT) {
            known.insert(DISPLACEMENT, Value::Unknown(Reason::Displacement));
        }
        AbstractState {
            known,
            modal: self.modal.join(other.modal),
            previous: self.previous.filter(|_| self.previous == other.previous),
            reaching: self.reaching.join(other.reaching),
            reachable: true,
        }
    }
}

/// What two values agree on.
fn join_values(a: &Value, b: &Value) -> Value {
    match (a, b) {
        _ if a == b => a.clone(),
        (Value::List(a), Value::List(b)) if a.len() == b.len() => {
            Value::List(a.iter().zip(b).map(|(a, b)| join_values(a, b)).collect())
        }
        _ => Value::Unknown(Reason::Assigned),
    }
}

/// A call of a routine of the program, with the switches as they stand there.
#[derive(Debug, Clone, Copy)]
pub(super) struct CallSite {
    pub(super) routine: u32,
    pub(super) modal: SwitchSet,
}

/// What the walk hands to its owner at each statement that may move the robot.
pub(super) trait Visitor {
    /// A call; answers the index of the motion, where it is one.
    fn visit_call(&mut self, unit: Unit, node: u32, state: &AbstractState, nesting: Nesting) -> Option<u32>;
    /// The states of switches with which a routine ends, "as at the entry" included.
    fn exit_switches(&mut self, routine: u32) -> SwitchSet;
    /// A call of a routine of the program.
    fn record_call(&mut self, site: CallSite);
    /// A call by a computed name, with the switches as they stand there.
    fn record_late_call(&mut self, modal: SwitchSet);
    /// A call of a routine that is in none of the files, which may call those that are.
    fn record_external_call(&mut self, modal: SwitchSet);
    /// A displacement is counted from where the robot stands.
    fn record_position_use(&mut self, reaching: &ReachingMotions);
    /// The next cycle begins at main with the switches as they stand here.
    fn record_cycle_restart(&mut self, modal: SwitchSet);
}

/// In what a statement stands.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Nesting {
    pub(super) in_loop: bool,
    pub(super) conditional: bool,
    /// Whether a compact IF guards the statement alone.
    pub(super) guarded: bool,
}

/// Walks one unit; hands back the states of the switches at its end.
pub(super) fn interpret_unit(
    evaluator: &Evaluator<'_, '_>,
    unit: Unit,
    visitor: &mut dyn Visitor,
) -> SwitchSet {
    let symbols = evaluator.symbols;
    let tree = &evaluator.trees[unit.file as usize];
    let resumes = tree.child_nodes(unit.node).any(|clause| is_resuming_handler(tree, clause));
    let (exits, any, handler_switches) = (SwitchSet::EMPTY, SwitchSet::EMPTY, SwitchSet::EMPTY);
    let aliases = aliases(evaluator, unit);
    let moved_between = symbols.may_move_between_statements(evaluator.trees, unit);
    let tracks_motions = symbols.uses_position();
    let mut interpreter = Interpreter {
        evaluator,
        unit,
        visitor,
        exits,
        any,
        handler_switches,
        resumes,
        moved_between,
        tracks_motions,
        aliases,
    };
    interpreter.handler_switches = interpreter.handler_switches();
    interpreter.any =
        interpreter.switches_set_under(unit.node).join(interpreter.handler_switches).join(SwitchSet::ENTRY);
    if let Some(routine) = unit.routine
        && tree.child_nodes(unit.node).any(|clause| is_exception_clause(tree.nodes[clause as usize].kind))
    {
        // An error leaves what is called anywhere.
        interpreter.any = interpreter.any.join(symbols.routines[routine as usize].effects.switches);
    }
    let reaching = if tracks_motions { ReachingMotions::routine_entry() } else { ReachingMotions::default() };
    let mut state = AbstractState {
        known: Known::new(),
        modal: SwitchSet::ENTRY,
        previous: None,
        reaching,
        reachable: true,
    };
    // Where ExitCycle begins main anew, its variables may be as they were.
    if unit
        .routine
        .is_some_and(|routine| !(symbols.restarts_main && symbols.is_main(evaluator.trees, routine)))
    {
        for &id in symbols.written_in(unit) {
            // A variable of the routine has its initial value at every call.
            let symbol = &symbols.symbols[id as usize];
            if symbol.scope == unit.scope
                && !symbol.volatile
                && matches!(&symbol.kind, SymbolKind::Data(data) if data.storage == Token::Var)
            {
                let context = Context::new(unit.file, unit.scope, &state.known);
                if let Some(value) = evaluator.initial_value(context, id) {
                    state.known.insert(id, value);
                }
            }
        }
    }
    let end = interpreter.transfer_block(unit.node, state, Nesting::default());
    if end.reachable { interpreter.exits.join(end.modal) } else { interpreter.exits }
}

/// The parameters of a unit that may be other names of data outside it, or of each other.
fn aliases(evaluator: &Evaluator<'_, '_>, unit: Unit) -> Vec<u32> {
    let Some(routine) = unit.routine else { return Vec::new() };
    let tree = &evaluator.trees[unit.file as usize];
    let parameters = &evaluator.symbols.routines[routine as usize].head.parameters;
    let referred = parameters.iter().filter(|parameter| parameter.by_reference);
    referred.filter_map(|parameter| evaluator.symbols.find(unit.scope, tree.text(parameter.name))).collect()
}

struct Interpreter<'w, 'a, 's> {
    evaluator: &'w Evaluator<'a, 's>,
    unit: Unit,
    visitor: &'w mut dyn Visitor,
    exits: SwitchSet,
    /// What any statement of the unit may set.
    any: SwitchSet,
    /// What an error handler may set before it goes back to the statements, and what trap routines leave set.
    handler_switches: SwitchSet,
    /// Whether an error handler goes back to the statements, so that what they call may end anywhere.
    resumes: bool,
    /// Whether an error handler that goes back to the statements, or a trap routine, moves the robot.
    moved_between: bool,
    /// Whether anything in the program tracks_motions from where the robot stands.
    tracks_motions: bool,
    /// The parameters that may be other names of data outside, or of each other.
    aliases: Vec<u32>,
}

impl Interpreter<'_, '_, '_> {
    /// The children of a node that are statements or hold statements.
    fn transfer_block(&mut self, node: u32, mut state: AbstractState, nesting: Nesting) -> AbstractState {
        let tree = &self.evaluator.trees[self.unit.file as usize];
        let (mut child, end) = (node + 1, node + tree.nodes[node as usize].size);
        while child < end {
            let kind = tree.nodes[child as usize].kind;
            if !(self.unit.routine.is_none() && (kind.is_routine() || kind == Syntax::Module)) {
                state = self.transfer_statement(child, kind, state, nesting);
            }
            child += tree.nodes[child as usize].size;
        }
        state
    }

    fn transfer_statement(
        &mut self,
        node: u32,
        kind: Syntax,
        mut state: AbstractState,
        nesting: Nesting,
    ) -> AbstractState {
        let conditional = Nesting { conditional: true, guarded: false, ..nesting };
        match kind {
            Syntax::Body => self.transfer_block(node, state, nesting),
            Syntax::Call | Syntax::LateCall => self.transfer_call(node, state, nesting),
            Syntax::Assignment => {
                self.transfer_assignment(node, &mut state);
                state
            }
            Syntax::If => self.transfer_branches(node, state, conditional, Token::Else),
            Syntax::Test => self.transfer_branches(node, state, conditional, Token::Default),
            Syntax::CompactIf => {
                // The condition is asked before the ways part.
                self.invalidate_condition(node, &mut state);
                let before = state.clone();
                let guarded = Nesting { guarded: true, ..conditional };
                self.transfer_block(node, state, guarded).join(before)
            }
            Syntax::For | Syntax::While => self.transfer_loop(node, kind, state, nesting),
            Syntax::ErrorClause | Syntax::UndoClause | Syntax::BackwardClause => {
                let entry = self.state_at_any_point();
                let end = self.transfer_block(node, entry, conditional);
                if end.reachable && kind == Syntax::ErrorClause {
                    self.exits = self.exits.join(end.modal);
                }
                if end.reachable && kind == Syntax::UndoClause && self.evaluator.symbols.restarts_main {
                    self.visitor.record_cycle_restart(end.modal);
                }
                // The handler is no continuation of the statements before it.
                state
            }
            Syntax::Label => state.join(self.state_at_any_point()),
            Syntax::Return => {
                self.invalidate_changed(node, &mut state);
                self.exits = self.exits.join(state.modal);
                AbstractState { reachable: false, ..state }
            }
            Syntax::Raise if self.resumes => {
                // The handler of the routine goes on behind it.
                self.join_switches(self.handler_switches, &mut state);
                AbstractState { previous: None, reaching: self.any_motion(), ..state }
            }
            // Where a caller catches the error, it tracks_motions with all that is set here.
            Syntax::Goto | Syntax::Raise => AbstractState { reachable: false, ..state },
            Syntax::Leave => {
                self.exits = self.exits.join(state.modal);
                AbstractState { reachable: false, ..state }
            }
            Syntax::Opaque | Syntax::Unwritten => {
                // What could not be read may do anything to what the routine assigns.
                AbstractState {
                    previous: None,
                    reaching: self.any_motion(),
                    known: self.state_at_any_point().known,
                    ..state
                }
            }
            // Conditions and bounds: the functions in them.
            _ => {
                self.invalidate_changed(node, &mut state);
                state
            }
        }
    }

    /// A loop: what holds in it and behind it holds on every way round.
    fn transfer_loop(
        &mut self,
        node: u32,
        kind: Syntax,
        mut entry: AbstractState,
        nesting: Nesting,
    ) -> AbstractState {
        entry.modal = entry.modal.join(self.switches_set_under(node));
        entry.previous = None;
        let outside = std::mem::take(&mut entry.reaching);
        entry.reaching = outside.in_loop();
        let displaces = self.may_displace(node);
        let invalidate = |interpreter: &mut Self, state: &mut AbstractState| {
            interpreter.invalidate_changed(node, state);
            if kind == Syntax::While {
                // It may wait for another task.
                interpreter.invalidate_shared(state);
            }
            if displaces {
                state.known.insert(DISPLACEMENT, Value::Unknown(Reason::Displacement));
            }
        };
        invalidate(self, &mut entry);
        let inside = Nesting { in_loop: true, guarded: false, ..nesting };
        let mut after = self.transfer_block(node, entry.clone(), inside).join(entry);
        invalidate(self, &mut after);
        after.previous = None;
        after.reaching = after.reaching.after_loop(&outside);
        after
    }

    fn transfer_branches(
        &mut self,
        node: u32,
        mut state: AbstractState,
        nesting: Nesting,
        otherwise: Token,
    ) -> AbstractState {
        let tree = &self.evaluator.trees[self.unit.file as usize];
        let mut joined: Option<AbstractState> = None;
        let mut complete = false;
        for branch in tree.child_nodes(node) {
            if !matches!(tree.nodes[branch as usize].kind, Syntax::Branch | Syntax::Case) {
                self.invalidate_changed(branch, &mut state);
                continue;
            }
            // A condition is asked before the branches that follow, whether they are gone or not.
            self.invalidate_condition(branch, &mut state);
            let first = parts(tree, branch).next();
            complete |= first.and_then(|first| token_kind(tree, first)) == Some(otherwise);
            let end = self.transfer_block(branch, state.clone(), nesting);
            joined = Some(match joined {
                Some(joined) => joined.join(end),
                None => end,
            });
        }
        match joined {
            // TRYNEXT passes all branches where a condition fails.
            Some(joined) if complete && !self.resumes => joined,
            Some(joined) => joined.join(state),
            None => state,
        }
    }

    /// What holds at a place that can be reachable from anywhere in the routine.
    fn state_at_any_point(&self) -> AbstractState {
        let mut known = Known::new();
        if !self.any.is_entry(Switch::Displacement) {
            known.insert(DISPLACEMENT, Value::Unknown(Reason::Displacement));
        }
        AbstractState { known, modal: self.any, previous: None, reaching: self.any_motion(), reachable: true }
    }

    /// The robot may stand at the end of any motion.
    fn any_motion(&self) -> ReachingMotions {
        if self.tracks_motions { ReachingMotions::any() } else { ReachingMotions::default() }
    }

    /// Where the robot stands after a motion.
    fn after_motion(&self, motion: Option<u32>, before: &mut ReachingMotions) {
        if !self.tracks_motions {
            return;
        }
        // A handler goes on behind a motion that has failed, or from any_motion.
        let also = if self.resumes { std::mem::take(before) } else { ReachingMotions::default() };
        *before = ReachingMotions::after(motion).join(also);
        before.any |= self.moved_between;
    }

    /// Whether statements under a node may set or end a program displacement.
    fn may_displace(&mut self, node: u32) -> bool {
        !self.switches_set_under(node).is_unset(Switch::Displacement)
    }

    /// The displacement after PDispSet, PDispOn, PDispAdd or PDispOff.
    fn displacement_value(&self, node: u32, state: &AbstractState, name: &[u8]) -> Value {
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
            // PDispAdd tracks_motions from what a search found.
            None
        };
        frame.map_or(Value::Unknown(Reason::Displacement), |frame| Value::from_frame(&frame))
    }

    /// What the error handlers of the unit set before they go back to the statements, and what trap routines leave set.
    fn handler_switches(&mut self) -> SwitchSet {
        let tree = &self.evaluator.trees[self.unit.file as usize];
        let clauses = tree.child_nodes(self.unit.node);
        let clauses: Vec<u32> =
            clauses.filter(|&clause| tree.nodes[clause as usize].kind == Syntax::ErrorClause).collect();
        let handler_switches = clauses
            .into_iter()
            .fold(SwitchSet::EMPTY, |all, clause| all.join(self.switches_set_under(clause)));
        let symbols = self.evaluator.symbols;
        // One trap routine waits for the other.
        if self.unit.routine.is_some_and(|routine| symbols.interrupts[routine as usize]) {
            return handler_switches;
        }
        let left = |all: SwitchSet, routine: &u32| {
            all.join(self.visitor.exit_switches(*routine).substitute_entry(SwitchSet::EMPTY))
        };
        symbols.interrupt_routines.iter().fold(handler_switches, left)
    }

    /// Everything that statements under a node may set.
    fn switches_set_under(&mut self, node: u32) -> SwitchSet {
        let tree = &self.evaluator.trees[self.unit.file as usize];
        let end = node + tree.nodes[node as usize].size;
        let symbols = self.evaluator.symbols;
        let mut out = SwitchSet::EMPTY;
        for &node in symbols.switch_calls_in(self.unit, node..end) {
            let name = tree.text(tree.nodes[node as usize].first);
            let late = tree.nodes[node as usize].kind == Syntax::LateCall;
            let called = if late { &[] } else { symbols.callees(self.unit.scope, name) };
            if let Some(sets) =
                (!late && called.is_empty()).then(|| switches_set_by(tree, node, name)).flatten()
            {
                out = out.join(sets);
            } else if called.is_empty() {
                out = out.join(symbols.late_switches_of(self.unit));
            }
            for &routine in called {
                out = out.join(self.visitor.exit_switches(routine));
                if self.resumes || tree.nodes[node as usize].kind == Syntax::Function {
                    out = out.join(symbols.routines[routine as usize].effects.switches);
                }
            }
        }
        // "As at the entry" of a called routine is what holds here anyway.
        out.substitute_entry(SwitchSet::EMPTY)
    }

    fn transfer_call(&mut self, node: u32, mut state: AbstractState, nesting: Nesting) -> AbstractState {
        let tree = &self.evaluator.trees[self.unit.file as usize];
        let symbols = self.evaluator.symbols;
        let name = tree.text(tree.nodes[node as usize].first);
        let late = tree.nodes[node as usize].kind == Syntax::LateCall;
        self.join_switches(self.handler_switches, &mut state);
        for inside in tree.child_nodes(node) {
            self.invalidate_changed(inside, &mut state);
        }
        let motion = self.visitor.visit_call(self.unit, node, &state, nesting);
        let known = if late { None } else { instruction::find(name).map(|known| &INSTRUCTIONS[known]) };
        let hidden = symbols.hides_instruction && symbols.routine(self.unit.scope, name).is_some();
        let known = known.filter(|_| !hidden);
        if let Some(known) = known {
            if !known.only_moves() {
                self.invalidate_written(node, &mut state);
            }
            if known.also == Also::Stiffens {
                state.modal = state.modal.set(Switch::Soft, false);
            }
            if motion.is_some() {
                // A search stops where its signal comes, and a handler may go on from any_motion.
                state.previous = motion.filter(|_| !known.ends_early() && !self.moved_between);
                self.after_motion(motion, &mut state.reaching);
            }
            return state;
        }
        let incremented = self.incremented(node, &state, name);
        self.invalidate_written(node, &mut state);
        if !late && symbols.writes_unknown_data(tree, self.unit.scope, node, name) {
            state.known.retain(|&id, _| id == DISPLACEMENT);
        }
        if let Some((target, value)) = incremented {
            self.store(target, value, &mut state);
        }
        if predefined::waits(name) {
            self.invalidate_shared(&mut state);
        }
        let own = symbols.routine(self.unit.scope, name).is_some();
        if let Some(sets) = (!late && !own).then(|| switches_set_by(tree, node, name)).flatten() {
            self.transfer_switch_instruction(node, name, sets, motion, &mut state);
            return state;
        }
        let called = if late { &[] } else { symbols.callees(self.unit.scope, name) };
        if late || called.is_empty() && predefined::calls_by_name(name) {
            self.transfer_late_call(&mut state);
            return state;
        }
        match called {
            [_, ..] => self.transfer_routine_call(called, name, &mut state),
            [] if predefined::effect(name).is_some() => {
                if predefined::begins_cycle(name) {
                    self.visitor.record_cycle_restart(state.modal);
                    return AbstractState { reachable: false, ..state };
                }
                if predefined::displaces(name).is_some() {
                    state.previous = None;
                    self.after_motion(motion, &mut state.reaching);
                }
                return state;
            }
            [] => {
                self.visitor.record_external_call(state.modal);
                self.invalidate_nonlocal(&mut state);
                if motion.is_some() {
                    state.previous = motion;
                    self.after_motion(motion, &mut state.reaching);
                    return state;
                }
                state.reaching = self.any_motion();
            }
        }
        state.previous = None;
        state
    }

    /// A call of what sets switches (ConfL, PDispOn): these hold from here on.
    fn transfer_switch_instruction(
        &mut self,
        node: u32,
        name: &[u8],
        sets: SwitchSet,
        motion: Option<u32>,
        state: &mut AbstractState,
    ) {
        let tree = &self.evaluator.trees[self.unit.file as usize];
        state.modal = state.modal.overwrite(sets);
        if counts_from_position(tree, node, name) {
            self.visitor.record_position_use(&state.reaching);
        }
        // One that also moves.
        state.previous = motion.or(state.previous);
        if motion.is_some() {
            self.after_motion(motion, &mut state.reaching);
        }
        if !sets.is_unset(Switch::Displacement) {
            let value = self.displacement_value(node, state, name);
            state.known.insert(DISPLACEMENT, value);
        }
        if predefined::displaces(name).is_some() {
            state.previous = None;
            self.after_motion(motion, &mut state.reaching);
        }
    }

    /// A call of a routine whose name is worked out while the program runs.
    fn transfer_late_call(&mut self, state: &mut AbstractState) {
        let symbols = self.evaluator.symbols;
        if self.tracks_motions {
            self.visitor.record_position_use(&state.reaching);
        }
        if self.resumes {
            // It may be called once more after an error in it.
            self.join_switches(symbols.late_switches_of(self.unit), state);
        }
        self.visitor.record_late_call(state.modal);
        if symbols.late_callees_of(self.unit).is_empty() {
            self.visitor.record_external_call(state.modal);
        }
        self.join_switches(symbols.late_switches_of(self.unit), state);
        self.invalidate_nonlocal(state);
        state.previous = None;
        state.reaching = self.any_motion();
    }

    /// A call of a routine of the program: of one of these, where modules declare several of the name.
    fn transfer_routine_call(&mut self, called: &[u32], name: &[u8], state: &mut AbstractState) {
        let symbols = self.evaluator.symbols;
        let sets =
            |all: SwitchSet, routine: &u32| all.join(symbols.routines[*routine as usize].effects.switches);
        let sets = called.iter().fold(SwitchSet::EMPTY, sets);
        if self.resumes {
            // It may have been left anywhere by an error, and be called once more.
            self.join_switches(sets, state);
        }
        if called.iter().any(|routine| symbols.routines[*routine as usize].effects.uses_position) {
            self.visitor.record_position_use(&state.reaching);
        }
        if self.tracks_motions
            && called.iter().any(|routine| symbols.routines[*routine as usize].effects.moves)
        {
            state.reaching.any = true;
        }
        let mut exit = SwitchSet::EMPTY;
        for &routine in called {
            self.visitor.record_call(CallSite { routine, modal: state.modal });
            exit = exit.join(self.visitor.exit_switches(routine));
        }
        if exit == SwitchSet::EMPTY {
            state.reachable = self.resumes;
            return;
        }
        state.modal = exit.substitute_entry(state.modal);
        if !exit.is_entry(Switch::Displacement) {
            let value = if exit.is_off(Switch::Displacement) {
                Value::from_frame(&Frame::IDENTITY)
            } else {
                Value::Unknown(Reason::Displacement)
            };
            state.known.insert(DISPLACEMENT, value);
        }
        if self.resumes {
            self.join_switches(sets, state);
        }
        self.invalidate_called(name, Syntax::Call, state);
    }
}

/// Whether a clause of a routine is gone into from any of its statements.
fn is_exception_clause(clause: Syntax) -> bool {
    matches!(clause, Syntax::ErrorClause | Syntax::UndoClause)
}
