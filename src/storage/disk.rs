//! The one door to the disk: whatever a store does with files and folders goes through a [`Disk`].
//!
//! Why a door: what a crash, a full disk or a failing one leaves behind can only be tested on a disk that does these things on demand.

use std::fmt::Debug;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use redb::{Builder, DatabaseError, ReadOnlyDatabase, StorageBackend};

use super::StorageError;
use super::real_disk::RealDisk;

/// Files and folders by path. Paths mean what they mean to the operating system.
///
/// What is written counts after [`StorageBackend::sync_data`] or [`Disk::sync_file`]; that a file has a name, another name or none, after
/// [`Disk::sync_dir`]. Errors: the system's, with its kinds ([`io::ErrorKind::StorageFull`] and so on).
pub trait Disk: Debug + Send + Sync {
    /// Creates a database file, which must not exist.
    fn create(&self, path: &Path) -> io::Result<Box<dyn StorageBackend>>;
    /// Opens a database file for reading and writing.
    fn open(&self, path: &Path) -> io::Result<Box<dyn StorageBackend>>;
    /// Opens a database file for reading, whoever has it.
    fn open_to_look(&self, path: &Path) -> io::Result<Box<dyn StorageBackend>>;
    /// Opens the database in a file for reading, beside other readers: redb does so for real files only, by their paths. `None`: this disk
    /// has none.
    fn open_shared(
        &self,
        path: &Path,
        builder: &Builder,
    ) -> Option<Result<ReadOnlyDatabase, DatabaseError>>;
    /// Creates a file to be written once from its beginning, such as a sorted run.
    fn create_stream(&self, path: &Path) -> io::Result<Box<dyn Write>>;
    /// Opens a file to be read once from its beginning.
    fn open_stream(&self, path: &Path) -> io::Result<Box<dyn Read + Send + Sync>>;
    /// Makes the content of a closed file last.
    fn sync_file(&self, path: &Path) -> io::Result<()>;
    /// Makes names in a folder last: of files that were created, renamed and removed.
    fn sync_dir(&self, dir: &Path) -> io::Result<()>;
    /// Makes a folder. Errors: its parent is missing, or it is there already.
    fn create_dir(&self, dir: &Path) -> io::Result<()>;
    /// Removes a folder with all that is in it.
    fn remove_dir_all(&self, dir: &Path) -> io::Result<()>;
    /// Removes a file.
    fn remove_file(&self, path: &Path) -> io::Result<()>;
    /// Gives a file another name on the same disk, replacing what had it.
    fn rename(&self, from: &Path, to: &Path) -> io::Result<()>;
    /// Names in a folder, in any order.
    fn list(&self, dir: &Path) -> io::Result<Vec<String>>;
    /// What is at a path; `None`: nothing, or nothing that may be seen.
    fn entry(&self, path: &Path) -> Option<Entry>;
    /// Bytes free for files at a path, where that can be told.
    fn available_bytes(&self, path: &Path) -> Option<u64>;
}

/// What has a name on a disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Entry {
    Folder,
    /// A file of this many bytes.
    File(u64),
}

/// A path on a disk: the real one, unless said otherwise.
#[derive(Clone, Debug)]
pub struct DiskPath {
    disk: Arc<dyn Disk>,
    path: PathBuf,
}

impl DiskPath {
    /// A path on `disk`.
    pub fn on(disk: Arc<dyn Disk>, path: impl Into<PathBuf>) -> Self {
        let path = path.into();
        Self { disk, path }
    }

    /// The path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The disk it is on.
    pub fn disk(&self) -> &dyn Disk {
        &*self.disk
    }

    /// A path below this one.
    pub fn join(&self, name: impl AsRef<Path>) -> Self {
        Self::on(self.disk.clone(), self.path.join(name))
    }

    /// The folder it is in.
    pub fn folder(&self) -> Self {
        let parent = match self.path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            // A bare name is in the current folder, and so is that folder itself as far as anybody asks.
            _ => Path::new("."),
        };
        Self::on(self.disk.clone(), parent)
    }

    /// Whether something is there.
    pub fn exists(&self) -> bool {
        self.disk.entry(&self.path).is_some()
    }

    /// Whether a file is there.
    pub fn is_file(&self) -> bool {
        matches!(self.disk.entry(&self.path), Some(Entry::File(_)))
    }

    /// Whether a folder is there.
    pub fn is_dir(&self) -> bool {
        self.disk.entry(&self.path) == Some(Entry::Folder)
    }

    /// Length of the file in bytes. Errors: there is none.
    pub fn bytes(&self) -> Result<u64, StorageError> {
        match self.disk.entry(&self.path) {
            Some(Entry::File(bytes)) => Ok(bytes),
            _ => self.told(Err(io::ErrorKind::NotFound.into())),
        }
    }

    /// Makes the folder, and those above it that are missing, to last.
    pub fn create_dir_all(&self) -> Result<(), StorageError> {
        self.told(self.make_dirs())
    }

    fn make_dirs(&self) -> io::Result<()> {
        if self.is_dir() {
            return Ok(());
        }
        let folder = self.folder();
        if folder.path != self.path {
            folder.make_dirs()?;
        }
        match self.disk.create_dir(&self.path) {
            Ok(()) => self.disk.sync_dir(&folder.path),
            Err(e) if e.kind() == io::ErrorKind::AlreadyExists => match self.is_dir() {
                true => Ok(()),
                false => Err(io::ErrorKind::NotADirectory.into()),
            },
            Err(e) => Err(e),
        }
    }

    /// Removes the folder with all that is in it.
    pub fn remove_dir_all(&self) -> Result<(), StorageError> {
        self.told(self.disk.remove_dir_all(&self.path))
    }

    /// Gives what is here another name in the same folder, to last.
    pub fn rename(&self, to: &Self) -> Result<(), StorageError> {
        to.told(self.disk.rename(&self.path, &to.path))?;
        to.folder().sync_dir()
    }

    /// Removes the file, if it is there.
    pub fn remove_file(&self) -> Result<(), StorageError> {
        match self.disk.remove_file(&self.path) {
            Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(()),
            removed => self.told(removed),
        }
    }

    /// Makes the content of the closed file last.
    pub fn sync_file(&self) -> Result<(), StorageError> {
        self.told(self.disk.sync_file(&self.path))
    }

    /// Makes the names in the folder last.
    pub fn sync_dir(&self) -> Result<(), StorageError> {
        self.told(self.disk.sync_dir(&self.path))
    }

    /// Names in the folder.
    pub fn list(&self) -> Result<Vec<String>, StorageError> {
        self.told(self.disk.list(&self.path))
    }

    /// What was done here, with the path in its error.
    pub(super) fn told<T>(&self, done: io::Result<T>) -> Result<T, StorageError> {
        done.map_err(|e| StorageError::io(&self.path, e))
    }
}

impl<T: AsRef<Path> + ?Sized> From<&T> for DiskPath {
    fn from(path: &T) -> Self {
        Self::on(Arc::new(RealDisk), path.as_ref())
    }
}

impl From<PathBuf> for DiskPath {
    fn from(path: PathBuf) -> Self {
        Self::on(Arc::new(RealDisk), path)
    }
}

impl From<&DiskPath> for DiskPath {
    fn from(path: &DiskPath) -> Self {
        path.clone()
    }
}
