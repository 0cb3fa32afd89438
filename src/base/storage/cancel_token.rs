//! A token that requests the end of a run.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Requests the end of the runs that have this token. Clones are the same token; [`CancelToken::reset`] makes it usable
/// again.
///
/// ```
/// # use tetdb_base::storage as tetdb;
/// let token = tetdb::CancelToken::new();
/// let other = token.clone();
/// std::thread::spawn(move || other.cancel()).join().unwrap();
/// assert!(token.is_cancelled());
/// token.reset();
/// assert!(!token.is_cancelled());
/// ```
#[derive(Clone, Debug, Default)]
pub struct CancelToken {
    wanted: Arc<AtomicBool>,
}

impl CancelToken {
    /// A token that is not cancelled.
    pub fn new() -> Self {
        Self::default()
    }

    /// Requests the end of the runs that have this token; each stops between two page accesses, at its last finished
    /// step.
    pub fn cancel(&self) {
        self.wanted.store(true, Ordering::Relaxed);
    }

    /// Returns whether the token was cancelled since the last [`CancelToken::reset`].
    pub fn is_cancelled(&self) -> bool {
        self.wanted.load(Ordering::Relaxed)
    }

    /// Forgets that it was cancelled.
    pub fn reset(&self) {
        self.wanted.store(false, Ordering::Relaxed);
    }
}
