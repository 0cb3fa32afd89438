//! The boundary where unwinding ends: failures, cancellation and panics become errors.

use std::panic::{AssertUnwindSafe, catch_unwind};
use tetdb_schema::code::Code;

use super::{Error, Settings};
use tetdb_base::storage::{RunContext, StorageError};

// Failed page accesses unwind; such a build would end the process instead.
#[cfg(panic = "abort")]
compile_error!(
    "tetdb needs `panic = \"unwind\"`: failures of the disk and requests to stop travel by unwinding, which never leaves a call"
);

/// Runs `work` as a new run, with the threads and the token of `settings`.
#[doc(hidden)]
pub fn guarded<T>(
    settings: &Settings,
    work: impl FnOnce() -> Result<T, Error>,
) -> Result<T, Error> {
    settings.check_threads()?;
    let context = RunContext::new(settings.n_threads(), settings.cancel.clone());
    guarded_in(&context, work)
}

/// Runs `work` as part of an existing run.
#[doc(hidden)]
pub fn guarded_in<T>(
    context: &RunContext,
    work: impl FnOnce() -> Result<T, Error>,
) -> Result<T, Error> {
    match catch_unwind(AssertUnwindSafe(|| context.enter(work))) {
        Ok(done) => done,
        Err(payload) => Err(match payload.downcast::<StorageError>() {
            Ok(error) => (*error).into(),
            Err(_) => of_panic(context),
        }),
    }
}

/// The error for a panic: damage if it came from redb, which asserts what it reads; otherwise a bug of this program.
#[doc(hidden)]
pub fn of_panic(context: &RunContext) -> Error {
    match context.take_panic() {
        Some(panic) if panic.is_in_redb => Error::new(
            Code::Damaged,
            "a database file of the store cannot be followed",
        )
        .at(panic.message.replace('\n', " "))
        .with_help(
            "verify the store to see what is damaged; damaged sub-domains can be meshed again",
        ),
        Some(panic) => Error::internal(panic.message),
        None => Error::internal("a panic without a message".to_owned()),
    }
}
