//! Call and return edges between motions of NC files: the last motion before a call and the first in the subprogram, the last in the
//! subprogram and the first behind the call, and what jumps and loops join.
//!
//! Method: context-insensitive interprocedural control flow (Nielson, Nielson, Hankin, Principles of Program Analysis, 1999, §2.5). Where a
//! jump leads within its program is left open: it may lead to every label there.

use std::collections::{HashMap, HashSet};

use super::super::called::program_of;
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
        let mut walk = Walk::new(graph, &callees);
        let mut arrivals = Vec::new();
        for (at, point) in (0_u32..).zip(&self.points) {
            let Point { flow, file, before, behind } = point;
            if let Some(previous) = at.checked_sub(1)
                && self.points[previous as usize].behind < *before
            {
                walk.last = Last::Motion(before - 1);
            }
            match flow {
                FlowPoint::File { restarts } => walk.file(at, *file, *restarts),
                FlowPoint::Program(name) => walk.program(at, *file, name),
                FlowPoint::Label(name) => walk.label(at, *file, name),
                FlowPoint::Call { callee, may_skip } => walk.call(at, *file, callee.as_ref(), *may_skip),
                FlowPoint::Return => walk.end(at, false),
                FlowPoint::EndOfSubprogram => walk.end(at, true),
                FlowPoint::Leaves => walk.joint(at, true, false),
                FlowPoint::Arrives => walk.joint(at, false, true),
                FlowPoint::Joins => walk.joint(at, true, true),
            }
            walk.last = Last::Node(at);
            let next = self.points.get(at as usize + 1).map_or(count, |next| next.before);
            if *behind < next {
                arrivals.push((at, *behind));
            }
        }
        let behind = self.points.last().map_or(0, |last| last.behind);
        let last = if behind < count { Last::Motion(count - 1) } else { walk.last };
        walk.graph.flows(last, walk.exit);
        walk.graph.solve(&arrivals)
    }

    /// What calls can name, by file: programs, labels, and the file itself by its name and by none.
    fn callees(&self, names: &[String], graph: &mut Graph) -> Callees {
        let mut out = Callees::default();
        for (point, extent) in self.points.iter().zip(self.extents()) {
            let Some(Extent { end, has_calls }) = extent else { continue };
            let Point { flow, file, behind, .. } = point;
            let is_empty = !has_calls && end == *behind;
            let callee = Callee { entry: graph.node(), exit: graph.node(), is_empty };
            match flow {
                FlowPoint::Program(name) | FlowPoint::Label(name) => {
                    out.by_file.entry((*file, name.clone())).or_insert(callee);
                }
                _ => {
                    // Motions may follow the last point of a file.
                    let callee = Callee { is_empty: false, ..callee };
                    out.by_file.insert((*file, Vec::new()), callee);
                    out.by_file.entry((*file, program_of(&names[*file as usize]))).or_insert(callee);
                }
            }
        }
        let mut files: Vec<_> = out.by_file.iter().collect();
        files.sort_unstable_by_key(|((file, _), _)| *file);
        for ((_, name), callee) in files {
            out.anywhere.entry(name.clone()).or_insert(*callee);
        }
        out
    }

    /// Of each point that begins what calls can name: how far that goes. From behind, since a search from each point to the end of the file
    /// takes quadratic time.
    fn extents(&self) -> Vec<Option<Extent>> {
        let mut out = vec![None; self.points.len()];
        let mut behind_it = BehindIt::default();
        for (at, point) in self.points.iter().enumerate().rev() {
            if self.points.get(at + 1).is_some_and(|next| next.file != point.file) {
                behind_it = BehindIt::default();
            }
            let whole = behind_it.last.map_or(point.behind, |last| last.max(point.behind));
            let extent =
                |until: Until| Extent { end: until.end.unwrap_or(whole), has_calls: until.has_calls };
            out[at] = match &point.flow {
                FlowPoint::File { .. } => Some(extent(behind_it.file)),
                FlowPoint::Program(_) => Some(extent(behind_it.program)),
                FlowPoint::Label(_) => Some(extent(behind_it.label)),
                _ => None,
            };
            behind_it.add(point);
        }
        out
    }
}

/// How far a program, a label or a file goes.
#[derive(Debug, Clone, Copy)]
struct Extent {
    /// The motions before it end there.
    end: u32,
    has_calls: bool,
}

/// The next point that ends something, and whether a call stands before it.
#[derive(Debug, Clone, Copy, Default)]
struct Until {
    end: Option<u32>,
    has_calls: bool,
}

/// What stands behind a point in its file.
#[derive(Debug, Default)]
struct BehindIt {
    /// Nothing ends a file but the last of its points.
    file: Until,
    /// Until the next program.
    program: Until,
    /// Until the next return.
    label: Until,
    /// After the last point.
    last: Option<u32>,
}

