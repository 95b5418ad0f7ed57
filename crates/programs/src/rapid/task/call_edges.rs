//! Call and return edges between motions: the last motion before a call and the first in the routine, the last in the routine and the
//! first behind the call, the last and the first of a loop.
//!
//! Method: context-insensitive interprocedural control flow (Nielson, Nielson, Hankin, Principles of Program Analysis, 1999, §2.5). The
//! motion before a call is also the last behind it if the routine may end without a motion. What an error handler repeats is left out.

use std::collections::BTreeMap;

use crate::dataflow::{Edge, Lattice, propagate};
use crate::motion_set::MotionSet;
use crate::rapid::reaching_motions::{Last, ReachingMotions};
use crate::rapid::symbol::{Symbols, Unit};

/// In a set: the robot may stand where none of the motions ends.
const ELSEWHERE: u32 = u32::MAX;

/// Motions with more before them have no list of them.
const MOST_PREDECESSORS: usize = 64;

/// A call of a routine that moves, or of any in a list. Behind the units come the lists of routines that computed names may call.
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
    /// By loop: its unit, and the motions that may be the last of an iteration.
    iterations: Vec<(u32, ReachingMotions)>,
    /// Motions before which another routine may have moved the robot, with their units.
    arrivals: Vec<(u32, u32, ReachingMotions)>,
    /// Whether each has several motions before it that the text may execute last.
    branched: Vec<bool>,
    /// By unit or list: the motions that may be its last.
    ends: Vec<ReachingMotions>,
}

/// Sets of motions by what they are last of: a routine, its entry, all that stands in it, a call that may pass, an iteration.
struct Nodes {
    units: u32,
    calls: u32,
}

impl Nodes {
    fn end(&self, unit: u32) -> u32 {
        unit
    }

    fn entry(&self, unit: u32) -> u32 {
        self.units + unit
    }

    fn anywhere(&self, unit: u32) -> u32 {
        2 * self.units + unit
    }

    fn before(&self, call: u32) -> u32 {
        3 * self.units + call
    }

    fn iteration(&self, at: u32) -> u32 {
        3 * self.units + self.calls + at
    }
}

impl CallEdges {
    pub(super) fn new(units: usize) -> Self {
        Self {
            calls: Vec::new(),
            iterations: Vec::new(),
            arrivals: Vec::new(),
            branched: Vec::new(),
            ends: vec![ReachingMotions::default(); units],
        }
    }

    /// A call after some motions; returns its number.
    pub(super) fn call(&mut self, caller: u32, callee: u32, before: &ReachingMotions) -> u32 {
        self.calls.push(MovingCall { caller, callee, before: before.clone() });
        self.calls.len() as u32 - 1
    }

    /// A loop of a unit; returns its number.
    pub(super) fn begin_loop(&mut self, unit: u32) -> u32 {
        self.iterations.push((unit, ReachingMotions::default()));
        self.iterations.len() as u32 - 1
    }

    /// Its iterations may end after some motions.
    pub(super) fn end_loop(&mut self, iteration: u32, reaching: &ReachingMotions) {
        self.iterations[iteration as usize].1.join(reaching);
    }

    /// A motion after some motions; `branched`: there is no single one before it in its routine.
    pub(super) fn arrive(&mut self, unit: u32, motion: u32, branched: bool, before: &ReachingMotions) {
        let branched = branched && !before.elsewhere && (before.entry || !before.known().is_empty());
        if before.crosses_call() || branched {
            self.arrivals.push((unit, motion, before.clone()));
            self.branched.push(branched);
        }
    }

    /// A unit may end after some motions.
    pub(super) fn end(&mut self, unit: u32, reaching: &ReachingMotions) {
        self.ends[unit as usize].join(reaching);
    }

