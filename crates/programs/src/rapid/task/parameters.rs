//! Tools and work objects that are parameters of a routine: known where every call hands over the same data.
//!
//! Method: all calls of the files are visited once; an argument that is a parameter itself stands for what its own routine's callers hand
//! over. Nothing is known of a routine that something else may call: a computed name, an interrupt, a missing part of the program, or text
//! that could not be read.

use std::collections::HashMap;

use crate::rapid::symbol::{SymbolKind, Symbols};
use crate::rapid::syntax::{RapidTree, Syntax, arguments};
use crate::rapid::token::{Token, folded, same_name};
use crate::tree::Child;

/// For each parameter, by symbol, the data that every call hands over.
pub(super) type PassedData = HashMap<u32, u32>;

/// What the calls of a routine hand over for one parameter, each symbol once; `None` where one of them is no name or there are many.
type Arguments = Option<Vec<u32>>;

/// Most symbols that the calls of a routine hand over; parameters of its callers among them.
const MAX_SYMBOLS: usize = 4;

/// Most routines through which one argument is handed on.
const DEPTH: usize = 6;

pub(super) fn of(trees: &[RapidTree<'_>], symbols: &Symbols, mains: &[u32]) -> PassedData {
    if trees.iter().any(|tree| !tree.opaque.is_empty()) {
        return PassedData::new();
    }
    let parameters = frame_parameters(trees, symbols, mains);
    if parameters.iter().all(Vec::is_empty) {
        return PassedData::new();
    }
    let mut found: HashMap<u32, Arguments> = HashMap::new();
    for body in &symbols.bodies {
        let tree = &trees[body.file as usize];
        let nodes = body.node..tree.nodes.subtree_end(body.node);
        for call in nodes.filter(|node| tree.nodes.kind(*node) == Syntax::Call) {
            let callees = symbols.callees(body.scope, tree.text(tree.nodes.first(call)));
            for (callee, is_alone) in callees.iter().map(|callee| (*callee, callees.len() == 1)) {
                for &(position, parameter) in &parameters[callee as usize] {
                    let data = argument(tree, symbols, body.scope, (call, callee, position), trees);
                    let all = found.entry(parameter).or_insert_with(|| Some(Vec::new()));
                    match (data.filter(|_| is_alone), &mut *all) {
                        (Some(data), Some(known)) if known.contains(&data) => {}
                        (Some(data), Some(known)) if known.len() < MAX_SYMBOLS => known.push(data),
                        _ => *all = None,
                    }
                }
            }
        }
    }
    let all = found.keys();
    all.filter_map(|parameter| Some((*parameter, resolved(*parameter, &found, symbols, DEPTH)?))).collect()
}

/// The data that a symbol always stands for.
fn resolved(symbol: u32, found: &HashMap<u32, Arguments>, symbols: &Symbols, depth: usize) -> Option<u32> {
    let Some(arguments) = found.get(&symbol) else {
        return is_fixed_data(symbols, symbol).then_some(symbol);
    };
    let depth = depth.checked_sub(1)?;
    let mut all = arguments.as_ref()?.iter().map(|argument| resolved(*argument, found, symbols, depth));
    let first = all.next()??;
    all.all(|other| other == Some(first)).then_some(first)
}

/// By routine: the tools and work objects among its required parameters, as position and symbol, which it does not change and which only
/// calls in the files hand over.
fn frame_parameters(trees: &[RapidTree<'_>], symbols: &Symbols, mains: &[u32]) -> Vec<Vec<(usize, u32)>> {
    let of_routine = |(routine, scope): (u32, &crate::rapid::symbol::RoutineScope)| {
        let is_open = mains.is_empty() && !scope.head.local;
        let is_late = symbols.late_lists.iter().any(|list| list.contains(&routine));
        if is_open || is_late || symbols.interrupts[routine as usize] {
            return Vec::new();
        }
        let tree = &trees[scope.file as usize];
        let is_kept = |index: usize| scope.parameter_writes.get(index).is_none_or(Option::is_none);
        let all = scope.head.parameters.iter().enumerate();
        let required = all.filter(|(_, parameter)| !parameter.optional).enumerate();
        let frames = required.filter_map(|(position, (index, parameter))| {
            let type_name = folded(tree.text(parameter.type_name));
            let is_frame =
                matches!(symbols.resolved_type(scope.scope, &type_name), b"tooldata" | b"wobjdata");
            let symbol = symbols.find(scope.scope, tree.text(parameter.name))?;
            let is_parameter = matches!(symbols.symbols[symbol as usize].kind, SymbolKind::Parameter);
            (is_frame && !parameter.array && is_parameter && is_kept(index)).then_some((position, symbol))
        });
        frames.collect()
    };
    (0_u32..).zip(&symbols.routines).map(of_routine).collect()
}

/// The symbol that a call hands over at a position among the required arguments; `None` for anything but a name.
fn argument(
    tree: &RapidTree<'_>,
    symbols: &Symbols,
    scope: u32,
    (call, callee, position): (u32, u32, usize),
    trees: &[RapidTree<'_>],
) -> Option<u32> {
    let head = &symbols.routines[callee as usize];
    let home = &trees[head.file as usize];
    let wanted = home.text(head.head.parameters.iter().filter(|p| !p.optional).nth(position)?.name);
    let required = arguments(tree, call).filter(|argument| !argument.optional);
    let value = required.enumerate().find_map(|(index, argument)| {
        let is_wanted = match argument.name {
            Some(name) => same_name(tree.text(name), wanted),
            None => index == position,
        };
        argument.value.filter(|_| is_wanted)
    })?;
    match value {
        Child::Token(token) if tree.kind(token) == Some(Token::Ident) => {
            symbols.find(scope, tree.text(token))
        }
        _ => None,
    }
}

/// Whether a symbol is data that nothing assigns.
fn is_fixed_data(symbols: &Symbols, symbol: u32) -> bool {
    let symbol = &symbols.symbols[symbol as usize];
    let is_one = matches!(&symbol.kind, SymbolKind::Data(data) if data.dimensions.is_none());
    is_one && !symbol.assigned && !symbol.volatile && !symbol.ambiguous
}
