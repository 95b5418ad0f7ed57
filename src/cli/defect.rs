//! Catches panics: a defect of truegrind in one unit of work becomes an error of that unit, with a request to report it.
//!
//! In a run over many programs the others are not affected. A stack overflow cannot be caught; recursion depth that depends on
//! inputs is limited by the parsers.

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, PoisonError};

/// Source locations of the latest panics, by message: only the hook knows the location, and a panic may be caught on another
/// thread.
static LOCATIONS: Mutex<VecDeque<(String, String)>> = Mutex::new(VecDeque::new());

const MAX_LOCATIONS: usize = 64;

/// Replaces the panic hook by one that prints nothing; the message is printed where the panic is caught.
pub(super) fn install_silent_hook() {
    std::panic::set_hook(Box::new(|info| {
        let message = message(info.payload());
        let location = info.location().map(|at| format!("{}:{}", at.file(), at.line())).unwrap_or_default();
        let mut locations = LOCATIONS.lock().unwrap_or_else(PoisonError::into_inner);
        if locations.iter().all(|(known, _)| *known != message) {
            locations.push_back((message, location));
        }
        if locations.len() > MAX_LOCATIONS {
            locations.pop_front();
        }
    }));
}

/// Runs one unit of work and turns a panic into an error.
///
/// # Errors
/// Those of the work, and a panic.
pub(super) fn catch_panic<T>(work: impl FnOnce() -> anyhow::Result<T>) -> anyhow::Result<T> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|payload| {
        let message = message(&*payload);
        let locations = LOCATIONS.lock().unwrap_or_else(PoisonError::into_inner);
        let location = locations.iter().find(|(known, _)| *known == message).map_or("", |(_, location)| location);
        Err(anyhow::anyhow!(
            "internal error of truegrind {}, not of the input: please report it with the command and the input files \
             ({message}; {location})",
            env!("CARGO_PKG_VERSION")
        ))
    })
}

fn message(payload: &(dyn std::any::Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| payload.downcast_ref::<String>().cloned()).unwrap_or_else(|| "no message".to_owned())
}
