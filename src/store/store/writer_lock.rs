//! The right to change a store.

use std::path::Path;
use std::sync::Arc;

use super::StoreError;
use tetdb_base::storage::{DiskPath, FileLock, Refused, StorageError};

/// File of the right to change a store; see [`FileLock`].
pub(super) const LOCK: &str = "writer.lock";

/// The right to change a store, which one process at a time has; it ends when the last that shares it is dropped.
#[derive(Debug)]
pub struct WriterLock {
    file: FileLock,
}

impl WriterLock {
    /// Takes the right to change the store in a folder.
    ///
    /// Errors: [`StoreError::Busy`] while another has it; [`StoreError::NotFound`]; the folder takes no files.
    pub fn acquire(dir: impl Into<DiskPath>) -> Result<Arc<Self>, StoreError> {
        let dir = dir.into();
        let path = dir.path().to_owned();
        match dir.join(LOCK).lock() {
            Ok(file) => Ok(Arc::new(Self { file })),
            Err(Refused::Held(writer)) => Err(StoreError::Busy { path, writer }),
            Err(Refused::Io(_)) if !dir.exists() => Err(StoreError::NotFound { path }),
            Err(Refused::Io(e)) => Err(StorageError::io(&path.join(LOCK), e).into()),
        }
    }

    /// Returns whether the file system has no locks. Then the file that [`WriterLock`] leaves there decides, and a file left
    /// by a process of another host has to be removed by hand.
    pub fn is_by_name(&self) -> bool {
        self.file.is_by_name()
    }

    /// Moves the lock to the store's new directory.
    pub fn moved_to(&self, dir: &Path) {
        self.file.moved_to(&dir.join(LOCK));
    }
}
