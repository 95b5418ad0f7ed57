//! Abstract interpreter of one routine: the values of data, the switches and the reaching motions before each statement.
//!
//! Method: a forward may-analysis over the structured statements, one pass per routine ([`crate::dataflow`]). [`AbstractState`]
//! holds constants (constant propagation, [`Known`]), a [`SwitchSet`] and the [`ReachingMotions`].
//! Labels and error handlers start in a state that joins every point of the routine. Calls apply the callee's side-effect
//! summary ([`super::symbol::SideEffects`]) and its exit switches. Volatile data, which an interrupt routine, an error handler
//! or the controller may write, is never known. A parameter by reference may alias outside data or another parameter: a write
//! to one invalidates the others. Data without a known assignment has its initial value where nothing writes it.

mod assign;
mod call;
mod invalidate;

use super::evaluate::{Context, Evaluator, Known};
use super::instruction::{self, INSTRUCTIONS, Instruction, SideEffect};
use super::modal::{Switch, SwitchSet, switches_set_by};
use super::payload::{self, Gripped};
use super::predefined;
use super::reaching_motions::ReachingMotions;
use super::symbol::facts::{counts_from_position, is_resuming_handler};
use super::symbol::{Body, SymbolKind};
use super::syntax::{RapidTree, Syntax, arguments, parts, token_kind};
use super::token::{Token, same_name};
use super::value::Value;
use crate::dataflow::{Control, Lattice, Nesting, Transfer};
use crate::motion::{Frame, Reason};
use crate::tree::Child;

/// The key of the program displacement in [`Known`]; no symbol has it. Where it is absent, the displacement is as at the entry
/// of the routine.
pub(super) const DISPLACEMENT: u32 = u32::MAX;

/// Larger values (scalars and strings) are not tracked.
const MAX_VALUE_SIZE: usize = 4096;

/// Longer arrays are not tracked element by element.
const MAX_ELEMENTS: f64 = 64.0;

/// Abstract state before a statement; by default of one that control flow cannot reach.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct AbstractState {
    pub(super) known: Known,
    pub(super) modal: SwitchSet,
    pub(super) gripped: Gripped,
    pub(super) previous: Option<u32>,
    /// The motions that may be the last executed; tracked only where the program depends on them.
    pub(super) reaching: ReachingMotions,
    /// Whether control flow can reach the statement.
    pub(super) reachable: bool,
}

impl AbstractState {
    /// The program displacement: `None` as at the entry of the routine, an error where it is unknown.
    pub(super) fn displacement(&self) -> Option<Result<Frame, Reason>> {
        self.known.get(&DISPLACEMENT).map(|value| value.frame())
    }
}

impl Lattice for AbstractState {
    fn join(&mut self, other: &Self) {
        if !self.reachable {
            return self.clone_from(other);
        }
        if !other.reachable {
            return;
        }
        let displaced = [&*self, other].map(|state| state.known.contains_key(&DISPLACEMENT));
        self.known = self
            .known
            .joined(&other.known, &|a: Option<&Value>, b: Option<&Value>| Some(join_values(a?, b?)));
        // Known on one branch only: unknown at the join.
        if displaced[0] != displaced[1] {
            self.known.insert(DISPLACEMENT, Value::Unknown(Reason::Displacement));
        }
        self.modal = self.modal.join(other.modal);
        self.gripped.join(&other.gripped);
        self.previous = self.previous.filter(|_| self.previous == other.previous);
        self.reaching.join(&other.reaching);
    }
}

/// Join of two values: equal components stay known.
fn join_values(a: &Value, b: &Value) -> Value {
    match (a, b) {
        _ if a == b => a.clone(),
        (Value::List(a), Value::List(b)) if a.len() == b.len() => {
            Value::List(a.iter().zip(b).map(|(a, b)| join_values(a, b)).collect())
        }
        _ => Value::Unknown(Reason::Assigned),
    }
}

/// A call of a routine of the program, with the switches and the load at the call.
#[derive(Debug, Clone, Copy)]
pub(super) struct CallSite {
    pub(super) routine: u32,
    pub(super) modal: SwitchSet,
    pub(super) gripped: Gripped,
}

/// What holds at the end of a routine, "as at the entry" included.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Exit {
    pub(super) modal: SwitchSet,
    /// `None` where it never ends.
    pub(super) gripped: Option<Gripped>,
}

