//! The interface to the disk: all operations of a store on files and folders go through a [`Disk`].
//!
//! Why: the state after a crash, on a full disk or on a failing one can be tested only on a disk that fails on demand.

use std::fmt::Debug;
use std::io::{self, Read, Write};
use std::path::Path;

use redb::{Builder, DatabaseError, ReadOnlyDatabase, StorageBackend};

use super::file_lock::{FileLock, Refused};

/// Files and folders by path. Paths have the meaning of the operating system.
///
/// Written bytes last after [`StorageBackend::sync_data`] or [`Disk::sync_file`]. Names of created, renamed and removed
/// files last after [`Disk::sync_dir`]. Errors: the system's, with its kinds ([`io::ErrorKind::StorageFull`] and so
/// on).
pub trait Disk: Debug + Send + Sync {
    /// Creates a database file, which must not exist.
    fn create(&self, path: &Path) -> io::Result<Box<dyn StorageBackend>>;
    /// Opens a database file for reading and writing.
    fn open(&self, path: &Path) -> io::Result<Box<dyn StorageBackend>>;
    /// Opens a database file for reading, even while another process has it open.
    fn open_read_only(&self, path: &Path) -> io::Result<Box<dyn StorageBackend>>;
    /// Opens a database for reading together with other readers. redb can do so only for real files, by their paths.
    /// `None`: this disk has none.
    fn open_shared(
        &self,
        path: &Path,
        builder: &Builder,
    ) -> Option<Result<ReadOnlyDatabase, DatabaseError>>;
    /// Creates a file to be written once from its beginning.
    fn create_stream(&self, path: &Path) -> io::Result<Box<dyn Write>>;
    /// Opens a file to be read once from its beginning.
    fn open_stream(&self, path: &Path) -> io::Result<Box<dyn Read + Send + Sync>>;
    /// Syncs the content of a closed file.
    fn sync_file(&self, path: &Path) -> io::Result<()>;
    /// Syncs the names in a folder: of files that were created, renamed and removed.
    fn sync_dir(&self, dir: &Path) -> io::Result<()>;
    /// Creates a folder. Errors: its parent is missing, or it exists.
    fn create_dir(&self, dir: &Path) -> io::Result<()>;
    /// Removes a folder with all that is in it.
    fn remove_dir_all(&self, dir: &Path) -> io::Result<()>;
    /// Removes a file.
    fn remove_file(&self, path: &Path) -> io::Result<()>;
    /// Renames a file on the same disk, replacing a file of the new name.
    fn rename(&self, from: &Path, to: &Path) -> io::Result<()>;
    /// Gives a file a second name on the same disk. Errors: there are none on this disk; the name is taken.
    fn link(&self, _from: &Path, _to: &Path) -> io::Result<()> {
        Err(io::ErrorKind::Unsupported.into())
    }
    /// Takes the right that a file stands for. Errors: another has it; the folder takes no files.
    fn lock(&self, path: &Path) -> Result<FileLock, Refused>;
    /// Names in a folder, in any order.
    fn list(&self, dir: &Path) -> io::Result<Vec<String>>;
    /// The kind of the entry at a path; `None` if there is none or it may not be read.
    fn entry(&self, path: &Path) -> Option<DiskEntry>;
    /// Identity of the file at a path; `None` if there is none.
    fn id(&self, path: &Path) -> Option<FileId>;
}

/// Identifies a file among all that exist or are open at the same time, by any name.
pub type FileId = (u64, u64);

/// The kind of a directory entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DiskEntry {
    /// A folder.
    Folder,
    /// A file of this many bytes.
    File(u64),
}
