//! Failures and requests to stop travel by unwinding to the step that contains them.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};

use super::StorageError;

static STOP: AtomicBool = AtomicBool::new(false);

/// Asks all running steps to end soon with [`StorageError::Cancelled`].
pub fn request_stop() {
    STOP.store(true, Ordering::Relaxed);
}

/// Unwinds to the surrounding [`attempt`] when a stop was requested; cheap enough for every thousandth operation.
#[inline]
pub fn check_cancelled() {
    if STOP.load(Ordering::Relaxed) {
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
