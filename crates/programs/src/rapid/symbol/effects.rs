//! Side effects: the writes of one statement, and the side-effect summary of a routine.

use crate::dataflow::Lattice;
use crate::motion::Reason;
use crate::rapid::modal::SwitchSet;

/// A routine that may write more outside data than this counts as writing anything.
pub(super) const MAX_WRITES: usize = 1024;

/// How a statement writes data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WriteKind {
    /// The whole, or a part that the text does not determine.
    Whole,
    /// One component: the node of the assigned place.
    Part(u32),
    /// Passed to a routine that none of the files declares or that is called by a computed name.
    Escaped,
    /// At any time from here on: the controller keeps a reference and writes it when an event occurs.
    Later,
}

/// A write of data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Write {
    /// The data.
    pub symbol: u32,
    /// How it is written.
    pub kind: WriteKind,
}

/// Side-effect summary of a routine: everything that a call may do, callees included. All may-information.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SideEffects {
    /// Data declared outside the routine that it may write, sorted.
    pub writes: Vec<u32>,
    /// Whether it calls unknown code, which may write all data declared outside routines.
    pub writes_anything: bool,
    /// Whether it may move the robot.
    pub moves: bool,
    /// Whether it waits, so that another task may write shared data.
    pub waits: bool,
    /// Whether it may change the gripped load (GripLoad).
    pub grips: bool,
    /// Whether it is impure: it writes outside data, moves, waits, reads a device or a clock, or raises.
    pub impure: bool,
    /// Whether it counts a displacement from the robot's current position (PDispOn without \ExeP).
    pub uses_position: bool,
    /// Whether it decides by the robot's current position (CRobT in a condition).
    pub decides_by_position: bool,
    /// The switches that it sets at some time, not at its end alone.
    pub switches: SwitchSet,
}

impl SideEffects {
    /// How many times they can grow: the writes, "anything", seven flags, the switches.
    pub(super) const HEIGHT: usize = MAX_WRITES + 8 + SwitchSet::HEIGHT;

    /// Sorts the writes and widens too many of them to "anything".
    pub(super) fn normalise(&mut self) {
        self.writes.sort_unstable();
        self.writes.dedup();
        self.writes_anything |= self.writes.len() > MAX_WRITES;
        if self.writes_anything {
            self.writes.clear();
        }
    }
}

impl Lattice for SideEffects {
    fn join(&mut self, callee: &Self) {
        self.writes_anything |= callee.writes_anything;
        self.moves |= callee.moves;
        self.waits |= callee.waits;
        self.grips |= callee.grips;
        self.impure |= callee.impure;
        self.uses_position |= callee.uses_position;
        self.decides_by_position |= callee.decides_by_position;
        self.switches = self.switches.join(callee.switches);
        self.writes.extend_from_slice(&callee.writes);
        self.normalise();
    }
}

/// Why data may be written: an assignment hides that it is also handed over.
impl Lattice for Reason {
    fn join(&mut self, other: &Self) {
        if self != other {
            *self = Reason::Assigned;
        }
    }
}
