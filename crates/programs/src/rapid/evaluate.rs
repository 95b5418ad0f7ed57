//! Constant evaluation of expressions.
//!
//! Method: constants are folded in double precision. Data that no file writes has its initial value; data that is written has
//! the value that constant propagation found ([`Known`]), else its initial value without the components that are written
//! anywhere. Target functions follow the RAPID reference: `Offs` adds in the object frame and keeps the orientation; `RelTool`
//! moves along the axes of the target's tool frame and then rotates about its x, the new y and the new z. A function of the
//! program whose only statement is RETURN is evaluated inline. Everything else is [`Value::Unknown`] with its reason.
//!
//! Termination: the value of a declaration is computed once; chains of declarations and of functions have a greatest length,
//! values that refer to each other a greatest size.
//!
//! Departure: a controller computes `num` in single precision.

mod functions;
mod operators;
pub mod target;
mod types;

use std::cell::{Cell, RefCell};
use std::collections::HashMap;

use self::functions::{Options, call};
use super::number;
use super::symbol::{Symbol, SymbolKind, Symbols};
use super::syntax::{Data, RapidTree, Syntax, arguments, expressions, parts, text_of, token_kind, tokens_of};
use super::token::{Token, fold, folded, same_name};
use super::value::{Value, built_in};
use crate::motion::Reason;
use crate::persistent_map::Map;
use crate::tree::Child;

/// Known values of written data, by symbol (constant propagation).
pub type Known = Map<u32, Value>;

/// Longest chain of constants that refer to constants.
const REFERENCE_DEPTH: u32 = 32;

/// Most scalars and strings in data that refers to other data.
const REFERENCE_SIZE: usize = 1 << 16;

/// Most functions of the program that one expression may call.
const FUNCTIONS: u32 = 256;

/// Where an expression is evaluated.
#[derive(Debug, Clone, Copy)]
pub struct Context<'k> {
    /// The file.
    pub file: u32,
    /// The scope.
    pub scope: u32,
    /// Known values of written data.
    pub known: &'k Known,
    depth: u32,
}

impl<'k> Context<'k> {
    /// An expression in a file and scope.
    pub fn new(file: u32, scope: u32, known: &'k Known) -> Self {
        Context { file, scope, known, depth: 0 }
    }
}

/// Zero-based index of an array element; the controller rounds the index in single precision.
pub(super) fn index_of(position: f64) -> Option<usize> {
    let index = f64::from(position as f32).round();
    (index >= 1.0).then(|| index as usize - 1)
}

/// What is read of persistent data that the program does not assign: the controller may hold others than the files state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Persistent {
    /// They are unknown.
    Unknown,
    /// They are as stated; none has been read.
    Stated,
    /// They are as stated; some have been read.
    Read,
}

/// Evaluates expressions of one task.
#[derive(Debug)]
pub struct Evaluator<'a, 's> {
    /// The files.
    pub trees: &'a [RapidTree<'s>],
    /// Their symbol table.
    pub symbols: &'a Symbols,
    elements: RefCell<HashMap<(u32, u32), Vec<Child>>>,
    /// Values of declarations that refer to others, and whether persistent data were read for them; by declaration, and whether persistent
    /// data are taken as stated.
    initial: RefCell<HashMap<(u32, bool), (Value, bool)>>,
    /// Functions of the program that the current expression has called.
    functions: Cell<u32>,
    /// What is read of persistent data.
    persistent: Cell<Persistent>,
    /// Whether a function of the program got an unknown argument, whose evaluation may raise an error even if it is not used.
    may_raise: Cell<bool>,
    /// Nothing is known at a declaration.
    nothing: Known,
}

