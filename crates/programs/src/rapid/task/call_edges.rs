//! Call and return edges between motions: the last motion before a call and the first in the routine, the last in the routine and the
//! first behind the call, the last and the first of a loop.
//!
//! Method: context-insensitive interprocedural control flow (Nielson, Nielson, Hankin, Principles of Program Analysis, 1999, §2.5). The
//! motion before a call is also the last behind it if the routine may end without a motion. What an error handler repeats is left out.

use std::collections::BTreeMap;

use crate::dataflow::{Edge, Lattice, propagate};
use crate::motion_set::MotionSet;
use crate::rapid::reaching_motions::{Last, ReachingMotions};
use crate::rapid::symbol::{Body, Symbols};

/// In a set: the robot may stand where none of the motions ends.
const ELSEWHERE: u32 = u32::MAX;

/// Motions with more before them have no list of them.
const MAX_PREDECESSORS: usize = 64;

/// A call of a routine that moves, or of any in a list. Behind the bodies come the lists of routines that computed names may call.
#[derive(Debug)]
struct MovingCall {
    caller: u32,
    callee: u32,
    before: ReachingMotions,
}

/// What the interpreter of each body finds, until the edges are solved.
#[derive(Debug)]
pub(super) struct CallEdges {
    calls: Vec<MovingCall>,
    /// By loop: its body, and the motions that may be the last of an iteration.
    iterations: Vec<(u32, ReachingMotions)>,
    /// Motions before which another routine may have moved the robot, with their bodies.
    arrivals: Vec<(u32, u32, ReachingMotions)>,
    /// Whether each has several motions before it that the text may execute last.
    branched: Vec<bool>,
    /// By body or list: the motions that may be its last.
    ends: Vec<ReachingMotions>,
}

/// Sets of motions by what they are last of: a routine, its entry, all that stands in it, a call that may pass, an iteration.
struct Nodes {
    bodies: u32,
    calls: u32,
}

impl Nodes {
    fn end(&self, body: u32) -> u32 {
        body
    }

    fn entry(&self, body: u32) -> u32 {
        self.bodies + body
    }

    fn anywhere(&self, body: u32) -> u32 {
        2 * self.bodies + body
    }

    fn before(&self, call: u32) -> u32 {
        3 * self.bodies + call
    }

    fn iteration(&self, at: u32) -> u32 {
        3 * self.bodies + self.calls + at
    }
}

impl CallEdges {
    pub(super) fn new(bodies: usize) -> Self {
        Self {
            calls: Vec::new(),
            iterations: Vec::new(),
            arrivals: Vec::new(),
            branched: Vec::new(),
            ends: vec![ReachingMotions::default(); bodies],
        }
    }

    /// A call after some motions; returns its number.
    pub(super) fn call(&mut self, caller: u32, callee: u32, before: &ReachingMotions) -> u32 {
        self.calls.push(MovingCall { caller, callee, before: before.clone() });
        self.calls.len() as u32 - 1
    }

    /// A loop of a body; returns its number.
    pub(super) fn begin_loop(&mut self, body: u32) -> u32 {
        self.iterations.push((body, ReachingMotions::default()));
        self.iterations.len() as u32 - 1
    }

    /// Its iterations may end after some motions.
    pub(super) fn end_loop(&mut self, iteration: u32, reaching: &ReachingMotions) {
        self.iterations[iteration as usize].1.join(reaching);
    }

    /// A motion after some motions; `branched`: there is no single one before it in its routine.
    pub(super) fn arrive(&mut self, body: u32, motion: u32, branched: bool, before: &ReachingMotions) {
        let branched = branched && !before.elsewhere && (before.entry || !before.known().is_empty());
        if before.crosses_call() || branched {
            self.arrivals.push((body, motion, before.clone()));
            self.branched.push(branched);
        }
    }

    /// A body may end after some motions.
    pub(super) fn end(&mut self, body: u32, reaching: &ReachingMotions) {
        self.ends[body as usize].join(reaching);
    }

    /// The motions that may follow each other across a call or a return or from one iteration to the next, sorted; and those before
    /// each motion with several, where all of them are known. `bodies`: of each motion; `mains`: routines at which a program starts.
    pub(super) fn solve(
        &self,
        symbols: &Symbols,
        bodies: &[u32],
        mains: &[u32],
    ) -> (Vec<[u32; 2]>, BTreeMap<u32, Vec<u32>>) {
        if self.calls.is_empty() && !self.branched.contains(&true) {
            return Default::default();
        }
        let mut graph = Graph::of(self, symbols);
        graph.add_elsewhere(symbols, mains);
        graph.add_flows();
        graph.add_late_lists(symbols);
        graph.add_anywhere(bodies);
        graph.solve();
        graph.collect()
    }

