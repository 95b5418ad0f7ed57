//! Names: what each stands for, from where it is seen, and whether the program changes it.
//!
//! Look-up goes from the routine to its module to the task (all files given together). LOCAL declarations and those
//! of routines hide others. What a file assigns, or hands to something that may assign it, is marked: its initial
//! value then says nothing about its value at a motion.

use std::collections::HashMap;

use super::instruction::{self, INSTRUCTIONS, Slot};
use super::syntax::{
    Argument, Data, RapidTree, RoutineHead, Syntax, arguments, data, parts, routine_head, text_of, token_kind,
};
use super::token::{Token, display, fold, folded};
use crate::program::tree::Child;

/// What a name stands for.
#[derive(Debug, Clone, PartialEq)]
pub enum What {
    /// Data.
    Data(Data),
    /// A parameter of a routine.
    Parameter,
    /// The variable of a FOR loop.
    Loop,
    /// A routine: index into [`Symbols::routines`].
    Routine(u32),
    /// A record type: names and types of its components.
    Record(Vec<(Vec<u8>, Vec<u8>)>),
    /// Another name of a type.
    Alias,
}

/// A declared name.
#[derive(Debug, Clone, PartialEq)]
pub struct Symbol {
    /// The file in which it is declared.
    pub file: u32,
    /// The scope in which it is declared.
    pub scope: u32,
    /// The token of its name.
    pub name: u32,
    /// What it stands for.
    pub what: What,
    /// Its type in lower case (the aliased type for an alias).
    pub type_name: Vec<u8>,
    /// Whether anything may change it while the program runs.
    pub assigned: bool,
    /// Whether another module declares the same global name.
    pub ambiguous: bool,
}

/// A scope: the task, a module, or a routine.
#[derive(Debug, Default)]
pub struct Scope {
    /// The scope around it.
    pub parent: Option<u32>,
    names: HashMap<Vec<u8>, u32>,
}

/// A routine.
#[derive(Debug)]
pub struct RoutineScope {
    /// Its file.
    pub file: u32,
    /// Its head.
    pub head: RoutineHead,
    /// Its scope.
    pub scope: u32,
    /// The name of its module.
    pub module: String,
}

/// Statements that run together: a routine, or the statements of a fragment outside routines.
#[derive(Debug, Clone, Copy)]
pub struct Unit {
    /// Its file.
    pub file: u32,
    /// Its node.
    pub node: u32,
    /// Its scope.
    pub scope: u32,
    /// Index into [`Symbols::routines`].
    pub routine: Option<u32>,
}

/// All names of a task.
#[derive(Debug, Default)]
pub struct Symbols {
    /// The names.
    pub symbols: Vec<Symbol>,
    /// The scopes; 0 is the task.
    pub scopes: Vec<Scope>,
    /// The routines.
    pub routines: Vec<RoutineScope>,
    /// Everything that runs, in the order of files and lines.
    pub units: Vec<Unit>,
    /// Whether a routine has the name of a motion instruction.
    pub hides_instruction: bool,
}

