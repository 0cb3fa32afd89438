//! Worker threads that take jobs from a queue; the calling thread commits their results.

use std::cell::Cell;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use super::error::PipelineError;
use super::progress::{Event, Watcher};
use tetdb_base::storage::RunContext;

/// Least number of milliseconds between two progress messages of one worker.
const TELL_EVERY: u128 = 100;

/// The function with which a worker runs a job.
pub type WorkerFn<'a, J, D> = &'a (dyn Fn(J, &Watcher) -> Result<D, PipelineError> + Sync);

/// Runs `jobs` with one thread per function in `workers`. `commit` receives the results in the order of completion and returns the
/// jobs that each result makes possible.
///
/// Workers are threads, not tasks of the pool. A task that waits for a sort would start another job meanwhile and need its memory
/// too. Errors: the first of `workers` and `commit`; results that other workers finish later are not committed.
pub fn run_jobs<J: Send, D: Send>(
    jobs: Vec<J>,
    workers: &[WorkerFn<J, D>],
    watch: &Watcher,
    commit: &mut dyn FnMut(D) -> Result<Vec<J>, PipelineError>,
) -> Result<(), PipelineError> {
    let list = JobQueue::new(jobs);
    let (tell, hear) = channel();
    std::thread::scope(|scope| {
        for &run in workers {
            let (list, tell) = (&list, tell.clone());
            let context = RunContext::current();
            scope.spawn(move || match context {
                Some(context) => context.enter(|| work(list, run, &tell)),
                None => work(list, run, &tell),
            });
        }
        drop(tell);
        // The receiving side may unwind too: `watch` and `commit` are the caller's code.
        let _alarm = Alarm(&list);
        let result = listen(&list, &hear, watch, commit);
        list.give_up();
        result
    })
}

/// Runs a job for each of `items`, in their order. `commit` receives the results in the order of completion.
///
/// Only the next few of thousands of jobs are created in advance, because each holds the owners of all interface faces of its
/// sub-domain. `draw` creates a job; `draw` and `commit` share `state`. Errors: the first of `draw`, `workers` and `commit`.
pub fn map_bounded<S, I, J: Send, D: Send>(
    state: &mut S,
    items: Vec<I>,
    workers: &[WorkerFn<J, D>],
    watch: &Watcher,
    draw: impl Fn(&mut S, I) -> Result<J, PipelineError>,
    commit: impl Fn(&mut S, D) -> Result<(), PipelineError>,
) -> Result<(), PipelineError> {
    let mut items = items.into_iter();
    let at_hand = 2 * workers.len();
    let mut jobs = Vec::with_capacity(at_hand);
    for item in items.by_ref().take(at_hand) {
        jobs.push(draw(state, item)?);
    }
    // Workers take the last job of the queue first.
    jobs.reverse();
    run_jobs(jobs, workers, watch, &mut |done| {
        commit(state, done)?;
        let next = items.next().map(|item| draw(state, item));
        Ok(next.transpose()?.into_iter().collect())
    })
}

/// A message from a worker.
enum WorkerMessage<D> {
    Progress(Event),
    Done(Box<Result<D, PipelineError>>),
}

/// Passes progress on to `watch`, and commits finished jobs.
fn listen<J, D>(
    list: &JobQueue<J>,
    hear: &Receiver<WorkerMessage<D>>,
    watch: &Watcher,
    commit: &mut dyn FnMut(D) -> Result<Vec<J>, PipelineError>,
) -> Result<(), PipelineError> {
    for told in hear {
        match told {
            WorkerMessage::Progress(event) => watch(event),
            WorkerMessage::Done(done) => list.done(commit((*done)?)?),
        }
    }
    Ok(())
}

/// Runs jobs until the queue is empty and no job can follow.
fn work<J, D>(
    list: &JobQueue<J>,
    run: &dyn Fn(J, &Watcher) -> Result<D, PipelineError>,
    tell: &Sender<WorkerMessage<D>>,
) {
    let _alarm = Alarm(list);
    while let Some(job) = list.take() {
        let last = Cell::new(None::<Instant>);
        let watch = |event: Event| {
            let due = last.get().is_none_or(|t| t.elapsed().as_millis() > TELL_EVERY);
            if due {
                last.set(Some(Instant::now()));
                // The receiver is gone once a job or a commit has failed.
                let _ = tell.send(WorkerMessage::Progress(event));
            }
        };
        let done = Box::new(RunContext::busy(|| run(job, &watch)));
        if tell.send(WorkerMessage::Done(done)).is_err() {
            return;
        }
    }
}