    /// The motions that may follow each other across a call or a return or from one iteration to the next, sorted; and those before
    /// each motion with several, where all of them are known. `units`: of each motion; `mains`: routines at which a program starts.
    pub(super) fn solve(
        &self,
        symbols: &Symbols,
        units: &[u32],
        mains: &[u32],
    ) -> (Vec<[u32; 2]>, BTreeMap<u32, Vec<u32>>) {
        if self.calls.is_empty() && !self.branched.contains(&true) {
            return Default::default();
        }
        let passes = self.passing(symbols);
        let nodes = Nodes { units: self.ends.len() as u32, calls: self.calls.len() as u32 };
        let count = nodes.iteration(self.iterations.len() as u32) as usize;
        let mut last = vec![MotionSet::default(); count];
        let mut edges: Vec<Edge<()>> = Vec::new();
        // What may be last according to a set of a unit: motions, and nodes.
        let sources = |unit: u32, reaching: &ReachingMotions, found: &mut dyn FnMut(Result<u32, u32>)| {
            for &known in reaching.known() {
                match known {
                    Last::Motion(motion) => found(Ok(motion)),
                    Last::Iteration(at) => found(Err(nodes.iteration(at))),
                    Last::Call(call) => {
                        let callee = self.calls[call as usize].callee;
                        found(Err(nodes.end(callee)));
                        if passes[callee as usize] {
                            found(Err(nodes.before(call)));
                        }
                    }
                }
            }
            if reaching.anywhere {
                found(Err(nodes.anywhere(unit)));
            }
            if reaching.entry {
                found(Err(nodes.entry(unit)));
            }
        };
        // Units that no call enters: the program's start, its next cycle, interrupts.
        let mut is_called = vec![false; self.ends.len()];
        self.calls.iter().for_each(|call| is_called[call.callee as usize] = true);
        for (list, routines) in symbols.late_lists.iter().enumerate() {
            if is_called[symbols.units.len() + list] {
                routines.iter().for_each(|routine| is_called[symbols.unit_of(*routine) as usize] = true);
            }
        }
        for (unit, is_called) in (0..).zip(&is_called) {
            let is_entered = |unit: &Unit| {
                let starts = |routine: u32| mains.contains(&routine) || symbols.interrupts[routine as usize];
                unit.routine.is_some_and(starts)
            };
            if !is_called || symbols.units.get(unit as usize).is_some_and(is_entered) {
                last[nodes.entry(unit) as usize].0.push(ELSEWHERE);
            }
        }
        let mut flows_into = |node: u32, unit: u32, reaching: &ReachingMotions| {
            if reaching.elsewhere {
                last[node as usize].0.push(ELSEWHERE);
            }
            sources(unit, reaching, &mut |found| match found {
                Ok(motion) => last[node as usize].0.push(motion),
                Err(from) => edges.push((from, node, ())),
            });
        };
        for (unit, end) in (0..).zip(&self.ends) {
            // What was last before the routine is the caller's to know.
            flows_into(nodes.end(unit), unit, &end.within_routine());
        }
        for (call, at) in (0..).zip(&self.calls) {
            flows_into(nodes.entry(at.callee), at.caller, &at.before);
            if passes[at.callee as usize] {
                flows_into(nodes.before(call), at.caller, &at.before);
            }
        }
        for (at, (unit, end)) in (0..).zip(&self.iterations) {
            flows_into(nodes.iteration(at), *unit, end);
        }
        for (list, routines) in (symbols.units.len() as u32..).zip(&symbols.late_lists) {
            for unit in routines.iter().map(|routine| symbols.unit_of(*routine)) {
                edges.push((nodes.end(unit), nodes.end(list), ()));
                edges.push((nodes.entry(list), nodes.entry(unit), ()));
            }
        }
        let befores = self.calls.iter().map(|call| &call.before);
        let of_loops = self.iterations.iter().map(|(_, end)| end);
        let of_arrivals = self.arrivals.iter().map(|(.., before)| before);
        if befores.chain(of_loops).chain(of_arrivals).chain(&self.ends).any(|reaching| reaching.anywhere) {
            for (motion, unit) in (0..).zip(units) {
                last[nodes.anywhere(*unit) as usize].0.push(motion);
            }
            let of_calls = self.calls.iter();
            edges.extend(of_calls.map(|call| (nodes.end(call.callee), nodes.anywhere(call.caller), ())));
            edges.extend((0..nodes.units).map(|unit| (nodes.entry(unit), nodes.anywhere(unit), ())));
        }
        edges.sort_unstable();
        edges.dedup();
        last.iter_mut().for_each(MotionSet::normalise);
        let height = last.iter().map(|motions| motions.0.len()).sum();
        propagate(&mut last, height, &mut edges, |(), motions| motions.clone());
        let mut out = Vec::new();
        let mut predecessors = BTreeMap::new();
        for ((unit, motion, before), branched) in self.arrivals.iter().zip(&self.branched) {
            let mut all = MotionSet::default();
            sources(*unit, before, &mut |found| match found {
                Ok(motion) => all.0.push(motion),
                Err(node) => {
                    let known = last[node as usize].0.iter().filter(|before| **before != ELSEWHERE);
                    out.extend(known.map(|before| [*before, *motion]));
                    if *branched && all.0.len() <= MOST_PREDECESSORS {
                        all.0.extend(&last[node as usize].0);
                    }
                }
            });
            all.normalise();
            if *branched && !all.0.contains(&ELSEWHERE) && (1..=MOST_PREDECESSORS).contains(&all.0.len()) {
                predecessors.insert(*motion, all.0);
            }
        }
        if self.calls.is_empty() {
            return (Vec::new(), predecessors);
        }
        out.sort_unstable();
        out.dedup();
        (out, predecessors)
    }

    /// Which units may end without a motion.
    fn passing(&self, symbols: &Symbols) -> Vec<bool> {
        let mut calls_of: Vec<Vec<u32>> = vec![Vec::new(); self.ends.len()];
        for (call, at) in (0..).zip(&self.calls) {
            calls_of[at.caller as usize].push(call);
        }
        let mut loops_of: Vec<Vec<usize>> = vec![Vec::new(); self.ends.len()];
        for (at, (unit, _)) in self.iterations.iter().enumerate() {
            loops_of[*unit as usize].push(at);
        }
        let mut units = vec![false; self.ends.len()];
        // A name computed at run time may be that of a routine without motions, or of none.
        units[symbols.units.len()..].fill(true);
        let mut calls = vec![false; self.calls.len()];
        let mut iterations = vec![false; self.iterations.len()];
        // Callees first, so that only recursive calls need another round.
        loop {
            let before = (units.clone(), calls.clone(), iterations.clone());
            for &unit in &symbols.callees_first {
                let passes =
                    |reaching: &ReachingMotions, units: &[bool], calls: &[bool], iterations: &[bool]| {
                        let one = |last: &Last| match *last {
                            Last::Motion(_) => false,
                            Last::Call(call) => {
                                calls[call as usize] && units[self.calls[call as usize].callee as usize]
                            }
                            Last::Iteration(at) => iterations[at as usize],
                        };
                        reaching.entry || reaching.anywhere || reaching.known().iter().any(one)
                    };
                for &call in &calls_of[unit as usize] {
                    calls[call as usize] =
                        passes(&self.calls[call as usize].before, &units, &calls, &iterations);
                }
                for &at in &loops_of[unit as usize] {
                    iterations[at] = passes(&self.iterations[at].1, &units, &calls, &iterations);
                }
                units[unit as usize] = passes(&self.ends[unit as usize], &units, &calls, &iterations);
            }
            if before == (units.clone(), calls.clone(), iterations.clone()) {
                return units;
            }
        }
    }
}
