//! Errors of writing.

use std::path::{Path, PathBuf};
use tetdb_schema::code::Code;

use thiserror::Error;

use tetdb_base::storage::RemoteFailure;
use tetdb_base::storage::StorageError;
use tetdb_store::sealed::SealedError;
use tetdb_store::store::StoreError;

/// Errors of writing meshes and surfaces.
#[derive(Debug, Error)]
pub enum WriteError {
    /// The name does not end as a format does.
    #[error("{path}: its ending names no known format, expected {known}")]
    UnknownFormat {
        /// The file to be written.
        path: PathBuf,
        /// The known endings.
        known: &'static str,
    },
    /// The format lacks a requested ability.
    #[error("{path}: the format {format} holds no {what}")]
    Unsupported {
        /// The file to be written.
        path: PathBuf,
        /// The format.
        format: &'static str,
        /// Name of the ability.
        what: String,
    },
    /// The format has only single precision, the surface needs double.
    #[error("{path}: this format would round the coordinates of vertex {vertex}")]
    Lossy {
        /// The file to be written.
        path: PathBuf,
        /// Index of the first vertex that would be rounded.
        vertex: u32,
    },
    /// The format's numbers are too small.
    #[error("{path}: this format holds at most {limit} {what}, found {found}")]
    TooLarge {
        /// The file to be written.
        path: PathBuf,
        /// Name of the counted things.
        what: &'static str,
        /// The most the format holds.
        limit: u64,
        /// Their number.
        found: u64,
    },
    /// The region has no tetrahedra.
    #[error("no region {region} is filled, {}", among(filled))]
    NoRegion {
        /// Number of the region.
        region: u32,
        /// Numbers of the filled regions.
        filled: Vec<u32>,
    },
    /// The file will not fit. Units: bytes.
    #[error("{path}: no space for it, {needed} bytes are needed and {available} are free")]
    NoSpace {
        /// The file to be written.
        path: PathBuf,
        /// Bytes needed.
        needed: u64,
        /// Bytes free.
        available: u64,
    },
    /// The disk filled up while the file was written.
    #[error("no space left to write {path}")]
    DiskFull {
        /// The file to be written.
        path: PathBuf,
    },
    /// The standard output accepts no more bytes.
    #[error(
        "the mesh could not be written to the standard output: {source}; of it {written} bytes were"
    )]
    StandardOutput {
        /// Bytes written before.
        written: u64,
        /// The error of the operating system.
        #[source]
        source: std::io::Error,
    },
    /// A file operation failed.
    #[error("{path}: {source}")]
    Io {
        /// The file to be written.
        path: PathBuf,
        /// The error of the operating system.
        #[source]
        source: std::io::Error,
    },
    /// The store cannot be read as it is: damaged, unfinished, busy.
    #[error(transparent)]
    Store(StoreError),
    /// Another process could not write its part.
    #[error("{}", .0.message)]
    Elsewhere(RemoteFailure),
}

impl WriteError {
    /// The word for this error.
    pub fn code(&self) -> Code {
        match self {
            Self::UnknownFormat { .. } => Code::UnknownFormat,
            Self::Unsupported { .. } => Code::Usage,
            Self::Lossy { .. } => Code::LossyFormat,
            Self::NoRegion { .. } => Code::NoSuchPart,
            Self::TooLarge { .. } => Code::FormatLimit,
            Self::NoSpace { .. } | Self::DiskFull { .. } => Code::DiskFull,
            Self::StandardOutput { source, .. }
                if source.kind() == std::io::ErrorKind::StorageFull =>
            {
                Code::DiskFull
            }
            Self::Io { .. } | Self::StandardOutput { .. } | Self::Elsewhere(_) => Code::Io,
            Self::Store(error) => word_of(error),
        }
    }