/// Receives what the interpreter finds.
pub(super) trait Visitor {
    /// A call, with the index in the table of instructions if it is `known` there; returns the index of the motion if it is one.
    fn visit_call(
        &mut self,
        body: Body,
        node: u32,
        known: Option<usize>,
        state: &AbstractState,
        nesting: Nesting,
    ) -> Option<u32>;
    /// The instruction of a call that is a motion, in the table: that of a routine whose only statement it is.
    fn inlined_instruction(&self, body: Body, node: u32) -> Option<usize>;
    /// What holds at the end of a routine.
    fn exit_of(&mut self, routine: u32) -> Exit;
    /// A call of a routine of the program.
    fn record_call(&mut self, site: CallSite);
    /// A call of a routine that moves, after these motions; returns a number of the call.
    fn record_moving_call(&mut self, routine: u32, before: &ReachingMotions) -> u32;
    /// A call of any of the routines that a computed name may call, after these motions; returns a number of the call.
    fn record_moving_late_call(&mut self, before: &ReachingMotions) -> u32;
    /// A loop begins; returns its number.
    fn record_loop(&mut self) -> u32;
    /// An iteration of the loop may end after these motions.
    fn record_loop_end(&mut self, iteration: u32, reaching: &ReachingMotions);
    /// The body may end after these motions.
    fn record_end(&mut self, reaching: &ReachingMotions);
    /// A call by a computed name, with the switches at the call.
    fn record_late_call(&mut self, modal: SwitchSet);
    /// A call of a routine that no file declares; it may call those that are declared.
    fn record_external_call(&mut self, modal: SwitchSet);
    /// A displacement is counted from the robot's current position.
    fn record_position_use(&mut self, reaching: &ReachingMotions);
    /// The program decides by the robot's current position, in the expression at a node.
    fn record_position_decision(&mut self, body: Body, node: u32, reaching: &ReachingMotions);
    /// The next cycle enters main with these switches and this load.
    fn record_cycle_restart(&mut self, modal: SwitchSet, gripped: Gripped);
}

/// Interprets one body; returns what holds at its end.
pub(super) fn interpret_body(evaluator: &Evaluator<'_, '_>, body: Body, visitor: &mut dyn Visitor) -> Exit {
    let symbols = evaluator.symbols;
    let tree = &evaluator.trees[body.file as usize];
    let resumes = tree.child_nodes(body.node).any(|clause| is_resuming_handler(tree, clause));
    let aliases = aliases(evaluator, body);
    let moved_between = symbols.may_move_between_statements(evaluator.trees, body);
    let tracks_motions = symbols.tracks_motions;
    let mut interpreter = Interpreter {
        evaluator,
        body,
        state: AbstractState::default(),
        visitor,
        exit: Exit::default(),
        any: SwitchSet::EMPTY,
        any_gripped: Gripped::default(),
        handler_switches: SwitchSet::EMPTY,
        resumes,
        moved_between,
        tracks_motions,
        aliases,
        loops: Vec::new(),
    };
    interpreter.handler_switches = interpreter.handler_switches();
    interpreter.any =
        interpreter.switches_set_under(body.node).join(interpreter.handler_switches).join(SwitchSet::ENTRY);
    if let Some(routine) = body.routine
        && tree.child_nodes(body.node).any(|clause| is_exception_clause(tree.nodes.kind(clause)))
    {
        // An error may leave a callee at any point.
        interpreter.any = interpreter.any.join(symbols.effects_of(routine).switches);
    }
    if interpreter.may_grip_under(body.node) {
        interpreter.any_gripped = Gripped::UNKNOWN;
    }
    let reaching = if tracks_motions { ReachingMotions::routine_entry() } else { ReachingMotions::default() };
    let mut state =
        AbstractState { modal: SwitchSet::ENTRY, reaching, reachable: true, ..AbstractState::default() };
    // ExitCycle restarts main without reinitialising its variables.
    if body
        .routine
        .is_some_and(|routine| !(symbols.restarts_main && symbols.is_main(evaluator.trees, routine)))
    {
        for &id in symbols.written_in(body) {
            // A variable of the routine has its initial value at every call.
            let symbol = &symbols.symbols[id as usize];
            if symbol.scope == body.scope
                && !symbol.volatile
                && matches!(&symbol.kind, SymbolKind::Data(data) if data.storage == Token::Var)
            {
                let context = Context::new(body.file, body.scope, &state.known);
                if let Some(value) = evaluator.initial_value(context, id) {
                    state.known.insert(id, value);
                }
            }
        }
    }
    interpreter.state = state;
    interpreter.walk(body.node, Nesting::default());
    let state = std::mem::take(&mut interpreter.state);
    if state.reachable {
        interpreter.leave(&state);
    }
    interpreter.exit
}

