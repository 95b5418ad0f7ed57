//! What every verb that computes takes, and the threads it computes on.

use std::sync::Arc;

use clap::Args;
use truegrind::math::work::{Watch, run_watched};

use super::progress::Work;

/// What every verb that computes takes.
#[derive(Debug, Clone, Args)]
pub(super) struct Common {
    /// Seed of everything random.
    #[arg(long, default_value_t = 0)]
    pub(super) seed: u64,
    /// Threads; the result is the same for any number.
    #[arg(long)]
    pub(super) threads: Option<usize>,
}

/// More threads than any machine has processors only cost memory.
const MOST_THREADS: usize = 1024;

/// A number of threads that can be.
fn checked(threads: Option<usize>) -> anyhow::Result<Option<usize>> {
    match threads {
        Some(n) if !(1..=MOST_THREADS).contains(&n) => {
            anyhow::bail!("--threads {n}: expected 1 to {MOST_THREADS}")
        }
        threads => Ok(threads),
    }
}

/// Runs `work` on the stated number of threads, and shows each step that the library tells.
pub(super) fn watching<T: Send>(
    threads: Option<usize>,
    shown: &Work,
    work: impl FnOnce() -> T + Send,
) -> anyhow::Result<T> {
    let watch = Arc::new(Watch::with_listener(shown.listener()));
    Ok(run_watched(&watch, checked(threads)?, work)??)
}

/// Runs `work` on the stated number of threads.
pub(super) fn on_threads<T: Send>(
    threads: Option<usize>,
    work: impl FnOnce() -> T + Send,
) -> anyhow::Result<T> {
    match checked(threads)? {
        None => Ok(work()),
        Some(n) => Ok(rayon::ThreadPoolBuilder::new().num_threads(n).build()?.install(work)),
    }
}