impl Symbols {
    /// Gathers the names of files that belong to one task.
    pub fn gather(trees: &[RapidTree<'_>]) -> Symbols {
        let mut symbols = Symbols { scopes: vec![Scope::default()], ..Symbols::default() };
        for (file, tree) in trees.iter().enumerate() {
            symbols.file(tree, file as u32);
        }
        for unit in symbols.units.clone() {
            symbols.changes(&trees[unit.file as usize], unit);
        }
        symbols
    }

    /// The symbol that a name stands for in a scope.
    pub fn find(&self, scope: u32, name: &[u8]) -> Option<u32> {
        let mut buffer = [0_u8; 64];
        let long;
        let key = if name.len() <= buffer.len() {
            for (to, &byte) in buffer.iter_mut().zip(name) {
                *to = fold(byte);
            }
            &buffer[..name.len()]
        } else {
            long = folded(name);
            &long
        };
        let mut at = Some(scope);
        while let Some(scope) = at {
            let scope = &self.scopes[scope as usize];
            if let Some(&found) = scope.names.get(key) {
                return Some(found);
            }
            at = scope.parent;
        }
        None
    }

    /// The routine that a name calls.
    pub fn routine(&self, scope: u32, name: &[u8]) -> Option<u32> {
        match self.symbols[self.find(scope, name)? as usize].what {
            What::Routine(routine) => Some(routine),
            _ => None,
        }
    }

    /// Every declared name, in lower case.
    pub fn names(&self) -> impl Iterator<Item = &[u8]> {
        self.scopes.iter().flat_map(|scope| scope.names.keys().map(Vec::as_slice))
    }

    /// A type name with aliases resolved.
    pub fn resolved_type<'a>(&'a self, scope: u32, type_name: &'a [u8]) -> &'a [u8] {
        let mut name = type_name;
        for _ in 0..16 {
            match self.find(scope, name).map(|symbol| &self.symbols[symbol as usize]) {
                Some(Symbol { what: What::Alias, type_name, .. }) => name = type_name,
                _ => break,
            }
        }
        name
    }

    /// The scope of a file's module, for names that stand outside routines.
    fn new_scope(&mut self, parent: u32) -> u32 {
        self.scopes.push(Scope { parent: Some(parent), names: HashMap::new() });
        self.scopes.len() as u32 - 1
    }

    fn declare(&mut self, text: &[u8], symbol: Symbol, global: bool) {
        let name = folded(text);
        let (scope, id) = (symbol.scope, self.symbols.len() as u32);
        self.symbols.push(symbol);
        self.scopes[scope as usize].names.entry(name.clone()).or_insert(id);
        if global {
            match self.scopes[0].names.get(&name) {
                Some(&other) => {
                    self.symbols[id as usize].ambiguous = true;
                    self.symbols[other as usize].ambiguous = true;
                }
                None => {
                    self.scopes[0].names.insert(name, id);
                }
            }
        }
    }

    fn file(&mut self, tree: &RapidTree<'_>, file: u32) {
        let outside = self.new_scope(0);
        let mut loose = false;
        for node in tree.child_nodes(0) {
            if tree.nodes[node as usize].kind == Syntax::Module {
                let scope = self.new_scope(0);
                let name = parts(tree, node).find(|&part| token_kind(tree, part) == Some(Token::Ident));
                let name = name.map(|part| display(text_of(tree, part))).unwrap_or_default();
                let mut inside = false;
                for item in tree.child_nodes(node) {
                    inside |= !self.item(tree, file, scope, item, &name);
                }
                if inside {
                    self.units.push(Unit { file, node, scope, routine: None });
                }
            } else {
                loose |= !self.item(tree, file, outside, node, "");
            }
        }
        if loose {
            self.units.push(Unit { file, node: 0, scope: outside, routine: None });
        }
    }

    /// A declaration or routine; false for a statement.
    fn item(&mut self, tree: &RapidTree<'_>, file: u32, scope: u32, node: u32, module: &str) -> bool {
        let kind = tree.nodes[node as usize].kind;
        match kind {
            Syntax::Data => self.data(tree, file, scope, node, true),
            Syntax::Record | Syntax::Alias => self.type_(tree, file, scope, node),
            Syntax::Proc | Syntax::Func | Syntax::Trap => self.routine_item(tree, file, scope, node, module),
            Syntax::Attributes | Syntax::Opaque | Syntax::Unwritten => {}
            _ => return false,
        }
        true
    }

    fn data(&mut self, tree: &RapidTree<'_>, file: u32, scope: u32, node: u32, module_level: bool) {
        let Some(data) = data(tree, node) else { return };
        let symbol = Symbol {
            file,
            scope,
            name: data.name,
            what: What::Data(data),
            type_name: folded(tree.text(data.type_name)),
            assigned: false,
            ambiguous: false,
        };
        self.declare(tree.text(data.name), symbol, module_level && !data.local);
    }

    fn type_(&mut self, tree: &RapidTree<'_>, file: u32, scope: u32, node: u32) {
        let names = |node: u32| -> Vec<u32> {
            parts(tree, node)
                .filter_map(|part| match part {
                    Child::Token(token) if tree.kind(token) == Some(Token::Ident) => Some(token),
                    _ => None,
                })
                .collect()
        };
        let own = names(node);
        let (name, type_name, what) = if tree.nodes[node as usize].kind == Syntax::Alias {
            let [type_name, name] = own[..] else { return };
            (name, folded(tree.text(type_name)), What::Alias)
        } else {
            let [name] = own[..] else { return };
            let components = tree.child_nodes(node).filter_map(|component| match names(component)[..] {
                [type_name, name] => Some((folded(tree.text(name)), folded(tree.text(type_name)))),
                _ => None,
            });
            (name, Vec::new(), What::Record(components.collect()))
        };
        let symbol = Symbol { file, scope, name, what, type_name, assigned: false, ambiguous: false };
        self.declare(tree.text(name), symbol, true);
    }

    fn routine_item(&mut self, tree: &RapidTree<'_>, file: u32, scope: u32, node: u32, module: &str) {
        let Some(head) = routine_head(tree, node) else { return };
        let inner = self.new_scope(scope);
        let index = self.routines.len() as u32;
        let text = tree.text(head.name);
        self.hides_instruction |= instruction::find(text).is_some();
        let symbol = Symbol {
            file,
            scope,
            name: head.name,
            what: What::Routine(index),
            type_name: Vec::new(),
            assigned: false,
            ambiguous: false,
        };
        self.declare(text, symbol, !head.local);
        for parameter in &head.parameters {
            let symbol = Symbol {
                file,
                scope: inner,
                name: parameter.name,
                what: What::Parameter,
                type_name: folded(tree.text(parameter.type_name)),
                assigned: true,
                ambiguous: false,
            };
            self.declare(tree.text(parameter.name), symbol, false);
        }
        for inside in node + 1..node + tree.nodes[node as usize].size {
            match tree.nodes[inside as usize].kind {
                Syntax::Data => self.data(tree, file, inner, inside, false),
                Syntax::For => {
                    let name = parts(tree, inside).find(|&part| token_kind(tree, part) == Some(Token::Ident));
                    if let Some(Child::Token(name)) = name {
                        let symbol = Symbol {
                            file,
                            scope: inner,
                            name,
                            what: What::Loop,
                            type_name: b"num".to_vec(),
                            assigned: true,
                            ambiguous: false,
                        };
                        self.declare(tree.text(name), symbol, false);
                    }
                }
                _ => {}
            }
        }
        self.routines.push(RoutineScope { file, head, scope: inner, module: module.to_owned() });
        self.units.push(Unit { file, node, scope: inner, routine: Some(index) });
    }

    // ---- what the program changes ----

    fn changes(&mut self, tree: &RapidTree<'_>, unit: Unit) {
        let end = unit.node + tree.nodes[unit.node as usize].size;
        let mut node = unit.node + 1;
        while node < end {
            let kind = tree.nodes[node as usize].kind;
            if unit.routine.is_none() && (kind.is_routine() || kind == Syntax::Module) {
                node += tree.nodes[node as usize].size;
                continue;
            }
            if kind.may_change() {
                for symbol in self.changed_by(tree, unit.scope, node) {
                    self.symbols[symbol as usize].assigned = true;
                }
            }
            node += 1;
        }
    }

    /// The symbols that a statement or function call may change by itself (not by what the called routine does).
    /// Constants never change.
    pub fn changed_by(&self, tree: &RapidTree<'_>, scope: u32, node: u32) -> Vec<u32> {
        let mut changed = self.given_by(tree, scope, node);
        changed.retain(|&symbol| {
            !matches!(&self.symbols[symbol as usize].what, What::Data(data) if data.storage == Token::Const)
        });
        changed
    }

    fn given_by(&self, tree: &RapidTree<'_>, scope: u32, node: u32) -> Vec<u32> {
        match tree.nodes[node as usize].kind {
            Syntax::Assignment => {
                let place = parts(tree, node).next();
                place.and_then(|place| self.root(tree, scope, place)).into_iter().collect()
            }
            Syntax::For => {
                let name = parts(tree, node).find(|&part| token_kind(tree, part) == Some(Token::Ident));
                name.and_then(|name| self.root(tree, scope, name)).into_iter().collect()
            }
            Syntax::Call | Syntax::Function => {
                let name = tree.text(tree.nodes[node as usize].first);
                self.changed_by_call(tree, scope, node, name)
            }
            Syntax::LateCall => {
                arguments(tree, node).filter_map(|argument| self.root(tree, scope, argument.value?)).collect()
            }
            _ => Vec::new(),
        }
    }

    fn changed_by_call(&self, tree: &RapidTree<'_>, scope: u32, node: u32, name: &[u8]) -> Vec<u32> {
        let is_call = tree.nodes[node as usize].kind == Syntax::Call;
        if is_call
            && !self.hides_instruction
            && let Some(known) = instruction::find(name)
        {
            let known = &INSTRUCTIONS[known];
            // Only searches write an argument.
            if known.slot(1, 4) != Some(Slot::Output) {
                return Vec::new();
            }
        }
        if let Some(routine) = self.routine(scope, name) {
            let parameters = &self.routines[routine as usize].head.parameters;
            let mut position = 0;
            return arguments(tree, node)
                .filter_map(|argument| {
                    let by_reference = match argument {
                        Argument { name: None, .. } => {
                            let mut required = parameters.iter().filter(|parameter| !parameter.optional);
                            let parameter = required.nth(position);
                            position += 1;
                            parameter.is_some_and(|parameter| parameter.by_reference)
                        }
                        // By name: taken as changed where any parameter could be.
                        Argument { name: Some(_), .. } => {
                            parameters.iter().any(|parameter| parameter.by_reference)
                        }
                    };
                    if by_reference { self.root(tree, scope, argument.value?) } else { None }
                })
                .collect();
        }
        if only_reads(name) {
            return Vec::new();
        }
        if is_call && let Some(known) = instruction::find(name) {
            let known = &INSTRUCTIONS[known];
            let count = arguments(tree, node).filter(|argument| !argument.optional).count();
            let required = arguments(tree, node).filter(|argument| !argument.optional).enumerate();
            return required
                .filter(|&(index, _)| known.slot(index, count) == Some(Slot::Output))
                .filter_map(|(_, argument)| self.root(tree, scope, argument.value?))
                .collect();
        }
        // Not known here: it may change what it is given.
        arguments(tree, node).filter_map(|argument| self.root(tree, scope, argument.value?)).collect()
    }

    /// The symbol that a name or place begins with.
    pub fn root(&self, tree: &RapidTree<'_>, scope: u32, place: Child) -> Option<u32> {
        let token = match place {
            Child::Token(token) => token,
            Child::Node(node) if tree.nodes[node as usize].kind == Syntax::Place => {
                tree.nodes[node as usize].first
            }
            Child::Node(_) => return None,
        };
        if tree.kind(token) != Some(Token::Ident) {
            return None;
        }
        self.find(scope, tree.text(token))
    }
}

/// Predefined instructions and functions that leave their arguments as they are.
pub fn only_reads(name: &[u8]) -> bool {
    const READERS: &[&str] = &[
        "abs",
        "accset",
        "acos",
        "actunit",
        "aorder",
        "asin",
        "atan",
        "atan2",
        "calcjointt",
        "calcrobt",
        "confj",
        "confl",
        "corrcon",
        "cos",
        "crobt",
        "crossprod",
        "cjointt",
        "deactunit",
        "defframe",
        "dim",
        "distance",
        "dotprod",
        "eoffsset",
        "erwrite",
        "eulerzyx",
        "exp",
        "fcact",
        "fccalib",
        "fcdeact",
        "gripload",
        "incrdisp",
        "ispers",
        "isvar",
        "max",
        "min",
        "mirpos",
        "norient",
        "numtostr",
        "offs",
        "orientzyx",
        "orobt",
        "pdispoff",
        "pdispon",
        "pdispset",
        "poseinv",
        "posemult",
        "posevect",
        "pow",
        "pulsedo",
        "reltool",
        "reset",
        "round",
        "set",
        "setao",
        "setdo",
        "setgo",
        "sin",
        "singarea",
        "softact",
        "sqrt",
        "strlen",
        "strpart",
        "tan",
        "tasksync",
        "testdi",
        "tpwrite",
        "trunc",
        "valtostr",
        "velset",
        "vectmagn",
        "waitdi",
        "waitdo",
        "waitsynctask",
        "waittime",
        "waituntil",
        "write",
        "wzsphdef",
        "syncmoveon",
        "syncmoveoff",
        "tperase",
        "stop",
        "clkstart",
        "clkreset",
        "clkstop",
        "isignaldi",
        "idelete",
        "waitrob",
        "syncmoveundo",
        "cirpathmode",
        "eoffson",
        "eoffsoff",
        "corrdiscon",
        "egmreset",
        "incrmove",
        "triggio",
        "bool",
        "doutput",
        "dinput",
        "goutput",
        "accmax",
        "worldacclim",
        "pathacclim",
        "spdoverride",
        "speedrefresh",
        "motionsup",
        "exitcycle",
        "waitload",
        "softdeact",
        "corrclear",
        "setallDO",
    ];
    READERS.iter().any(|reader| reader.as_bytes().eq_ignore_ascii_case(name))
}
