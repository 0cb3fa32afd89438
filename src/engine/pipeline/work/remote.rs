//! Remote workers: other processes that perform orders of this run, by messages.

use std::fmt;
use std::sync::Arc;

use tetdb_base::storage::RemoteFailure;

/// Processes that perform orders while this one holds the store's lock. The implementation transports the bytes.
pub trait WorkerPool: Send + Sync {
    /// Sends the parameters common to all orders; returns how many orders the workers perform at once, in total. Errors: a
    /// failure, in words.
    fn begin(&self, job: &[u8]) -> Result<usize, RemoteFailure>;
    /// Sends an order to slot number `slot`, and waits for its receipt.
    fn perform(&self, slot: usize, order: Vec<u8>) -> Result<Vec<u8>, RemoteFailure>;
}

/// The remote workers of a run, if it has any. The mesh does not depend on them, so all values compare equal.
#[derive(Clone, Default)]
pub struct RemoteWorkers(pub Option<Arc<dyn WorkerPool>>);

impl fmt::Debug for RemoteWorkers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.0.is_some() { "RemoteWorkers" } else { "no remote workers" })
    }
}

impl PartialEq for RemoteWorkers {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}
