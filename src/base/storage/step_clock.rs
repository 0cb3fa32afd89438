//! Seconds of a step, by how many threads could have shared them.
//!
//! A forecast for more threads needs to know what only one thread could do. What goes through [`parallel`](super::parallel) and
//! its like is measured as it begins and ends, on the thread of the step.

use std::cell::Cell;
use std::time::Instant;

thread_local! {
    static SHARED: Cell<SharedSeconds> = const { Cell::new(SharedSeconds::NONE) };
    static IS_WITHIN: Cell<bool> = const { Cell::new(false) };
}

/// Seconds that threads have shared, or could have shared if there had been more.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SharedSeconds {
    /// On the clock, while they did.
    pub clock: f64,
    /// Of work without order: the time of a section times its threads.
    pub parallel: f64,
    /// Of tasks with an order.
    pub tasks: f64,
    /// Of the longest chains of such tasks, each of which waits for the one before.
    pub chain: f64,
}

impl SharedSeconds {
    const NONE: Self = Self { clock: 0.0, parallel: 0.0, tasks: 0.0, chain: 0.0 };
}

/// Runs `work` as a section that threads share, and adds what `add` says of its result and its seconds. Nothing is counted inside of another
/// section.
fn section<T>(work: impl FnOnce() -> T, add: impl FnOnce(&mut SharedSeconds, &T, f64)) -> T {
    struct Leave;
    impl Drop for Leave {
        fn drop(&mut self) {
            IS_WITHIN.set(false);
        }
    }
    if IS_WITHIN.replace(true) {
        return work();
    }
    let leave = Leave;
    let begun = Instant::now();
    let result = work();
    let seconds = begun.elapsed().as_secs_f64();
    drop(leave);
    let mut shared = SHARED.get();
    shared.clock += seconds;
    add(&mut shared, &result, seconds);
    SHARED.set(shared);
    result
}

/// Runs `work` that `threads` share without order.
pub(super) fn shared<T>(threads: usize, work: impl FnOnce() -> T) -> T {
    section(work, |sum, _, seconds| sum.parallel += threads as f64 * seconds)
}

/// Runs `work` that does tasks in an order; it returns the seconds of all of them and of the longest chain.
pub(super) fn in_order(work: impl FnOnce() -> [f64; 2]) {
    section(work, |sum, [tasks, chain], _| {
        sum.tasks += tasks;
        sum.chain += chain;
    });
}

/// The time of a step since its beginning. Everything is counted on one thread, that of the step.
#[derive(Clone, Copy, Debug)]
pub struct StepClock {
    begun: Instant,
    before: SharedSeconds,
}

impl StepClock {
    /// Begins now, on this thread.
    pub fn start() -> Self {
        Self { begun: Instant::now(), before: SHARED.get() }
    }

    /// When it began.
    pub fn begun(&self) -> Instant {
        self.begun
    }

    /// Seconds until now.
    pub fn seconds(&self) -> f64 {
        self.begun.elapsed().as_secs_f64()
    }

    /// The seconds that threads have shared since the step began. Call it on the thread of the step.
    pub fn shared(&self) -> SharedSeconds {
        let (now, before) = (SHARED.get(), self.before);
        SharedSeconds {
            clock: now.clock - before.clock,
            parallel: now.parallel - before.parallel,
            tasks: now.tasks - before.tasks,
            chain: now.chain - before.chain,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::storage::{
        CancelToken, RunContext, StorageError, attempt, parallel, raise, shared_tasks,
    };
    use std::thread::sleep;
    use std::time::Duration;

    const PAUSE: Duration = Duration::from_millis(20);

    #[test]
    fn sections_count_once_and_on_the_thread_that_asks() {
        RunContext::new(2, CancelToken::default()).enter(|| {
            let clock = StepClock::start();
            sleep(PAUSE);
            assert_eq!(clock.shared(), SharedSeconds::NONE);
            parallel(|| parallel(|| sleep(PAUSE)));
            shared_tasks(|| {
                parallel(|| sleep(PAUSE));
                [4.0, 3.0]
            });
            let shared = clock.shared();
            assert_eq!([shared.tasks, shared.chain], [4.0, 3.0]);
            assert!(shared.parallel >= 2.0 * PAUSE.as_secs_f64(), "{shared:?}");
            assert!(shared.clock >= 2.0 * PAUSE.as_secs_f64(), "{shared:?}");
            assert!(shared.clock + PAUSE.as_secs_f64() <= clock.seconds(), "{shared:?}");
        });
    }

    #[test]
    fn an_unwound_section_leaves_no_trace() {
        RunContext::new(1, CancelToken::default()).enter(|| {
            assert!(attempt(|| shared_tasks(|| raise(StorageError::Cancelled))).is_err());
            let clock = StepClock::start();
            shared_tasks(|| [2.0, 1.0]);
            assert_eq!(clock.shared().tasks, 2.0);
        });
    }
}
