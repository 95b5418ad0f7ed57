//! Routines whose only statement is one motion on their parameters, as integrators write them (`MyMoveL`): a call of one is that motion,
//! and its targets are arguments of the call.
//!
//! Method: such a call is inlined. Nothing else happens between the call and the motion, so that the state before the call is that before
//! the motion, and the motion leads back to behind the call. A routine that wraps such a routine is one itself. What an argument may not be
//! replaced for is no such routine: a target that is handed over by reference, is used twice, or is computed from the parameter. The motion
//! of the routine itself is listed only where something may run it that is no inlined call: a computed name, an interrupt, a missing part of
//! the program, or text that could not be read.

use std::collections::HashMap;

use smallvec::SmallVec;

use crate::motion::MotionKind;
use crate::rapid::instruction::{self, INSTRUCTIONS, Instruction, SideEffect, Slot};
use crate::rapid::symbol::{Body, RoutineScope, Symbol, SymbolKind, Symbols};
use crate::rapid::syntax::{Argument, Parameter, RapidTree, Syntax, arguments, tokens_of};
use crate::rapid::token::{Token, folded, same_name};
use crate::tree::Child;

/// An argument of a motion instruction, with where it stands.
#[derive(Debug, Clone, Copy)]
pub(super) struct Given {
    pub(super) argument: Argument,
    /// The file in which its name stands.
    pub(super) named_in: u32,
    /// The body in which its value stands.
    pub(super) body: Body,
}

/// A call that is a motion.
#[derive(Debug)]
pub(super) struct Inlined {
    /// Its instruction, in the table.
    pub(super) known: usize,
    /// The arguments of the motion.
    pub(super) given: SmallVec<[Given; 6]>,
}

/// The calls that are motions.
#[derive(Debug, Default)]
pub(super) struct Wrappers {
    /// By file and node.
    inlined: HashMap<(u32, u32), Inlined>,
    /// Bodies whose motion runs only by inlined calls.
    unlisted: Vec<u32>,
}

/// An argument of the motion in a routine.
#[derive(Debug, Clone, Copy)]
struct Passed {
    given: Given,
    /// The parameter of the routine that it is.
    parameter: Option<usize>,
    /// Whether it is handed on only where it is present: `\WObj?WObj`.
    conditional: bool,
}

/// The motion in a routine.
#[derive(Debug)]
struct Wrapper {
    known: usize,
    passed: SmallVec<[Passed; 6]>,
}

impl Wrappers {
    pub(super) fn of(trees: &[RapidTree<'_>], symbols: &Symbols, mains: &[u32]) -> Self {
        let finder = Finder { trees, symbols };
        let mut wrappers: HashMap<u32, Wrapper> = HashMap::new();
        for &body in &symbols.callees_first {
            let body = symbols.bodies[body as usize];
            let Some(routine) = body.routine.filter(|routine| !mains.contains(routine)) else { continue };
            if let Some(wrapper) = finder.wrapper(routine, body, &wrappers) {
                wrappers.insert(routine, wrapper);
            }
        }
        if wrappers.is_empty() {
            return Self::default();
        }
        let mut out = Self::default();
        let is_unread = trees.iter().any(|tree| !tree.opaque.is_empty());
        let is_open = |routine: u32| {
            is_unread
                || mains.is_empty() && !symbols.routines[routine as usize].head.local
                || symbols.interrupts[routine as usize]
                || symbols.late_lists.iter().any(|list| list.contains(&routine))
        };
        let mut unlisted: Vec<u32> = wrappers.keys().copied().filter(|routine| !is_open(*routine)).collect();
        for body in &symbols.bodies {
            let tree = &trees[body.file as usize];
            let mut node = body.node;
            let end = tree.nodes.subtree_end(node);
            while node < end {
                let kind = tree.nodes.kind(node);
                // Routines have bodies of their own.
                if kind.is_routine() && node != body.node {
                    node = tree.nodes.subtree_end(node);
                    continue;
                }
                if matches!(kind, Syntax::Call | Syntax::Function) {
                    let called = symbols.callees(body.scope, tree.text(tree.nodes.first(node)));
                    match finder.inlined(*body, node, &wrappers) {
                        Some(inlined) => {
                            out.inlined.insert((body.file, node), inlined);
                        }
                        None => unlisted.retain(|routine| !called.contains(routine)),
                    }
                }
                node += 1;
            }
        }
        out.unlisted = unlisted.into_iter().map(|routine| symbols.body_of(routine)).collect();
        out.unlisted.sort_unstable();
        out
    }

    /// The motion that a call is.
    pub(super) fn motion(&self, file: u32, call: u32) -> Option<&Inlined> {
        if self.inlined.is_empty() { None } else { self.inlined.get(&(file, call)) }
    }

    /// Whether the motion of a body runs only by inlined calls, where it is listed.
    pub(super) fn is_unlisted(&self, body: u32) -> bool {
        self.unlisted.binary_search(&body).is_ok()
    }
}

struct Finder<'a, 's> {
    trees: &'a [RapidTree<'s>],
    symbols: &'a Symbols,
}

