//! Uses of declared targets: by motions, and all other uses that an edit of the declaration would affect.

use super::ListingBuilder;
use crate::motion::{MotionKind, Origin, OtherUse};
use crate::rapid::symbol::{Body, SymbolKind};
use crate::rapid::syntax::{RapidTree, Syntax, arguments, token_kind, tokens_of};
use crate::rapid::token::{Token, fold, same_name};

impl<'s> ListingBuilder<'_, 's> {
    /// Finds every use of the listed declarations that is not a motion's target argument.
    pub(super) fn other_uses(&mut self) {
        for (index, motion) in self.listing.motions.iter().enumerate() {
            for (target_index, target) in motion.targets.iter().enumerate() {
                if let Origin::Declared(declaration) | Origin::Element { declaration, .. } = target.origin {
                    let uses = &mut self.listing.declarations[declaration as usize].uses;
                    uses.push((index as u32, target_index as u32));
                }
            }
        }
        if self.declarations.is_empty() {
            return;
        }
        // A hash of the first and last byte rejects most names at once.
        let mut likely = vec![false; 1 << 16];
        let hash = |text: &[u8]| {
            let ends = [text[0], text[text.len() - 1]].map(|byte| usize::from(fold(byte)));
            (ends[0] << 8 | ends[1]) ^ text.len() << 4 & 0xFFFF
        };
        for &symbol in self.declarations.keys().collect::<std::collections::BTreeSet<_>>() {
            let symbol = &self.symbols.symbols[symbol as usize];
            likely[hash(self.trees[symbol.file as usize].text(symbol.name))] = true;
        }
        // A use at the first byte of a target argument is the motion's own; any other within it is part of an expression.
        for (body_index, body) in self.symbols.bodies.iter().enumerate() {
            let tree = &self.trees[body.file as usize];
            // Motions are listed body by body.
            let first = self.bodies.partition_point(|&body| body < body_index as u32) as u32;
            let end = self.bodies.partition_point(|&body| body <= body_index as u32) as u32;
            let motions: Vec<u32> = (first..end).collect();
            self.uses_in(*body, tree, &motions, &likely, &hash);
        }
        self.uses_in_declarations(&likely, &hash);
        self.uses_by_name();
    }

    /// GetDataVal with a computed name may read any of them.
    fn uses_by_name(&mut self) {
        for (file, tree) in (0..).zip(self.trees) {
            let reads = |node: &u32| {
                let node = tree.nodes.get(*node);
                node.kind == Syntax::Call && same_name(tree.text(node.first), b"GetDataVal")
            };
            let computed = |node: &u32| {
                let name = arguments(tree, *node).find(|argument| !argument.optional);
                name.and_then(|name| name.value).and_then(|name| token_kind(tree, name))
                    != Some(Token::String)
            };
            // One per file suffices.
            if let Some(node) = (0..tree.nodes.len()).filter(reads).find(computed) {
                let place = self.place(file, tree.nodes.first(node));
                for declaration in &mut self.listing.declarations {
                    declaration.other_uses.push(OtherUse { motion: None, place });
                }
            }
        }
    }

    pub(super) fn uses_in(
        &mut self,
        body: Body,
        tree: &RapidTree<'s>,
        motions: &[u32],
        likely: &[bool],
        hash: &dyn Fn(&[u8]) -> usize,
    ) {
        let node = tree.nodes.get(body.node);
        let mut next = 0;
        for token in node.first..node.end {
            // A string may be the name that GetDataVal reads.
            let name = match (tree.kind(token), tree.text(token)) {
                (Some(Token::Ident), name) => name,
                (Some(Token::String), [_, name @ .., _]) if !name.is_empty() => name,
                _ => continue,
            };
            if !likely[hash(name)] {
                continue;
            }
            let Some(symbol) = self.symbols.find(body.scope, name) else { continue };
            let Some(&declaration) = self.declarations.get(&symbol) else { continue };
            let found = &self.symbols.symbols[symbol as usize];
            if found.file == body.file && found.name == token {
                continue;
            }
            let start = tree.start(token) as u32;
            while motions
                .get(next)
                .is_some_and(|&motion| self.listing.motions[motion as usize].statement.end <= start)
            {
                next += 1;
            }
            let user = motions.get(next).and_then(|&index| {
                let motion = &self.listing.motions[index as usize];
                motion
                    .targets
                    .iter()
                    .position(|target| (target.argument.start..target.argument.end).contains(&start))
                    .map(|target| (index, target as u32))
            });
            let own = user.is_some_and(|(motion, target)| {
                let target = &self.listing.motions[motion as usize].targets[target as usize];
                matches!(target.origin, Origin::Declared(_) | Origin::Element { .. })
                    && target.argument.start == start
            });
            if !own {
                let computed = user.filter(|&(motion, target)| {
                    let motion = &self.listing.motions[motion as usize];
                    motion.kind != MotionKind::Unknown
                        && match motion.targets[target as usize].origin {
                            Origin::Computed => true,
                            Origin::Offset(offset) => {
                                let base = self.listing.offsets[offset as usize].base;
                                (base.start..base.end).contains(&start)
                            }
                            _ => false,
                        }
                });
                let place = self.place(body.file, token);
                let uses = &mut self.listing.declarations[declaration as usize].other_uses;
                uses.push(OtherUse { motion: computed, place });
            }
        }
    }

    /// Uses in the initial values of other declarations at module level.
    pub(super) fn uses_in_declarations(&mut self, likely: &[bool], hash: &dyn Fn(&[u8]) -> usize) {
        for symbol in &self.symbols.symbols {
            let SymbolKind::Data(data) = &symbol.kind else { continue };
            let tree = &self.trees[symbol.file as usize];
            let Some(value) = data.value else { continue };
            let (first, end) = tokens_of(tree, value);
            if end - first > 1
                && tree.kinds()[first as usize..end as usize].iter().all(|&kind| kind != Token::Ident)
            {
                continue;
            }
            for token in first..end {
                if tree.kind(token) != Some(Token::Ident) || !likely[hash(tree.text(token))] {
                    continue;
                }
                let Some(used) = self.symbols.find(symbol.scope, tree.text(token)) else { continue };
                if let Some(&declaration) = self.declarations.get(&used) {
                    let place = self.place(symbol.file, token);
                    let uses = &mut self.listing.declarations[declaration as usize].other_uses;
                    uses.push(OtherUse { motion: None, place });
                }
            }
        }
    }
}
