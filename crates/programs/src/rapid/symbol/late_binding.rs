//! Late binding: which procedures a computed name may call, from the text at its beginning and end and the number of arguments.
//!
//! Method: all names sorted twice, forwards and reversed; a pattern scans the shorter of its two matching ranges. Equal
//! patterns, and bodies with the same patterns, share one list.

use std::collections::{BTreeSet, HashMap};

use super::Symbols;
use super::computed_name::NamePattern;
use crate::rapid::syntax::{RapidTree, RoutineHead, Syntax};
use crate::rapid::token::{fold, folded};

/// Most patterns that are checked for one covering another.
const MAX_COMPARED: usize = 64;

/// How many arguments a routine requires.
fn required(head: &RoutineHead) -> usize {
    head.parameters.iter().filter(|parameter| !parameter.optional).count()
}

/// The procedures by name, with and without the module name.
pub(super) struct ProcedureIndex {
    forward: Vec<(Vec<u8>, u32)>,
    backward: Vec<(Vec<u8>, u32)>,
    /// Required parameters of each routine.
    required: Vec<usize>,
    found: HashMap<BTreeSet<NamePattern>, u32>,
    /// The routines that match, sorted, for each set of patterns.
    pub(super) lists: Vec<Vec<u32>>,
}

impl ProcedureIndex {
    pub(super) fn of(symbols: &Symbols, trees: &[RapidTree<'_>]) -> ProcedureIndex {
        let mut forward = Vec::new();
        let mut required_of = Vec::new();
        for (at, routine) in (0..).zip(&symbols.routines) {
            required_of.push(required(&routine.head));
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
        ProcedureIndex { forward, backward, required: required_of, found: HashMap::new(), lists: Vec::new() }
    }

    /// The procedures that match any of the patterns: index into `lists`.
    pub(super) fn matches(&mut self, patterns: &BTreeSet<NamePattern>) -> u32 {
        let few = patterns.len() <= MAX_COMPARED;
        let covered = |one: &NamePattern| {
            few && patterns
                .iter()
                .any(|other| other != one && other.covers(one) && !(one.covers(other) && other > one))
        };
        let least: BTreeSet<NamePattern> = patterns.iter().filter(|one| !covered(one)).cloned().collect();
        if let Some(&found) = self.found.get(&least) {
            return found;
        }
        let mut all: Vec<u32> = least.iter().flat_map(|one| self.match_one(one)).collect();
        all.sort_unstable();
        all.dedup();
        let list = self.lists.len() as u32;
        self.lists.push(all);
        self.found.insert(least, list);
        list
    }

    /// The patterns that no procedure matches.
    pub(super) fn without_match<'p>(
        &self,
        patterns: impl Iterator<Item = &'p NamePattern>,
    ) -> BTreeSet<NamePattern> {
        let all: BTreeSet<&NamePattern> = patterns.collect();
        all.into_iter().filter(|one| self.match_one(one).is_empty()).cloned().collect()
    }

    fn match_one(&self, pattern: &NamePattern) -> Vec<u32> {
        let forward = prefix_range(&self.forward, &pattern.prefix);
        let end: Vec<u8> = pattern.suffix.iter().rev().copied().collect();
        let backward = prefix_range(&self.backward, &end);
        let takes = |at: &u32| self.required[*at as usize] == pattern.given;
        if forward.len() <= backward.len() {
            let fit = forward.iter().filter(|(name, at)| takes(at) && pattern.matches(name));
            fit.map(|(_, at)| *at).collect()
        } else {
            let turned = |name: &Vec<u8>| -> Vec<u8> { name.iter().rev().copied().collect() };
            let fit = backward.iter().filter(|(name, at)| takes(at) && pattern.matches(&turned(name)));
            fit.map(|(_, at)| *at).collect()
        }
    }
}

/// The names with a prefix.
fn prefix_range<'n>(names: &'n [(Vec<u8>, u32)], prefix: &[u8]) -> &'n [(Vec<u8>, u32)] {
    let first = names.partition_point(|(name, _)| &name[..] < prefix);
    let long = names[first..].partition_point(|(name, _)| name.starts_with(prefix));
    &names[first..first + long]
}
