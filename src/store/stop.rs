//! Failures and requests to stop travel by unwinding to the step that contains them.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};

use super::StoreError;

static STOP: AtomicBool = AtomicBool::new(false);

/// Asks all running steps to end soon with [`StoreError::Stopped`].
pub fn request_stop() {
    STOP.store(true, Ordering::Relaxed);
}

/// Unwinds to the surrounding [`attempt`] when a stop was requested; cheap enough for every thousandth operation.
#[inline]
pub fn stop_if_requested() {
    if STOP.load(Ordering::Relaxed) {
        fail(StoreError::Stopped);
    }
}

/// Unwinds to the surrounding [`attempt`] with `error`, without the message of a panic.
#[cold]
#[inline(never)]
pub fn fail(error: StoreError) -> ! {
    resume_unwind(Box::new(error))
}

/// Runs a step; a [`fail`] inside becomes its error. True panics go on unwinding.
pub fn attempt<T>(step: impl FnOnce() -> T) -> Result<T, StoreError> {
    match catch_unwind(AssertUnwindSafe(step)) {
        Ok(done) => Ok(done),
        Err(payload) => match payload.downcast::<StoreError>() {
            Ok(error) => Err(*error),
            Err(panic) => resume_unwind(panic),
        },
    }
}
