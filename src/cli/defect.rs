//! What happens when the program itself is at fault: a panic is caught where one unit of work ends, and becomes an error
//! that asks to be reported.
//!
//! A thousand programs are a thousand units: what one of them brings to light does not take the others with it. A stack that
//! overflows cannot be caught; depth that inputs decide is bounded where it is read.

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, PoisonError};

/// Where the latest panics came from, by their message: the place is known to the hook alone, and a panic may travel
/// from thread to thread before it is caught.
static PLACES: Mutex<VecDeque<(String, String)>> = Mutex::new(VecDeque::new());

/// More are not kept.
const MOST_PLACES: usize = 64;

/// From here on a panic prints nothing: whoever catches it says it.
pub(super) fn hush() {
    std::panic::set_hook(Box::new(|info| {
        let message = message(info.payload());
        let place = info.location().map(|at| format!("{}:{}", at.file(), at.line())).unwrap_or_default();
        let mut places = PLACES.lock().unwrap_or_else(PoisonError::into_inner);
        if places.iter().all(|(known, _)| *known != message) {
            places.push_back((message, place));
        }
        if places.len() > MOST_PLACES {
            places.pop_front();
        }
    }));
}

/// Runs one unit of work; a panic in it is an error.
///
/// # Errors
/// Those of the work, and a panic.
pub(super) fn isolated<T>(work: impl FnOnce() -> anyhow::Result<T>) -> anyhow::Result<T> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|payload| {
        let message = message(&*payload);
        let places = PLACES.lock().unwrap_or_else(PoisonError::into_inner);
        let place = places.iter().find(|(known, _)| *known == message).map_or("", |(_, place)| place);
        Err(anyhow::anyhow!(
            "a defect of truegrind {}, not of its input: please report it, with the command and the files that it was \
             given ({message}; {place})",
            env!("CARGO_PKG_VERSION")
        ))
    })
}

fn message(payload: &(dyn std::any::Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| payload.downcast_ref::<String>().cloned()).unwrap_or_else(|| "no message".to_owned())
}
