//! A private scratch file that disappears with the process.

use std::sync::atomic::{AtomicU64, Ordering};

use redb::StorageBackend;

use super::{DiskPath, StorageError};

/// Numbers files within the process.
static FILES: AtomicU64 = AtomicU64::new(0);

/// Read and written at any place, by any thread.
pub(super) struct ScratchFile {
    file: Box<dyn StorageBackend>,
    path: DiskPath,
    /// True if its name is removed already.
    is_nameless: bool,
}

impl ScratchFile {
    /// A new file in `dir`, which must exist. Errors: the disk.
    pub fn create(dir: &DiskPath) -> Result<Self, StorageError> {
        let number = FILES.fetch_add(1, Ordering::Relaxed);
        let path = dir.join(format!(".tetdb-scratch-{}-{number}", std::process::id()));
        let file = path.at_path(path.disk().create(path.path()))?;
        // On systems that keep an open file without a name, a killed run leaves nothing behind.
        let is_nameless = cfg!(unix) && path.remove_file().is_ok();
        Ok(Self { file, path, is_nameless })
    }

    /// Fills `out` from byte `at` on, all of which must have been written.
    pub fn read(&self, at: u64, out: &mut [u8]) -> Result<(), StorageError> {
        self.path.at_path(self.file.read(at, out))
    }

    /// Path at which it was created.
    pub fn path(&self) -> &DiskPath {
        &self.path
    }

    /// Writes `bytes` from byte `at` on.
    pub fn write(&self, at: u64, bytes: &[u8]) -> Result<(), StorageError> {
        self.path.at_path(self.file.write(at, bytes))
    }
}

impl Drop for ScratchFile {
    fn drop(&mut self) {
        if !self.is_nameless {
            // The file has no content of value.
            let _ = self.path.remove_file();
        }
    }
}
