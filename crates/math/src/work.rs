//! Progress and cancellation of long computations.
//!
//! A caller runs its work under a [`Watch`] ([`run_watched`]). The computation reports its progress ([`report_step`]) and checks
//! for cancellation ([`checkpoint`]); the watch is stored in the threads of the work and need not be passed. When cancelled, the
//! work is unwound from its next checkpoint, and the caller gets [`Cancelled`] instead of a result. Outside a watch both
//! functions do nothing.
//!
//! A checkpoint reads a thread-local variable and a flag, which takes some nanoseconds: it is placed at the beginning of a block
//! of rows, a candidate or a motion, never in an inner loop.

use std::cell::RefCell;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Receives the progress of a computation, and can cancel it.
pub struct Watch {
    cancelled: AtomicBool,
    listener: Box<dyn Fn(&str) + Send + Sync>,
}

impl fmt::Debug for Watch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Watch").field("cancelled", &self.cancelled).finish_non_exhaustive()
    }
}

impl Default for Watch {
    fn default() -> Self {
        Self::with_listener(|_| {})
    }
}

impl Watch {
    /// A watch that is called for each step, from any thread.
    pub fn with_listener(listener: impl Fn(&str) + Send + Sync + 'static) -> Self {
        Self { cancelled: AtomicBool::new(false), listener: Box::new(listener) }
    }

    /// Cancels the work, which ends at its next checkpoint.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// Whether the work was cancelled.
    pub fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}

/// The work was called off before it ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cancelled;

impl fmt::Display for Cancelled {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("called off before it ended")
    }
}

impl std::error::Error for Cancelled {}

thread_local! {
    static WATCH: RefCell<Option<Arc<Watch>>> = const { RefCell::new(None) };
}

/// Initialises a thread of watched work.
fn watch_this_thread(watch: &Arc<Watch>) {
    WATCH.with(|current| *current.borrow_mut() = Some(watch.clone()));
}

/// Ends the work here if it was cancelled.
pub fn checkpoint() {
    let cancelled = WATCH.with(|current| current.borrow().as_ref().is_some_and(|watch| watch.is_cancelled()));
    if cancelled {
        // Not a panic: no panic hook is called, and nothing is printed.
        resume_unwind(Box::new(Cancelled));
    }
}

/// Reports the current step, and ends the work if it was cancelled.
pub fn report_step(step: &str) {
    checkpoint();
    let watch = WATCH.with(|current| current.borrow().clone());
    if let Some(watch) = watch {
        (watch.listener)(step);
    }
}

/// Stack size, as of a program's main thread.
const STACK_BYTES: usize = 8 << 20;

/// Runs `work` on its own threads under a watch; by default as many threads as the machine has.
///
/// ```
/// use std::sync::Arc;
/// use truegrind_math::work::{Cancelled, Watch, checkpoint, report_step, run_watched};
///
/// let watch = Arc::new(Watch::default());
/// assert_eq!(run_watched(&watch, Some(2), || 6 * 7)?, Ok(42));
///
/// // Any holder of the watch can cancel the work; here the work itself, at its second step.
/// let caller = watch.clone();
/// let ended = run_watched(&watch, None, move || {
///     for step in 0.. {
///         report_step(&format!("step {step}"));
///         if step == 1 {
///             caller.cancel();
///         }
///         checkpoint();
///     }
/// })?;
/// assert_eq!(ended, Err(Cancelled));
/// # Ok::<(), rayon::ThreadPoolBuildError>(())
/// ```
///
/// # Errors
/// If the system provides no threads; inside, [`Cancelled`] if the work was cancelled.
///
/// # Panics
/// If the work panics.
pub fn run_watched<T: Send>(
    watch: &Arc<Watch>,
    threads: Option<usize>,
    work: impl FnOnce() -> T + Send,
) -> Result<Result<T, Cancelled>, rayon::ThreadPoolBuildError> {
    let watch_of_threads = watch.clone();
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads.unwrap_or(0))
        .stack_size(STACK_BYTES)
        .start_handler(move |_| watch_this_thread(&watch_of_threads))
        .build()?;
    // Unwind safety: the work's state is dropped with it, so no partial state is visible.
    let ended = catch_unwind(AssertUnwindSafe(|| pool.install(work)));
    Ok(ended.map_err(|payload| match payload.downcast::<Cancelled>() {
        Ok(cancelled) => *cancelled,
        Err(payload) => resume_unwind(payload),
    }))
}
