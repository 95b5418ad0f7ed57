//! Condition of the arm along a segment, and the sampling accuracy of segments.

use crate::backlash::motion_end::{BacklashSides, JointSides};

/// Accuracy to which sampled deviations are determined between samples (mm): the midpoint deviates from the chord of two
/// samples by no more.
pub(crate) const CHORD_MM: f64 = 0.002;

/// Index of the condition along a segment, piecewise constant in the share of the path.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ConditionSchedule {
    /// From the start.
    pub(crate) first: usize,
    /// Changes caused by joint reversals: share of the path, and the condition from there.
    pub(crate) later: Vec<(f64, usize)>,
}

impl ConditionSchedule {
    /// Along a segment with these backlash sides; `condition_index`: that of the sides with the payload there.
    pub(crate) fn of(sides: &BacklashSides, mut condition_index: impl FnMut(JointSides) -> usize) -> Self {
        let mut turns = sides.turns.iter();
        let first = turns.next().map(|turn| turn.1);
        let later = turns.map(|(share, sides)| (*share, condition_index(*sides))).collect();
        Self { first: condition_index(first.unwrap_or(sides.end)), later }
    }

    pub(crate) fn at(&self, s: f64) -> usize {
        self.later.iter().rev().find(|(from, _)| *from <= s).map_or(self.first, |later| later.1)
    }
}
