//! Which procedures a computed name may call: told by the text at its beginning and end, and by the number of arguments.
//!
//! Method: every name twice in order, as it is and from its end; a pattern looks at the shorter of the two stretches that
//! fit it. Equal patterns, and units with the same patterns, share one list.

use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

use super::Symbols;
use crate::rapid::syntax::{RapidTree, Syntax, parts};
use crate::rapid::token::{Token, fold, folded};
use crate::tree::Child;

/// More patterns than this are not compared with each other.
const COMPARED: usize = 64;

/// What the text tells of a computed name.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct Named {
    begins: Vec<u8>,
    ends: Vec<u8>,
    /// Whether `begins` is all of it.
    whole: bool,
    /// How many required arguments are given.
    given: usize,
}

impl Named {
    /// Of an expression of text; `numbered` where a number is added to it.
    pub(super) fn by(tree: &RapidTree<'_>, (name, given, numbered): (Option<Child>, usize, bool)) -> Named {
        let text = |part: Child| match part {
            Child::Token(token) if tree.kind(token) == Some(Token::String) => {
                let text = tree.text(token);
                text.get(1..text.len() - 1).map(folded)
            }
            _ => None,
        };
        let (mut begins, mut ends, mut whole) = (None, None, false);
        match name {
            Some(Child::Node(node)) if tree.nodes[node as usize].kind == Syntax::Binary => {
                begins = parts(tree, node).next().and_then(text);
                ends = parts(tree, node).last().and_then(text).filter(|_| !numbered);
            }
            Some(part) => {
                begins = text(part);
                whole = begins.is_some() && !numbered;
            }
            None => {}
        }
        Named { begins: begins.unwrap_or_default(), ends: ends.unwrap_or_default(), whole, given }
    }

    fn fits(&self, name: &[u8]) -> bool {
        if self.whole {
            *name == self.begins[..]
        } else {
            name.starts_with(&self.begins) && name.ends_with(&self.ends)
        }
    }

    /// Whether every name that fits the other fits this.
    fn covers(&self, other: &Named) -> bool {
        !self.whole
            && self.given == other.given
            && other.begins.starts_with(&self.begins)
            && if other.whole { other.begins.ends_with(&self.ends) } else { other.ends.ends_with(&self.ends) }
    }
}

/// The procedures by their names, with and without that of the module.
pub(super) struct Names {
    forward: Vec<(Vec<u8>, u32)>,
    backward: Vec<(Vec<u8>, u32)>,
    /// Required parameters of each routine.
    required: Vec<usize>,
    found: HashMap<BTreeSet<Named>, Arc<[u32]>>,
}

impl Names {
    pub(super) fn of(symbols: &Symbols, trees: &[RapidTree<'_>]) -> Names {
        let mut forward = Vec::new();
        let mut required = Vec::new();
        for (at, routine) in (0..).zip(&symbols.routines) {
            required.push(routine.head.parameters.iter().filter(|parameter| !parameter.optional).count());
            if routine.head.kind == Syntax::Proc {
                let name = folded(trees[routine.file as usize].text(routine.head.name));
                let module: Vec<u8> = routine.module.bytes().map(fold).collect();
                forward.push(([&module[..], b":", &name[..]].concat(), at));
                forward.push((name, at));
            }
        }
        let turned = |name: &Vec<u8>| name.iter().rev().copied().collect();
        let mut backward: Vec<(Vec<u8>, u32)> =
            forward.iter().map(|(name, at)| (turned(name), *at)).collect();
        forward.sort_unstable();
        backward.sort_unstable();
        Names { forward, backward, required, found: HashMap::new() }
    }

    /// The procedures that any of the patterns may mean, in order.
    pub(super) fn all(&mut self, patterns: &BTreeSet<Named>) -> Arc<[u32]> {
        let few = patterns.len() <= COMPARED;
        let covered = |one: &Named| {
            few && patterns
                .iter()
                .any(|other| other != one && other.covers(one) && !(one.covers(other) && other > one))
        };
        let least: BTreeSet<Named> = patterns.iter().filter(|one| !covered(one)).cloned().collect();
        if let Some(found) = self.found.get(&least) {
            return found.clone();
        }
        let mut all: Vec<u32> = least.iter().flat_map(|one| self.one(one)).collect();
        all.sort_unstable();
        all.dedup();
        let all: Arc<[u32]> = all.into();
        self.found.insert(least, all.clone());
        all
    }

    fn one(&self, named: &Named) -> Vec<u32> {
        let forward = stretch(&self.forward, &named.begins);
        let end: Vec<u8> = named.ends.iter().rev().copied().collect();
        let backward = stretch(&self.backward, &end);
        let takes = |at: &u32| self.required[*at as usize] == named.given;
        if forward.len() <= backward.len() {
            let fit = forward.iter().filter(|(name, at)| takes(at) && named.fits(name));
            fit.map(|(_, at)| *at).collect()
        } else {
            let turned = |name: &Vec<u8>| -> Vec<u8> { name.iter().rev().copied().collect() };
            let fit = backward.iter().filter(|(name, at)| takes(at) && named.fits(&turned(name)));
            fit.map(|(_, at)| *at).collect()
        }
    }
}

/// The names that begin so.
fn stretch<'n>(names: &'n [(Vec<u8>, u32)], begins: &[u8]) -> &'n [(Vec<u8>, u32)] {
    let first = names.partition_point(|(name, _)| &name[..] < begins);
    let long = names[first..].partition_point(|(name, _)| name.starts_with(begins));
    &names[first..first + long]
}
