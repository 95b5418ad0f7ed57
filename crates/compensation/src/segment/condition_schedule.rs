//! A way from target to target: under which condition the arm goes along it, and how finely it is told.

/// Between two samples the distance from the intended path is known to this (mm): their chord leaves the distance half
/// way by no more.
pub(crate) const CHORD_MM: f64 = 0.002;

/// Under which condition the arm goes along a path: from a share of the way on, a place in the list of conditions.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ConditionSchedule {
    /// From the start on.
    pub(crate) first: usize,
    /// Where it changes, because a joint turns: share of the way, and from there on.
    pub(crate) later: Vec<(f64, usize)>,
}

impl ConditionSchedule {
    pub(crate) fn at(&self, s: f64) -> usize {
        self.later.iter().rev().find(|(from, _)| *from <= s).map_or(self.first, |later| later.1)
    }
}
