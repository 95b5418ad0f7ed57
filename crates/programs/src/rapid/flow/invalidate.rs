//! Invalidation of known values: data that a statement writes, that callees may write, and that other tasks may write meanwhile.

use super::{AbstractState, CallSite, DISPLACEMENT, Interpreter};
use crate::dataflow::Transfer;
use crate::motion::Reason;
use crate::rapid::modal::{Switch, SwitchSet};
use crate::rapid::payload::Gripped;
use crate::rapid::predefined;
use crate::rapid::symbol::SymbolKind;
use crate::rapid::syntax::Syntax;
use crate::rapid::token::Token;
use crate::rapid::value::Value;

impl Interpreter<'_, '_, '_> {
    /// Invalidates everything that statements under a node may write: assignments, output arguments, side effects of callees.
    pub(super) fn invalidate_changed(&mut self, node: u32, state: &mut AbstractState) {
        let tree = &self.evaluator.trees[self.body.file as usize];
        let symbols = self.evaluator.symbols;
        for node in node..tree.nodes.subtree_end(node) {
            let kind = tree.nodes.kind(node);
            if !kind.may_change() {
                continue;
            }
            self.invalidate_written(node, state);
            let name = tree.text(tree.nodes.first(node));
            match kind {
                Syntax::LateCall => self.invalidate_nonlocal(state),
                Syntax::Call => self.invalidate_called(name, kind, state),
                Syntax::Function => {
                    if self.may_grip(node) {
                        state.gripped = Gripped::UNKNOWN;
                    }
                    for &routine in symbols.callees(self.body.scope, name) {
                        let sets = symbols.effects_of(routine).switches;
                        if self.resumes {
                            // RETRY may call it again after an error in it.
                            self.join_switches(sets, state);
                        }
                        self.join_switches(self.handler_switches, state);
                        let AbstractState { modal, gripped, .. } = *state;
                        self.visitor.record_call(CallSite { routine, modal, gripped });
                        self.join_switches(sets, state);
                    }
                    self.after_calls(symbols.callees(self.body.scope, name), true, state);
                    self.invalidate_called(name, kind, state);
                }
                _ => {}
            }
        }
    }

    /// Whether any statement or function under a node may change the gripped load.
    pub(super) fn may_grip_under(&self, node: u32) -> bool {
        let end = node + self.size(node);
        self.evaluator.symbols.states_loads && (node..end).any(|node| self.may_grip(node))
    }

    /// Whether a statement or function may change the gripped load.
    pub(super) fn may_grip(&self, node: u32) -> bool {
        let tree = &self.evaluator.trees[self.body.file as usize];
        let symbols = self.evaluator.symbols;
        let any_grips = |routines: &[u32]| routines.iter().any(|routine| symbols.effects_of(*routine).grips);
        let found = tree.nodes.get(node);
        match found.kind {
            Syntax::LateCall | Syntax::Opaque => true,
            Syntax::Call | Syntax::Function => {
                let name = tree.text(found.first);
                match symbols.callees(self.body.scope, name) {
                    [] if predefined::calls_by_name(name) => any_grips(symbols.late_callees_of(self.body)),
                    [] => found.kind == Syntax::Call && predefined::grips(name),
                    called => any_grips(called),
                }
            }
            _ => false,
        }
    }

    /// Invalidates what one statement or function writes, callees not counted.
    pub(super) fn invalidate_written(&self, node: u32, state: &mut AbstractState) {
        let tree = &self.evaluator.trees[self.body.file as usize];
        let symbols = self.evaluator.symbols;
        symbols
            .for_each_write(tree, self.body.scope, node, &mut |write| self.invalidate(write.symbol, state));
    }

    /// Invalidates data and its possible aliases.
    pub(super) fn invalidate(&self, symbol: u32, state: &mut AbstractState) {
        state.known.remove(&symbol);
        if self.aliases.is_empty() {
            return;
        }
        let symbols = &self.evaluator.symbols.symbols;
        if self.aliases.contains(&symbol) {
            self.invalidate_nonlocal(state);
        } else if symbols[symbol as usize].scope != self.body.scope {
            for alias in &self.aliases {
                state.known.remove(alias);
            }
        }
    }

    /// Invalidates the data that tasks share: another task may write it while this one waits.
    pub(super) fn invalidate_shared(&self, state: &mut AbstractState) {
        let symbols = &self.evaluator.symbols.symbols;
        state.known.retain(|&id, _| {
            symbols.get(id as usize).is_none_or(|symbol| match &symbol.kind {
                SymbolKind::Data(data) => data.storage != Token::Pers || data.local || data.task,
                _ => true,
            })
        });
    }

    /// Joins switches that may be set here.
    pub(super) fn join_switches(&self, sets: SwitchSet, state: &mut AbstractState) {
        state.modal = state.modal.join(sets);
        if !sets.is_unset(Switch::Displacement) {
            state.known.insert(DISPLACEMENT, Value::Unknown(Reason::Displacement));
        }
    }

    /// Invalidates what a routine or instruction may write apart from its arguments.
    pub(super) fn invalidate_called(&self, name: &[u8], kind: Syntax, state: &mut AbstractState) {
        let symbols = self.evaluator.symbols;
        if kind == Syntax::Call && symbols.is_motion(self.body.scope, name) {
            return;
        }
        let moves = match symbols.callees(self.body.scope, name) {
            called @ [_, ..] => {
                let mut moves = false;
                for &routine in called {
                    let effects = symbols.effects_of(routine);
                    for &symbol in &effects.writes {
                        self.invalidate(symbol, state);
                    }
                    if effects.writes_anything {
                        self.invalidate_nonlocal(state);
                    }
                    if effects.waits {
                        self.invalidate_shared(state);
                    }
                    moves |= effects.moves;
                }
                moves
            }
            [] if predefined::effect(name).is_some() => {
                if kind == Syntax::Call && predefined::calls_by_name(name) {
                    self.invalidate_nonlocal(state);
                }
                if predefined::waits(name) {
                    self.invalidate_shared(state);
                }
                state.reaching.elsewhere |= predefined::displaces(name).is_some();
                predefined::displaces(name).is_some()
            }
            [] => {
                self.invalidate_nonlocal(state);
                state.reaching.elsewhere = true;
                true
            }
        };
        if moves {
            state.previous = None;
        }
    }

    /// Invalidates everything declared outside the body, which unknown code may write.
    pub(super) fn invalidate_nonlocal(&self, state: &mut AbstractState) {
        let symbols = &self.evaluator.symbols.symbols;
        state.known.retain(|&id, _| {
            symbols.get(id as usize).is_none_or(|s| s.scope == self.body.scope) && !self.aliases.contains(&id)
        });
    }
}