impl Finder<'_, '_> {
    /// The motion in a routine, if that is its only statement.
    fn wrapper(&self, routine: u32, body: Body, others: &HashMap<u32, Wrapper>) -> Option<Wrapper> {
        let scope = &self.symbols.routines[routine as usize];
        let tree = &self.trees[body.file as usize];
        if scope.head.kind != Syntax::Proc || instruction::find(tree.text(scope.head.name)).is_some() {
            return None;
        }
        let call = only_call(tree, body.node)?;
        let (known, mut passed) = self.motion(body, call, others)?;
        for passed in &mut passed {
            // What was resolved in a routine deeper down is no parameter of this one.
            if let Some(value) = passed.given.argument.value.filter(|_| passed.given.body.node == body.node) {
                passed.parameter = parameter(tree, scope, value);
                if passed.parameter.is_none() && !self.is_fixed(body, value) {
                    return None;
                }
            }
        }
        self.is_replaceable(scope, known, &passed).then_some(Wrapper { known, passed })
    }

    /// The motion that a call is, and what it hands on.
    fn inlined(&self, body: Body, call: u32, wrappers: &HashMap<u32, Wrapper>) -> Option<Inlined> {
        let tree = &self.trees[body.file as usize];
        let name = tree.text(tree.nodes.first(call));
        self.symbols.routine(body.scope, name)?;
        let (known, passed) = self.motion(body, call, wrappers)?;
        Some(Inlined { known, given: passed.iter().map(|passed| passed.given).collect() })
    }

    /// The instruction that a call leads to, and the arguments of that instruction.
    fn motion(
        &self,
        body: Body,
        call: u32,
        wrappers: &HashMap<u32, Wrapper>,
    ) -> Option<(usize, SmallVec<[Passed; 6]>)> {
        let tree = &self.trees[body.file as usize];
        if tree.nodes.kind(call) != Syntax::Call {
            return None;
        }
        let name = tree.text(tree.nodes.first(call));
        let written = arguments(tree, call).map(|argument| Passed {
            given: Given { argument, named_in: body.file, body },
            parameter: None,
            conditional: argument.value.is_some_and(|value| is_conditional(tree, value)),
        });
        let routine = match self.symbols.callees(body.scope, name) {
            [] => {
                let known =
                    instruction::find(name).filter(|_| self.symbols.find(body.scope, name).is_none())?;
                return is_plain(&INSTRUCTIONS[known]).then(|| (known, written.collect()));
            }
            [routine] => *routine,
            _ => return None,
        };
        let wrapper = wrappers.get(&routine)?;
        let scope = &self.symbols.routines[routine as usize];
        let mut of_parameter: SmallVec<[Option<Passed>; 8]> = SmallVec::new();
        of_parameter.resize(scope.head.parameters.len(), None);
        let home = &self.trees[scope.file as usize];
        let required = scope.head.parameters.iter().enumerate().filter(|(_, parameter)| !parameter.optional);
        let mut required = required.map(|(index, _)| index);
        for argument in written {
            let index = match argument.given.argument.name {
                None => required.next()?,
                Some(name) => {
                    if !argument.given.argument.optional {
                        required.next();
                    }
                    let named = |p: &Parameter| same_name(home.text(p.name), tree.text(name));
                    scope.head.parameters.iter().position(named)?
                }
            };
            if of_parameter[index].replace(argument).is_some() {
                return None;
            }
        }
        let is_missing = |(parameter, argument): (&Parameter, &Option<Passed>)| {
            !parameter.optional && argument.is_none_or(|argument| argument.given.argument.value.is_none())
        };
        if scope.head.parameters.iter().zip(&of_parameter).any(is_missing) {
            return None;
        }
        let mut out = SmallVec::new();
        for passed in &wrapper.passed {
            let Some(index) = passed.parameter else {
                out.push(*passed);
                continue;
            };
            let Some(argument) = &of_parameter[index] else {
                // An absent parameter that is handed on regardless is an error when the program runs.
                if !passed.conditional {
                    return None;
                }
                continue;
            };
            if argument.conditional && !passed.conditional {
                return None;
            }
            let Argument { name, optional, .. } = passed.given.argument;
            let argument_of_motion = Argument { name, optional, value: argument.given.argument.value };
            out.push(Passed {
                given: Given { argument: argument_of_motion, named_in: passed.given.named_in, body },
                parameter: None,
                conditional: argument.conditional,
            });
        }
        Some((wrapper.known, out))
    }

