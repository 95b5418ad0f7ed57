//! Targets: their values, and where their numbers are written.

use super::{Context, Evaluator, Persistent};
use crate::motion::{Offset, Reason, Span, TargetValue};
use crate::rapid::literal;
use crate::rapid::symbol::SymbolKind;
use crate::rapid::syntax::{RapidTree, Syntax, arguments, node_kind, parts, text_of, tokens_of};
use crate::rapid::token::{Token, same_name};
use crate::rapid::value::{cartesian_target, joint_target};
use crate::tree::Child;

/// Where a target's numbers are written, before declarations are indexed in the listing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ValueOrigin {
    /// The literal in the instruction.
    Inline,
    /// A declared name.
    Symbol(u32),
    /// One element of a declared array.
    Element(u32, Span),
    /// Computed from the text.
    Computed,
    /// Its first argument with an offset by persistent data.
    Offset(Child, Offset),
    /// Not known.
    Unknown,
}

impl<'s> Evaluator<'_, 's> {
    /// Value of a target argument, and where its numbers are written.
    pub fn target(
        &self,
        context: Context<'_>,
        argument: Child,
        joints: bool,
    ) -> (Result<TargetValue, Reason>, ValueOrigin) {
        let tree = self.tree(context.file);
        self.may_raise.set(false);
        match argument {
            Child::Node(node) if tree.nodes.kind(node) == Syntax::Aggregate => {
                if let Some(value) = literal_target(tree.node_text(node), joints) {
                    let source = if value.is_ok() { ValueOrigin::Inline } else { ValueOrigin::Unknown };
                    return (value, source);
                }
            }
            Child::Token(token) => match tree.kind(token) {
                Some(Token::Ident) => return self.named_target(context, tree.text(token), joints),
                Some(Token::Placeholder | Token::Star) => {
                    return (Err(Reason::Placeholder), ValueOrigin::Unknown);
                }
                _ => {}
            },
            Child::Node(node) if tree.nodes.kind(node) == Syntax::Place => {
                if let Some(found) = self.element_target(context, node, joints) {
                    return found;
                }
            }
            Child::Node(node) => {
                if let Some(found) = self.offset_target(context, tree, node) {
                    return found;
                }
            }
        }
        let value = self.value(context, argument).target(joints);
        let source = if value.is_ok() { ValueOrigin::Computed } else { ValueOrigin::Unknown };
        (value, source)
    }

    /// `Offs` or `RelTool` of a known target, perhaps by persistent data; `None` for anything else.
    fn offset_target(
        &self,
        context: Context<'_>,
        tree: &RapidTree<'s>,
        node: u32,
    ) -> Option<(Result<TargetValue, Reason>, ValueOrigin)> {
        if tree.nodes.kind(node) != Syntax::Function {
            return None;
        }
        let name = tree.text(tree.nodes.first(node));
        let of_tool = same_name(name, b"RelTool");
        if !(of_tool || same_name(name, b"Offs")) || self.symbols.find(context.scope, name).is_some() {
            return None;
        }
        let base = arguments(tree, node).find(|argument| argument.name.is_none())?.value?;
        let from = self.value(context, base).target(false).ok()?.cartesian()?.pose();
        self.persistent.set(Persistent::Stated);
        let value = self.function(context, tree, node).target(false);
        let read = self.persistent.replace(Persistent::Unknown) == Persistent::Read;
        let Some(to) = value.ok().filter(|_| read) else {
            let source = if value.is_ok() { ValueOrigin::Computed } else { ValueOrigin::Unknown };
            return Some((value, source));
        };
        let to = to.cartesian()?.pose();
        let offset = match of_tool {
            true => Offset::OfTool(from.inverse() * to),
            false => Offset::OfObject((to.translation.vector - from.translation.vector).into()),
        };
        Some((value, ValueOrigin::Offset(base, offset)))
    }

    fn named_target(
        &self,
        context: Context<'_>,
        name: &[u8],
        joints: bool,
    ) -> (Result<TargetValue, Reason>, ValueOrigin) {
        let unknown = |reason| (Err(reason), ValueOrigin::Unknown);
        let Some(id) = self.symbols.find(context.scope, name) else {
            return unknown(Reason::Undeclared);
        };
        let symbol = &self.symbols.symbols[id as usize];
        let data = match &symbol.kind {
            SymbolKind::Data(data) => data,
            SymbolKind::Parameter if context.known.contains_key(&id) => {
                let value = self.symbol_value(context, id).target(joints);
                let source = if value.is_ok() { ValueOrigin::Computed } else { ValueOrigin::Unknown };
                return (value, source);
            }
            SymbolKind::Parameter => return unknown(Reason::Parameter),
            _ => return unknown(Reason::WrongShape),
        };
        let wanted: &[u8] = if joints { b"jointtarget" } else { b"robtarget" };
        if self.symbols.resolved_type(symbol.scope, &symbol.type_name) != wanted || data.dimensions.is_some()
        {
            return unknown(Reason::WrongShape);
        }
        if symbol.ambiguous && symbol.scope != self.symbols.module_scope(context.scope) {
            return unknown(Reason::Ambiguous);
        }
        if symbol.assigned || context.known.contains_key(&id) {
            let value = self.symbol_value(context, id).target(joints);
            let source = if value.is_ok() { ValueOrigin::Computed } else { ValueOrigin::Unknown };
            return (value, source);
        }
        let Some(initial) = data.value else { return unknown(Reason::Uninitialised) };
        let value = match literal_target(text_of(self.tree(symbol.file), initial), joints) {
            Some(value) => value,
            None => self.symbol_value(context, id).target(joints),
        };
        let source = if value.is_ok() { ValueOrigin::Symbol(id) } else { ValueOrigin::Unknown };
        (value, source)
    }

    /// `name{i, …}` of an array that is never written.
    fn element_target(
        &self,
        context: Context<'_>,
        node: u32,
        joints: bool,
    ) -> Option<(Result<TargetValue, Reason>, ValueOrigin)> {
        let tree = self.tree(context.file);
        let mut parts = parts(tree, node);
        let root = self.symbols.root(tree, context.scope, parts.next()?)?;
        let index = parts.next().filter(|&part| node_kind(tree, part) == Some(Syntax::Index))?;
        if parts.next().is_some() {
            return None;
        }
        let symbol = &self.symbols.symbols[root as usize];
        if symbol.assigned || symbol.ambiguous && symbol.scope != self.symbols.module_scope(context.scope) {
            return None;
        }
        let Child::Node(index) = index else { return None };
        let (file, element) = match self.element(context, root, index) {
            Ok(found) => found,
            Err(reason) => return Some((Err(reason), ValueOrigin::Unknown)),
        };
        let text = text_of(self.tree(file), element);
        let (first, end) = tokens_of(self.tree(file), element);
        let value = match literal_target(text, joints) {
            Some(value) => value,
            None => self.value(self.declaration_context(context, symbol.scope, file), element).target(joints),
        };
        let source = match value {
            Ok(_) => ValueOrigin::Element(root, self.tree(file).span(first, end)),
            Err(_) => ValueOrigin::Unknown,
        };
        Some((value, source))
    }
}

/// The target of a literal of plain numbers; `None` for anything else.
fn literal_target(text: &[u8], joints: bool) -> Option<Result<TargetValue, Reason>> {
    if joints {
        let found = literal::numbers(text, literal::JOINTTARGET)?;
        let [robot @ .., _, _, _, _, _] = found.values;
        let (mut angles, mut axes) = ([0.0; 6], [0.0; 6]);
        angles.copy_from_slice(&robot[..6]);
        axes.copy_from_slice(&found.values[6..12]);
        return Some(joint_target(angles, axes));
    }
    let values = literal::numbers(text, literal::ROBTARGET)?.values;
    let [x, y, z, q1, q2, q3, q4, c1, c2, c3, c4, e1, e2, e3, e4, e5, e6] = values;
    Some(cartesian_target([x, y, z], [q1, q2, q3, q4], [c1, c2, c3, c4], [e1, e2, e3, e4, e5, e6]))
}
