//! The least facts that hold along the edges of a graph: side effects flow from callees to callers, states at entry from callers to
//! callees. A worklist in reverse post-order.

use std::collections::BTreeSet;

use super::lattice::Lattice;

/// An edge of a graph: from, to, and what happens to the facts along it.
pub(crate) type Edge<E> = (u32, u32, E);

/// The edges that leave a node; `edges` are sorted by where they begin.
fn leaving<E>(edges: &[Edge<E>], node: u32) -> &[Edge<E>] {
    let first = edges.partition_point(|edge| edge.0 < node);
    &edges[first..first + edges[first..].partition_point(|edge| edge.0 == node)]
}

/// Post-order: each node after those to which its edges lead, except along cycles. `edges` are sorted by where they begin.
pub(crate) fn post_order<E>(nodes: usize, edges: &[Edge<E>]) -> Vec<u32> {
    let mut order = Vec::with_capacity(nodes);
    let mut seen = vec![false; nodes];
    let mut open = Vec::new();
    for root in 0..nodes as u32 {
        if !std::mem::replace(&mut seen[root as usize], true) {
            open.push((root, leaving(edges, root)));
        }
        while let Some((node, rest)) = open.last_mut() {
            if let Some(((_, to, _), others)) = rest.split_first() {
                *rest = others;
                if !std::mem::replace(&mut seen[*to as usize], true) {
                    open.push((*to, leaving(edges, *to)));
                }
            } else {
                order.push(*node);
                open.pop();
            }
        }
    }
    order
}

/// Least fixpoint: `facts` grow until each holds what `arriving` makes, along every edge, of the facts where the edge begins. None
/// can grow more than `height` times, which bounds the steps.
pub(crate) fn propagate<F: Lattice + PartialEq, E>(
    facts: &mut [F],
    height: usize,
    edges: &mut [Edge<E>],
    arriving: impl Fn(&E, &F) -> F,
) {
    edges.sort_by_key(|edge| edge.0);
    let mut order = post_order(facts.len(), edges);
    order.reverse();
    let mut rank = vec![0; order.len()];
    (0..).zip(&order).for_each(|(at, &node)| rank[node as usize] = at);
    let mut open: BTreeSet<u32> = (0..order.len() as u32).collect();
    let mut steps = 0;
    while let Some(at) = open.pop_first() {
        steps += 1;
        debug_assert!(steps <= order.len() * (1 + height), "a fact grew too often");
        let node = order[at as usize];
        for (_, to, along) in leaving(edges, node) {
            let arriving = arriving(along, &facts[node as usize]);
            let fact = &mut facts[*to as usize];
            let before = fact.clone();
            fact.join(&arriving);
            if *fact != before {
                open.insert(rank[*to as usize]);
            }
        }
    }
}
