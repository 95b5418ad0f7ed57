//! Transfer function of assignments: to a whole, a component or an element.

use super::{AbstractState, Interpreter, MAX_ELEMENTS, MAX_VALUE_SIZE};
use crate::dataflow::Lattice;
use crate::motion::Reason;
use crate::rapid::evaluate::{Context, index_of};
use crate::rapid::symbol::SymbolKind;
use crate::rapid::syntax::{Syntax, arguments, expressions, parts, token_kind};
use crate::rapid::token::{Token, folded, same_name};
use crate::rapid::value::Value;
use crate::tree::Child;

impl Interpreter<'_, '_, '_> {
    /// Place and new value of Incr, Decr, Add and Clear, where the old value is known.
    pub(super) fn incremented(
        &self,
        node: u32,
        state: &AbstractState,
        name: &[u8],
    ) -> Option<(Child, Value)> {
        let is = |wanted: &[u8]| same_name(name, wanted);
        if !(is(b"Incr") || is(b"Decr") || is(b"Add") || is(b"Clear"))
            || self.evaluator.symbols.routine(self.body.scope, name).is_some()
        {
            return None;
        }
        let tree = &self.evaluator.trees[self.body.file as usize];
        let context = Context::new(self.body.file, self.body.scope, &state.known);
        let mut given = arguments(tree, node).filter(|argument| !argument.optional);
        let place = given.next()?.value?;
        let old = self.evaluator.value(context, place).number().ok();
        if self.resumes && arguments(tree, node).filter_map(|a| a.value).any(|value| self.may_fail(value)) {
            return None;
        }
        let new = if is(b"Clear") {
            0.0
        } else if is(b"Incr") {
            old? + 1.0
        } else if is(b"Decr") {
            old? - 1.0
        } else {
            old? + self.evaluator.value(context, given.next()?.value?).number().ok()?
        };
        Some((place, Value::Number(new)))
    }

    /// `place := value;`
    pub(super) fn transfer_assignment(&mut self, node: u32, state: &mut AbstractState) {
        let tree = &self.evaluator.trees[self.body.file as usize];
        let mut sides = parts(tree, node)
            .filter(|&part| !matches!(token_kind(tree, part), Some(Token::Assign | Token::Semicolon)));
        let (Some(place), Some(expression)) = (sides.next(), sides.next()) else { return };
        for inside in tree.child_nodes(node) {
            self.invalidate_changed(inside, state);
        }
        let context = Context::new(self.body.file, self.body.scope, &state.known);
        let value = self.evaluator.value(context, expression);
        // TRYNEXT skips an assignment that raises an error.
        let skipped =
            (self.resumes && (self.may_fail(place) || self.may_fail(expression))).then(|| state.clone());
        self.store(place, value, state);
        if let Some(skipped) = skipped {
            state.join(&skipped);
        }
    }

    /// Whether an expression calls a function of the program, which may raise an error.
    fn may_fail(&self, part: Child) -> bool {
        let tree = &self.evaluator.trees[self.body.file as usize];
        let Child::Node(node) = part else { return false };
        (node..tree.nodes.subtree_end(node)).any(|node| {
            let name = tree.text(tree.nodes.first(node));
            tree.nodes.kind(node) == Syntax::Function
                && self.evaluator.symbols.routine(self.body.scope, name).is_some()
        })
    }

    /// Stores a value in a place.
    pub(super) fn store(&self, place: Child, value: Value, state: &mut AbstractState) {
        let tree = &self.evaluator.trees[self.body.file as usize];
        let symbols = self.evaluator.symbols;
        let Some(root) = symbols.root(tree, self.body.scope, place) else { return };
        let context = Context::new(self.body.file, self.body.scope, &state.known);
        let new = match place {
            Child::Token(_) => value,
            Child::Node(place) => {
                let path: Vec<Child> = parts(tree, place).skip(1).collect();
                let mut old = self.evaluator.symbol_value(context, root);
                if let (Value::Unknown(reason), Some(Child::Node(_))) = (&old, path.first()) {
                    old = self.unknown_elements(context, root, *reason);
                }
                let type_name = symbols.symbols[root as usize].type_name.clone();
                self.with_component(context, old, &type_name, &path, value)
            }
        };
        self.invalidate(root, state);
        // A large array that is filled element by element is not tracked.
        if new.size(MAX_VALUE_SIZE) > MAX_VALUE_SIZE || symbols.symbols[root as usize].volatile {
            state.known.remove(&root);
        } else {
            state.known.insert(root, new);
        }
    }

    /// An unknown array, element by element, so that assigned elements become known.
    fn unknown_elements(&self, context: Context<'_>, root: u32, reason: Reason) -> Value {
        let symbol = &self.evaluator.symbols.symbols[root as usize];
        let tree = &self.evaluator.trees[symbol.file as usize];
        let dimensions = match &symbol.kind {
            SymbolKind::Data(data) => data.dimensions,
            _ => None,
        };
        let Some(dimensions) = dimensions else { return Value::Unknown(reason) };
        let sizes: Vec<Child> = expressions(tree, dimensions).collect();
        let there = Context::new(symbol.file, symbol.scope, context.known);
        let mut value = Value::Unknown(reason);
        let mut count = 1.0;
        for size in sizes.into_iter().rev() {
            let Ok(size) = self.evaluator.value(there, size).number() else { return Value::Unknown(reason) };
            count *= size;
            if !(1.0..=MAX_ELEMENTS).contains(&size) || count > MAX_ELEMENTS {
                return Value::Unknown(reason);
            }
            value = Value::List(vec![value; size as usize]);
        }
        value
    }

    /// `old` with the component at `path` replaced.
    fn with_component(
        &self,
        context: Context<'_>,
        old: Value,
        type_name: &[u8],
        path: &[Child],
        value: Value,
    ) -> Value {
        let tree = &self.evaluator.trees[self.body.file as usize];
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
                list[index] = self.with_component(context, part, &component_type, rest, value);
                Value::List(list)
            }
            Child::Token(_) => self.with_component(context, old, type_name, rest, value),
            Child::Node(index) => {
                let positions: Vec<Child> = expressions(tree, index).collect();
                self.with_element(context, old, type_name, (&positions, rest), value)
            }
        }
    }

    /// `old` with the component `rest` of the element at `positions` replaced.
    fn with_element(
        &self,
        context: Context<'_>,
        old: Value,
        type_name: &[u8],
        (positions, rest): (&[Child], &[Child]),
        value: Value,
    ) -> Value {
        let Some((&position, positions)) = positions.split_first() else {
            return self.with_component(context, old, type_name, rest, value);
        };
        let Value::List(mut list) = old else { return Value::Unknown(Reason::Assigned) };
        let Ok(position) = self.evaluator.value(context, position).number() else {
            return Value::Unknown(Reason::Assigned);
        };
        let Some(part) = index_of(position).and_then(|at| list.get_mut(at)) else {
            return Value::Unknown(Reason::IndexOutOfRange);
        };
        let old = std::mem::replace(part, Value::Bool(false));
        *part = self.with_element(context, old, type_name, (positions, rest), value);
        Value::List(list)
    }
}