impl<'a, 's> Evaluator<'a, 's> {
    /// For the files of one task.
    pub fn new(trees: &'a [RapidTree<'s>], symbols: &'a Symbols) -> Self {
        Evaluator {
            trees,
            symbols,
            elements: RefCell::default(),
            initial: RefCell::default(),
            functions: Cell::new(0),
            persistent: Cell::new(Persistent::Unknown),
            may_raise: Cell::new(false),
            nothing: Known::new(),
        }
    }

    fn tree(&self, file: u32) -> &'a RapidTree<'s> {
        &self.trees[file as usize]
    }

    /// Whether the value of the last target holds only if no error is raised: a function of the program got an unknown
    /// argument that it does not use.
    pub fn may_raise(&self) -> bool {
        self.may_raise.get()
    }

    /// The expression of an array element.
    fn element(&self, context: Context<'_>, root: u32, index: u32) -> Result<(u32, Child), Reason> {
        let symbol = &self.symbols.symbols[root as usize];
        let SymbolKind::Data(data) = &symbol.kind else { return Err(Reason::WrongShape) };
        let mut at = data.value.ok_or(Reason::Uninitialised)?;
        let tree = self.tree(symbol.file);
        for position in expressions(self.tree(context.file), index) {
            let Ok(position) = self.value(context, position).number() else {
                return Err(Reason::RunTimeIndex);
            };
            let Child::Node(list) = at else { return Err(Reason::WrongShape) };
            if tree.nodes.kind(list) != Syntax::Aggregate {
                return Err(Reason::WrongShape);
            }
            let mut cache = self.elements.borrow_mut();
            let items = cache.entry((symbol.file, list)).or_insert_with(|| expressions(tree, list).collect());
            at = *index_of(position).and_then(|at| items.get(at)).ok_or(Reason::IndexOutOfRange)?;
        }
        Ok((symbol.file, at))
    }

    /// The context of a declaration, where no assignment is known.
    fn declaration_context(&self, context: Context<'_>, scope: u32, file: u32) -> Context<'_> {
        Context { file, scope, known: &self.nothing, depth: context.depth + 1 }
    }

    /// Value of data or a parameter.
    pub fn symbol_value(&self, context: Context<'_>, id: u32) -> Value {
        if let Some(value) = context.known.get(&id) {
            return value.clone();
        }
        let symbol = &self.symbols.symbols[id as usize];
        match &symbol.kind {
            SymbolKind::Data(_)
                if symbol.ambiguous && symbol.scope != self.symbols.module_scope(context.scope) =>
            {
                Value::Unknown(Reason::Ambiguous)
            }
            SymbolKind::Data(_) if symbol.assigned && symbol.written_whole => {
                Value::Unknown(symbol.unknown_reason)
            }
            SymbolKind::Data(data) if self.is_persistent(symbol, data) && !self.reads_persistent() => {
                Value::Unknown(if symbol.assigned { symbol.unknown_reason } else { Reason::Persistent })
            }
            SymbolKind::Data(data) => match data.value {
                Some(initial) if context.depth < REFERENCE_DEPTH => {
                    let mut value = self.declared_value(context, id, initial);
                    for part in &symbol.written_parts {
                        self.make_unknown(
                            &mut value,
                            (symbol.scope, &symbol.type_name),
                            part,
                            symbol.unknown_reason,
                        );
                    }
                    value
                }
                Some(_) => Value::Unknown(Reason::WrongShape),
                None if symbol.assigned => Value::Unknown(symbol.unknown_reason),
                None if self.starts_at_zero(symbol, data) => Value::Number(0.0),
                None => Value::Unknown(Reason::Uninitialised),
            },
            SymbolKind::Loop => Value::Unknown(Reason::Assigned),
            SymbolKind::Parameter => Value::Unknown(Reason::Parameter),
            _ => Value::Unknown(Reason::WrongShape),
        }
    }

    /// Whether data stay on the controller when the program ends, where an operator or another task may change them. Tools, work
    /// objects, loads, speeds and zones have to be persistent, or usually are: they are taken as stated.
    fn is_persistent(&self, symbol: &Symbol, data: &Data) -> bool {
        let of = || self.symbols.resolved_type(symbol.scope, &symbol.type_name);
        data.storage == Token::Pers
            && !matches!(of(), b"tooldata" | b"wobjdata" | b"loaddata" | b"speeddata" | b"zonedata")
    }

    /// Whether persistent data are taken as stated; notes that some are read.
    fn reads_persistent(&self) -> bool {
        let stated = self.persistent.get() != Persistent::Unknown;
        if stated {
            self.persistent.set(Persistent::Read);
        }
        stated
    }

    /// Whether uninitialised data is 0: a number declared in a routine, which no other file can write.
    fn starts_at_zero(&self, symbol: &Symbol, data: &Data) -> bool {
        let of_routine = self.symbols.module_scope(symbol.scope) != symbol.scope;
        let number = matches!(&*symbol.type_name, b"num" | b"dnum") && data.dimensions.is_none();
        of_routine && number && data.storage == Token::Var
    }

    /// Makes the component at a path unknown.
    fn make_unknown(&self, value: &mut Value, (scope, type_name): (u32, &[u8]), path: &[u8], reason: Reason) {
        let mut names = path.splitn(2, |&byte| byte == b'.');
        let (Some(name), rest) = (names.next(), names.next()) else { return };
        let found = self.component(scope, type_name, name);
        match (found, &mut *value) {
            (Some((index, type_name)), Value::List(list)) if index < list.len() => match rest {
                Some(rest) => self.make_unknown(&mut list[index], (scope, &type_name), rest, reason),
                None => list[index] = Value::Unknown(reason),
            },
            (_, Value::Unknown(_)) => {}
            _ => *value = Value::Unknown(reason),
        }
    }

    /// The value of the initial expression of data, whatever is assigned later.
    pub fn initial_value(&self, context: Context<'_>, id: u32) -> Option<Value> {
        let symbol = &self.symbols.symbols[id as usize];
        match &symbol.kind {
            SymbolKind::Data(data) => data.value.map(|value| self.declared_value(context, id, value)),
            _ => None,
        }
    }

    /// The value of the initial expression of data, cached where it refers to other data.
    fn declared_value(&self, context: Context<'_>, id: u32, initial: Child) -> Value {
        let symbol = &self.symbols.symbols[id as usize];
        let tree = self.tree(symbol.file);
        let there = self.declaration_context(context, symbol.scope, symbol.file);
        let (first, end) = tokens_of(tree, initial);
        if !tree.kinds()[first as usize..end as usize].contains(&Token::Ident) {
            return self.value(there, initial);
        }
        let before = self.persistent.get();
        let key = (id, before != Persistent::Unknown);
        if let Some((value, read)) = self.initial.borrow().get(&key) {
            if *read {
                self.persistent.set(Persistent::Read);
            }
            return value.clone();
        }
        if before == Persistent::Read {
            self.persistent.set(Persistent::Stated);
        }
        let value = self.value(there, initial);
        let read = self.persistent.get() == Persistent::Read;
        if before == Persistent::Read {
            self.persistent.set(before);
        }
        self.initial.borrow_mut().insert(key, (value.clone(), read));
        value
    }

    /// The value of an expression.
    pub fn value(&self, context: Context<'_>, expression: Child) -> Value {
        let tree = self.tree(context.file);
        match expression {
            Child::Token(token) => self.operand(context, tree, token),
            Child::Node(node) => match tree.nodes.kind(node) {
                Syntax::Aggregate => self.aggregate(context, tree, node),
                Syntax::Paren => match expressions(tree, node).next() {
                    Some(inner) => self.value(context, inner),
                    None => Value::Unknown(Reason::WrongShape),
                },
                Syntax::Unary => self.unary(context, tree, node),
                Syntax::Binary => self.binary(context, tree, node),
                Syntax::Function => self.function(context, tree, node),
                Syntax::Place => self.place(context, tree, node),
                _ => Value::Unknown(Reason::WrongShape),
            },
        }
    }

    fn aggregate(&self, context: Context<'_>, tree: &RapidTree<'s>, node: u32) -> Value {
        let mut size = 0;
        let mut list = Vec::new();
        for part in expressions(tree, node) {
            let value = self.value(context, part);
            let (first, end) = tokens_of(tree, part);
            // Literal numbers are bounded by the length of the text.
            if tree.kinds()[first as usize..end as usize].contains(&Token::Ident) {
                size += value.size(REFERENCE_SIZE);
            }
            if size > REFERENCE_SIZE {
                return Value::Unknown(Reason::WrongShape);
            }
            list.push(value);
        }
        Value::List(list)
    }

    fn operand(&self, context: Context<'_>, tree: &RapidTree<'s>, token: u32) -> Value {
        let text = tree.text(token);
        match tree.kind(token) {
            Some(Token::Number) => {
                number::value(text).map_or(Value::Unknown(Reason::WrongShape), Value::Number)
            }
            Some(Token::True) => Value::Bool(true),
            Some(Token::False) => Value::Bool(false),
            Some(Token::String) => Value::Text(unquoted(text)),
            Some(Token::Ident) => match self.symbols.find(context.scope, text) {
                Some(id) => self.symbol_value(context, id),
                None => built_in(&folded(text)).unwrap_or(Value::Unknown(Reason::Undeclared)),
            },
            Some(Token::Placeholder | Token::Star) => Value::Unknown(Reason::Placeholder),
            _ => Value::Unknown(Reason::WrongShape),
        }
    }

    fn unary(&self, context: Context<'_>, tree: &RapidTree<'s>, node: u32) -> Value {
        let mut parts = parts(tree, node);
        let operator = parts.next().and_then(|part| token_kind(tree, part));
        let Some(operand) = parts.next() else { return Value::Unknown(Reason::WrongShape) };
        match (operator, self.value(context, operand)) {
            (_, unknown @ Value::Unknown(_)) => unknown,
            (Some(Token::Minus), Value::Number(value)) => Value::Number(-value),
            (Some(Token::Plus), Value::Number(value)) => Value::Number(value),
            (Some(Token::Not), Value::Bool(value)) => Value::Bool(!value),
            (Some(Token::Minus), list @ Value::List(_)) => match list.numbers::<3>() {
                Ok(vector) => Value::from_numbers(&vector.map(|value| -value)),
                Err(reason) => Value::Unknown(reason),
            },
            _ => Value::Unknown(Reason::WrongShape),
        }
    }

    fn binary(&self, context: Context<'_>, tree: &RapidTree<'s>, node: u32) -> Value {
        let mut left: Option<Value> = None;
        let mut operator = None;
        // Operands and operators alternate (`*` alone is ambiguous).
        for (index, part) in parts(tree, node).enumerate() {
            if index % 2 == 1 {
                operator = token_kind(tree, part);
                continue;
            }
            let right = self.value(context, part);
            left = Some(match (left, operator) {
                (Some(left), Some(operator)) => operators::binary(&left, operator, &right),
                _ => right,
            });
        }
        left.unwrap_or(Value::Unknown(Reason::WrongShape))
    }

    fn place(&self, context: Context<'_>, tree: &RapidTree<'s>, node: u32) -> Value {
        let Some(root) = parts(tree, node).next() else { return Value::Unknown(Reason::WrongShape) };
        let (mut value, mut type_name, mut rest) = match self.symbols.root(tree, context.scope, root) {
            Some(id) => {
                let symbol = &self.symbols.symbols[id as usize];
                let type_name = symbol.type_name.clone();
                // An element of an array that is never written, without building the array.
                let index = parts(tree, node).nth(1);
                match index {
                    Some(Child::Node(index))
                        if !symbol.assigned
                            && let SymbolKind::Data(data) = &symbol.kind
                            && !symbol.ambiguous =>
                    {
                        if self.is_persistent(symbol, data) && !self.reads_persistent() {
                            return Value::Unknown(Reason::Persistent);
                        }
                        match self.element(context, id, index) {
                            Ok((file, element)) => {
                                let at = self.declaration_context(context, symbol.scope, file);
                                (self.value(at, element), type_name, parts(tree, node).skip(2))
                            }
                            Err(reason) => return Value::Unknown(reason),
                        }
                    }
                    _ => (self.symbol_value(context, id), type_name, parts(tree, node).skip(1)),
                }
            }
            None => {
                let name = match root {
                    Child::Token(token) => folded(tree.text(token)),
                    Child::Node(_) => Vec::new(),
                };
                let type_name: &[u8] = match &*name {
                    b"tool0" => b"tooldata",
                    b"wobj0" => b"wobjdata",
                    [b'v', ..] => b"speeddata",
                    _ => b"zonedata",
                };
                (self.value(context, root), type_name.to_vec(), parts(tree, node).skip(1))
            }
        };
        for part in rest.by_ref() {
            match part {
                Child::Node(index) if tree.nodes.kind(index) == Syntax::Index => {
                    for position in expressions(tree, index) {
                        let Ok(position) = self.value(context, position).number() else {
                            return Value::Unknown(Reason::RunTimeIndex);
                        };
                        value = match value {
                            Value::List(mut list) => match index_of(position) {
                                Some(at) if at < list.len() => list.swap_remove(at),
                                _ => return Value::Unknown(Reason::IndexOutOfRange),
                            },
                            unknown @ Value::Unknown(_) => return unknown,
                            _ => return Value::Unknown(Reason::WrongShape),
                        };
                    }
                }
                Child::Token(token) if tree.kind(token) == Some(Token::Ident) => {
                    let Some((index, component_type)) =
                        self.component(context.scope, &type_name, tree.text(token))
                    else {
                        return Value::Unknown(Reason::WrongShape);
                    };
                    value = match value {
                        Value::List(mut list) if index < list.len() => list.swap_remove(index),
                        unknown @ Value::Unknown(_) => return unknown,
                        _ => return Value::Unknown(Reason::WrongShape),
                    };
                    type_name = component_type;
                }
                _ => {}
            }
        }
        value
    }

    fn function(&self, context: Context<'_>, tree: &RapidTree<'s>, node: u32) -> Value {
        let name = folded(tree.text(tree.nodes.first(node)));
        if let Some(id) = self.symbols.find(context.scope, &name) {
            let symbol = &self.symbols.symbols[id as usize];
            return match symbol.kind {
                SymbolKind::Routine(routine) if !symbol.ambiguous => {
                    self.inline_function(context, tree, node, routine)
                }
                _ => Value::Unknown(Reason::RunTimeFunction),
            };
        }
        if name == b"dim" {
            return self.dimension(context, tree, node).unwrap_or(Value::Unknown(Reason::RunTimeFunction));
        }
        let mut required = Vec::new();
        let mut options = Options::default();
        for argument in arguments(tree, node) {
            match (argument.name, argument.value) {
                (None, None) => {}
                (None, Some(value)) => {
                    // reg1 to reg5: variables of the USER module of every controller.
                    let own =
                        matches!(text_of(tree, value), [b'r' | b'R', b'e' | b'E', b'g' | b'G', b'1'..=b'5']);
                    required.push(match self.value(context, value) {
                        Value::Unknown(Reason::Undeclared) if own => Value::Unknown(Reason::RunTimeOffset),
                        value => value,
                    });
                }
                (Some(option), value) => {
                    let option: Vec<u8> = tree.text(option).iter().map(|&byte| fold(byte)).collect();
                    let value = value.map(|value| self.value(context, value));
                    match (&*option, value) {
                        (b"rx", Some(value)) => options.turns[0] = Some(value),
                        (b"ry", Some(value)) => options.turns[1] = Some(value),
                        (b"rz", Some(value)) => options.turns[2] = Some(value),
                        (b"wobj", Some(value)) if name == b"mirpos" => options.work_object = Some(value),
                        (b"miry", None) => options.mirrors_y = true,
                        (b"origin", Some(value)) if name == b"defframe" => options.origin = Some(value),
                        (b"dec", Some(value)) if name == b"round" || name == b"trunc" => {
                            options.decimals = Some(value);
                        }
                        ([letter @ b'x'..=b'z'], None) if name == b"eulerzyx" => {
                            options.axis = Some(usize::from(letter - b'x'));
                        }
                        _ => return Value::Unknown(Reason::RunTimeFunction),
                    }
                }
            }
        }
        match call(&name, &required, &options) {
            Ok(value) => value,
            Err(reason) => Value::Unknown(reason),
        }
    }

    /// Inline evaluation of a function of the program whose only statement is RETURN.
    fn inline_function(&self, context: Context<'_>, tree: &RapidTree<'s>, node: u32, routine: u32) -> Value {
        let unknown = Value::Unknown(Reason::RunTimeFunction);
        self.functions.set(if context.depth == 0 { 0 } else { self.functions.get() + 1 });
        if context.depth >= REFERENCE_DEPTH || self.functions.get() >= FUNCTIONS {
            return unknown;
        }
        let found = &self.symbols.routines[routine as usize];
        let home = self.tree(found.file);
        let Some(returned) = single_return(home, found.head.node) else { return unknown };
        let parameters = &found.head.parameters;
        if parameters.iter().any(|parameter| parameter.by_reference || parameter.array) {
            return unknown;
        }
        let mut known = context.known.clone();
        self.symbols.declared_in(found.scope).for_each(|id| known.remove(&id));
        let mut required = parameters.iter().filter(|parameter| !parameter.optional);
        for argument in arguments(tree, node) {
            let parameter = match argument.name {
                None => required.next(),
                Some(name) => {
                    parameters.iter().find(|parameter| same_name(home.text(parameter.name), tree.text(name)))
                }
            };
            let (Some(parameter), Some(value)) = (parameter, argument.value) else { return unknown };
            let Some(id) = self.symbols.find(found.scope, home.text(parameter.name)) else { return unknown };
            let given = self.value(Context { depth: context.depth + 1, ..context }, value);
            self.may_raise.set(self.may_raise.get() || !given.is_known() && !is_plain_place(tree, value));
            known.insert(id, given);
        }
        let depth = context.depth + 1;
        match self.value(Context { file: found.file, scope: found.scope, known: &known, depth }, returned) {
            // A parameter of the function, not of the calling routine.
            Value::Unknown(Reason::Parameter) => unknown,
            value => value,
        }
    }

    /// `Dim(array, number)`, where the declaration states the dimensions.
    fn dimension(&self, context: Context<'_>, tree: &RapidTree<'s>, node: u32) -> Option<Value> {
        let mut given = arguments(tree, node);
        let (array, number) = (given.next()?.value?, given.next()?.value?);
        let Child::Token(_) = array else { return None };
        let symbol = &self.symbols.symbols[self.symbols.root(tree, context.scope, array)? as usize];
        let SymbolKind::Data(data) = &symbol.kind else { return None };
        if symbol.ambiguous && symbol.scope != self.symbols.module_scope(context.scope) {
            return None;
        }
        let number = self.value(context, number).number().ok()?.round();
        let at = if number >= 1.0 { number as usize - 1 } else { return None };
        let size = expressions(self.tree(symbol.file), data.dimensions?).nth(at)?;
        let size =
            self.value(self.declaration_context(context, symbol.scope, symbol.file), size).number().ok()?;
        Some(Value::Number(size))
    }
}

