//! Symbol table: names, scopes and routines of all files of a task, the call graph, and the side effects of each routine.
//!
//! Look-up goes from the routine to its module to the task (all files given together). LOCAL declarations and those of
//! routines hide others. A symbol that the program may write is marked: its initial value then holds at no motion, or only
//! for the components that are never written.

mod effects;
pub(super) mod facts;
pub(super) mod computed_name;
mod late_binding;
mod position_reads;
mod purity;
mod solve;
mod writes;

use std::collections::{BTreeSet, HashMap, HashSet};

use self::computed_name::NamePattern;
pub use self::effects::{SideEffects, Write, WriteKind};
use self::position_reads::position_decisions;
use super::instruction;
use super::modal::{Switch, SwitchSet};
use super::syntax::{Data, RapidTree, RoutineHead, Syntax, data, parts, routine_head, text_of, token_kind};
use super::token::{Token, display, fold, folded, same_name};
use crate::motion::Reason;
use crate::tree::Child;

/// Kind of a symbol.
#[derive(Debug, Clone, PartialEq)]
pub enum SymbolKind {
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
    /// Its kind.
    pub kind: SymbolKind,
    /// Its type in lower case (the aliased type for an alias).
    pub type_name: Vec<u8>,
    /// Whether the program may write it.
    pub assigned: bool,
    /// Whether it is written otherwise than by assignments to the components in `written_parts`.
    pub written_whole: bool,
    /// The components that are assigned, each as a path of lower-case names with a point between.
    pub written_parts: Vec<Vec<u8>>,
    /// Why its value is unknown where no assignment reaches.
    pub unknown_reason: Reason,
    /// Whether it may change between any two statements: written by a trap routine, an error handler or the controller.
    pub volatile: bool,
    /// Whether another module declares the same global name.
    pub ambiguous: bool,
}

impl Symbol {
    /// A symbol that is never written.
    fn new((file, scope): (u32, u32), name: u32, kind: SymbolKind, type_name: Vec<u8>) -> Symbol {
        Symbol {
            file,
            scope,
            name,
            kind,
            type_name,
            assigned: false,
            written_whole: false,
            written_parts: Vec::new(),
            unknown_reason: Reason::Assigned,
            volatile: false,
            ambiguous: false,
        }
    }

    /// One whose value varies: a parameter, the variable of a loop.
    fn varying(self) -> Symbol {
        Symbol { assigned: true, written_whole: true, ..self }
    }

    /// Whether it is declared as a constant.
    pub fn is_constant(&self) -> bool {
        matches!(&self.kind, SymbolKind::Data(data) if data.storage == Token::Const)
    }

    /// Whether it is data and no constant.
    fn is_variable_data(&self) -> bool {
        matches!(self.kind, SymbolKind::Data(_)) && !self.is_constant()
    }
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
    /// Why the argument of each parameter may be written; `None` where it is not.
    pub parameter_writes: Vec<Option<Reason>>,
    /// Side effects of a call.
    pub effects: SideEffects,
    /// Index into [`Symbols::bodies`].
    pub body: u32,
}

/// The statements of a routine, or of a fragment outside routines.
#[derive(Debug, Clone, Copy)]
pub struct Body {
    /// Its file.
    pub file: u32,
    /// Its node.
    pub node: u32,
    /// Its scope.
    pub scope: u32,
    /// Index into [`Symbols::routines`].
    pub routine: Option<u32>,
}

/// The symbol table of a task.
#[derive(Debug, Default)]
pub struct Symbols {
    /// The symbols.
    pub symbols: Vec<Symbol>,
    /// The scopes; 0 is the task.
    pub scopes: Vec<Scope>,
    /// The routines.
    pub routines: Vec<RoutineScope>,
    /// All bodies, in the order of files and lines.
    pub bodies: Vec<Body>,
    /// Whether a routine has the name of a motion instruction.
    pub hides_instruction: bool,
    /// The symbols that the statements of each body may write, sorted.
    pub written: Vec<Vec<u32>>,
    /// Post-order of the call graph: each body after its callees, except along recursive calls.
    pub callees_first: Vec<u32>,
    /// Whether anything calls each body by its name.
    pub called: Vec<bool>,
    /// The calls and functions of each body that set a switch or call a routine of the program, in order.
    pub switch_calls: Vec<Vec<u32>>,
    /// The list of routines that each body may call by a computed name: index into `late_lists`.
    pub late_list: Vec<u32>,
    /// Those lists, each sorted.
    pub late_lists: Vec<Vec<u32>>,
    /// The computed names that no procedure of the files has.
    missing_callees: BTreeSet<NamePattern>,
    /// The switches that the routines of each list set.
    pub late_switches: Vec<SwitchSet>,
    /// Whether each routine may run between any two statements: a trap routine, or called while the robot moves.
    pub interrupts: Vec<bool>,
    /// Those that may.
    pub interrupt_routines: Vec<u32>,
    /// Whether one of those moves the robot without storing the path.
    interrupts_move_robot: bool,
    /// The switches that any statement sets.
    pub all_switches: SwitchSet,
    /// Whether anything in the files is named as what states a load (GripLoad, TLoad).
    pub states_loads: bool,
    /// Whether any statement may depend on the robot's current position (PDispOn without \ExeP).
    pub(super) uses_position: bool,
    /// File and node of each function that reads the robot's position for a decision.
    pub(super) position_decisions: BTreeSet<(u32, u32)>,
    /// Whether anything depends on which motions may be the last executed: the robot's position, a configuration that is not
    /// monitored, or a call of a routine that moves.
    pub(super) tracks_motions: bool,
    /// Whether ExitCycle may restart main in the middle of a cycle.
    pub restarts_main: bool,
    /// The routines of each global name that several modules declare, in lower case.
    namesakes: HashMap<Vec<u8>, Vec<u32>>,
    /// Names of record types that are declared more than once, in lower case.
    pub(super) duplicate_records: HashSet<Vec<u8>>,
    /// File, scope and name of the loop variables, until they are declared.
    loop_names: Vec<(u32, u32, u32)>,
}

