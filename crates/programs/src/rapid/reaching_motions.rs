//! Reaching motions: which motions may be the last executed before a statement, as reaching definitions are for data.
//!
//! A displacement counted from the robot's current position (PDispOn without \ExeP) requires that none of these endpoints moves, and a
//! path that goes on across a call of a routine must be corrected on both sides of it.

use smallvec::SmallVec;

use crate::dataflow::Lattice;

/// What moved the robot last.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Last {
    /// This motion of the routine.
    Motion(u32),
    /// A motion in the routine called there, or before the call if it makes none.
    Call(u32),
    /// What is last in an iteration of this loop.
    Iteration(u32),
}

/// A set of motions, one of which was executed last.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct ReachingMotions {
    /// In order.
    last: SmallVec<[Last; 2]>,
    /// Or any motion of the program.
    pub(super) any: bool,
    /// Or any motion or call of the routine, or what was last before it.
    pub(super) anywhere: bool,
    /// Or any motion of an enclosing loop.
    any_in_loop: bool,
    /// Or the last motion before the routine was called.
    pub(super) entry: bool,
    /// Or something moved the robot that is no motion of the listing, or an error or interrupt led elsewhere.
    pub(super) elsewhere: bool,
}

/// A larger set is any motion for what depends on the robot's position.
const MAX_MOTIONS: usize = 256;

/// A larger set is any motion of the routine.
const MAX_KNOWN: usize = 1 << 16;

/// So many elements are inserted one by one.
const FEW_ELEMENTS: usize = 8;

impl ReachingMotions {
    /// This motion.
    pub(super) fn after(motion: Option<u32>) -> Self {
        Self {
            last: motion.map(Last::Motion).into_iter().collect(),
            elsewhere: motion.is_none(),
            ..Self::default()
        }
    }

    /// A motion in one of the routines called there.
    pub(super) fn after_calls(calls: &[u32]) -> Self {
        Self { last: calls.iter().copied().map(Last::Call).collect(), any: true, ..Self::default() }
    }

    /// The last motion before the routine was called.
    pub(super) fn routine_entry() -> Self {
        Self { entry: true, ..Self::default() }
    }

    /// Any motion, at a point that can be reached from anywhere in the routine.
    pub(super) fn at_any_point() -> Self {
        Self { any: true, anywhere: true, elsewhere: true, ..Self::default() }
    }

    /// At the head of a loop, after any number of iterations.
    pub(super) fn in_loop(&self, iteration: Option<u32>) -> Self {
        let mut out = Self { any_in_loop: true, ..self.clone() };
        if let Some(iteration) = iteration {
            out.insert(Last::Iteration(iteration));
        }
        out
    }

    /// After a loop that was entered with `outside`.
    pub(super) fn leave_loop(&mut self, outside: &Self) {
        self.any_in_loop = outside.any_in_loop;
    }

    /// The motions of the routine; `None` where any may have been the last.
    pub(super) fn motions(&self) -> Option<impl Iterator<Item = u32>> {
        let motion = |last: &Last| match last {
            Last::Motion(motion) => Some(*motion),
            Last::Call(_) | Last::Iteration(_) => None,
        };
        (!self.any && !self.any_in_loop).then(|| self.last.iter().filter_map(motion))
    }

    /// Those without what was last before the routine.
    pub(super) fn within_routine(&self) -> Self {
        Self { entry: false, ..self.clone() }
    }

    /// What is known of them.
    pub(super) fn known(&self) -> &[Last] {
        &self.last
    }

    /// Whether the last motion may stand in another routine, or in an earlier iteration.
    pub(super) fn crosses_call(&self) -> bool {
        self.entry || self.anywhere || self.last.iter().any(|last| !matches!(last, Last::Motion(_)))
    }

    fn insert(&mut self, last: Last) {
        if let Err(at) = self.last.binary_search(&last) {
            self.last.insert(at, last);
        }
    }
}

/// The union.
impl Lattice for ReachingMotions {
    fn join(&mut self, other: &Self) {
        if other.last.len() <= FEW_ELEMENTS {
            other.last.iter().for_each(|last| self.insert(*last));
        } else if self.last != other.last {
            self.last.extend_from_slice(&other.last);
            self.last.sort_unstable();
            self.last.dedup();
        }
        self.any |= other.any || self.last.len() > MAX_MOTIONS;
        self.anywhere |= other.anywhere;
        if self.last.len() > MAX_KNOWN {
            (self.last, self.anywhere) = (SmallVec::new(), true);
        }
        self.any_in_loop |= other.any_in_loop;
        self.entry |= other.entry;
        self.elsewhere |= other.elsewhere;
    }
}
