//! Errors of the file of a sealed sub-domain.

use std::path::{Path, PathBuf};

use tetdb_schema::chunk::ChunkError;
use thiserror::Error;

use tetdb_base::storage::StorageError;

/// Errors of the file of a sub-domain.
#[derive(Debug, Error)]
pub enum SealedError {
    /// The sub-domain is not sealed yet.
    #[error("sub-domain {subdomain} of {path} is not finished")]
    NotSealed {
        /// The file or folder.
        path: PathBuf,
        /// Rank of the sub-domain.
        subdomain: u32,
    },
    /// A chunk is not what its address says.
    #[error("{path} is damaged: {source}")]
    Chunk {
        /// The file or folder.
        path: PathBuf,
        /// The cause.
        #[source]
        source: ChunkError,
    },
    /// Parts of a sub-domain that contradict each other, or a missing one.
    #[error("{path} is damaged: sub-domain {subdomain}, {what}")]
    Content {
        /// The file or folder.
        path: PathBuf,
        /// Rank of the sub-domain.
        subdomain: u32,
        /// The contradiction.
        what: String,
    },
    /// The file itself.
    #[error(transparent)]
    Storage(#[from] StorageError),
}

impl SealedError {
    /// Returns whether the file was changed after it was written.
    pub fn is_damage(&self) -> bool {
        match self {
            Self::Chunk { .. } | Self::Content { .. } => true,
            Self::Storage(error) => error.is_damage(),
            Self::NotSealed { .. } => false,
        }
    }

    /// Damage in the file of a sub-domain, or in `path` as a whole.
    pub fn content(path: &Path, subdomain: u32, what: impl Into<String>) -> Self {
        Self::Content { path: path.to_owned(), subdomain, what: what.into() }
    }

    /// Wraps a failed operation on `path`.
    pub fn io(path: &Path, source: std::io::Error) -> Self {
        Self::Storage(StorageError::io(path, source))
    }
}
