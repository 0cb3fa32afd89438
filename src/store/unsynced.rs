//! A file whose commits reach the system, but not yet the disk.

use std::fs::OpenOptions;
use std::io;
use std::path::Path;

use redb::backends::FileBackend;
use redb::{DatabaseError, StorageBackend, StorageError};

/// A redb file that is not synced at its commits.
///
/// A file that the catalog does not list yet is worth nothing after a crash, whatever reached the disk; the commit that lists it syncs
/// it as a whole first. Syncing each batch instead was most of the time of a cut with very few frames. Is not: for files that are
/// changed in place once they are listed, nor for several processes; it takes no lock.
#[derive(Debug)]
pub(super) struct Unsynced(FileBackend);

impl Unsynced {
    /// Creates a file that must not exist.
    pub(super) fn create(path: &Path) -> Result<Self, DatabaseError> {
        let mut options = OpenOptions::new();
        let file = options.read(true).write(true).create_new(true).open(path);
        Ok(Self(FileBackend::new(file.map_err(StorageError::Io)?)?))
    }
}

impl StorageBackend for Unsynced {
    fn len(&self) -> io::Result<u64> {
        self.0.len()
    }

    fn read(&self, offset: u64, out: &mut [u8]) -> io::Result<()> {
        self.0.read(offset, out)
    }

    fn set_len(&self, len: u64) -> io::Result<()> {
        self.0.set_len(len)
    }

    fn sync_data(&self) -> io::Result<()> {
        Ok(())
    }

    fn write(&self, offset: u64, data: &[u8]) -> io::Result<()> {
        self.0.write(offset, data)
    }

    fn close(&self) -> io::Result<()> {
        self.0.close()
    }
}
