//! Failures and requests to stop travel by unwinding to the step that contains them.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

use super::{RunContext, StorageError};

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
