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

/// The value of a storage operation; a failure unwinds to the surrounding [`attempt`].
pub trait OrRaise<T> {
    /// Returns the value, or unwinds with the error as [`raise`] does.
    fn or_raise(self) -> T;
}

impl<T> OrRaise<T> for Result<T, StorageError> {
    #[inline]
    fn or_raise(self) -> T {
        self.unwrap_or_else(|error| raise(error))
    }
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
