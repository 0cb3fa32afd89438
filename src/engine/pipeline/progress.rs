//! Progress reports of a run.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use tetdb_kernel::optimize;

/// Progress of one stage of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    /// Name of the stage: a few words, always the same for the same work.
    pub stage: &'static str,
    /// Work done so far, in `unit`.
    pub done: u64,
    /// Total work in `unit`, if known.
    pub total: Option<u64>,
    /// The unit of `done` and `total`; empty if nothing is counted.
    pub unit: &'static str,
}

impl Event {
    /// The begin of a stage of which nothing is counted.
    pub fn begin(stage: &'static str) -> Self {
        Self { stage, done: 0, total: None, unit: "" }
    }

    /// So many predicted tetrahedra of how many.
    pub fn tets(stage: &'static str, (done, total): (u64, u64)) -> Self {
        Self { stage, done, total: Some(total), unit: "tetrahedra" }
    }
}

impl From<optimize::Progress> for Event {
    fn from(progress: optimize::Progress) -> Self {
        Self {
            stage: progress.stage,
            done: progress.done.into(),
            total: Some(progress.total.into()),
            unit: progress.unit,
        }
    }
}

/// Callback for [`Event`]s. It is called often and must be quick.
pub type Watcher<'a> = dyn Fn(Event) + 'a;

/// A watcher that ignores all events.
pub fn silent(_: Event) {}

/// One stage made of jobs side by side, such as the sub-domains of a run.
///
/// Stages of jobs that run at once alternate, so none of them has a rate; this one has.
pub struct JobProgress {
    stage: &'static str,
    unit: &'static str,
    total: f64,
    work: Mutex<JobWork>,
}

/// Work in the units of the stage.
struct JobWork {
    /// Of jobs that are over.
    done: f64,
    /// How much of each running job is done.
    running: BTreeMap<u32, f64>,
}

impl JobProgress {
    /// `done` is what an earlier run has done of the `total`.
    pub fn new(stage: &'static str, unit: &'static str, [done, total]: [f64; 2]) -> Self {
        Self { stage, unit, total, work: Mutex::new(JobWork { done, running: BTreeMap::new() }) }
    }

    /// A stage of a job of so much work is the share of it that its event says; how far the job is never goes back.
    pub fn heard(&self, (job, work): (u32, f64), event: Event, watch: &Watcher) {
        let share = match event.total {
            Some(total) if total > 0 => (event.done as f64 / total as f64).min(1.0),
            _ => 0.0,
        };
        self.say(watch, |all| {
            let of_job = all.running.entry(job).or_default();
            *of_job = of_job.max(share * work);
        });
    }

    /// A job of so much work is over.
    pub fn finished(&self, (job, work): (u32, f64), watch: &Watcher) {
        self.say(watch, |all| {
            all.running.remove(&job);
            all.done += work;
        });
    }

    fn say(&self, watch: &Watcher, change: impl FnOnce(&mut JobWork)) {
        let mut work = self.work.lock().unwrap_or_else(PoisonError::into_inner);
        change(&mut work);
        let done = work.done + work.running.values().sum::<f64>();
        drop(work);
        let (done, total) = (done.min(self.total) as u64, Some(self.total as u64));
        watch(Event { stage: self.stage, done, total, unit: self.unit });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::RefCell;

    #[test]
    fn jobs_side_by_side_are_one_stage() {
        let said = RefCell::new(Vec::new());
        let watch = |event: Event| {
            assert_eq!((event.stage, event.total, event.unit), ("jobs", Some(100), "%"));
            said.borrow_mut().push(event.done);
        };
        let all = JobProgress::new("jobs", "%", [20.0, 100.0]);
        let (one, two) = ((1, 40.0), (2, 40.0));
        all.heard(one, Event::tets("a", (1, 2)), &watch);
        all.heard(two, Event::tets("a", (1, 4)), &watch);
        // A later stage begins, and says nothing.
        all.heard(one, Event::begin("b"), &watch);
        all.heard(one, Event::tets("b", (1, 4)), &watch);
        all.finished(one, &watch);
        all.finished(two, &watch);
        assert_eq!(*said.borrow(), [40, 50, 50, 50, 70, 100]);
    }
}
