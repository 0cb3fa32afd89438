//! Several processes that write one file together, each a part of it.

use std::path::{Path, PathBuf};

use super::selection::Share;
use tetdb_base::storage::RemoteFailure;

/// The processes. The first makes the file, announces where it is, and renames it when all have done their parts.
pub trait Writers {
    /// Which of them this one is.
    fn share(&self) -> Share;
    /// The first says where the unfinished file is, its head written.
    fn announce(&self, file: &Path);
    /// What the first has said; `None` when there will be no file.
    fn hear(&self) -> Option<PathBuf>;
    /// The others say how their part went.
    fn say(&self, done: Result<(), RemoteFailure>);
    /// The first waits until all others have. Errors: of any of them.
    fn wait(&self) -> Result<(), RemoteFailure>;
}

/// Whether what is written once is for this process to write.
pub(super) fn is_first(writers: Option<&dyn Writers>) -> bool {
    writers.is_none_or(|writers| writers.share().number == 1)
}
