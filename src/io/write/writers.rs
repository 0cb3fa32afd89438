//! Processes that write one file together, each a part of it.

use std::path::{Path, PathBuf};

use super::selection::Share;
use tetdb_base::storage::RemoteFailure;

/// The processes. The first creates the file, announces its place, and renames it when all parts are written.
pub trait Writers {
    /// The share of this process.
    fn share(&self) -> Share;
    /// Called by the first process: sends the place of the unfinished file, whose head is written.
    fn announce(&self, file: &Path);
    /// Called by the others: receives the place of the file; `None` when there will be no file.
    fn hear(&self) -> Option<PathBuf>;
    /// Called by the others: sends the result of their part.
    fn say(&self, done: Result<(), RemoteFailure>);
    /// Called by the first process: waits for the results of all others. Errors: those of any other.
    fn wait(&self) -> Result<(), RemoteFailure>;
}

/// Returns whether this process writes the parts that are written once.
pub(super) fn is_first(writers: Option<&dyn Writers>) -> bool {
    writers.is_none_or(|writers| writers.share().number == 1)
}
