//! The motion before a block, or those of which one ended last where paths have met.

use smallvec::{SmallVec, smallvec};

use crate::dataflow::Lattice;

/// More are as good as unknown.
const MAX_PRECEDING: usize = 64;

/// The motions of which one ended last, in order; none where that is unknown.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Preceding {
    motions: SmallVec<[u32; 2]>,
    /// Whether paths have met since.
    joined: bool,
}

impl Preceding {
    /// After a motion.
    pub(super) fn after(motion: u32) -> Self {
        Preceding { motions: smallvec![motion], joined: false }
    }

    /// Where paths meet.
    pub(super) fn meet(&mut self) {
        self.joined = !self.motions.is_empty();
    }

    /// The motion before, if no paths have met since.
    pub(super) fn single(&self) -> Option<u32> {
        self.motions.first().copied().filter(|_| !self.joined)
    }

    /// All that are known.
    pub(super) fn each(&self) -> impl Iterator<Item = u32> {
        self.motions.iter().copied()
    }

    /// Those before where paths have met; none where they are unknown.
    pub(super) fn of_paths(&self) -> Option<&[u32]> {
        (self.joined && !self.motions.is_empty()).then_some(&self.motions)
    }
}

impl Lattice for Preceding {
    fn join(&mut self, other: &Self) {
        if *self == *other {
            return;
        }
        if self.motions.is_empty() || other.motions.is_empty() {
            return *self = Preceding::default();
        }
        self.motions.extend_from_slice(&other.motions);
        self.motions.sort_unstable();
        self.motions.dedup();
        self.joined = true;
        if self.motions.len() > MAX_PRECEDING {
            *self = Preceding::default();
        }
    }
}
