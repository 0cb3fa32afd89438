//! Failures and requests to stop travel by unwinding to the step that contains them.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::{RunContext, StorageError};

/// Asks the runs it was given to, and no others, to end soon. Clones are the same token; [`CancelToken::reset`] makes it usable again.
///
/// ```
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
    /// A token nobody has cancelled.
    pub fn new() -> Self {
        Self::default()
    }

    /// Asks the runs that have this token to end; each stops between two page accesses, at its last finished step.
    pub fn cancel(&self) {
        self.wanted.store(true, Ordering::Relaxed);
    }

    /// Whether it was cancelled since the last [`CancelToken::reset`].
    pub fn is_cancelled(&self) -> bool {
        self.wanted.load(Ordering::Relaxed)
    }

    /// Forgets that it was cancelled.
    pub fn reset(&self) {
        self.wanted.store(false, Ordering::Relaxed);
    }
}

/// Unwinds to the surrounding [`attempt`] when this run is to stop; cheap enough for every thousandth operation.
#[inline]
pub fn check_cancelled() {
    if RunContext::is_current_cancelled() {
        raise(StorageError::Cancelled);
    }
}

/// Unwinds to the surrounding [`attempt`] with `error`, without the message of a panic.
#[cold]
#[inline(never)]
pub fn raise(error: StorageError) -> ! {
    resume_unwind(Box::new(error))
}

/// Runs a step; a [`raise`] inside becomes its error. True panics go on unwinding.
pub fn attempt<T>(step: impl FnOnce() -> T) -> Result<T, StorageError> {
    match catch_unwind(AssertUnwindSafe(step)) {
        Ok(done) => Ok(done),
        Err(payload) => match payload.downcast::<StorageError>() {
            Ok(error) => Err(*error),
            Err(panic) => resume_unwind(panic),
        },
    }
}
