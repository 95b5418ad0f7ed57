//! Options of every verb that computes, and the thread pool.

use std::sync::Arc;

use clap::Args;
use truegrind::math::work::{Watch, run_watched};

use super::progress::Spinner;

/// Options of every verb that computes.
#[derive(Debug, Clone, Args)]
pub(super) struct Common {
    /// Seed of all random numbers.
    #[arg(long, default_value_t = 0, allow_negative_numbers = true)]
    pub(super) seed: u64,
    /// Number of threads; the result does not depend on it.
    #[arg(long)]
    pub(super) threads: Option<usize>,
}

/// More threads would only cost memory.
const MAX_THREADS: usize = 1024;

fn check_threads(threads: Option<usize>) -> anyhow::Result<Option<usize>> {
    match threads {
        Some(n) if !(1..=MAX_THREADS).contains(&n) => {
            anyhow::bail!("--threads {n}: expected 1 to {MAX_THREADS}")
        }
        threads => Ok(threads),
    }
}

/// Runs `work` on the given number of threads and shows the progress that the library reports.
pub(super) fn watching<T: Send>(
    threads: Option<usize>,
    shown: &Spinner,
    work: impl FnOnce() -> T + Send,
) -> anyhow::Result<T> {
    let watch = Arc::new(Watch::with_listener(shown.listener()));
    Ok(run_watched(&watch, check_threads(threads)?, work)??)
}

/// [`on_threads`] for work that waits for the disk in between: without a number, one thread more than there are processors, which
/// computes meanwhile.
pub(super) fn on_threads_that_wait<T: Send>(
    threads: Option<usize>,
    work: impl FnOnce() -> T + Send,
) -> anyhow::Result<T> {
    on_threads(threads.or_else(|| Some((rayon::current_num_threads() + 1).min(MAX_THREADS))), work)
}

/// Runs `work` on the given number of threads.
pub(super) fn on_threads<T: Send>(
    threads: Option<usize>,
    work: impl FnOnce() -> T + Send,
) -> anyhow::Result<T> {
    match check_threads(threads)? {
        // On a thread of the pool: this one would sleep and be woken at every parallel step.
        None => Ok(rayon::join(work, || ()).0),
        Some(n) => Ok(rayon::ThreadPoolBuilder::new().num_threads(n).build()?.install(work)),
    }
}
