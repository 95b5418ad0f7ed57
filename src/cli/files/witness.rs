//! What is read, by its content: between two calls every file that is read is noted, so that a key covers what was read and
//! not what somebody thought of listing.

use std::sync::{Mutex, MutexGuard, PoisonError};

use truegrind::units::key::sha256;

static SEEN: Mutex<Option<Vec<String>>> = Mutex::new(None);

fn seen() -> MutexGuard<'static, Option<Vec<String>>> {
    SEEN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// From here on.
pub(crate) fn begin() {
    *seen() = Some(Vec::new());
}

/// Up to here: the SHA-256 of each, in the order in which they were read.
pub(crate) fn end() -> Vec<String> {
    seen().take().unwrap_or_default()
}

/// Notes what was read.
pub(super) fn note(bytes: &[u8]) {
    if let Some(seen) = seen().as_mut() {
        seen.push(sha256(bytes));
    }
}
