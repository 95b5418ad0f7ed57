//! Call and return edges between motions of NC files: the last motion before a call and the first in the subprogram, the last in the
//! subprogram and the first behind the call, and what jumps and loops join.
//!
//! Method: context-insensitive interprocedural control flow (Nielson, Nielson, Hankin, Principles of Program Analysis, 1999, §2.5). Where a
//! jump leads within its program is left open: it may lead to every label there.

use std::collections::HashMap;

use super::super::expression::Variable;
use crate::dataflow::{Edge, propagate};
use crate::motion_set::MotionSet;

/// Where control does not simply pass on to the next block.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum FlowPoint {
    /// A file begins; whether its end leads to its start.
    File { restarts: bool },
    /// A program or subprogram begins.
    Program(Variable),
    /// A label begins that calls may name, and control also passes it (LBL).
    Label(Variable),
    /// A call; `None`: of a label of the same program whose name is open.
    Call { callee: Option<Variable>, may_skip: bool },
    /// A return to the caller; control may also pass it.
    Return,
    /// The end of a subprogram that the main program bypasses (O endsub).
    EndOfSubprogram,
    /// Control may continue elsewhere in the program.
    Leaves,
    /// Control may come from elsewhere in the program.
    Arrives,
    /// Both: the head or the end of a loop, the end of a branch.
    Joins,
}

/// A point between the motions of the listing.
#[derive(Debug)]
struct Point {
    flow: FlowPoint,
    file: u32,
    /// The motions before it end here.
    before: u32,
    /// The motions behind it begin here: the block of a call is itself listed as a motion.
    behind: u32,
}

/// The points of all files, in order.
#[derive(Debug, Default)]
pub(super) struct CallEdges {
    points: Vec<Point>,
}

/// The nodes of what calls can name.
#[derive(Debug, Clone, Copy)]
struct Callee {
    entry: u32,
    exit: u32,
    /// Whether neither motion nor call stands in it.
    is_empty: bool,
}

/// What was executed last.
#[derive(Debug, Clone, Copy)]
enum Last {
    Motion(u32),
    /// Any motion that reaches this node.
    Node(u32),
}

impl CallEdges {
    pub(super) fn len(&self) -> usize {
        self.points.len()
    }

    pub(super) fn truncate(&mut self, len: usize) {
        self.points.truncate(len);
    }

    /// A point of a file, before the motion `next`; a call has been listed as the motion before that.
    pub(super) fn push(&mut self, flow: FlowPoint, file: u32, next: u32, is_listed: bool) {
        self.points.push(Point { flow, file, before: next - u32::from(is_listed), behind: next });
    }

    /// The motions that may follow each other although they are not consecutive, sorted. `names`: of the files; `count`: of motions.
    pub(super) fn solve(&self, names: &[String], count: u32) -> Vec<[u32; 2]> {
        let flows =
            |point: &Point| !matches!(point.flow, FlowPoint::File { restarts: false } | FlowPoint::Return);
        if !self.points.iter().any(flows) {
            return Vec::new();
        }
        let mut graph = Graph { count: self.points.len() as u32, ..Graph::default() };
        let callees = self.callees(names, &mut graph);
        let mut arrivals = Vec::new();
        // By program: what its jumps leave, and what reaches its end.
        let (mut jumps, mut exit) = (0, 0);
        let mut last = Last::Node(0);
        let mut bypassed = None;
        let mut labels: Vec<Callee> = Vec::new();
        for (at, point) in (0_u32..).zip(&self.points) {
            let Point { flow, file, before, behind } = point;
            if let Some(previous) = at.checked_sub(1)
                && self.points[previous as usize].behind < *before
            {
                last = Last::Motion(before - 1);
            }
            let here = |name: &Variable| callees.get(&(*file, name.clone())).filter(|_| !name.is_empty());
            match flow {
                FlowPoint::File { restarts } => {
                    // A file returns at its end, too.
                    if at > 0 {
                        graph.flows(last, exit);
                    }
                    let whole = callees[&(*file, Vec::new())];
                    graph.edge(whole.entry, at);
                    (jumps, exit, bypassed) = (graph.node(), whole.exit, None);
                    labels.clear();
                    if *restarts {
                        graph.edge(whole.exit, at);
                    }
                }
                FlowPoint::Program(name) => {
                    let is_first = !self.points[..at as usize]
                        .iter()
                        .any(|other| other.file == *file && matches!(other.flow, FlowPoint::Program(_)));
                    bypassed = Some((last, jumps, exit));
                    // What stands before the first program number belongs to that program.
                    if is_first {
                        graph.flows(last, at);
                    }
                    if let Some(program) = here(name) {
                        graph.edge(program.entry, at);
                        if is_first {
                            graph.edge(program.exit, exit);
                        }
                        (jumps, exit) = (graph.node(), program.exit);
                    }
                }
                FlowPoint::Label(name) => {
                    graph.flows(last, at);
                    if let Some(label) = here(name) {
                        graph.edge(label.entry, at);
                        labels.push(*label);
                    }
                    graph.edge(jumps, at);
                }
                FlowPoint::Call { callee, may_skip } => {
                    let known = callee.as_ref().map(|name| {
                        let elsewhere = || {
                            let mut files = 0..names.len() as u32;
                            files
                                .find_map(|other| callees.get(&(other, name.clone())))
                                .filter(|_| !name.is_empty())
                        };
                        here(name).or_else(elsewhere)
                    });
                    match known {
                        Some(Some(callee)) if !callee.is_empty => {
                            graph.flows(last, callee.entry);
                            graph.edge(callee.exit, at);
                            if *may_skip {
                                graph.flows(last, at);
                            }
                        }
                        // A program that is not in these files may move or not.
                        Some(_) => graph.flows(last, at),
                        None => {
                            graph.flows(last, jumps);
                            graph.edge(exit, at);
                            graph.flows(last, at);
                        }
                    }
                }
                FlowPoint::Return | FlowPoint::EndOfSubprogram => {
                    graph.flows(last, exit);
                    labels.drain(..).for_each(|label| graph.flows(last, label.exit));
                    if let Some(main) = bypassed.filter(|_| *flow == FlowPoint::EndOfSubprogram) {
                        (last, jumps, exit) = main;
                    }
                    graph.flows(last, at);
                }
                FlowPoint::Leaves | FlowPoint::Arrives | FlowPoint::Joins => {
                    graph.flows(last, at);
                    if *flow != FlowPoint::Arrives {
                        graph.flows(last, jumps);
                    }
                    if *flow != FlowPoint::Leaves {
                        graph.edge(jumps, at);
                    }
                }
            }
            last = Last::Node(at);
            let next = self.points.get(at as usize + 1).map_or(count, |next| next.before);
            if *behind < next {
                arrivals.push((at, *behind));
            }
        }
        let behind = self.points.last().map_or(0, |last| last.behind);
        graph.flows(if behind < count { Last::Motion(count - 1) } else { last }, exit);
        graph.solve(&arrivals)
    }