/// Whether an expression is a name or a component of one, whose evaluation cannot fail.
fn is_plain_place(tree: &RapidTree<'_>, expression: Child) -> bool {
    match expression {
        Child::Token(_) => true,
        Child::Node(node) => {
            tree.nodes.kind(node) == Syntax::Place
                && parts(tree, node).all(|part| matches!(part, Child::Token(_)))
        }
    }
}

/// The returned expression of a function whose only statement is RETURN and which declares nothing.
fn single_return(tree: &RapidTree<'_>, function: u32) -> Option<Child> {
    let mut inside = tree.child_nodes(function).filter(|&node| tree.nodes.kind(node) != Syntax::Parameters);
    let (mut only, None) = (inside.next()?, inside.next()) else { return None };
    if tree.nodes.kind(only) == Syntax::Body {
        let mut statements = tree.child_nodes(only);
        let (Some(first), None) = (statements.next(), statements.next()) else { return None };
        only = first;
    }
    (tree.nodes.kind(only) == Syntax::Return).then(|| expressions(tree, only).next()).flatten()
}

/// The content of a string token.
fn unquoted(text: &[u8]) -> Vec<u8> {
    let inner = text.get(1..text.len().saturating_sub(1)).unwrap_or_default();
    let mut out = Vec::with_capacity(inner.len());
    let mut rest = inner;
    while let Some((&byte, after)) = rest.split_first() {
        rest = after;
        match (byte, after) {
            (b'"', [b'"', after @ ..]) | (b'\\', [b'\\', after @ ..]) => {
                out.push(byte);
                rest = after;
            }
            (b'\\', [high, low, after @ ..]) if high.is_ascii_hexdigit() && low.is_ascii_hexdigit() => {
                let digit = |byte: u8| char::from(byte).to_digit(16).unwrap_or(0) as u8;
                out.push(digit(*high) * 16 + digit(*low));
                rest = after;
            }
            _ => out.push(byte),
        }
    }
    out
}
