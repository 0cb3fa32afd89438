//! What can be wrong with a store as a whole.

use std::path::{Path, PathBuf};

use tetdb_schema::chunk::ChunkError;
use thiserror::Error;

use crate::store::StoreError;

/// Errors of opening, reading and changing a store.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CatalogError {
    /// Another process writes the store.
    #[error("{path} is being written by another process; wait for it, or stop it")]
    Busy { path: PathBuf },
    /// There is nothing at this path.
    #[error("there is no store at {path}")]
    NotFound { path: PathBuf },
    /// There is something else at this path.
    #[error("{path} exists and is not a store: {reason}")]
    NotOurs { path: PathBuf, reason: &'static str },
    /// A finished store is already there.
    #[error("{path} is already a finished store; give another name, or replace it with --force")]
    Finished { path: PathBuf },
    /// A store is there whose making was interrupted.
    #[error("{path} is an unfinished store; `tetdb resume` continues it")]
    Unfinished { path: PathBuf },
    /// The store is of another format version.
    #[error("{path} has format version {found}, this program reads version {expected}")]
    Format {
        path: PathBuf,
        expected: u16,
        found: u16,
    },
    /// The catalog lists no such sub-domain.
    #[error("{path} has no sub-domain {subdomain}")]
    NoSubdomain { path: PathBuf, subdomain: u32 },
    /// The sub-domain is not sealed yet.
    #[error("sub-domain {subdomain} of {path} is not finished")]
    NotSealed { path: PathBuf, subdomain: u32 },
    /// The sub-domain's coarse leaf was not kept.
    #[error(
        "{path} has no coarse leaf of sub-domain {subdomain}, from which it could be made again"
    )]
    NoCoarseLeaf { path: PathBuf, subdomain: u32 },
    /// A row of the catalog cannot be what was written.
    #[error("{path} is damaged: catalog row {key:016x} {reason}")]
    Row {
        path: PathBuf,
        key: u64,
        reason: String,
    },
    /// A chunk of a sub-domain's file is not what its address says.
    #[error("{path} is damaged: {source}")]
    Chunk {
        path: PathBuf,
        #[source]
        source: ChunkError,
    },
    /// Parts of a sub-domain that contradict each other, or a missing one.
    #[error("{path} is damaged: sub-domain {subdomain}, {what}")]
    Content {
        path: PathBuf,
        subdomain: u32,
        what: String,
    },
    /// A directory or file operation failed.
    #[error("{path}: {source}")]
    Io {
        path: PathBuf,
        #[source]
        source: std::io::Error,
    },
    /// The files of the store.
    #[error(transparent)]
    Store(StoreError),
}

impl CatalogError {
    /// The process exit code of this class of error.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Busy { .. } | Self::Store(StoreError::Busy { .. }) => 5,
            Self::NotFound { .. } | Self::NoSubdomain { .. } => 3,
            Self::NotOurs { .. }
            | Self::Finished { .. }
            | Self::Unfinished { .. }
            | Self::Format { .. }
            | Self::NotSealed { .. }
            | Self::NoCoarseLeaf { .. } => 8,
            Self::Row { .. } | Self::Chunk { .. } | Self::Content { .. } => 4,
            Self::Store(
                StoreError::Damaged { .. } | StoreError::Page { .. } | StoreError::Missing { .. },
            ) => 4,
            Self::Io { .. } | Self::Store(_) => 6,
        }
    }

    /// Whether what is on disk is not what was written.
    pub fn is_damage(&self) -> bool {
        self.exit_code() == 4
    }

    /// Wraps a failed operation on `path`.
    pub(crate) fn io(path: &Path, source: std::io::Error) -> Self {
        match StoreError::io(path, source) {
            StoreError::Io { path, source } => Self::Io { path, source },
            full => Self::Store(full),
        }
    }
}

impl From<StoreError> for CatalogError {
    fn from(error: StoreError) -> Self {
        match error {
            StoreError::Busy { path } => Self::Busy { path },
            other => Self::Store(other),
        }
    }
}