/// The parameters of a body that may alias outside data or each other.
fn aliases(evaluator: &Evaluator<'_, '_>, body: Body) -> Vec<u32> {
    let Some(routine) = body.routine else { return Vec::new() };
    let tree = &evaluator.trees[body.file as usize];
    let parameters = &evaluator.symbols.routines[routine as usize].head.parameters;
    let referred = parameters.iter().filter(|parameter| parameter.by_reference);
    referred.filter_map(|parameter| evaluator.symbols.find(body.scope, tree.text(parameter.name))).collect()
}

struct Interpreter<'w, 'a, 's> {
    evaluator: &'w Evaluator<'a, 's>,
    body: Body,
    state: AbstractState,
    visitor: &'w mut dyn Visitor,
    exit: Exit,
    /// The switches that any statement of the body may set: those at a point reachable from anywhere.
    any: SwitchSet,
    /// The load at such a point.
    any_gripped: Gripped,
    /// The switches that an error handler may set before it resumes, and those that trap routines leave set.
    handler_switches: SwitchSet,
    /// Whether an error handler resumes the statements, so that a callee may have ended anywhere.
    resumes: bool,
    /// Whether the robot may move between two statements (error handler or interrupt).
    moved_between: bool,
    /// Whether anything in the program depends on the robot's current position.
    tracks_motions: bool,
    /// The parameters that may alias outside data or each other.
    aliases: Vec<u32>,
    /// The loops around the statement.
    loops: Vec<u32>,
}

/// What a node of a body is for the flow of control.
pub(super) fn control(tree: &RapidTree<'_>, body: Body, node: u32) -> Control {
    match tree.nodes.kind(node) {
        kind if body.routine.is_none() && (kind.is_routine() || kind == Syntax::Module) => Control::Apart,
        Syntax::Body => Control::Sequence,
        Syntax::CompactIf => Control::Optional,
        Syntax::If | Syntax::Test => Control::Branches,
        Syntax::Branch | Syntax::Case => {
            let first = parts(tree, node).next().and_then(|first| token_kind(tree, first));
            Control::Branch { otherwise: matches!(first, Some(Token::Else | Token::Default)) }
        }
        Syntax::For | Syntax::While => Control::Loop,
        Syntax::ErrorClause | Syntax::UndoClause | Syntax::BackwardClause => Control::Handler,
        Syntax::Label => Control::Label,
        kind if kind.is_expression() => Control::Expression,
        _ => Control::Simple,
    }
}

