//! Search budget: bounds the work of the global inverse search, counted in evaluations of the arm and never timed, so that
//! the result depends neither on the machine nor on the number of threads.
//!
//! A reachable target costs a few evaluations, in lanes. An unreachable one, or one beside a singularity, is searched from
//! every branch and from seeds spread over the joint ranges: thousands of evaluations. A file with a hundred thousand such
//! targets would run for minutes, so code that solves targets from files calls [`with_budget`]. A search that starts when the
//! budget is used up ends with [`InverseError::Abandoned`](super::InverseError::Abandoned).

use std::cell::Cell;

/// Remaining work, and whether it ran out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SearchBudget {
    /// Evaluations of the arm in searches.
    pub evaluations: u64,
    /// Calls of [`Inverse::solve_near`](super::Inverse::solve_near).
    pub near_solves: u64,
    /// Whether the latest [`with_budget`] needed more than was left.
    pub exhausted: bool,
    /// Whether any of them did.
    pub ever_exhausted: bool,
}

impl SearchBudget {
    /// A budget of evaluations in searches, with unlimited calls of `solve_near`.
    pub fn of(evaluations: u64) -> Self {
        Self { evaluations, near_solves: u64::MAX, exhausted: false, ever_exhausted: false }
    }

    /// The same with a limit on calls of `solve_near`.
    pub fn with_near_solves(self, near_solves: u64) -> Self {
        Self { near_solves, ..self }
    }

    /// Share `index` of `count` equal ones; the shares add up to the whole.
    pub fn share(self, index: usize, count: usize) -> Self {
        let share = |total: u64| {
            let up_to = |pieces: usize| (u128::from(total) * pieces as u128 / count.max(1) as u128) as u64;
            up_to(index + 1) - up_to(index)
        };
        let near_solves = if self.near_solves == u64::MAX { u64::MAX } else { share(self.near_solves) };
        Self { evaluations: share(self.evaluations), near_solves, ..self }
    }
}

thread_local! {
    /// Budget of the work that this thread does now; `None` where nothing is counted.
    static NOW: Cell<Option<SearchBudget>> = const { Cell::new(None) };
}

/// Restores the previous budget, also where the work panics.
struct Restore(Option<SearchBudget>);

impl Drop for Restore {
    fn drop(&mut self) {
        NOW.set(self.0);
    }
}

/// Runs `work` on this thread; its searches are charged to `budget`.
pub fn with_budget<T>(budget: &mut SearchBudget, work: impl FnOnce() -> T) -> T {
    let before = Restore(NOW.replace(Some(SearchBudget { exhausted: false, ..*budget })));
    let done = work();
    if let Some(left) = NOW.get() {
        *budget = left;
    }
    drop(before);
    done
}

/// Charges evaluations to the current budget.
pub(super) fn spend(evaluations: u64) {
    if let Some(now) = NOW.get() {
        NOW.set(Some(SearchBudget { evaluations: now.evaluations.saturating_sub(evaluations), ..now }));
    }
}

/// Whether no evaluations are left for a new search.
pub(super) fn refuses() -> bool {
    refused(|now| now.evaluations == 0)
}

/// Charges one call of `solve_near`; whether none was left.
pub(super) fn refuses_near_solve() -> bool {
    if let Some(now) = NOW.get()
        && now.near_solves > 0
    {
        NOW.set(Some(SearchBudget {
            near_solves: now.near_solves - u64::from(now.near_solves < u64::MAX),
            ..now
        }));
        return false;
    }
    refused(|now| now.near_solves == 0)
}

fn refused(empty: impl Fn(&SearchBudget) -> bool) -> bool {
    match NOW.get() {
        Some(now) if empty(&now) => {
            NOW.set(Some(SearchBudget { exhausted: true, ever_exhausted: true, ..now }));
            true
        }
        _ => false,
    }
}

/// Whether the current work was refused something already.
pub(super) fn exhausted() -> bool {
    NOW.get().is_some_and(|now| now.exhausted)
}
