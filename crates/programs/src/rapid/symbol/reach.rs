//! What one statement changes, what a call may bring about, and how a unit leaves the switches.

use crate::rapid::modal::States;

/// A routine that changes more data outside than this may as well change anything.
pub(super) const REACH: usize = 1024;

/// How a statement changes data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum How {
    /// As a whole, or in a way that the text does not tell.
    Whole,
    /// One component: the node of the place that is assigned.
    Part(u32),
    /// It is given to a routine that is declared in none of the files, or called by a computed name.
    HandedOver,
    /// From here on at any time: the controller keeps it and writes it when something happens.
    Later,
}

/// A change of data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Change {
    /// The data.
    pub symbol: u32,
    /// How.
    pub how: How,
}

/// What a call of a routine may bring about.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Reach {
    /// Data declared outside the routine that it may change, in order.
    pub changes: Vec<u32>,
    /// Whether it calls what is not known here, which may change everything that is declared outside routines.
    pub anything: bool,
    /// Whether it may move the robot.
    pub moves: bool,
    /// Whether it waits, so that another task may write what tasks share.
    pub waits: bool,
    /// Whether it may grip something else (GripLoad).
    pub grips: bool,
    /// Whether it does more than answer: it changes what others see, moves, writes, waits, reads devices, raises.
    pub acts: bool,
    /// Whether it counts a displacement from where the robot stands (PDispOn without \ExeP).
    pub places: bool,
    /// The switches that statements in it, or in what it calls, set: at some time, not at its end alone.
    pub sets: States,
}

impl Reach {
    /// In order, each once; and anything where it is too much.
    pub(super) fn settle(&mut self) {
        self.changes.sort_unstable();
        self.changes.dedup();
        if self.changes.len() > REACH {
            self.anything = true;
        }
        if self.anything {
            self.changes.clear();
        }
    }
}

/// How a unit leaves the switches that act in execution order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ends {
    /// As they were at its entry.
    AsItBegins,
    /// As its statements set them.
    Set {
        /// Whether anything calls it.
        called: bool,
    },
}
