//! Where the targets of each motion are in a list of all targets.

use std::ops::Range;
use std::sync::Arc;

/// The ranges; copies share them.
#[derive(Clone)]
pub(crate) struct TargetRanges {
    /// Index of the first target of each motion, and the total count.
    first: Arc<[u32]>,
}

impl TargetRanges {
    /// From the index of the first target of each motion, and the total count.
    pub(crate) fn of(first: Vec<u32>) -> Self {
        Self { first: first.into() }
    }

    /// The targets of a motion.
    pub(crate) fn of_motion(&self, motion: usize) -> Range<usize> {
        self.of_motions(motion..motion + 1)
    }

    /// The targets of consecutive motions.
    pub(crate) fn of_motions(&self, motions: Range<usize>) -> Range<usize> {
        self.first[motions.start] as usize..self.first[motions.end] as usize
    }
}
