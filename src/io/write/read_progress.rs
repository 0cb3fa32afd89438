//! Progress of an export in records read.

use std::cell::Cell;

use tetdb_base::storage::check_cancelled;

/// Counts records and reports progress.
pub(super) struct ReadProgress<'a> {
    pub report: &'a dyn Fn(u64, u64),
    pub done: Cell<u64>,
    pub total: Cell<u64>,
}

impl<'a> ReadProgress<'a> {
    pub fn new(report: &'a dyn Fn(u64, u64)) -> Self {
        let (done, total) = (Cell::new(0), Cell::new(0));
        Self { report, done, total }
    }

    /// Counts `n` more records; unwinds when the run is cancelled.
    pub fn advance(&self, n: usize) {
        check_cancelled();
        let done = self.done.get() + n as u64;
        self.done.set(done);
        (self.report)(done, self.total.get().max(done));
    }
}
