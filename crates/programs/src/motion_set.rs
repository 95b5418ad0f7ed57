//! Sets of motions, as facts of an analysis.

use crate::dataflow::Lattice;

/// A set of motions, sorted.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct MotionSet(pub(crate) Vec<u32>);

impl MotionSet {
    pub(crate) fn normalise(&mut self) {
        self.0.sort_unstable();
        self.0.dedup();
    }
}

/// The union.
impl Lattice for MotionSet {
    fn join(&mut self, other: &Self) {
        self.0.extend_from_slice(&other.0);
        self.normalise();
    }
}