    /// Which bodies may end without a motion.
    fn passing(&self, symbols: &Symbols) -> Vec<bool> {
        let mut calls_of: Vec<Vec<u32>> = vec![Vec::new(); self.ends.len()];
        for (call, at) in (0..).zip(&self.calls) {
            calls_of[at.caller as usize].push(call);
        }
        let mut loops_of: Vec<Vec<usize>> = vec![Vec::new(); self.ends.len()];
        for (at, (body, _)) in self.iterations.iter().enumerate() {
            loops_of[*body as usize].push(at);
        }
        let mut bodies = vec![false; self.ends.len()];
        // A name computed at run time may be that of a routine without motions, or of none.
        bodies[symbols.bodies.len()..].fill(true);
        let mut calls = vec![false; self.calls.len()];
        let mut iterations = vec![false; self.iterations.len()];
        // Callees first, so that only recursive calls need another round.
        loop {
            let before = (bodies.clone(), calls.clone(), iterations.clone());
            for &body in &symbols.callees_first {
                let passes =
                    |reaching: &ReachingMotions, bodies: &[bool], calls: &[bool], iterations: &[bool]| {
                        let one = |last: &Last| match *last {
                            Last::Motion(_) => false,
                            Last::Call(call) => {
                                calls[call as usize] && bodies[self.calls[call as usize].callee as usize]
                            }
                            Last::Iteration(at) => iterations[at as usize],
                        };
                        reaching.entry || reaching.anywhere || reaching.known().iter().any(one)
                    };
                for &call in &calls_of[body as usize] {
                    calls[call as usize] =
                        passes(&self.calls[call as usize].before, &bodies, &calls, &iterations);
                }
                for &at in &loops_of[body as usize] {
                    iterations[at] = passes(&self.iterations[at].1, &bodies, &calls, &iterations);
                }
                bodies[body as usize] = passes(&self.ends[body as usize], &bodies, &calls, &iterations);
            }
            if before == (bodies.clone(), calls.clone(), iterations.clone()) {
                return bodies;
            }
        }
    }
}

/// What may be last according to a set of motions.
enum EdgeSource {
    Motion(u32),
    /// Any motion that reaches this node.
    Node(u32),
}

/// The sets of motions, and what flows from one into another.
struct Graph<'c> {
    found: &'c CallEdges,
    nodes: Nodes,
    /// Which bodies may end without a motion.
    passes: Vec<bool>,
    /// By node.
    last: Vec<MotionSet>,
    edges: Vec<Edge<()>>,
}

impl<'c> Graph<'c> {
    fn of(found: &'c CallEdges, symbols: &Symbols) -> Self {
        let nodes = Nodes { bodies: found.ends.len() as u32, calls: found.calls.len() as u32 };
        let count = nodes.iteration(found.iterations.len() as u32) as usize;
        let last = vec![MotionSet::default(); count];
        Self { found, nodes, passes: found.passing(symbols), last, edges: Vec::new() }
    }

    /// What may be last according to a set of a body.
    fn sources(&self, body: u32, reaching: &ReachingMotions) -> Vec<EdgeSource> {
        let mut out = Vec::new();
        for &known in reaching.known() {
            match known {
                Last::Motion(motion) => out.push(EdgeSource::Motion(motion)),
                Last::Iteration(at) => out.push(EdgeSource::Node(self.nodes.iteration(at))),
                Last::Call(call) => {
                    let callee = self.found.calls[call as usize].callee;
                    out.push(EdgeSource::Node(self.nodes.end(callee)));
                    if self.passes[callee as usize] {
                        out.push(EdgeSource::Node(self.nodes.before(call)));
                    }
                }
            }
        }
        if reaching.anywhere {
            out.push(EdgeSource::Node(self.nodes.anywhere(body)));
        }
        if reaching.entry {
            out.push(EdgeSource::Node(self.nodes.entry(body)));
        }
        out
    }

    fn flows_into(&mut self, node: u32, body: u32, reaching: &ReachingMotions) {
        if reaching.elsewhere {
            self.last[node as usize].0.push(ELSEWHERE);
        }
        for source in self.sources(body, reaching) {
            match source {
                EdgeSource::Motion(motion) => self.last[node as usize].0.push(motion),
                EdgeSource::Node(from) => self.edges.push((from, node, ())),
            }
        }
    }

