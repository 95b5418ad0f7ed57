//! Work that is watched and called off.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use rayon::prelude::*;
use truegrind_math::work::{Cancelled, Watch, checkpoint, report_step, run_watched};

/// Whatever nests threads below the work, each of them knows the watch, and all of them end.
#[test]
fn what_runs_in_parallel_is_called_off_as_a_whole() {
    for threads in [1, 3] {
        let watch = Arc::new(Watch::default());
        let caller = watch.clone();
        let begun = Instant::now();
        let waiting = std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(30));
            caller.cancel();
        });
        let ended = run_watched(&watch, Some(threads), || {
            (0..64).into_par_iter().for_each(|_| {
                (0..64).into_par_iter().for_each(|_| {
                    for _ in 0..100 {
                        std::thread::sleep(Duration::from_millis(1));
                        checkpoint();
                    }
                });
            });
        });
        waiting.join().unwrap();
        assert_eq!(ended.unwrap(), Err(Cancelled));
        assert!(begun.elapsed() < Duration::from_millis(1000), "{:?}", begun.elapsed());
    }
}

#[test]
fn steps_are_told_in_their_order() {
    let told = Arc::new(Mutex::new(Vec::new()));
    let listener = told.clone();
    let watch = Arc::new(Watch::with_listener(move |step| listener.lock().unwrap().push(step.to_owned())));
    let done = run_watched(&watch, Some(1), || {
        report_step("first");
        report_step("second");
        7
    });
    assert_eq!(done.unwrap(), Ok(7));
    assert_eq!(*told.lock().unwrap(), ["first", "second"]);
}

/// Without a watch nothing is called off, and nothing is told.
#[test]
fn outside_a_watch_nothing_happens() {
    checkpoint();
    report_step("nobody hears this");
    let watch = Arc::new(Watch::default());
    watch.cancel();
    checkpoint();
}

/// A panic of the work stays one.
#[test]
#[should_panic(expected = "a defect")]
fn a_panic_is_no_cancelling() {
    let _ = run_watched(&Arc::new(Watch::default()), Some(1), || panic!("a defect"));
}