impl Symbols {
    /// Whether a procedure of the files may be what a call by a computed name calls.
    pub(super) fn has_late_callee(&self, tree: &RapidTree<'_>, call: u32) -> bool {
        !self.missing_callees.contains(&NamePattern::of_call(tree, call))
    }

    /// Builds the symbol table of the files of one task and solves its side effects.
    pub fn collect(trees: &[RapidTree<'_>]) -> Symbols {
        let mut symbols = Symbols { scopes: vec![Scope::default()], ..Symbols::default() };
        for (file, tree) in trees.iter().enumerate() {
            symbols.declare_file(tree, file as u32);
        }
        symbols.declare_loop_variables(trees);
        symbols.collect_namesakes(trees);
        symbols.position_decisions = position_decisions(trees);
        symbols.solve_effects(trees);
        symbols.uses_position = symbols.may_use_position();
        let sets = |switch: Switch| !symbols.all_switches.is_unset(switch);
        let may_unmonitor = sets(Switch::ConfLinear) || sets(Switch::ConfJoint);
        symbols.tracks_motions = symbols.uses_position
            || !symbols.position_decisions.is_empty()
            || may_unmonitor
            || symbols.calls_motions();
        symbols
    }

    /// Resolves a name in a scope.
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
        match self.symbols[self.find(scope, name)? as usize].kind {
            SymbolKind::Routine(routine) => Some(routine),
            _ => None,
        }
    }

    /// The routines that a name may call: several where other modules declare it, of which the controller has loaded one.
    pub fn callees(&self, scope: u32, name: &[u8]) -> &[u32] {
        let Some(symbol) = self.find(scope, name).map(|symbol| &self.symbols[symbol as usize]) else {
            return &[];
        };
        let SymbolKind::Routine(routine) = &symbol.kind else { return &[] };
        if symbol.ambiguous && symbol.scope != self.module_scope(scope) {
            let name = folded(name);
            return self.namesakes.get(&name).map_or(std::slice::from_ref(routine), Vec::as_slice);
        }
        std::slice::from_ref(routine)
    }

    fn may_use_position(&self) -> bool {
        self.bodies.iter().any(|body| body.routine.is_none())
            || self.routines.iter().any(|routine| routine.effects.uses_position)
    }

    /// Whether anything calls a routine that moves the robot.
    fn calls_motions(&self) -> bool {
        let late = self.late_lists.iter().flatten().any(|routine| self.effects_of(*routine).moves);
        late || self
            .routines
            .iter()
            .any(|routine| routine.effects.moves && self.called[routine.body as usize])
    }

