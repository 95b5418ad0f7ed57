//! The types of expressions, and the components of types.

use super::{Evaluator, functions};
use crate::rapid::symbol::{SymbolKind, Symbols};
use crate::rapid::syntax::{RapidTree, Syntax, expressions, parts, text_of, token_kind};
use crate::rapid::token::{Token, folded, same_name};
use crate::rapid::value::components;
use crate::tree::Child;

impl<'a, 's> Evaluator<'a, 's> {
    /// The type of an expression, aliases resolved; `None` for an aggregate, an array, and what the text does not tell.
    pub fn type_of(&self, (file, scope): (u32, u32), expression: Child) -> Option<Vec<u8>> {
        let tree = self.tree(file);
        let node = match expression {
            Child::Token(_) => {
                let (type_name, dimensions) = self.declared_type(tree, scope, expression)?;
                return (dimensions == 0).then_some(type_name);
            }
            Child::Node(node) => node,
        };
        let inner = || expressions(tree, node).next();
        match tree.nodes.kind(node) {
            Syntax::Paren => self.type_of((file, scope), inner()?),
            Syntax::Function => {
                let name = tree.text(tree.nodes.first(node));
                let Some(id) = self.symbols.find(scope, name) else {
                    return functions::result_type(&folded(name)).map(<[u8]>::to_vec);
                };
                let SymbolKind::Routine(routine) = self.symbols.symbols[id as usize].kind else {
                    return None;
                };
                let routine = &self.symbols.routines[routine as usize];
                let home = self.tree(routine.file);
                let first = parts(home, routine.head.node)
                    .find(|&part| token_kind(home, part) == Some(Token::Ident))?;
                let type_name = folded(text_of(home, first));
                Some(self.symbols.resolved_type(routine.scope, &type_name).to_vec())
            }
            Syntax::Place => {
                let mut steps = parts(tree, node);
                let (mut type_name, mut dimensions) = self.declared_type(tree, scope, steps.next()?)?;
                for step in steps {
                    match step {
                        Child::Node(index) => {
                            // An array that is a parameter does not state its dimensions.
                            dimensions = dimensions.saturating_sub(expressions(tree, index).count());
                        }
                        Child::Token(token) if tree.kind(token) == Some(Token::Ident) => {
                            type_name = self.component(scope, &type_name, tree.text(token))?.1;
                        }
                        Child::Token(_) => {}
                    }
                }
                (dimensions == 0).then(|| self.symbols.resolved_type(scope, &type_name).to_vec())
            }
            _ => None,
        }
    }

    /// The type of data, aliases resolved, and how many dimensions it has.
    fn declared_type(&self, tree: &RapidTree<'s>, scope: u32, name: Child) -> Option<(Vec<u8>, usize)> {
        let symbol = &self.symbols.symbols[self.symbols.root(tree, scope, name)? as usize];
        let dimensions = match &symbol.kind {
            SymbolKind::Data(data) => {
                data.dimensions.map_or(0, |node| expressions(self.tree(symbol.file), node).count())
            }
            SymbolKind::Parameter | SymbolKind::Loop => 0,
            _ => return None,
        };
        Some((self.symbols.resolved_type(symbol.scope, &symbol.type_name).to_vec(), dimensions))
    }

    /// The position and type of a component of a record type.
    pub fn component(&self, scope: u32, type_name: &[u8], name: &[u8]) -> Option<(usize, Vec<u8>)> {
        let type_name = self.symbols.resolved_type(scope, type_name);
        if let Some(list) = components(type_name) {
            let index = list.iter().position(|(component, _)| same_name(component.as_bytes(), name))?;
            return Some((index, list[index].1.as_bytes().to_vec()));
        }
        let list = self.record(scope, type_name)?;
        let index = list.iter().position(|(component, _)| same_name(component, name))?;
        Some((index, list[index].1.clone()))
    }

    /// Number of components of a record type.
    pub fn component_count(&self, scope: u32, type_name: &[u8]) -> Option<usize> {
        let type_name = self.symbols.resolved_type(scope, type_name);
        if let Some(list) = components(type_name) {
            return Some(list.len());
        }
        self.record(scope, type_name).map(|list| list.len())
    }

    /// The components of a record of the program; `None` where several modules declare one of this name: data of one may
    /// be used in another.
    fn record(&self, scope: u32, type_name: &[u8]) -> Option<&'a Vec<(Vec<u8>, Vec<u8>)>> {
        let symbols: &'a Symbols = self.symbols;
        match &symbols.symbols[symbols.find(scope, type_name)? as usize].kind {
            SymbolKind::Record(list) if !symbols.duplicate_records.contains(type_name) => Some(list),
            _ => None,
        }
    }
}
