//! Long work that can be watched and called off: one hook for progress and for cancelling, from outside the library.
//!
//! A caller runs its work under a [`Watch`] ([`run_watched`]). What computes says where it stands ([`report_step`]) and asks now and then
//! whether it shall go on ([`checkpoint`]), without being handed anything: the watch is known to the threads that the work runs
//! on. Called off, the work is unwound from its next checkpoint, so that nothing between there and the caller has to know; the
//! caller gets [`Cancelled`] in place of a result. Outside a watch both do nothing.
//!
//! A checkpoint costs a look at the thread and one at a flag, some nanoseconds: it stands where a block of rows, a candidate or a
//! motion begins, never in an inner loop.

use std::cell::RefCell;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// What listens to a piece of work, and can call it off.
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
    /// A watch that hears of each step, from whatever thread comes to it.
    pub fn with_listener(listener: impl Fn(&str) + Send + Sync + 'static) -> Self {
        Self { cancelled: AtomicBool::new(false), listener: Box::new(listener) }
    }

    /// Calls the work off: it ends at its next checkpoint.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// Whether it was called off.
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

/// What a thread of a watched piece of work does first.
fn heed(watch: &Arc<Watch>) {
    WATCH.with(|place| *place.borrow_mut() = Some(watch.clone()));
}

/// Ends the work here where it was called off.
pub fn checkpoint() {
    let cancelled = WATCH.with(|place| place.borrow().as_ref().is_some_and(|watch| watch.is_cancelled()));
    if cancelled {
        // No panic: no hook hears of it, and nothing is printed.
        resume_unwind(Box::new(Cancelled));
    }
}

/// Says what is being done now, and ends the work where it was called off.
pub fn report_step(step: &str) {
    checkpoint();
    let watch = WATCH.with(|place| place.borrow().clone());
    if let Some(watch) = watch {
        (watch.listener)(step);
    }
}

/// As deep as the main thread of a program.
const STACK_BYTES: usize = 8 << 20;

/// Runs `work` on threads of its own, as many as the machine has unless stated, under a watch.
///
/// ```
/// use std::sync::Arc;
/// use truegrind_math::work::{Cancelled, Watch, checkpoint, report_step, run_watched};
///
/// let watch = Arc::new(Watch::default());
/// assert_eq!(run_watched(&watch, Some(2), || 6 * 7)?, Ok(42));
///
/// // Whoever holds the watch calls the work off; here the work itself, at its second step.
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
/// Where the system gives no threads; inside, [`Cancelled`] where the work was called off.
///
/// # Panics
/// With what the work panics with.
pub fn run_watched<T: Send>(
    watch: &Arc<Watch>,
    threads: Option<usize>,
    work: impl FnOnce() -> T + Send,
) -> Result<Result<T, Cancelled>, rayon::ThreadPoolBuildError> {
    let heeded = watch.clone();
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads.unwrap_or(0))
        .stack_size(STACK_BYTES)
        .start_handler(move |_| heed(&heeded))
        .build()?;
    // What the work held is lost with it, so nobody sees it half done.
    let ended = catch_unwind(AssertUnwindSafe(|| pool.install(work)));
    Ok(ended.map_err(|payload| match payload.downcast::<Cancelled>() {
        Ok(cancelled) => *cancelled,
        Err(payload) => resume_unwind(payload),
    }))
}
