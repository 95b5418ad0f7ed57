//! The kinds of RAPID node, and typed views of them.
//!
//! A view is a typed node index; it stores no content. An expression of one token has
//! no node: [`Child`] says which it is.

use super::token::Token;
use crate::tree::{Child, Tree};

/// The tree of one RAPID file.
pub type RapidTree<'s> = Tree<'s, Token, Syntax>;

/// A kind of node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Syntax {
    /// The whole file.
    File,
    /// MODULE … ENDMODULE.
    Module,
    /// The attributes of a module.
    Attributes,
    /// RECORD … ENDRECORD.
    Record,
    /// A component of a record: type and name.
    Component,
    /// ALIAS type name.
    Alias,
    /// A declaration of data.
    Data,
    /// The dimensions of an array.
    Dimensions,
    /// PROC … ENDPROC.
    Proc,
    /// FUNC … ENDFUNC.
    Func,
    /// TRAP … ENDTRAP.
    Trap,
    /// The parameter list of a routine.
    Parameters,
    /// One parameter.
    Parameter,
    /// The statements of a routine or loop.
    Body,
    /// ERROR and its statements.
    ErrorClause,
    /// UNDO and its statements.
    UndoClause,
    /// BACKWARD and its statements.
    BackwardClause,
    /// IF … THEN … ENDIF; holds branches.
    If,
    /// THEN, ELSEIF or ELSE with its statements.
    Branch,
    /// IF without THEN: guards one statement.
    CompactIf,
    /// FOR … ENDFOR.
    For,
    /// WHILE … ENDWHILE.
    While,
    /// TEST … ENDTEST; holds cases.
    Test,
    /// CASE or DEFAULT with its statements.
    Case,
    /// `place := value;`
    Assignment,
    /// `name arguments;`
    Call,
    /// `%name% arguments;`
    LateCall,
    /// `name:`
    Label,
    /// GOTO.
    Goto,
    /// RETURN.
    Return,
    /// RAISE.
    Raise,
    /// EXIT, RETRY, TRYNEXT.
    Leave,
    /// CONNECT … WITH ….
    Connect,
    /// A placeholder where a statement or declaration should be.
    Unwritten,
    /// Unreadable text.
    Opaque,
    /// A required argument by position.
    Argument,
    /// A required argument by name.
    NamePattern,
    /// An optional argument: `\name`, `\name:=value`, `\name?parameter`.
    Option,
    /// `[…]`
    Aggregate,
    /// `(…)`
    Paren,
    /// `-x`, `+x`, `NOT x`.
    Unary,
    /// Operands of operators of one priority.
    Binary,
    /// `name(arguments)`
    Function,
    /// `name{index}.component…`
    Place,
    /// `{…}` in a place.
    Index,
}

impl Syntax {
    /// Whether it is a routine.
    pub fn is_routine(self) -> bool {
        matches!(self, Syntax::Proc | Syntax::Func | Syntax::Trap)
    }

    /// Whether it is a block within the statements of a routine.
    pub fn is_statement_block(self) -> bool {
        matches!(
            self,
            Syntax::If
                | Syntax::Branch
                | Syntax::CompactIf
                | Syntax::For
                | Syntax::While
                | Syntax::Test
                | Syntax::Case
        ) || self == Syntax::Body
    }

    /// Whether it is an expression.
    pub fn is_expression(self) -> bool {
        matches!(
            self,
            Syntax::Aggregate
                | Syntax::Paren
                | Syntax::Unary
                | Syntax::Binary
                | Syntax::Function
                | Syntax::Place
                | Syntax::Index
        )
    }

    /// Whether it may write data itself.
    pub(super) fn may_change(self) -> bool {
        matches!(
            self,
            Syntax::Assignment
                | Syntax::Call
                | Syntax::LateCall
                | Syntax::Function
                | Syntax::For
                | Syntax::Connect
        )
    }

    /// Whether it is closed by an END of its own.
    pub(super) fn needs_end(self) -> bool {
        self.is_routine()
            || matches!(self, Syntax::Module | Syntax::If | Syntax::For | Syntax::While | Syntax::Test)
    }
}