    /// Whether a routine is the entry of a program.
    pub fn is_main(&self, trees: &[RapidTree<'_>], routine: u32) -> bool {
        let routine = &self.routines[routine as usize];
        same_name(trees[routine.file as usize].text(routine.head.name), b"main")
    }

    /// The scope of the module around a scope.
    pub(super) fn module_scope(&self, scope: u32) -> u32 {
        let mut scope = scope;
        while let Some(parent) = self.scopes[scope as usize].parent.filter(|&parent| parent != 0) {
            scope = parent;
        }
        scope
    }

    /// The symbols that the statements of a body may write, sorted.
    pub fn written_in(&self, body: Body) -> &[u32] {
        self.body_index(body).and_then(|at| self.written.get(at)).map_or(&[], Vec::as_slice)
    }

    /// The calls among some nodes of a body that set a switch or call a routine of the program.
    pub fn switch_calls_in(&self, body: Body, nodes: std::ops::Range<u32>) -> &[u32] {
        let all =
            self.body_index(body).and_then(|at| self.switch_calls.get(at)).map_or(&[][..], Vec::as_slice);
        let first = all.partition_point(|&node| node < nodes.start);
        let end = all.partition_point(|&node| node < nodes.end);
        &all[first..end]
    }

    /// The routines that a body may call by a computed name.
    pub fn late_callees_of(&self, body: Body) -> &[u32] {
        self.body_index(body).map_or(&[], |at| &self.late_lists[self.late_list[at] as usize])
    }

    /// The switches set by the routines that a body may call by a computed name.
    pub fn late_switches_of(&self, body: Body) -> SwitchSet {
        self.body_index(body).map_or(SwitchSet::EMPTY, |at| self.late_switches[self.late_list[at] as usize])
    }

    /// The body of a routine.
    pub fn body_of(&self, routine: u32) -> u32 {
        self.routines[routine as usize].body
    }

    fn body_index(&self, body: Body) -> Option<usize> {
        match body.routine {
            Some(routine) => Some(self.routines[routine as usize].body as usize),
            None => self.bodies.iter().position(|other| (other.file, other.node) == (body.file, body.node)),
        }
    }

    /// Every declared name, in lower case.
    pub fn names(&self) -> impl Iterator<Item = &[u8]> {
        self.scopes.iter().flat_map(|scope| scope.names.keys().map(Vec::as_slice))
    }

    /// The symbols declared in a scope.
    pub fn declared_in(&self, scope: u32) -> impl Iterator<Item = u32> {
        self.scopes[scope as usize].names.values().copied()
    }

    /// A type name with aliases resolved.
    pub fn resolved_type<'a>(&'a self, scope: u32, type_name: &'a [u8]) -> &'a [u8] {
        let mut name = type_name;
        for _ in 0..16 {
            match self.find(scope, name).map(|symbol| &self.symbols[symbol as usize]) {
                Some(Symbol { kind: SymbolKind::Alias, type_name, .. }) => name = type_name,
                _ => break,
            }
        }
        name
    }

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

    fn declare_file(&mut self, tree: &RapidTree<'_>, file: u32) {
        let outside = self.new_scope(0);
        let mut loose = false;
        for node in tree.child_nodes(0) {
            if tree.nodes.kind(node) == Syntax::Module {
                let scope = self.new_scope(0);
                let name = parts(tree, node).find(|&part| token_kind(tree, part) == Some(Token::Ident));
                let name = name.map(|part| display(text_of(tree, part))).unwrap_or_default();
                let mut inside = false;
                for item in tree.child_nodes(node) {
                    inside |= !self.item(tree, file, scope, item, &name);
                }
                if inside {
                    self.collect_loop_variables(tree, file, scope, node);
                    self.bodies.push(Body { file, node, scope, routine: None });
                }
            } else {
                loose |= !self.item(tree, file, outside, node, "");
            }
        }
        if loose {
            self.collect_loop_variables(tree, file, outside, 0);
            self.bodies.push(Body { file, node: 0, scope: outside, routine: None });
        }
    }

    /// A declaration or routine; false for a statement.
    fn item(&mut self, tree: &RapidTree<'_>, file: u32, scope: u32, node: u32, module: &str) -> bool {
        let kind = tree.nodes.kind(node);
        match kind {
            Syntax::Data => self.declare_data(tree, file, scope, node, true),
            Syntax::Record | Syntax::Alias => self.declare_type(tree, file, scope, node),
            Syntax::Proc | Syntax::Func | Syntax::Trap => {
                self.declare_routine(tree, file, scope, node, module)
            }
            Syntax::Attributes | Syntax::Opaque | Syntax::Unwritten => {}
            _ => return false,
        }
        true
    }

    fn declare_data(&mut self, tree: &RapidTree<'_>, file: u32, scope: u32, node: u32, module_level: bool) {
        let Some(data) = data(tree, node) else { return };
        let type_name = folded(tree.text(data.type_name));
        let symbol = Symbol::new((file, scope), data.name, SymbolKind::Data(data), type_name);
        self.declare(tree.text(data.name), symbol, module_level && !data.local);
    }

    fn declare_type(&mut self, tree: &RapidTree<'_>, file: u32, scope: u32, node: u32) {
        let names = |node: u32| -> Vec<u32> {
            parts(tree, node)
                .filter_map(|part| match part {
                    Child::Token(token) if tree.kind(token) == Some(Token::Ident) => Some(token),
                    _ => None,
                })
                .collect()
        };
        let own = names(node);
        let (name, type_name, kind) = if tree.nodes.kind(node) == Syntax::Alias {
            let [type_name, name] = own[..] else { return };
            (name, folded(tree.text(type_name)), SymbolKind::Alias)
        } else {
            let [name] = own[..] else { return };
            let components = tree.child_nodes(node).filter_map(|component| match names(component)[..] {
                [type_name, name] => Some((folded(tree.text(name)), folded(tree.text(type_name)))),
                _ => None,
            });
            (name, Vec::new(), SymbolKind::Record(components.collect()))
        };
        let symbol = Symbol::new((file, scope), name, kind, type_name);
        self.declare(tree.text(name), symbol, true);
    }

    fn declare_routine(&mut self, tree: &RapidTree<'_>, file: u32, scope: u32, node: u32, module: &str) {
        let Some(head) = routine_head(tree, node) else { return };
        let inner = self.new_scope(scope);
        let index = self.routines.len() as u32;
        let text = tree.text(head.name);
        self.hides_instruction |= instruction::find(text).is_some();
        let symbol = Symbol::new((file, scope), head.name, SymbolKind::Routine(index), Vec::new());
        self.declare(text, symbol, !head.local);
        for parameter in &head.parameters {
            let type_name = folded(tree.text(parameter.type_name));
            let symbol = Symbol::new((file, inner), parameter.name, SymbolKind::Parameter, type_name);
            self.declare(tree.text(parameter.name), symbol.varying(), false);
        }
        for inside in node + 1..tree.nodes.subtree_end(node) {
            match tree.nodes.kind(inside) {
                Syntax::Data => self.declare_data(tree, file, inner, inside, false),
                Syntax::For => {
                    self.loop_names.extend(loop_name(tree, inside).map(|name| (file, inner, name)))
                }
                _ => {}
            }
        }
        let parameter_writes = vec![None; head.parameters.len()];
        let module = module.to_owned();
        let effects = SideEffects::default();
        let body = self.bodies.len() as u32;
        self.routines.push(RoutineScope {
            file,
            head,
            scope: inner,
            module,
            parameter_writes,
            effects,
            body,
        });
        self.bodies.push(Body { file, node, scope: inner, routine: Some(index) });
    }

    /// The variables of the loops of a fragment, outside routines.
    fn collect_loop_variables(&mut self, tree: &RapidTree<'_>, file: u32, scope: u32, node: u32) {
        let (mut at, end) = (node + 1, tree.nodes.subtree_end(node));
        while at < end {
            let kind = tree.nodes.kind(at);
            if kind.is_routine() || kind == Syntax::Module {
                at = tree.nodes.subtree_end(at);
                continue;
            }
            if kind == Syntax::For {
                self.loop_names.extend(loop_name(tree, at).map(|name| (file, scope, name)));
            }
            at += 1;
        }
    }

    /// Collects the routines that share a global name.
    fn collect_namesakes(&mut self, trees: &[RapidTree<'_>]) {
        for symbol in self.symbols.iter().filter(|symbol| symbol.ambiguous) {
            if let SymbolKind::Routine(routine) = symbol.kind {
                let name = folded(trees[symbol.file as usize].text(symbol.name));
                self.namesakes.entry(name).or_default().push(routine);
            }
        }
    }

    /// Declares loop variables in their routines where the name is free. One that hides other data within its loop is taken for
    /// that data, which the loop then writes; one that hides a constant hides it in the whole routine.
    fn declare_loop_variables(&mut self, trees: &[RapidTree<'_>]) {
        for (file, inner, name) in std::mem::take(&mut self.loop_names) {
            let text = trees[file as usize].text(name);
            let hides = self.find(inner, text).is_some_and(|found| {
                let found = &self.symbols[found as usize];
                matches!(found.kind, SymbolKind::Data(_) | SymbolKind::Parameter | SymbolKind::Loop)
                    && !found.is_constant()
            });
            if !hides {
                let symbol = Symbol::new((file, inner), name, SymbolKind::Loop, b"num".to_vec()).varying();
                let id = self.symbols.len() as u32;
                self.symbols.push(symbol);
                self.scopes[inner as usize].names.insert(folded(text), id);
            }
        }
    }

    /// The symbol with which a name or place begins.
    pub fn root(&self, tree: &RapidTree<'_>, scope: u32, place: Child) -> Option<u32> {
        let token = match place {
            Child::Token(token) => token,
            Child::Node(node) if tree.nodes.kind(node) == Syntax::Place => tree.nodes.first(node),
            Child::Node(_) => return None,
        };
        if tree.kind(token) != Some(Token::Ident) {
            return None;
        }
        self.find(scope, tree.text(token))
    }
}

/// The token that names the variable of a loop.
fn loop_name(tree: &RapidTree<'_>, node: u32) -> Option<u32> {
    let name = parts(tree, node).find(|&part| token_kind(tree, part) == Some(Token::Ident))?;
    if let Child::Token(name) = name { Some(name) } else { None }
}
