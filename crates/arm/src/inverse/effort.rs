//! How much the careful road may still cost: evaluations of the arm, counted and never timed, so that the same targets end
//! the same way on every machine and for any number of threads.
//!
//! A target that is reached costs a few evaluations, in lanes. One that is not, or that lies beside a singularity, is sought
//! from every branch and from seeds all about: thousands of them. A file of a hundred thousand such targets would keep the
//! machine busy for minutes, so whoever works through targets of others does it [`within`] an allowance. What is sought
//! when that is used up ends with [`InverseError::Abandoned`](super::InverseError::Abandoned).

use std::cell::Cell;

/// What may still be done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Allowance {
    /// Evaluations of the arm in searches.
    pub evaluations: u64,
    /// Targets that are reached from nearby ([`Inverse::solve_near`](super::Inverse::solve_near)).
    pub steps: u64,
    /// Whether the latest work wanted more than there was.
    pub ran_out: bool,
    /// Whether any work did.
    pub short: bool,
}

impl Allowance {
    /// So many evaluations in searches; steps from nearby are not counted.
    pub fn of(evaluations: u64) -> Self {
        Self { evaluations, steps: u64::MAX, ran_out: false, short: false }
    }

    /// The same with so many steps.
    pub fn with_steps(self, steps: u64) -> Self {
        Self { steps, ..self }
    }

    /// What piece `index` of `count` equal ones gets; all together get the whole.
    pub fn part(self, index: usize, count: usize) -> Self {
        let part = |total: u64| {
            let up_to = |pieces: usize| (u128::from(total) * pieces as u128 / count.max(1) as u128) as u64;
            up_to(index + 1) - up_to(index)
        };
        let steps = if self.steps == u64::MAX { u64::MAX } else { part(self.steps) };
        Self { evaluations: part(self.evaluations), steps, ..self }
    }
}

thread_local! {
    /// The allowance of the work that this thread does now; absent where nobody counts.
    static NOW: Cell<Option<Allowance>> = const { Cell::new(None) };
}

/// Puts back what was there before, also where the work panics.
struct Before(Option<Allowance>);

impl Drop for Before {
    fn drop(&mut self) {
        NOW.set(self.0);
    }
}

/// Does some work on this thread alone, its careful searches within an allowance, from which they are taken.
pub fn within<T>(allowance: &mut Allowance, work: impl FnOnce() -> T) -> T {
    let before = Before(NOW.replace(Some(Allowance { ran_out: false, ..*allowance })));
    let done = work();
    if let Some(left) = NOW.get() {
        *allowance = left;
    }
    drop(before);
    done
}

/// Takes evaluations that were made.
pub(super) fn spend(evaluations: u64) {
    if let Some(now) = NOW.get() {
        NOW.set(Some(Allowance { evaluations: now.evaluations.saturating_sub(evaluations), ..now }));
    }
}

/// Whether nothing is left for what is about to be sought.
pub(super) fn refuses() -> bool {
    refused(|now| now.evaluations == 0)
}

/// Takes a step from nearby; whether there is none left.
pub(super) fn refuses_step() -> bool {
    if let Some(now) = NOW.get()
        && now.steps > 0
    {
        NOW.set(Some(Allowance { steps: now.steps - u64::from(now.steps < u64::MAX), ..now }));
        return false;
    }
    refused(|now| now.steps == 0)
}

fn refused(empty: impl Fn(&Allowance) -> bool) -> bool {
    match NOW.get() {
        Some(now) if empty(&now) => {
            NOW.set(Some(Allowance { ran_out: true, short: true, ..now }));
            true
        }
        _ => false,
    }
}

/// Whether something was refused already.
pub(super) fn ran_out() -> bool {
    NOW.get().is_some_and(|now| now.ran_out)
}