/// Whether a child carries meaning: a node, or a token that is no trivia.
fn matters(tree: &RapidTree<'_>, child: Child) -> bool {
    match child {
        Child::Node(_) => true,
        Child::Token(token) => tree.kind(token).is_some_and(|kind| !kind.is_trivia()),
    }
}

/// The children of a node without white space and comments.
pub fn parts<'t>(tree: &'t RapidTree<'_>, node: u32) -> impl Iterator<Item = Child> + 't {
    tree.children(node).filter(move |&child| matters(tree, child))
}

/// The kind of a token child.
pub fn token_kind(tree: &RapidTree<'_>, child: Child) -> Option<Token> {
    match child {
        Child::Token(token) => tree.kind(token),
        Child::Node(_) => None,
    }
}

/// The kind of a child node.
pub fn node_kind(tree: &RapidTree<'_>, child: Child) -> Option<Syntax> {
    match child {
        Child::Token(_) => None,
        Child::Node(node) => Some(tree.nodes.kind(node)),
    }
}

/// The tokens that a child covers: first, and one past the last.
pub fn tokens_of(tree: &RapidTree<'_>, child: Child) -> (u32, u32) {
    match child {
        Child::Token(token) => (token, token + 1),
        Child::Node(node) => {
            let node = tree.nodes.get(node);
            (node.first, node.end)
        }
    }
}

/// The bytes of a child.
pub fn text_of<'s>(tree: &RapidTree<'s>, child: Child) -> &'s [u8] {
    let (first, end) = tokens_of(tree, child);
    &tree.source()[tree.range(first, end)]
}

/// Whether a token can be an expression of its own.
fn is_operand(kind: Token) -> bool {
    matches!(
        kind,
        Token::Ident
            | Token::Number
            | Token::String
            | Token::True
            | Token::False
            | Token::Placeholder
            | Token::Star
    )
}

/// The expressions among the children of an aggregate, argument list, index or parenthesis.
pub fn expressions<'t>(tree: &'t RapidTree<'_>, node: u32) -> impl Iterator<Item = Child> + 't {
    tree.children(node).filter(move |&child| match child {
        Child::Node(_) => true,
        Child::Token(token) => tree.kind(token).is_some_and(is_operand),
    })
}

/// One argument of a call.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Argument {
    /// The token of the name, for optional and named arguments.
    pub name: Option<u32>,
    /// Whether it is optional (begins with `\`).
    pub optional: bool,
    /// Its value; a switch has none.
    pub value: Option<Child>,
}

/// The arguments of a call, late call or function.
pub fn arguments<'t>(tree: &'t RapidTree<'_>, call: u32) -> impl Iterator<Item = Argument> + 't {
    tree.child_nodes(call).filter_map(move |node| {
        let kind = tree.nodes.kind(node);
        match kind {
            Syntax::Argument => {
                Some(Argument { name: None, optional: false, value: expressions(tree, node).next() })
            }
            Syntax::NamePattern | Syntax::Option => {
                let mut inner = parts(tree, node).filter(|&part| {
                    !matches!(token_kind(tree, part), Some(Token::Backslash | Token::Assign))
                });
                let name = inner.next().and_then(|part| match part {
                    Child::Token(token) => Some(token),
                    Child::Node(_) => None,
                });
                let value = inner.find(|&part| token_kind(tree, part) != Some(Token::Question));
                Some(Argument { name, optional: kind == Syntax::Option, value })
            }
            _ => None,
        }
    })
}

/// A view of a declaration of data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Data {
    /// The node.
    pub node: u32,
    /// LOCAL.
    pub local: bool,
    /// TASK.
    pub task: bool,
    /// VAR, PERS or CONST.
    pub storage: Token,
    /// The token of the type.
    pub type_name: u32,
    /// The token of the name.
    pub name: u32,
    /// The node of the dimensions, for an array.
    pub dimensions: Option<u32>,
    /// The initial value.
    pub value: Option<Child>,
}

