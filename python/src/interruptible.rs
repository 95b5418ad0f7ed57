//! Long computations without the GIL, with Ctrl-C and progress.

use std::any::Any;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pyo3::prelude::*;
use truegrind::math::work::{Watch, run_watched};

use crate::errors::{Kind, Refusal};

/// Interval of the checks for Ctrl-C.
const LOOK: Duration = Duration::from_millis(20);

/// More threads would only cost memory.
const MAX_THREADS: i64 = 1024;

enum Event {
    Step(String),
    Done,
}

/// Runs `work` on its own threads. `progress` is called with each step; an exception it raises, or Ctrl-C, ends the work at the next
/// checkpoint and is raised here.
pub(crate) fn run<T: Send>(
    py: Python<'_>,
    threads: Option<i64>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce() -> Result<T, Refusal> + Send,
) -> PyResult<T> {
    let within = |n: i64| match usize::try_from(n) {
        Ok(count) if (1..=MAX_THREADS).contains(&n) => Ok(count),
        _ => Err(Refusal::argument("threads", n, "1 to 1024")),
    };
    let threads = threads.map(within).transpose()?;
    let (send, receive) = channel();
    let ended = send.clone();
    let watch = Arc::new(Watch::with_listener(move |step| drop(send.send(Event::Step(step.to_owned())))));
    let receive = Mutex::new(receive);
    let (fault, joined) = std::thread::scope(|scope| {
        let worker = scope.spawn(|| {
            let done = run_watched(&watch, threads, work);
            drop(ended.send(Event::Done));
            done
        });
        let mut fault = None;
        loop {
            match py.detach(|| next(&receive)) {
                Ok(Event::Done) | Err(RecvTimeoutError::Disconnected) => break,
                Ok(Event::Step(step)) => {
                    if let (Some(progress), None) = (progress, &fault)
                        && let Err(error) = progress.call1((step,))
                    {
                        fault = Some(error);
                    }
                }
                // Only with nothing left to tell: work that panicked says no end, and work that was quick has steps waiting.
                Err(RecvTimeoutError::Timeout) if worker.is_finished() => break,
                Err(RecvTimeoutError::Timeout) => {}
            }
            if fault.is_none()
                && let Err(error) = py.check_signals()
            {
                fault = Some(error);
            }
            if fault.is_some() {
                watch.cancel();
            }
        }
        (fault, py.detach(|| worker.join()))
    });
    if let Some(fault) = fault {
        return Err(fault);
    }
    match joined {
        Ok(Ok(Ok(done))) => done.map_err(PyErr::from),
        Ok(Ok(Err(cancelled))) => Err(Refusal::new(Kind::Defect, cancelled).into()),
        Ok(Err(pool)) => Err(Refusal::new(Kind::Defect, format!("no threads: {pool}")).into()),
        Err(payload) => Err(defect(&*payload).into()),
    }
}

fn next(receive: &Mutex<Receiver<Event>>) -> Result<Event, RecvTimeoutError> {
    receive.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(LOOK)
}

/// Turns a panic into an exception that asks for a report.
fn defect(payload: &(dyn Any + Send)) -> Refusal {
    let text = payload.downcast_ref::<&str>().map(|text| (*text).to_owned());
    let text = text.or_else(|| payload.downcast_ref::<String>().cloned());
    Refusal::new(
        Kind::Defect,
        format!(
            "a defect of truegrind {}, not of its input: please report it, with the call and the files that it was given ({})",
            env!("CARGO_PKG_VERSION"),
            text.unwrap_or_else(|| "no message".to_owned())
        ),
    )
}
