//! What is no longer known behind a statement: what it writes, what it calls may change, and what others may write meanwhile.

use super::{CallSite, DISPLACEMENT, State, Walk};
use crate::motion::Reason;
use crate::rapid::modal::{States, Which};
use crate::rapid::predefined;
use crate::rapid::symbol::What;
use crate::rapid::syntax::Syntax;
use crate::rapid::token::Token;
use crate::rapid::value::Value;

impl Walk<'_, '_, '_> {
    /// Forgets what anything under a node may change: assignments, arguments that come back changed, what called
    /// routines and functions do.
    pub(super) fn forget_changed(&mut self, node: u32, state: &mut State) {
        let tree = &self.evaluator.trees[self.unit.file as usize];
        let symbols = self.evaluator.symbols;
        for node in node..node + tree.nodes[node as usize].size {
            let kind = tree.nodes[node as usize].kind;
            if !kind.may_change() {
                continue;
            }
            self.forget_written(node, state);
            let name = tree.text(tree.nodes[node as usize].first);
            match kind {
                Syntax::LateCall => self.forget_outside(state),
                Syntax::Call => self.forget_called(name, kind, state),
                Syntax::Function => {
                    for &routine in symbols.called(self.unit.scope, name) {
                        let sets = symbols.routines[routine as usize].reach.sets;
                        if self.resumes {
                            // It may be called once more after an error in it.
                            self.may_set(sets, state);
                        }
                        self.may_set(self.handled, state);
                        self.visitor.called(CallSite { routine, modal: state.modal });
                        self.may_set(sets, state);
                    }
                    self.forget_called(name, kind, state);
                }
                _ => {}
            }
        }
    }

    /// Forgets what the expressions of a statement, such as its condition, may change.
    pub(super) fn forget_asked(&mut self, node: u32, state: &mut State) {
        let tree = &self.evaluator.trees[self.unit.file as usize];
        for asked in tree.child_nodes(node).filter(|&node| tree.nodes[node as usize].kind.is_expression()) {
            self.forget_changed(asked, state);
        }
    }

    /// Forgets what one statement or function writes by itself.
    pub(super) fn forget_written(&self, node: u32, state: &mut State) {
        let tree = &self.evaluator.trees[self.unit.file as usize];
        let symbols = self.evaluator.symbols;
        symbols.changed_by(tree, self.unit.scope, node, &mut |change| self.forget(change.symbol, state));
    }

    /// Forgets data, and what may be the same data by another name.
    pub(super) fn forget(&self, symbol: u32, state: &mut State) {
        state.known.remove(&symbol);
        if self.aliases.is_empty() {
            return;
        }
        let symbols = &self.evaluator.symbols.symbols;
        if self.aliases.contains(&symbol) {
            self.forget_outside(state);
        } else if symbols[symbol as usize].scope != self.unit.scope {
            for alias in &self.aliases {
                state.known.remove(alias);
            }
        }
    }

    /// Forgets the data that all tasks share: while this one waits, another may have written it.
    pub(super) fn forget_shared(&self, state: &mut State) {
        let symbols = &self.evaluator.symbols.symbols;
        state.known.retain(|&id, _| {
            symbols.get(id as usize).is_none_or(|symbol| match &symbol.what {
                What::Data(data) => data.storage != Token::Pers || data.local || data.task,
                _ => true,
            })
        });
    }

    /// Notes that switches may be set here, or not.
    pub(super) fn may_set(&self, sets: States, state: &mut State) {
        state.modal = state.modal.or(sets);
        if !sets.leaves(Which::Displacement) {
            state.known.insert(DISPLACEMENT, Value::Unknown(Reason::Displacement));
        }
    }

    /// Forgets what the routine or instruction of this name may change apart from its arguments.
    pub(super) fn forget_called(&self, name: &[u8], kind: Syntax, state: &mut State) {
        let symbols = self.evaluator.symbols;
        if kind == Syntax::Call && symbols.is_motion(self.unit.scope, name) {
            return;
        }
        let moves = match symbols.called(self.unit.scope, name) {
            called @ [_, ..] => {
                let mut moves = false;
                for &routine in called {
                    let reach = &symbols.routines[routine as usize].reach;
                    for &symbol in &reach.changes {
                        self.forget(symbol, state);
                    }
                    if reach.anything {
                        self.forget_outside(state);
                    }
                    if reach.waits {
                        self.forget_shared(state);
                    }
                    moves |= reach.moves;
                }
                moves
            }
            [] if predefined::effect(name).is_some() => {
                if kind == Syntax::Call && predefined::calls_by_name(name) {
                    self.forget_outside(state);
                }
                if predefined::waits(name) {
                    self.forget_shared(state);
                }
                predefined::displaces(name).is_some()
            }
            [] => {
                self.forget_outside(state);
                true
            }
        };
        if moves {
            state.previous = None;
        }
    }

    /// A routine that is not known here may change everything that is declared outside this one.
    pub(super) fn forget_outside(&self, state: &mut State) {
        let symbols = &self.evaluator.symbols.symbols;
        state.known.retain(|&id, _| {
            symbols.get(id as usize).is_none_or(|s| s.scope == self.unit.scope) && !self.aliases.contains(&id)
        });
    }
}