    /// What calls can name, by file: programs, labels, and the file itself by its name and by none.
    fn callees(&self, names: &[String], graph: &mut Graph) -> HashMap<(u32, Variable), Callee> {
        let mut out = HashMap::new();
        for (at, point) in self.points.iter().enumerate() {
            let Point { flow, file, behind, .. } = point;
            let ends: fn(&FlowPoint) -> bool = match flow {
                FlowPoint::File { .. } => |_| false,
                FlowPoint::Program(_) => |flow| matches!(flow, FlowPoint::Program(_)),
                FlowPoint::Label(_) => |flow| *flow == FlowPoint::Return,
                _ => continue,
            };
            let behind_it = self.points[at + 1..].iter().take_while(|other| other.file == *file);
            let mut within = behind_it.clone().take_while(|other| !ends(&other.flow));
            let calls = within.any(|other| matches!(other.flow, FlowPoint::Call { .. }));
            let end = behind_it.clone().find(|other| ends(&other.flow)).map(|other| other.before);
            let end =
                end.unwrap_or_else(|| behind_it.last().map_or(*behind, |last| last.behind.max(*behind)));
            let callee =
                Callee { entry: graph.node(), exit: graph.node(), is_empty: !calls && end == *behind };
            match flow {
                FlowPoint::Program(name) | FlowPoint::Label(name) => {
                    out.entry((*file, name.clone())).or_insert(callee);
                }
                _ => {
                    // Motions may follow the last point of a file.
                    let callee = Callee { is_empty: false, ..callee };
                    out.insert((*file, Vec::new()), callee);
                    out.entry((*file, program_of(&names[*file as usize]))).or_insert(callee);
                }
            }
        }
        out
    }
}

/// The name by which other programs call a file: without folder, extension and the archive's additions (`_N_NAME_SPF`).
pub(super) fn program_of(file: &str) -> Variable {
    let name = file.rsplit(['/', '\\']).next().unwrap_or(file).to_ascii_uppercase();
    let name = name.split('.').next().unwrap_or_default();
    let name = name.strip_prefix("_N_").unwrap_or(name);
    let name = name.strip_suffix("_SPF").or_else(|| name.strip_suffix("_MPF")).unwrap_or(name);
    name.as_bytes().to_vec()
}

/// What may be last at each node: the points, then what calls name, then the jumps of each program.
#[derive(Default)]
struct Graph {
    count: u32,
    edges: Vec<Edge<()>>,
    motions: Vec<(u32, u32)>,
}

impl Graph {
    fn node(&mut self) -> u32 {
        self.count += 1;
        self.count - 1
    }

    fn edge(&mut self, from: u32, to: u32) {
        self.edges.push((from, to, ()));
    }

    fn flows(&mut self, last: Last, to: u32) {
        match last {
            Last::Motion(motion) => self.motions.push((to, motion)),
            Last::Node(from) => self.edge(from, to),
        }
    }

    /// The pairs of motions across the points, by what arrives behind each.
    fn solve(mut self, arrivals: &[(u32, u32)]) -> Vec<[u32; 2]> {
        let mut last = vec![MotionSet::default(); self.count as usize];
        let height = self.motions.len();
        for (node, motion) in self.motions {
            last[node as usize].0.push(motion);
        }
        last.iter_mut().for_each(MotionSet::normalise);
        self.edges.sort_unstable();
        self.edges.dedup();
        propagate(&mut last, height, &mut self.edges, |(), motions| motions.clone());
        let pairs = arrivals.iter().flat_map(|(node, motion)| {
            let before = last[*node as usize].0.iter().filter(|before| **before + 1 != *motion);
            before.map(|before| [*before, *motion])
        });
        let mut out: Vec<[u32; 2]> = pairs.collect();
        out.sort_unstable();
        out.dedup();
        out
    }
}
