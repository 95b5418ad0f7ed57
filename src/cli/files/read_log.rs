//! Log of the files read between two calls, by content, so that the key of a run covers every file that was read.

use std::sync::{Mutex, MutexGuard, PoisonError};

use truegrind::units::key::sha256;

static SEEN: Mutex<Option<Vec<String>>> = Mutex::new(None);

fn seen() -> MutexGuard<'static, Option<Vec<String>>> {
    SEEN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Starts the log.
pub(crate) fn begin() {
    *seen() = Some(Vec::new());
}

/// Ends the log: the SHA-256 of each file, in the order of reading.
pub(crate) fn finish() -> Vec<String> {
    seen().take().unwrap_or_default()
}

/// Adds a file.
pub(super) fn note(bytes: &[u8]) {
    if let Some(seen) = seen().as_mut() {
        seen.push(sha256(bytes));
    }
}
