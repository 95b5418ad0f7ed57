//! Targets written as numbers in motion instructions. No statement changes their values, so they are read on other threads
//! during the interpretation.

use rayon::prelude::*;

use super::super::evaluate::target::ValueOrigin;
use super::super::evaluate::{Context, Evaluator, Known};
use super::super::instruction::{self, INSTRUCTIONS};
use super::super::symbol::Symbols;
use super::super::syntax::{RapidTree, Syntax, arguments};
use super::super::token::Token;
use crate::motion::{MotionTarget, Origin, Role};
use crate::tree::Child;

/// Nodes that one thread processes at a time.
const CHUNK: u32 = 1 << 14;

/// About as many nodes as a motion with its target written out has, or fewer.
pub(super) const NODES_PER_MOTION: usize = 14;

/// The targets, by file and chunk of the call, in the order of nodes.
pub(super) struct Literals {
    read: Vec<Vec<Vec<Read>>>,
}

#[derive(Debug)]
struct Read {
    node: u32,
    joints: bool,
    target: MotionTarget,
}

impl Literals {
    /// Reads the literals in motion instructions.
    pub(super) fn of(trees: &[RapidTree<'_>], symbols: &Symbols) -> Self {
        let files = trees.par_iter().enumerate().map(|(file, tree)| {
            let chunks = 0..tree.nodes.len().div_ceil(CHUNK);
            chunks.into_par_iter().map(|chunk| read(trees, symbols, file as u32, chunk)).collect()
        });
        Literals { read: files.collect() }
    }

    /// The target of the literal at `node` in the call at `call`; `None` where it was not read. `last`: where in its chunk the
    /// last one was found: the next one usually follows it.
    pub(super) fn target(
        &self,
        file: u32,
        call: u32,
        node: u32,
        joints: bool,
        last: &mut usize,
    ) -> Option<MotionTarget> {
        let chunk = self.read.get(file as usize)?.get((call / CHUNK) as usize)?;
        let next = [*last + 1, 0].into_iter().find(|at| chunk.get(*at).is_some_and(|read| read.node == node));
        let at = next.or_else(|| chunk.binary_search_by_key(&node, |read| read.node).ok())?;
        *last = at;
        Some(&chunk[at]).filter(|read| read.joints == joints).map(|read| read.target)
    }
}

fn read(trees: &[RapidTree<'_>], symbols: &Symbols, file: u32, chunk: u32) -> Vec<Read> {
    let tree = &trees[file as usize];
    let evaluator = Evaluator::new(trees, symbols);
    let first = chunk * CHUNK;
    let end = (first + CHUNK).min(tree.nodes.len());
    let mut out = Vec::with_capacity(CHUNK as usize / NODES_PER_MOTION);
    for call in first..end {
        let found = tree.nodes.get(call);
        if found.kind != Syntax::Call {
            continue;
        }
        let Some(known) = instruction::find(tree.text(found.first)) else { continue };
        let joints = INSTRUCTIONS[known].takes_joints();
        for argument in arguments(tree, call).filter(|argument| !argument.optional) {
            if let Some(node) = argument.value.and_then(|value| plain(tree, value)) {
                out.push(Read { node, joints, target: target(&evaluator, file, node, joints) });
            }
        }
    }
    out
}

/// An aggregate of numbers as a motion's target.
pub(super) fn target(evaluator: &Evaluator<'_, '_>, file: u32, node: u32, joints: bool) -> MotionTarget {
    let nothing = Known::new();
    // It contains no name: any scope serves.
    let (value, source) = evaluator.target(Context::new(file, 0, &nothing), Child::Node(node), joints);
    let origin = match source {
        ValueOrigin::Inline => Origin::Inline,
        ValueOrigin::Computed => Origin::Computed,
        _ => Origin::Unknown,
    };
    let argument = evaluator.trees[file as usize].node_span(node);
    MotionTarget { role: Role::To, value, origin, argument }
}

/// The node of an argument that is an aggregate of numbers alone.
pub(super) fn plain(tree: &RapidTree<'_>, argument: Child) -> Option<u32> {
    let Child::Node(node) = argument else { return None };
    let found = tree.nodes.get(node);
    if found.kind != Syntax::Aggregate {
        return None;
    }
    // All sixty tokens of a target at once, without a branch for each: the compiler compares them sixteen at a time.
    let number = |all: bool, kind: &Token| {
        let part = kind.is_trivia()
            | (*kind == Token::Number)
            | (*kind == Token::Comma)
            | (*kind == Token::BracketOpen)
            | (*kind == Token::BracketClose)
            | (*kind == Token::Minus);
        all & part
    };
    let tokens = &tree.kinds()[found.first as usize..found.end as usize];
    tokens.iter().fold(true, number).then_some(node)
}
