//! Errors of the catalog.

use std::path::PathBuf;

use thiserror::Error;

use crate::sealed::SealedError;
use tetdb_base::storage::StorageError;

/// Errors of opening, reading and changing a store.
#[derive(Debug, Error)]
pub enum StoreError {
    /// Another process writes the store.
    #[error("{path} is being written by {writer}; wait for it, or stop it")]
    Busy {
        /// The file or folder.
        path: PathBuf,
        /// The process, in words.
        writer: String,
    },
    /// Another process has changed the store since it was opened, and the requested file is no longer there.
    #[error("{path} was changed by another process while it was read")]
    Changed {
        /// The folder.
        path: PathBuf,
    },
    /// There is nothing at this path.
    #[error("there is no store at {path}")]
    NotFound {
        /// The file or folder.
        path: PathBuf,
    },
    /// There is something else at this path.
    #[error("{path} exists and is not a store: {reason}")]
    NotOurs {
        /// The file or folder.
        path: PathBuf,
        /// The fault.
        reason: &'static str,
    },
    /// A finished store is already there.
    #[error(
        "{path} is already a finished store; a run of another surface or other options does not replace it"
    )]
    Finished {
        /// The file or folder.
        path: PathBuf,
    },
    /// A store is there whose creation was interrupted.
    #[error("{path} is an unfinished store")]
    Unfinished {
        /// The file or folder.
        path: PathBuf,
    },
    /// The store is of another format version.
    #[error("{path} has format version {found}, this program reads version {expected}")]
    Format {
        /// The file or folder.
        path: PathBuf,
        /// Version of this program.
        expected: u16,
        /// Version of the store.
        found: u16,
    },
    /// The catalog lists no such sub-domain.
    #[error("{path} has no sub-domain {subdomain}")]
    NoSubdomain {
        /// The file or folder.
        path: PathBuf,
        /// Rank of the sub-domain.
        subdomain: u32,
    },
    /// The store has no version of this name.
    #[error(
        "{path} has no version {name}; {}",
        if known.is_empty() { "it has none".to_owned() } else { format!("there are {}", known.join(", ")) }
    )]
    NoVersion {
        /// The file or folder.
        path: PathBuf,
        /// The name.
        name: String,
        /// The names of its versions.
        known: Vec<String>,
    },
    /// The sub-domain's coarse snapshot was not kept.
    #[error(
        "{path} has no coarse snapshot of sub-domain {subdomain}, from which it could be meshed again"
    )]
    NoCoarseSnapshot {
        /// The file or folder.
        path: PathBuf,
        /// Rank of the sub-domain.
        subdomain: u32,
    },
    /// A row of the catalog cannot be what was written.
    #[error("{path} is damaged: catalog row {key:016x} {reason}")]
    Row {
        /// The file or folder.
        path: PathBuf,
        /// Key of the row.
        key: u64,
        /// The fault.
        reason: String,
    },
    /// The file of a sub-domain.
    #[error(transparent)]
    Sealed(#[from] SealedError),
    /// The files of the store.
    #[error(transparent)]
    Storage(StorageError),
}

impl StoreError {
    /// Reason of [`StoreError::NotOurs`] for a store without its first commit.
    pub const BARELY_BEGUN: &str =
        "its creation was interrupted at the start; meshing into it begins it again";

    /// Returns whether the store was changed after it was written.
    pub fn is_damage(&self) -> bool {
        match self {
            Self::Row { .. } => true,
            Self::Sealed(error) => error.is_damage(),
            Self::Storage(error) => error.is_damage(),
            _ => false,
        }
    }
}

impl From<StorageError> for StoreError {
    fn from(error: StorageError) -> Self {
        match error {
            StorageError::Busy { path } => {
                Self::Busy { path, writer: "another process".to_owned() }
            }
            other => Self::Storage(other),
        }
    }
}
