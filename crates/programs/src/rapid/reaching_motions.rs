//! Reaching motions: which motions may be the last executed before a statement, as reaching definitions are for data.
//!
//! A displacement counted from the robot's current position (PDispOn without \ExeP) requires that none of these endpoints moves.

use crate::dataflow::Lattice;

/// A set of motions, one of which was executed last.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct ReachingMotions {
    /// Their indices, sorted.
    motions: Vec<u32>,
    /// Or any motion of the program.
    pub(super) any: bool,
    /// Or any motion of an enclosing loop.
    any_in_loop: bool,
    /// Or the last motion before the routine was called.
    pub(super) entry: bool,
}

/// A larger set is widened to any motion.
const MAX_MOTIONS: usize = 256;

impl ReachingMotions {
    /// This motion.
    pub(super) fn after(motion: Option<u32>) -> Self {
        Self { motions: motion.into_iter().collect(), ..Self::default() }
    }

    /// The last motion before the routine was called.
    pub(super) fn routine_entry() -> Self {
        Self { entry: true, ..Self::default() }
    }

    /// Any motion.
    pub(super) fn any() -> Self {
        Self { any: true, ..Self::default() }
    }

    /// At the head of a loop, after any number of iterations.
    pub(super) fn in_loop(&self) -> Self {
        Self { any_in_loop: true, ..self.clone() }
    }

    /// Behind a loop that was entered with `outside`.
    pub(super) fn leave_loop(&mut self, outside: &Self) {
        self.any_in_loop = outside.any_in_loop;
    }

    /// The motions; `None` where any may have been the last.
    pub(super) fn motions(&self) -> Option<&[u32]> {
        (!self.any && !self.any_in_loop).then_some(&self.motions)
    }
}

/// The union.
impl Lattice for ReachingMotions {
    fn join(&mut self, other: &Self) {
        if self.motions != other.motions {
            self.motions.extend_from_slice(&other.motions);
            self.motions.sort_unstable();
            self.motions.dedup();
        }
        if self.motions.len() > MAX_MOTIONS {
            (self.motions, self.any) = (Vec::new(), true);
        }
        self.any |= other.any;
        self.any_in_loop |= other.any_in_loop;
        self.entry |= other.entry;
    }
}
