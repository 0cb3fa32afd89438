//! Errors between memory and disk.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use tetdb_schema::page::PageError;
use thiserror::Error;

/// A failure between memory and disk.
#[derive(Debug, Error)]
pub enum StorageError {
    /// The operating system or redb refused a read or write.
    #[error("{path}: {source}")]
    Database {
        /// The file or folder.
        path: PathBuf,
        /// The cause.
        #[source]
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// The file is open for writing elsewhere.
    #[error("{path} is being written by another process")]
    Busy {
        /// The file or folder.
        path: PathBuf,
    },
    /// The disk is full.
    #[error("no space left to write {path}")]
    Full {
        /// The file or folder.
        path: PathBuf,
    },
    /// redb could not follow its own tree.
    #[error("{path} is damaged: {reason}")]
    Damaged {
        /// The file or folder.
        path: PathBuf,
        /// The damage found.
        reason: String,
    },
    /// A page does not match its address.
    #[error("{path} is damaged: {source}")]
    Page {
        /// The file or folder.
        path: PathBuf,
        /// The cause.
        #[source]
        source: PageError,
    },
    /// A page that must exist does not.
    #[error("{path} is damaged: {what} is missing")]
    Missing {
        /// The file or folder.
        path: PathBuf,
        /// The missing page or file.
        what: String,
    },
    /// A file operation outside redb failed.
    #[error("{path}: {source}")]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The cause.
        #[source]
        source: std::io::Error,
    },
    /// The ledger has no bytes left for a demand.
    #[error("{what} needs {needed} bytes, the memory budget has {available} left")]
    Budget {
        /// The purpose of the bytes.
        what: &'static str,
        /// Bytes requested.
        needed: u64,
        /// Bytes left.
        available: u64,
    },
    /// The system refuses the memory for an array.
    #[error("the system refuses {bytes} bytes of memory")]
    NoMemory {
        /// Bytes requested.
        bytes: u64,
    },
    /// More records than 30-bit ids can name.
    #[error("a sub-domain cannot hold more than 2^30 {what}")]
    TooMany {
        /// Kind of the records.
        what: &'static str,
    },
    /// The user asked to stop. The current step is lost; all steps before it are kept.
    #[error("the run was ended before it was done")]
    Cancelled,
}

impl StorageError {
    /// Returns whether the bytes on disk differ from those written.
    pub fn is_damage(&self) -> bool {
        matches!(self, Self::Damaged { .. } | Self::Page { .. } | Self::Missing { .. })
    }

    /// Wraps a failed operation on `path`.
    pub fn io(path: &Path, source: std::io::Error) -> Self {
        let path = path.to_owned();
        match source.kind() {
            ErrorKind::StorageFull | ErrorKind::QuotaExceeded => Self::Full { path },
            _ => Self::Io { path, source },
        }
    }
}
