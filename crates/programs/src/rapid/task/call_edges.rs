//! Call and return edges between motions: the last motion before a call and the first in the routine, the last in the routine and the
//! first behind the call.
//!
//! Method: context-insensitive interprocedural control flow (Nielson, Nielson, Hankin, Principles of Program Analysis, 1999, §2.5). A
//! routine that is called may pass without a motion, so that the motion before the call may also be the last behind it. What a loop or
//! an error handler repeats is left out.

use crate::dataflow::{Edge, Lattice, propagate};
use crate::rapid::reaching_motions::{Last, ReachingMotions};
use crate::rapid::symbol::Symbols;

/// A call of a routine that moves.
#[derive(Debug)]
struct MovingCall {
    caller: u32,
    callee: u32,
    before: ReachingMotions,
}

/// What the interpreter of each unit finds, until the edges are solved.
#[derive(Debug)]
pub(super) struct CallEdges {
    calls: Vec<MovingCall>,
    /// Motions before which a call or the entry of the routine may stand, with their units.
    arrivals: Vec<(u32, u32, ReachingMotions)>,
    /// By unit: the motions that may be its last.
    ends: Vec<ReachingMotions>,
}

impl CallEdges {
    pub(super) fn new(units: usize) -> Self {
        Self { calls: Vec::new(), arrivals: Vec::new(), ends: vec![ReachingMotions::default(); units] }
    }

    /// A call after some motions; returns its number.
    pub(super) fn call(&mut self, caller: u32, callee: u32, before: &ReachingMotions) -> u32 {
        self.calls.push(MovingCall { caller, callee, before: before.clone() });
        self.calls.len() as u32 - 1
    }

    /// A motion after some motions.
    pub(super) fn arrive(&mut self, unit: u32, motion: u32, before: &ReachingMotions) {
        if before.crosses_call() {
            self.arrivals.push((unit, motion, before.clone()));
        }
    }

    /// A unit may end after some motions.
    pub(super) fn end(&mut self, unit: u32, reaching: &ReachingMotions) {
        self.ends[unit as usize].join(reaching);
    }

    /// The motions that may follow each other across a call or a return, sorted.
    pub(super) fn solve(&self, symbols: &Symbols) -> Vec<[u32; 2]> {
        if self.calls.is_empty() {
            return Vec::new();
        }
        let units = symbols.units.len();
        // The motions that may be the last of each unit, and behind these nodes those that may be the last before it.
        let mut last = vec![Motions::default(); 2 * units];
        let mut edges: Vec<Edge<()>> = Vec::new();
        let mut enter = |node: usize, reaching: &ReachingMotions, edges: &mut Vec<Edge<()>>| {
            for &known in reaching.known() {
                match known {
                    Last::Motion(motion) => last[node].0.push(motion),
                    Last::Call(call) => edges.push((self.calls[call as usize].callee, node as u32, ())),
                }
            }
        };
        for (unit, end) in self.ends.iter().enumerate() {
            enter(unit, end, &mut edges);
        }
        for call in &self.calls {
            let entry = units + call.callee as usize;
            enter(entry, &call.before, &mut edges);
            if call.before.entry {
                edges.push(((units as u32) + call.caller, entry as u32, ()));
            }
        }
        edges.sort_unstable();
        edges.dedup();
        last.iter_mut().for_each(Motions::normalise);
        let height = last.iter().map(|motions| motions.0.len()).sum();
        propagate(&mut last, height, &mut edges, |(), motions| motions.clone());
        let mut out = Vec::new();
        for (unit, motion, before) in &self.arrivals {
            let of_calls = before.known().iter().filter_map(|known| match known {
                Last::Call(call) => Some(self.calls[*call as usize].callee as usize),
                Last::Motion(_) => None,
            });
            let entry = before.entry.then_some(units + *unit as usize);
            for node in of_calls.chain(entry) {
                out.extend(last[node].0.iter().map(|before| [*before, *motion]));
            }
        }
        out.sort_unstable();
        out.dedup();
        out
    }
}

/// A set of motions, sorted.
#[derive(Debug, Clone, Default, PartialEq)]
struct Motions(Vec<u32>);

impl Motions {
    fn normalise(&mut self) {
        self.0.sort_unstable();
        self.0.dedup();
    }
}

/// The union.
impl Lattice for Motions {
    fn join(&mut self, other: &Self) {
        self.0.extend_from_slice(&other.0);
        self.normalise();
    }
}
