//! Reads of the robot's position (CRobT, CPos, CJointT) by which a program decides: in a condition, a result, an argument of a routine
//! of the program, or data that occur in one. At the corrected end of a motion they read another place than the text states.

use std::collections::{BTreeSet, HashMap, HashSet};

use crate::rapid::instruction;
use crate::rapid::predefined;
use crate::rapid::syntax::{RapidTree, Syntax, parts, token_kind};
use crate::rapid::token::{Token, folded, same_name};
use crate::tree::Child;

/// File and node of each function that reads the position for a decision.
pub(super) fn position_decisions(trees: &[RapidTree<'_>]) -> BTreeSet<(u32, u32)> {
    let reads = |tree: &RapidTree<'_>, node: u32| {
        tree.nodes.kind(node) == Syntax::Function && is_position(tree.text(tree.nodes.first(node)))
    };
    let all = |tree: &RapidTree<'_>| (0..tree.nodes.len()).filter(|&node| reads(tree, node)).collect();
    let found: Vec<Vec<u32>> = trees.iter().map(all).collect();
    if found.iter().all(Vec::is_empty) {
        return BTreeSet::new();
    }
    let deciding = deciding_names(trees);
    let mut out = BTreeSet::new();
    for ((file, tree), found) in (0..).zip(trees).zip(found) {
        let mut add = |node: u32| {
            let first = found.partition_point(|read| *read < node);
            let reads = found[first..].iter().take_while(|read| **read < tree.nodes.subtree_end(node));
            out.extend(reads.map(|read| (file, *read)));
        };
        for node in 0..tree.nodes.len() {
            match tree.nodes.kind(node) {
                Syntax::Assignment => {
                    if assigned(tree, node).is_some_and(|name| deciding.contains(&folded(name))) {
                        add(node);
                    }
                }
                _ => deciding_parts(tree, node).into_iter().for_each(|part| {
                    if let Child::Node(part) = part {
                        add(part);
                    }
                }),
            }
        }
    }
    out
}

/// The names, in lower case, of data by which a program decides, or from which such data are computed.
fn deciding_names(trees: &[RapidTree<'_>]) -> HashSet<Vec<u8>> {
    let mut names = HashSet::new();
    let mut assignments: HashMap<Vec<u8>, Vec<(&RapidTree<'_>, u32)>> = HashMap::new();
    for tree in trees {
        for node in 0..tree.nodes.len() {
            if tree.nodes.kind(node) == Syntax::Assignment {
                if let Some(name) = assigned(tree, node) {
                    assignments.entry(folded(name)).or_default().push((tree, node));
                }
            } else {
                deciding_parts(tree, node).into_iter().for_each(|part| names_in(tree, part, &mut names));
            }
        }
    }
    let mut open: Vec<Vec<u8>> = names.iter().cloned().collect();
    while let Some(name) = open.pop() {
        for (tree, node) in assignments.remove(&name).unwrap_or_default() {
            let mut from = HashSet::new();
            deciding_parts(tree, node).into_iter().for_each(|part| names_in(tree, part, &mut from));
            open.extend(from.into_iter().filter(|name| names.insert(name.clone())));
        }
    }
    names
}

/// Whether a predefined function of this name reads where the robot stands.
fn is_position(name: &[u8]) -> bool {
    [&b"CRobT"[..], b"CPos", b"CJointT"].iter().any(|known| same_name(name, known))
}

/// The expressions of a statement by which the program decides or that it hands on.
fn deciding_parts(tree: &RapidTree<'_>, node: u32) -> Vec<Child> {
    let is_operand = |part: &Child| match *part {
        Child::Node(node) => tree.nodes.kind(node).is_expression(),
        Child::Token(token) => tree.kind(token) == Some(Token::Ident),
    };
    match tree.nodes.kind(node) {
        Syntax::Branch
        | Syntax::If
        | Syntax::CompactIf
        | Syntax::While
        | Syntax::For
        | Syntax::Test
        | Syntax::Case
        | Syntax::Return => parts(tree, node).filter(is_operand).collect(),
        Syntax::Assignment => parts(tree, node)
            .skip_while(|&part| token_kind(tree, part) != Some(Token::Assign))
            .filter(is_operand)
            .collect(),
        Syntax::Call if is_own_call(tree, node) => tree.child_nodes(node).map(Child::Node).collect(),
        _ => Vec::new(),
    }
}

/// Whether a call is of a routine of the program.
fn is_own_call(tree: &RapidTree<'_>, node: u32) -> bool {
    let name = tree.text(tree.nodes.first(node));
    predefined::effect(name).is_none() && instruction::find(name).is_none()
}

/// The name of the data that an assignment changes.
fn assigned<'t>(tree: &'t RapidTree<'_>, node: u32) -> Option<&'t [u8]> {
    let token = match parts(tree, node).next()? {
        Child::Token(token) => token,
        Child::Node(place) => tree.nodes.first(place),
    };
    Some(tree.text(token))
}

/// Adds every name in an expression, in lower case.
fn names_in(tree: &RapidTree<'_>, part: Child, names: &mut HashSet<Vec<u8>>) {
    let tokens = match part {
        Child::Token(token) => token..token + 1,
        Child::Node(node) => {
            let node = tree.nodes.get(node);
            node.first..node.end
        }
    };
    names.extend(
        tokens.filter(|&token| tree.kind(token) == Some(Token::Ident)).map(|token| folded(tree.text(token))),
    );
}