/// Reads a declaration of data.
pub fn data(tree: &RapidTree<'_>, node: u32) -> Option<Data> {
    let mut data = Data {
        node,
        local: false,
        task: false,
        storage: Token::Var,
        type_name: 0,
        name: 0,
        dimensions: None,
        value: None,
    };
    let mut names = 0;
    let mut assigned = false;
    let mut stored = false;
    for part in parts(tree, node) {
        match (part, token_kind(tree, part)) {
            _ if assigned => {
                data.value = Some(part);
                break;
            }
            (_, Some(Token::Local)) => data.local = true,
            (_, Some(storage @ (Token::Var | Token::Pers | Token::Const))) => {
                (data.storage, stored) = (storage, true);
            }
            (_, Some(Token::Assign)) => assigned = true,
            (_, Some(Token::Semicolon)) => break,
            (Child::Token(_), _) if !stored => data.task = true,
            (Child::Token(token), _) => {
                if names == 0 {
                    data.type_name = token;
                } else {
                    data.name = token;
                }
                names += 1;
            }
            (Child::Node(dimensions), _) => data.dimensions = Some(dimensions),
        }
    }
    (names == 2).then_some(data)
}

/// A view of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Parameter {
    /// Whether it is optional.
    pub optional: bool,
    /// Whether the routine may change the argument (VAR, PERS, INOUT).
    pub by_reference: bool,
    /// The token of the type.
    pub type_name: u32,
    /// The token of the name.
    pub name: u32,
    /// Whether it is an array.
    pub array: bool,
}

/// A view of a routine's head.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RoutineHead {
    /// The node.
    pub node: u32,
    /// PROC, FUNC or TRAP.
    pub kind: Syntax,
    /// LOCAL.
    pub local: bool,
    /// The token of the name.
    pub name: u32,
    /// The parameters.
    pub parameters: Vec<Parameter>,
}

/// Reads the head of a routine.
pub fn routine_head(tree: &RapidTree<'_>, node: u32) -> Option<RoutineHead> {
    let kind = tree.nodes.kind(node);
    let mut head = RoutineHead { node, kind, local: false, name: 0, parameters: Vec::new() };
    let mut named = false;
    for part in parts(tree, node) {
        match (part, token_kind(tree, part)) {
            (_, Some(Token::Local)) => head.local = true,
            (Child::Token(token), Some(Token::Ident | Token::Placeholder)) => {
                (head.name, named) = (token, true);
            }
            (Child::Node(list), _) => match tree.nodes.kind(list) {
                Syntax::Parameters => {
                    head.parameters = parameters(tree, list);
                }
                _ => break,
            },
            _ => {}
        }
    }
    named.then_some(head)
}

/// The parameters of a list. Of `\a | b` a call gives one or none: the parameter after `|` is optional too.
fn parameters(tree: &RapidTree<'_>, list: u32) -> Vec<Parameter> {
    let mut out = Vec::new();
    let mut alternative = false;
    for part in parts(tree, list) {
        match part {
            Child::Token(token) => alternative = tree.kind(token) == Some(Token::Pipe),
            Child::Node(node) => {
                let found = parameter(tree, node);
                out.extend(found.map(|found| Parameter { optional: found.optional || alternative, ..found }));
                alternative = false;
            }
        }
    }
    out
}

fn parameter(tree: &RapidTree<'_>, node: u32) -> Option<Parameter> {
    let mut parameter =
        Parameter { optional: false, by_reference: false, type_name: 0, name: 0, array: false };
    let mut names = 0;
    for part in parts(tree, node) {
        match (part, token_kind(tree, part)) {
            (_, Some(Token::Backslash)) => parameter.optional = true,
            (_, Some(Token::Var | Token::Pers | Token::InOut)) => parameter.by_reference = true,
            (_, Some(Token::BraceOpen)) => {
                parameter.array = true;
                break;
            }
            (Child::Token(token), Some(Token::Ident | Token::Placeholder)) => {
                if names == 0 {
                    parameter.type_name = token;
                } else {
                    parameter.name = token;
                }
                names += 1;
            }
            _ => {}
        }
    }
    (names == 2).then_some(parameter)
}