    /// Whether each target is a parameter by value that nothing else uses.
    fn is_replaceable(&self, scope: &RoutineScope, known: usize, passed: &[Passed]) -> bool {
        let tree = &self.trees[scope.file as usize];
        let instruction = &INSTRUCTIONS[known];
        let count = passed.iter().filter(|passed| !passed.given.argument.optional).count();
        let (mut index, mut targets) = (0, 0);
        for here in passed.iter().filter(|passed| !passed.given.argument.optional) {
            let slot = match here.given.argument.name {
                Some(name) => instruction::named_slot(self.trees[here.given.named_in as usize].text(name)),
                None => instruction.slot(index, count),
            };
            index += 1;
            if !matches!(slot, Some(Slot::To | Slot::Via)) {
                continue;
            }
            targets += 1;
            let Some(parameter) = here.parameter else { return false };
            let is_shared = passed.iter().filter(|other| other.parameter == Some(parameter)).count() > 1;
            let parameter = &scope.head.parameters[parameter];
            let wanted: &[u8] = if instruction.takes_joints() { b"jointtarget" } else { b"robtarget" };
            let type_name = folded(tree.text(parameter.type_name));
            let is_target = self.symbols.resolved_type(scope.scope, &type_name) == wanted;
            if is_shared || !is_target || parameter.by_reference || parameter.array || parameter.optional {
                return false;
            }
        }
        targets > 0
    }

    /// Whether a value in a routine is the same at every call: it names no parameter and calls nothing.
    fn is_fixed(&self, body: Body, value: Child) -> bool {
        let tree = &self.trees[body.file as usize];
        if let Child::Node(node) = value
            && (node..tree.nodes.subtree_end(node)).any(|node| tree.nodes.kind(node) == Syntax::Function)
        {
            return false;
        }
        let (first, end) = tokens_of(tree, value);
        let is_parameter = |token: u32| {
            let found = self.symbols.find(body.scope, tree.text(token));
            let found = found.map(|symbol| &self.symbols.symbols[symbol as usize]);
            matches!(found, Some(Symbol { kind: SymbolKind::Parameter, .. }))
        };
        !(first..end).any(|token| tree.kind(token) == Some(Token::Ident) && is_parameter(token))
    }
}

/// The only statement of a routine, if that is a call and nothing else stands in it.
fn only_call(tree: &RapidTree<'_>, routine: u32) -> Option<u32> {
    let mut call = None;
    for part in tree.child_nodes(routine) {
        match tree.nodes.kind(part) {
            Syntax::Parameters => {}
            Syntax::Call if call.is_none() => call = Some(part),
            Syntax::Body if call.is_none() => {
                let mut statements = tree.child_nodes(part);
                let only = statements.next().filter(|node| tree.nodes.kind(*node) == Syntax::Call)?;
                if statements.next().is_some() {
                    return None;
                }
                call = Some(only);
            }
            _ => return None,
        }
    }
    call
}

/// Whether an instruction moves to its targets and does nothing else.
fn is_plain(instruction: &Instruction) -> bool {
    let moves = matches!(
        instruction.kind,
        MotionKind::Linear | MotionKind::Joint | MotionKind::Circular | MotionKind::AbsoluteJoint
    );
    moves
        && instruction.side_effect == SideEffect::Nothing
        && instruction.only_moves()
        && !instruction.sensor_guided
}

/// The parameter of a routine that a value is.
fn parameter(tree: &RapidTree<'_>, scope: &RoutineScope, value: Child) -> Option<usize> {
    let Child::Token(token) = value else { return None };
    let is_it = |p: &Parameter| same_name(tree.text(p.name), tree.text(token));
    (tree.kind(token) == Some(Token::Ident)).then(|| scope.head.parameters.iter().position(is_it))?
}

/// Whether an argument is handed on only where it is present: a question mark before it.
fn is_conditional(tree: &RapidTree<'_>, value: Child) -> bool {
    let (first, _) = tokens_of(tree, value);
    let before = (0..first).rev().filter_map(|token| tree.kind(token)).find(|kind| !kind.is_trivia());
    before == Some(Token::Question)
}
