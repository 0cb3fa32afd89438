//! Other processes that do orders of this run, by messages.

use std::fmt;
use std::sync::Arc;

use tetdb_base::storage::RemoteFailure;

/// Processes that do orders while this one holds the store's lock; how bytes come to them is theirs to know.
pub trait Helpers: Send + Sync {
    /// Says what is the same for all orders; how many they do at once, all together. Errors: in words.
    fn begin(&self, job: &[u8]) -> Result<usize, RemoteFailure>;
    /// Has an order done, by the `slot`th of them, and waits for its receipt.
    fn perform(&self, slot: usize, order: Vec<u8>) -> Result<Vec<u8>, RemoteFailure>;
}

/// The helpers of a run, if it has any. They do not shape the mesh, so all are equal.
#[derive(Clone, Default)]
pub struct Hands(pub Option<Arc<dyn Helpers>>);

impl fmt::Debug for Hands {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.0.is_some() { "Hands" } else { "no hands" })
    }
}

impl PartialEq for Hands {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}
