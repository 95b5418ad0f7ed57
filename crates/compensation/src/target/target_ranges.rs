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
    /// From the number of targets of each motion.
    pub(crate) fn of(counts: impl Iterator<Item = usize>) -> Self {
        let mut total = 0;
        let mut first: Vec<u32> = Vec::with_capacity(counts.size_hint().0 + 1);
        first.push(0);
        first.extend(counts.map(|count| {
            total += count as u32;
            total
        }));
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