impl Transfer for Interpreter<'_, '_, '_> {
    type State = AbstractState;

    fn state(&mut self) -> &mut AbstractState {
        &mut self.state
    }

    fn size(&self, node: u32) -> u32 {
        self.evaluator.trees[self.body.file as usize].nodes.get(node).size
    }

    fn control(&self, node: u32) -> Control {
        control(&self.evaluator.trees[self.body.file as usize], self.body, node)
    }

    fn transfer(&mut self, node: u32, nesting: Nesting) {
        let mut state = std::mem::take(&mut self.state);
        self.note_position_decisions(node, &state);
        match self.kind(node) {
            Syntax::Call | Syntax::LateCall => self.transfer_call(node, &mut state, nesting),
            Syntax::Assignment => self.transfer_assignment(node, &mut state),
            Syntax::Return => {
                self.invalidate_changed(node, &mut state);
                self.leave(&state);
                state.reachable = false;
            }
            Syntax::Raise if self.resumes => {
                // The handler may resume after it.
                self.join_switches(self.handler_switches, &mut state);
                (state.previous, state.reaching) = (None, self.any_motion());
                state.gripped.join(&self.any_gripped);
            }
            Syntax::Raise => {
                // A caller that catches the error joins all switches set here.
                self.exit.gripped.join(&state.reachable.then_some(state.gripped));
                state.reachable = false;
            }
            Syntax::Goto => state.reachable = false,
            Syntax::Leave => {
                self.leave(&state);
                state.reachable = false;
            }
            Syntax::Opaque | Syntax::Unwritten => {
                // Unparsed text may write anything.
                (state.previous, state.reaching) = (None, self.any_motion());
                (state.known, state.gripped) = (self.state_at_any_point().known, Gripped::UNKNOWN);
            }
            _ => self.invalidate_changed(node, &mut state),
        }
        self.state = state;
    }

    fn join_any_point(&mut self) {
        let any = self.state_at_any_point();
        self.state.join(&any);
    }

    fn evaluate(&mut self, node: u32) {
        let mut state = std::mem::take(&mut self.state);
        self.note_position_decisions(node, &state);
        self.invalidate_changed(node, &mut state);
        self.state = state;
    }

    fn enter_loop(&mut self, node: u32) {
        if self.tracks_motions {
            self.loops.push(self.visitor.record_loop());
        }
        self.state.reaching = self.state.reaching.in_loop(self.loops.last().copied());
        self.invalidate_iterations(node);
        if self.may_grip_under(node) {
            self.state.gripped = Gripped::UNKNOWN;
        }
    }

    fn leave_loop(&mut self, node: u32, before: &AbstractState) {
        // What is gripped on re-entry may be anything that the loop grips, but not behind it.
        let gripped = self.state.gripped;
        self.invalidate_iterations(node);
        self.state.gripped = gripped;
        self.conditions(node);
        if let Some(iteration) = self.loops.pop() {
            self.visitor.record_loop_end(iteration, &self.state.reaching);
        }
        self.state.reaching.leave_loop(&before.reaching);
    }

    fn end_handler(&mut self, node: u32, end: AbstractState) {
        match self.kind(node) {
            Syntax::ErrorClause if end.reachable => self.leave(&end),
            Syntax::UndoClause if end.reachable && self.evaluator.symbols.restarts_main => {
                self.visitor.record_cycle_restart(end.modal, end.gripped);
            }
            _ => {}
        }
    }

    /// TRYNEXT skips all branches where a condition raises an error.
    fn may_pass_branches(&self) -> bool {
        self.resumes
    }
}