    /// The entries of bodies that no call enters: the program's start, its next cycle, interrupts.
    fn add_elsewhere(&mut self, symbols: &Symbols, mains: &[u32]) {
        let mut is_called = vec![false; self.found.ends.len()];
        self.found.calls.iter().for_each(|call| is_called[call.callee as usize] = true);
        for (list, routines) in symbols.late_lists.iter().enumerate() {
            if is_called[symbols.bodies.len() + list] {
                routines.iter().for_each(|routine| is_called[symbols.body_of(*routine) as usize] = true);
            }
        }
        for (body, is_called) in (0..).zip(&is_called) {
            let is_entered = |body: &Body| {
                let starts = |routine: u32| mains.contains(&routine) || symbols.interrupts[routine as usize];
                body.routine.is_some_and(starts)
            };
            if !is_called || symbols.bodies.get(body as usize).is_some_and(is_entered) {
                self.last[self.nodes.entry(body) as usize].0.push(ELSEWHERE);
            }
        }
    }

    /// What flows to the ends of bodies, into calls, and around loops.
    fn add_flows(&mut self) {
        let found = self.found;
        for (body, end) in (0..).zip(&found.ends) {
            // What was last before the routine is the caller's to know.
            self.flows_into(self.nodes.end(body), body, &end.within_routine());
        }
        for (call, at) in (0..).zip(&found.calls) {
            self.flows_into(self.nodes.entry(at.callee), at.caller, &at.before);
            if self.passes[at.callee as usize] {
                self.flows_into(self.nodes.before(call), at.caller, &at.before);
            }
        }
        for (at, (body, end)) in (0..).zip(&found.iterations) {
            self.flows_into(self.nodes.iteration(at), *body, end);
        }
    }

    /// A call by a computed name enters each routine of its list.
    fn add_late_lists(&mut self, symbols: &Symbols) {
        for (list, routines) in (symbols.bodies.len() as u32..).zip(&symbols.late_lists) {
            for body in routines.iter().map(|routine| symbols.body_of(*routine)) {
                self.edges.push((self.nodes.end(body), self.nodes.end(list), ()));
                self.edges.push((self.nodes.entry(list), self.nodes.entry(body), ()));
            }
        }
    }

    /// All motions of each body, if any set asks for them.
    fn add_anywhere(&mut self, bodies: &[u32]) {
        let found = self.found;
        let befores = found.calls.iter().map(|call| &call.before);
        let of_loops = found.iterations.iter().map(|(_, end)| end);
        let of_arrivals = found.arrivals.iter().map(|(.., before)| before);
        let mut all = befores.chain(of_loops).chain(of_arrivals).chain(&found.ends);
        if !all.any(|reaching| reaching.anywhere) {
            return;
        }
        for (motion, body) in (0..).zip(bodies) {
            self.last[self.nodes.anywhere(*body) as usize].0.push(motion);
        }
        let nodes = &self.nodes;
        let of_calls = found.calls.iter();
        self.edges.extend(of_calls.map(|call| (nodes.end(call.callee), nodes.anywhere(call.caller), ())));
        self.edges.extend((0..nodes.bodies).map(|body| (nodes.entry(body), nodes.anywhere(body), ())));
    }

    fn solve(&mut self) {
        self.edges.sort_unstable();
        self.edges.dedup();
        self.last.iter_mut().for_each(MotionSet::normalise);
        let height = self.last.iter().map(|motions| motions.0.len()).sum();
        propagate(&mut self.last, height, &mut self.edges, |(), motions| motions.clone());
    }

    /// See [`CallEdges::solve`].
    fn collect(&self) -> (Vec<[u32; 2]>, BTreeMap<u32, Vec<u32>>) {
        let mut out = Vec::new();
        let mut predecessors = BTreeMap::new();
        for ((body, motion, before), branched) in self.found.arrivals.iter().zip(&self.found.branched) {
            let mut all = MotionSet::default();
            for source in self.sources(*body, before) {
                match source {
                    EdgeSource::Motion(motion) => all.0.push(motion),
                    EdgeSource::Node(node) => {
                        let last = &self.last[node as usize].0;
                        let known = last.iter().filter(|before| **before != ELSEWHERE);
                        out.extend(known.map(|before| [*before, *motion]));
                        if *branched && all.0.len() <= MAX_PREDECESSORS {
                            all.0.extend(last);
                        }
                    }
                }
            }
            all.normalise();
            if *branched && !all.0.contains(&ELSEWHERE) && (1..=MAX_PREDECESSORS).contains(&all.0.len()) {
                predecessors.insert(*motion, all.0);
            }
        }
        if self.found.calls.is_empty() {
            return (Vec::new(), predecessors);
        }
        out.sort_unstable();
        out.dedup();
        (out, predecessors)
    }
}
