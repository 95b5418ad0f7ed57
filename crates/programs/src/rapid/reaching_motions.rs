//! Where the robot may stand when a way leads to a statement: at the ends of which motions.
//!
//! A displacement that counts from there (PDispOn without \ExeP) needs these ends where they always were, on every way.

/// Motions at one of whose ends the robot stands.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct ReachingMotions {
    /// Their indices, in order.
    motions: Vec<u32>,
    /// Or at that of any motion of the program.
    pub(super) any: bool,
    /// Or at that of any motion of a loop that is gone through.
    any_in_loop: bool,
    /// Or where it stood at the begin of the routine.
    pub(super) entry: bool,
}

/// More motions than these count as any.
const MAX_MOTIONS: usize = 256;

impl ReachingMotions {
    /// At the end of this motion.
    pub(super) fn after(motion: Option<u32>) -> Self {
        Self { motions: motion.into_iter().collect(), ..Self::default() }
    }

    /// Where it stood at the begin of the routine.
    pub(super) fn routine_entry() -> Self {
        Self { entry: true, ..Self::default() }
    }

    /// At the end of any motion.
    pub(super) fn any() -> Self {
        Self { any: true, ..Self::default() }
    }

    /// Where either stands.
    pub(super) fn join(mut self, other: Self) -> Self {
        if self.motions != other.motions {
            self.motions.extend(other.motions);
            self.motions.sort_unstable();
            self.motions.dedup();
        }
        if self.motions.len() > MAX_MOTIONS {
            (self.motions, self.any) = (Vec::new(), true);
        }
        self.any |= other.any;
        self.any_in_loop |= other.any_in_loop;
        self.entry |= other.entry;
        self
    }

    /// The same at the begin of a loop, which may have been gone through before.
    pub(super) fn in_loop(&self) -> Self {
        Self { any_in_loop: true, ..self.clone() }
    }

    /// The same behind a loop that stands where the robot did as in `outside`.
    pub(super) fn after_loop(self, outside: &Self) -> Self {
        Self { any_in_loop: outside.any_in_loop, ..self }
    }

    /// The motions, or nothing where it may be any.
    pub(super) fn motions(&self) -> Option<&[u32]> {
        (!self.any && !self.any_in_loop).then_some(&self.motions)
    }
}
