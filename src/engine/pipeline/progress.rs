//! Progress reports of a run.

use tetdb_kernel::optimize;

/// Progress of one stage of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    /// Name of the stage: one or two words, always the same for the same work.
    pub stage: &'static str,
    /// Work done so far, in `unit`.
    pub done: u64,
    /// Total work in `unit`, if known.
    pub total: Option<u64>,
    /// The unit of `done` and `total`.
    pub unit: &'static str,
}

impl From<optimize::Progress> for Event {
    fn from(progress: optimize::Progress) -> Self {
        Self {
            stage: progress.stage,
            done: progress.done.into(),
            total: Some(progress.total.into()),
            unit: "pages",
        }
    }
}

/// Callback for [`Event`]s. It is called often and must be quick.
pub type Watcher<'a> = dyn Fn(Event) + 'a;

/// A watcher that ignores all events.
pub fn silent(_: Event) {}
