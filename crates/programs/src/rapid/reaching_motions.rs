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
    /// A motion in the routine called there.
    Call(u32),
}

/// A set of motions, one of which was executed last.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct ReachingMotions {
    /// In order.
    last: SmallVec<[Last; 2]>,
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
        Self { last: motion.map(Last::Motion).into_iter().collect(), ..Self::default() }
    }

    /// The last motion before the routine was called.
    pub(super) fn routine_entry() -> Self {
        Self { entry: true, ..Self::default() }
    }

    /// Any motion.
    pub(super) fn any() -> Self {
        Self { any: true, ..Self::default() }
    }

    /// Or a motion of the routines called there.
    pub(super) fn or_in_calls(&mut self, calls: Vec<u32>) {
        self.join(&Self { last: calls.into_iter().map(Last::Call).collect(), any: true, ..Self::default() });
    }

    /// At the head of a loop, after any number of iterations.
    pub(super) fn in_loop(&self) -> Self {
        Self { any_in_loop: true, ..self.clone() }
    }

    /// Behind a loop that was entered with `outside`.
    pub(super) fn leave_loop(&mut self, outside: &Self) {
        self.any_in_loop = outside.any_in_loop;
    }

    /// The motions of the routine; `None` where any may have been the last.
    pub(super) fn motions(&self) -> Option<impl Iterator<Item = u32>> {
        let motion = |last: &Last| match last {
            Last::Motion(motion) => Some(*motion),
            Last::Call(_) => None,
        };
        (!self.any && !self.any_in_loop).then(|| self.last.iter().filter_map(motion))
    }

    /// Those that are known, whether or not others may follow in a loop or a handler.
    pub(super) fn known(&self) -> &[Last] {
        &self.last
    }

    /// Whether the last motion may stand in another routine.
    pub(super) fn crosses_call(&self) -> bool {
        self.entry || self.last.iter().any(|last| matches!(last, Last::Call(_)))
    }
}

/// The union.
impl Lattice for ReachingMotions {
    fn join(&mut self, other: &Self) {
        if self.last != other.last {
            self.last.extend_from_slice(&other.last);
            self.last.sort_unstable();
            self.last.dedup();
        }
        if self.last.len() > MAX_MOTIONS {
            (self.last, self.any) = (SmallVec::new(), true);
        }
        self.any |= other.any;
        self.any_in_loop |= other.any_in_loop;
        self.entry |= other.entry;
    }
}