impl Interpreter<'_, '_, '_> {
    fn kind(&self, node: u32) -> Syntax {
        self.evaluator.trees[self.body.file as usize].nodes.kind(node)
    }

    /// Records decisions by the robot's position in a statement or expression, and in the functions that it calls.
    fn note_position_decisions(&mut self, node: u32, state: &AbstractState) {
        let symbols = self.evaluator.symbols;
        if symbols.position_decisions.is_empty() {
            return;
        }
        let tree = &self.evaluator.trees[self.body.file as usize];
        for node in node..tree.nodes.subtree_end(node) {
            let decides = match tree.nodes.kind(node) {
                Syntax::Function | Syntax::Call => {
                    let called = symbols.callees(self.body.scope, tree.text(tree.nodes.first(node)));
                    called.iter().any(|routine| symbols.effects_of(*routine).decides_by_position)
                }
                _ => false,
            };
            if decides || symbols.position_decisions.contains(&(self.body.file, node)) {
                self.visitor.record_position_decision(self.body, node, &state.reaching);
            }
        }
    }

    /// The routine ends in a state.
    fn leave(&mut self, state: &AbstractState) {
        self.exit.modal = self.exit.modal.join(state.modal);
        self.exit.gripped.join(&state.reachable.then_some(state.gripped));
        if self.tracks_motions {
            self.visitor.record_end(&state.reaching);
        }
    }

    /// Everything that a loop may change in any number of iterations is unknown.
    fn invalidate_iterations(&mut self, node: u32) {
        let mut state = std::mem::take(&mut self.state);
        let sets = self.switches_set_under(node);
        state.modal = state.modal.join(sets);
        state.previous = None;
        self.invalidate_changed(node, &mut state);
        if self.kind(node) == Syntax::While {
            // The condition may wait for another task.
            self.invalidate_shared(&mut state);
        }
        if !sets.is_unset(Switch::Displacement) {
            state.known.insert(DISPLACEMENT, Value::Unknown(Reason::Displacement));
        }
        self.state = state;
    }

    /// State at a point that can be reached from anywhere in the routine.
    fn state_at_any_point(&self) -> AbstractState {
        let mut known = Known::new();
        if !self.any.is_entry(Switch::Displacement) {
            known.insert(DISPLACEMENT, Value::Unknown(Reason::Displacement));
        }
        let (modal, gripped, reaching) = (self.any, self.any_gripped, self.any_motion());
        AbstractState { known, modal, gripped, previous: None, reaching, reachable: true }
    }

    /// Any motion may be the last executed.
    fn any_motion(&self) -> ReachingMotions {
        if self.tracks_motions { ReachingMotions::at_any_point() } else { ReachingMotions::default() }
    }

    /// Updates the reaching motions after a motion.
    fn after_motion(&self, motion: Option<u32>, before: &mut ReachingMotions) {
        if !self.tracks_motions {
            return;
        }
        // A handler may resume after a failed motion, or from anywhere.
        let also = if self.resumes { std::mem::take(before) } else { ReachingMotions::default() };
        *before = ReachingMotions::after(motion);
        before.join(&also);
        before.any |= self.moved_between;
        before.elsewhere |= self.moved_between || self.resumes;
    }

    /// The displacement after PDispSet, PDispOn, PDispAdd or PDispOff.
    fn displacement_value(&self, node: u32, state: &AbstractState, name: &[u8]) -> Value {
        let tree = &self.evaluator.trees[self.body.file as usize];
        if same_name(name, b"PDispOff") {
            return Value::from_frame(&Frame::IDENTITY);
        }
        let context = Context::new(self.body.file, self.body.scope, &state.known);
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
            // From the programmed to the executed point; without \ExeP from the current position.
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
            // PDispAdd depends on a search result.
            None
        };
        frame.map_or(Value::Unknown(Reason::Displacement), |frame| Value::from_frame(&frame))
    }

    /// The switches that the body's error handlers set before they resume, and those that trap routines leave set.
    fn handler_switches(&mut self) -> SwitchSet {
        let tree = &self.evaluator.trees[self.body.file as usize];
        let clauses = tree.child_nodes(self.body.node);
        let clauses: Vec<u32> =
            clauses.filter(|&clause| tree.nodes.kind(clause) == Syntax::ErrorClause).collect();
        let handler_switches = clauses
            .into_iter()
            .fold(SwitchSet::EMPTY, |all, clause| all.join(self.switches_set_under(clause)));
        let symbols = self.evaluator.symbols;
        // Trap routines do not interrupt each other.
        if self.body.routine.is_some_and(|routine| symbols.interrupts[routine as usize]) {
            return handler_switches;
        }
        let left = |all: SwitchSet, routine: &u32| {
            all.join(self.visitor.exit_of(*routine).modal.substitute_entry(SwitchSet::EMPTY))
        };
        symbols.interrupt_routines.iter().fold(handler_switches, left)
    }

    /// The switches that statements under a node may set.
    fn switches_set_under(&mut self, node: u32) -> SwitchSet {
        let tree = &self.evaluator.trees[self.body.file as usize];
        let end = tree.nodes.subtree_end(node);
        let symbols = self.evaluator.symbols;
        let mut out = SwitchSet::EMPTY;
        for &node in symbols.switch_calls_in(self.body, node..end) {
            let name = tree.text(tree.nodes.first(node));
            let late = tree.nodes.kind(node) == Syntax::LateCall;
            let called = if late { &[] } else { symbols.callees(self.body.scope, name) };
            if let Some(sets) =
                (!late && called.is_empty()).then(|| switches_set_by(tree, node, name)).flatten()
            {
                out = out.join(sets);
            } else if called.is_empty() {
                out = out.join(symbols.late_switches_of(self.body));
            }
            for &routine in called {
                out = out.join(self.visitor.exit_of(routine).modal);
                if self.resumes || tree.nodes.kind(node) == Syntax::Function {
                    out = out.join(symbols.effects_of(routine).switches);
                }
            }
        }
        // A callee's "as at the entry" adds nothing.
        out.substitute_entry(SwitchSet::EMPTY)
    }

    fn transfer_call(&mut self, node: u32, state: &mut AbstractState, nesting: Nesting) {
        let tree = &self.evaluator.trees[self.body.file as usize];
        let symbols = self.evaluator.symbols;
        let name = tree.text(tree.nodes.first(node));
        let late = tree.nodes.kind(node) == Syntax::LateCall;
        self.join_switches(self.handler_switches, state);
        for inside in tree.child_nodes(node) {
            self.invalidate_changed(inside, state);
        }
        let hidden = symbols.hides_instruction && symbols.routine(self.body.scope, name).is_some();
        let known = if late || hidden { None } else { instruction::find(name) };
        let motion = self.visitor.visit_call(self.body, node, known, state, nesting);
        if let Some(known) = known {
            self.transfer_motion_instruction(node, &INSTRUCTIONS[known], motion, state);
            return;
        }
        if let Some(known) = self.visitor.inlined_instruction(self.body, node) {
            self.invalidate_written(node, state);
            self.invalidate_called(name, Syntax::Call, state);
            self.transfer_motion_instruction(node, &INSTRUCTIONS[known], motion, state);
            return;
        }
        let incremented = self.incremented(node, state, name);
        self.invalidate_written(node, state);
        if !late && symbols.writes_unknown_data(tree, self.body.scope, node, name) {
            state.known.retain(|&id, _| id == DISPLACEMENT);
        }
        if let Some((target, value)) = incremented {
            self.store(target, value, state);
        }
        if predefined::waits(name) {
            self.invalidate_shared(state);
        }
        let own = symbols.routine(self.body.scope, name).is_some();
        if let Some(sets) = (!late && !own).then(|| switches_set_by(tree, node, name)).flatten() {
            self.transfer_switch_instruction(node, name, sets, motion, state);
            return;
        }
        let called = if late { &[] } else { symbols.callees(self.body.scope, name) };
        if late || called.is_empty() && predefined::calls_by_name(name) {
            if self.may_grip(node) {
                state.gripped = Gripped::UNKNOWN;
            }
            self.transfer_late_call(state);
            return;
        }
        match called {
            [_, ..] => self.transfer_routine_call(called, name, state),
            [] if predefined::effect(name).is_some() => {
                if predefined::begins_cycle(name) {
                    self.visitor.record_cycle_restart(state.modal, state.gripped);
                    state.reachable = false;
                    return;
                }
                if predefined::grips(name) {
                    let context = Context::new(self.body.file, self.body.scope, &state.known);
                    state.gripped = payload::gripped_by(self.evaluator, context, tree, node);
                }
                if predefined::displaces(name).is_some() {
                    state.previous = None;
                    self.after_motion(motion, &mut state.reaching);
                }
                return;
            }
            [] => {
                self.visitor.record_external_call(state.modal);
                self.invalidate_nonlocal(state);
                if motion.is_some() {
                    state.previous = motion;
                    self.after_motion(motion, &mut state.reaching);
                    return;
                }
                state.reaching.any |= self.tracks_motions;
                state.reaching.elsewhere = true;
            }
        }
        state.previous = None;
    }

    /// An instruction of the table of motions.
    fn transfer_motion_instruction(
        &mut self,
        node: u32,
        known: &Instruction,
        motion: Option<u32>,
        state: &mut AbstractState,
    ) {
        if !known.only_moves() {
            self.invalidate_written(node, state);
        }
        if known.side_effect == SideEffect::Stiffens {
            state.modal = state.modal.set(Switch::Soft, false);
        }
        if motion.is_some() {
            // A search stops where its signal comes, and a handler may resume from anywhere.
            state.previous = motion.filter(|_| !known.ends_early() && !self.moved_between);
            self.after_motion(motion, &mut state.reaching);
            state.reaching.elsewhere |= known.ends_early();
        }
    }

    /// An instruction that sets switches (ConfL, PDispOn).
    fn transfer_switch_instruction(
        &mut self,
        node: u32,
        name: &[u8],
        sets: SwitchSet,
        motion: Option<u32>,
        state: &mut AbstractState,
    ) {
        let tree = &self.evaluator.trees[self.body.file as usize];
        state.modal = state.modal.overwrite(sets);
        if counts_from_position(tree, node, name) {
            self.visitor.record_position_use(&state.reaching);
        }
        // Some also move.
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
}

/// Whether a clause can be entered from any statement of its routine.
fn is_exception_clause(clause: Syntax) -> bool {
    matches!(clause, Syntax::ErrorClause | Syntax::UndoClause)
}