impl BehindIt {
    fn add(&mut self, point: &Point) {
        let ends_here = Until { end: Some(point.before), has_calls: false };
        match point.flow {
            FlowPoint::Call { .. } => {
                [&mut self.file, &mut self.program, &mut self.label]
                    .into_iter()
                    .for_each(|until| until.has_calls = true);
            }
            FlowPoint::Program(_) => self.program = ends_here,
            FlowPoint::Return => self.label = ends_here,
            _ => {}
        }
        self.last.get_or_insert(point.behind);
    }
}

/// The nodes of everything that calls can name.
#[derive(Debug, Default)]
struct Callees {
    by_file: HashMap<(u32, Variable), Callee>,
    /// Of the first file that has it.
    anywhere: HashMap<Variable, Callee>,
}

/// The walk over the points of all files.
struct Walk<'c> {
    graph: Graph,
    callees: &'c Callees,
    last: Last,
    /// What the jumps of the current program leave.
    jumps: u32,
    /// What reaches its end.
    exit: u32,
    /// What goes on behind the current program: `last`, `jumps` and `exit`.
    bypassed: Option<(Last, u32, u32)>,
    /// The labels that the next return ends.
    labels: Vec<Callee>,
    /// The files in which a program has begun.
    begun: HashSet<u32>,
}

impl<'c> Walk<'c> {
    fn new(graph: Graph, callees: &'c Callees) -> Self {
        let (labels, begun) = (Vec::new(), HashSet::new());
        Self { graph, callees, last: Last::Node(0), jumps: 0, exit: 0, bypassed: None, labels, begun }
    }

    fn here(&self, file: u32, name: &Variable) -> Option<Callee> {
        if name.is_empty() { None } else { self.callees.by_file.get(&(file, name.clone())).copied() }
    }

    fn file(&mut self, at: u32, file: u32, restarts: bool) {
        // A file returns at its end, too.
        if at > 0 {
            self.graph.flows(self.last, self.exit);
        }
        let whole = self.callees.by_file[&(file, Vec::new())];
        self.graph.edge(whole.entry, at);
        (self.jumps, self.exit, self.bypassed) = (self.graph.node(), whole.exit, None);
        self.labels.clear();
        if restarts {
            self.graph.edge(whole.exit, at);
        }
    }

    fn program(&mut self, at: u32, file: u32, name: &Variable) {
        let is_first = self.begun.insert(file);
        self.bypassed = Some((self.last, self.jumps, self.exit));
        // What stands before the first program number belongs to that program.
        if is_first {
            self.graph.flows(self.last, at);
        }
        if let Some(program) = self.here(file, name) {
            self.graph.edge(program.entry, at);
            if is_first {
                self.graph.edge(program.exit, self.exit);
            }
            (self.jumps, self.exit) = (self.graph.node(), program.exit);
        }
    }

    fn label(&mut self, at: u32, file: u32, name: &Variable) {
        self.graph.flows(self.last, at);
        if let Some(label) = self.here(file, name) {
            self.graph.edge(label.entry, at);
            self.labels.push(label);
        }
        self.graph.edge(self.jumps, at);
    }

    /// `callee`: `None` for a label of the same program whose name is open.
    fn call(&mut self, at: u32, file: u32, callee: Option<&Variable>, may_skip: bool) {
        let Some(name) = callee else {
            self.graph.flows(self.last, self.jumps);
            self.graph.edge(self.exit, at);
            self.graph.flows(self.last, at);
            return;
        };
        let elsewhere = || self.callees.anywhere.get(name).copied().filter(|_| !name.is_empty());
        match self.here(file, name).or_else(elsewhere) {
            Some(callee) if !callee.is_empty => {
                self.graph.flows(self.last, callee.entry);
                self.graph.edge(callee.exit, at);
                if may_skip {
                    self.graph.flows(self.last, at);
                }
            }
            // A program that is not in these files may move or not.
            _ => self.graph.flows(self.last, at),
        }
    }

    /// A return, or the end of a subprogram that the main program bypasses.
    fn end(&mut self, at: u32, is_bypassed: bool) {
        self.graph.flows(self.last, self.exit);
        for label in self.labels.drain(..) {
            self.graph.flows(self.last, label.exit);
        }
        if let Some(main) = self.bypassed.filter(|_| is_bypassed) {
            (self.last, self.jumps, self.exit) = main;
        }
        self.graph.flows(self.last, at);
    }

    /// A point at which control may leave for, or arrive from, elsewhere in the program.
    fn joint(&mut self, at: u32, leaves: bool, arrives: bool) {
        self.graph.flows(self.last, at);
        if leaves {
            self.graph.flows(self.last, self.jumps);
        }
        if arrives {
            self.graph.edge(self.jumps, at);
        }
    }
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