/// Stops the queue if this thread panics, so that no other thread waits for its job.
struct Alarm<'a, J>(&'a JobQueue<J>);

impl<J> Drop for Alarm<'_, J> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.give_up();
        }
    }
}

/// Queue of jobs; the last one is taken first.
struct JobQueue<J> {
    state: Mutex<Jobs<J>>,
    changed: Condvar,
}

struct Jobs<J> {
    waiting: Vec<J>,
    /// Number of jobs that wait, run, or are finished but not committed: only these can add new jobs. At 0, workers stop.
    open: usize,
}

impl<J> JobQueue<J> {
    fn new(waiting: Vec<J>) -> Self {
        let open = waiting.len();
        Self { state: Mutex::new(Jobs { waiting, open }), changed: Condvar::new() }
    }

    fn lock(&self) -> MutexGuard<'_, Jobs<J>> {
        // A worker that panics does so outside of the lock.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for a job; returns `None` when no job can follow.
    fn take(&self) -> Option<J> {
        let mut jobs = self.lock();
        loop {
            if jobs.open == 0 {
                return None;
            }
            if let Some(job) = jobs.waiting.pop() {
                return Some(job);
            }
            jobs = (self.changed.wait(jobs)).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Records that a job is committed, and adds the jobs that it made possible.
    fn done(&self, more: Vec<J>) {
        let mut jobs = self.lock();
        if jobs.open > 0 {
            jobs.open = jobs.open + more.len() - 1;
            jobs.waiting.extend(more);
        }
        self.changed.notify_all();
    }

    /// Empties the queue and stops the workers.
    fn give_up(&self) {
        let mut jobs = self.lock();
        jobs.waiting.clear();
        jobs.open = 0;
        self.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::progress::silent;

    /// Runs jobs that halve a number until it is 1: `n` such jobs end at 1, in any order.
    fn halve(n: u32, workers: usize, fail_at: u32) -> Result<u32, PipelineError> {
        let mut leaves = 0;
        let run = &|n: u32, _: &Watcher| match n {
            n if n == fail_at => Err(PipelineError::NothingFilled { policy: String::new() }),
            n => Ok(n),
        };
        run_jobs(vec![n], &vec![run as WorkerFn<u32, u32>; workers], &silent, &mut |n| {
            if n == 1 {
                leaves += 1;
                return Ok(Vec::new());
            }
            Ok(vec![n / 2, n - n / 2])
        })?;
        Ok(leaves)
    }

    #[test]
    fn jobs_bring_jobs_and_a_failure_ends_all() {
        for workers in [1, 2, 5] {
            assert_eq!(halve(1, workers, 0).ok(), Some(1));
            assert_eq!(halve(37, workers, 0).ok(), Some(37));
            assert!(halve(37, workers, 3).is_err());
        }
        let nothing: Vec<u32> = Vec::new();
        assert!(
            run_jobs(
                nothing,
                &[&|n, _: &Watcher| Ok(n), &|n, _: &Watcher| Ok(n)],
                &silent,
                &mut |_| Ok(Vec::new())
            )
            .is_ok()
        );
    }

    #[test]
    fn nobody_waits_when_the_listener_unwinds() {
        let run = &|n: u32, watch: &Watcher| {
            watch(Event { stage: "a step", done: 1, total: None, unit: "jobs" });
            Ok(n)
        };
        for (in_watch, in_commit) in [(true, false), (false, true)] {
            let watch = |_: Event| assert!(!in_watch, "the caller's own trouble");
            let ended = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
                run_jobs(vec![1, 2], &[run as WorkerFn<u32, u32>; 2], &watch, &mut |n| {
                    assert!(!in_commit, "the same here");
                    // Adds one more job each time, without end.
                    Ok(vec![n])
                })
            }));
            assert!(ended.is_err());
        }
    }
}