    /// The file of the error; errors of the store name their file themselves.
    pub fn place(&self) -> Option<&Path> {
        match self {
            Self::UnknownFormat { path, .. }
            | Self::Unsupported { path, .. }
            | Self::Lossy { path, .. }
            | Self::TooLarge { path, .. }
            | Self::NoSpace { path, .. }
            | Self::DiskFull { path }
            | Self::Io { path, .. } => Some(path),
            Self::NoRegion { .. } | Self::StandardOutput { .. } => None,
            Self::Store(_) | Self::Elsewhere(_) => None,
        }
    }

    /// Advice for the user.
    pub fn help(&self) -> &'static str {
        match self {
            Self::UnknownFormat { .. } => "end the name with one of those that are expected",
            Self::Unsupported { .. } => "choose another format, or leave that option out",
            Self::Lossy { .. } => "choose .ply, .obj, .off or .stl (text), which keep doubles",
            Self::NoRegion { .. } => "choose one of the store's filled regions",
            Self::TooLarge { .. } => "export to .vtu or .meshb, whose numbers have 64 bits",
            Self::NoSpace { .. } | Self::DiskFull { .. } => {
                "free some space, or export to another disk; compare with `df -h`"
            }
            Self::StandardOutput { .. } => "send it to a disk with more space",
            Self::Io { .. } => "check that the folder exists and may be written: `ls -ld FOLDER`",
            Self::Store(error) if error.is_damage() => {
                "verify the store to see what is left; copy it again or mesh the surface again"
            }
            Self::Store(StoreError::Storage(StorageError::Cancelled)) => "run the command again",
            Self::Store(StoreError::Changed { .. }) => {
                "run the command again: the file is then of the store as it is now"
            }
            Self::Store(StoreError::NoSubdomain { .. }) => "`tetdb info` lists the sub-domains",
            Self::Store(_) | Self::Elsewhere(_) => "look at the state of the store",
        }
    }

    /// Wraps a failed operation on `path`.
    pub(super) fn io(path: &Path, source: std::io::Error) -> Self {
        let path = path.to_owned();
        if source.kind() == std::io::ErrorKind::StorageFull {
            return Self::DiskFull { path };
        }
        Self::Io { path, source }
    }
}

/// The filled regions as the end of a sentence.
fn among(filled: &[u32]) -> String {
    match filled {
        [] => "none at all is".to_owned(),
        [one] => format!("only {one} is"),
        [first, .., last] => format!("only {} from {first} to {last} are", filled.len()),
    }
}

/// The word for a store that cannot be read.
fn word_of(error: &StoreError) -> Code {
    match error {
        StoreError::Storage(StorageError::Cancelled) => Code::Stopped,
        StoreError::NotFound { .. } => Code::NoSuchStore,
        StoreError::NoSubdomain { .. } => Code::NoSuchPart,
        StoreError::NotOurs { .. } => Code::NotAStore,
        StoreError::Unfinished { .. } | StoreError::Sealed(SealedError::NotSealed { .. }) => {
            Code::StoreUnfinished
        }
        StoreError::Format { .. } => Code::StoreFormat,
        _ if error.is_damage() => Code::Damaged,
        StoreError::Busy { .. } => Code::Busy,
        StoreError::Changed { .. } => Code::StoreChanged,
        _ => Code::Io,
    }
}

impl From<StoreError> for WriteError {
    fn from(error: StoreError) -> Self {
        match error {
            StoreError::Storage(error) | StoreError::Sealed(SealedError::Storage(error)) => {
                Self::from(error)
            }
            other => Self::Store(other),
        }
    }
}

impl From<StorageError> for WriteError {
    fn from(error: StorageError) -> Self {
        match error {
            StorageError::Full { path } => Self::DiskFull { path },
            StorageError::Io { path, source } => Self::Io { path, source },
            other => Self::Store(other.into()),
        }
    }
}

impl From<SealedError> for WriteError {
    fn from(error: SealedError) -> Self {
        Self::from(StoreError::from(error))
    }
}

/// Result of all writers.
pub(super) type Result<T> = std::result::Result<T, WriteError>;
