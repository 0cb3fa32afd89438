//! What a run says while it works.

use tetdb_kernel::optimize;

/// What a long run says while it works.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    /// Name of the stage: one or two words, always the same for the same work.
    pub stage: &'static str,
    /// Work done so far, in `unit`.
    pub done: u64,
    /// Work there is in all, where that is known.
    pub total: Option<u64>,
    /// What `done` and `total` count.
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

/// Receives [`Event`]s, often; it must be quick.
pub type Watcher<'a> = dyn Fn(Event) + 'a;

/// The watcher that does nothing.
pub fn silent(_: Event) {}
