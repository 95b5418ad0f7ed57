//! The writes of one statement: which data an assignment, call or function writes, callees counted by the parameters that
//! they write.

use super::Symbols;
use super::effects::{Write, WriteKind};
use crate::motion::Reason;
use crate::rapid::instruction::{self, INSTRUCTIONS, Instruction, SideEffect, Slot};
use crate::rapid::predefined::{self, Effect};
use crate::rapid::syntax::{Argument, RapidTree, Syntax, arguments, parts, token_kind};
use crate::rapid::token::{Token, folded, same_name};
use crate::tree::Child;

impl Symbols {
    /// Reports the data that a statement or function call may write, apart from what the called routine writes outside its
    /// parameters. Constants are never written.
    pub fn for_each_write(&self, tree: &RapidTree<'_>, scope: u32, node: u32, report: &mut dyn FnMut(Write)) {
        let mut add = |symbol: Option<u32>, kind: WriteKind| {
            if let Some(symbol) = symbol
                && !self.symbols[symbol as usize].is_constant()
            {
                report(Write { symbol, kind });
            }
        };
        match tree.nodes.kind(node) {
            Syntax::Assignment => {
                if let Some(place) = parts(tree, node).next() {
                    add(self.root(tree, scope, place), assignment_kind(tree, place));
                }
            }
            Syntax::For => {
                let name = parts(tree, node).find(|&part| token_kind(tree, part) == Some(Token::Ident));
                add(name.and_then(|name| self.root(tree, scope, name)), WriteKind::Whole);
            }
            Syntax::Connect => {
                let name = parts(tree, node).find(|&part| token_kind(tree, part) != Some(Token::Connect));
                add(name.and_then(|name| self.root(tree, scope, name)), WriteKind::Whole);
            }
            Syntax::Call | Syntax::Function => {
                let name = tree.text(tree.nodes.first(node));
                self.writes_of_call(tree, scope, (node, name), &mut add);
            }
            Syntax::LateCall => {
                for argument in arguments(tree, node) {
                    add(argument.value.and_then(|value| self.root(tree, scope, value)), WriteKind::Escaped);
                }
            }
            _ => {}
        }
    }

    fn writes_of_call(
        &self,
        tree: &RapidTree<'_>,
        scope: u32,
        (node, name): (u32, &[u8]),
        add: &mut dyn FnMut(Option<u32>, WriteKind),
    ) {
        let is_call = tree.nodes.kind(node) == Syntax::Call;
        let known = if is_call { instruction::find(name).map(|known| &INSTRUCTIONS[known]) } else { None };
        // Nearly all motions write nothing.
        if !self.hides_instruction && known.is_some_and(Instruction::only_moves) {
            return;
        }
        let root = |argument: &Argument| self.root(tree, scope, argument.value?);
        let callees = self.callees(scope, name);
        self.for_each_passed(tree, node, callees, &mut |routine, index, argument| match self.routines
            [routine as usize]
            .parameter_writes[index]
        {
            Some(Reason::Escaped) => add(root(argument), WriteKind::Escaped),
            Some(_) => add(root(argument), WriteKind::Whole),
            None => {}
        });
        if !callees.is_empty() {
            return;
        }
        if let Some(known) = known {
            return outputs_of_instruction(tree, node, known, &mut |argument| {
                add(root(argument), WriteKind::Whole)
            });
        }
        match predefined::effect(name) {
            Some(Effect::Reads) => {
                if name.eq_ignore_ascii_case(b"SetDataVal")
                    && let Some(data_name) = literal_data_name(tree, node)
                {
                    // With \Block it may be the data of another module or routine.
                    let key = folded(data_name);
                    for symbol in self.scopes.iter().filter_map(|scope| scope.names.get(&key)) {
                        add(Some(*symbol), WriteKind::Whole);
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
                        add(root(&argument), if written.later { WriteKind::Later } else { WriteKind::Whole });
                    }
                }
            }
            // Unknown code may write its arguments.
            None => arguments(tree, node).for_each(|argument| add(root(&argument), WriteKind::Escaped)),
        }
    }

    /// Reports the arguments of a call: routine, index of its parameter, argument.
    pub(super) fn for_each_passed(
        &self,
        tree: &RapidTree<'_>,
        node: u32,
        callees: &[u32],
        report: &mut dyn FnMut(u32, usize, &Argument),
    ) {
        for &callee in callees {
            let routine = &self.routines[callee as usize];
            let mut required =
                (0..).zip(&routine.head.parameters).filter(|(_, parameter)| !parameter.optional);
            for argument in arguments(tree, node) {
                let index: Option<usize> = match argument.name {
                    None => required.next().map(|(index, _)| index),
                    Some(name) => self.parameter(routine.scope, tree.text(name)).and_then(|name| {
                        routine.head.parameters.iter().position(|parameter| parameter.name == name)
                    }),
                };
                if let Some(index) = index {
                    report(callee, index, &argument);
                }
            }
        }
    }

    /// The token of a routine's parameter, by its name.
    fn parameter(&self, scope: u32, name: &[u8]) -> Option<u32> {
        let symbol = self.scopes[scope as usize].names.get(&folded(name))?;
        Some(self.symbols[*symbol as usize].name)
    }
}

/// The arguments that a motion instruction of the table writes.
fn outputs_of_instruction(
    tree: &RapidTree<'_>,
    node: u32,
    known: &Instruction,
    add: &mut dyn FnMut(&Argument),
) {
    let count = arguments(tree, node).filter(|argument| !argument.optional).count();
    let required = arguments(tree, node).filter(|argument| !argument.optional).enumerate();
    for (_, argument) in required.filter(|&(index, _)| known.slot(index, count) == Some(Slot::Output)) {
        add(&argument);
    }
    for argument in arguments(tree, node).filter(|argument| argument.optional) {
        let returned = |name: u32| tree.text(name).get(..3).is_some_and(|n| same_name(n, b"Ret"));
        if known.side_effect == SideEffect::Returns && argument.name.is_some_and(returned) {
            add(&argument);
        }
    }
}

fn assignment_kind(tree: &RapidTree<'_>, place: Child) -> WriteKind {
    match place {
        Child::Node(node) if parts(tree, node).all(|part| matches!(part, Child::Token(_))) => {
            WriteKind::Part(node)
        }
        _ => WriteKind::Whole,
    }
}

/// The components that a place names, in lower case with a point between.
pub(super) fn component_path(tree: &RapidTree<'_>, place: u32) -> Vec<u8> {
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
pub(super) fn literal_data_name<'s>(tree: &RapidTree<'s>, call: u32) -> Option<&'s [u8]> {
    let first = arguments(tree, call).find(|argument| !argument.optional)?;
    let Some(Child::Token(token)) = first.value else { return None };
    let text = tree.text(token);
    (tree.kind(token) == Some(Token::String)).then(|| &text[1..text.len() - 1])
}
