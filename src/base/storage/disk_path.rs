//! A path on a disk, and the operations of a store there.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::StorageError;
use super::disk::{Disk, DiskEntry, FileId};
use super::file_lock::{FileLock, Refused};
use super::real_disk::RealDisk;

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
            // A bare name is in the current folder. The current folder counts as its own folder here.
            _ => Path::new("."),
        };
        Self::on(self.disk.clone(), parent)
    }

    /// Returns whether a file or folder exists here.
    pub fn exists(&self) -> bool {
        self.disk.entry(&self.path).is_some()
    }

    /// Returns whether a file exists here.
    pub fn is_file(&self) -> bool {
        matches!(self.disk.entry(&self.path), Some(DiskEntry::File(_)))
    }

    /// Returns whether a folder exists here.
    pub fn is_dir(&self) -> bool {
        self.disk.entry(&self.path) == Some(DiskEntry::Folder)
    }

    /// Identity of the file here.
    pub fn id(&self) -> Option<FileId> {
        self.disk.id(&self.path)
    }

    /// Takes the right that the file stands for. Errors: another has it; the folder takes no files.
    pub fn lock(&self) -> Result<FileLock, Refused> {
        self.disk.lock(&self.path)
    }

    /// Length of the file in bytes. Errors: there is no such file.
    pub fn bytes(&self) -> Result<u64, StorageError> {
        match self.disk.entry(&self.path) {
            Some(DiskEntry::File(bytes)) => Ok(bytes),
            _ => self.at_path(Err(io::ErrorKind::NotFound.into())),
        }
    }

    /// Creates the folder and its missing parents, durably.
    pub fn create_dir_all(&self) -> Result<(), StorageError> {
        self.at_path(self.create_dirs())
    }

    fn create_dirs(&self) -> io::Result<()> {
        if self.is_dir() {
            return Ok(());
        }
        let folder = self.folder();
        if folder.path != self.path {
            folder.create_dirs()?;
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
        self.at_path(self.disk.remove_dir_all(&self.path))
    }

    /// Renames the file or folder within its folder, durably.
    pub fn rename(&self, to: &Self) -> Result<(), StorageError> {
        to.at_path(self.disk.rename(&self.path, &to.path))?;
        to.folder().sync_dir()
    }

    /// Adds a second name. Errors: the disk does not support it; the name exists.
    pub fn link(&self, to: &Self) -> Result<(), StorageError> {
        to.at_path(self.disk.link(&self.path, &to.path))
    }

    /// Removes the file, if it is there.
    pub fn remove_file(&self) -> Result<(), StorageError> {
        match self.disk.remove_file(&self.path) {
            Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(()),
            removed => self.at_path(removed),
        }
    }

    /// Syncs the content of the closed file.
    pub fn sync_file(&self) -> Result<(), StorageError> {
        self.at_path(self.disk.sync_file(&self.path))
    }

    /// Syncs the names in the folder.
    pub fn sync_dir(&self) -> Result<(), StorageError> {
        self.at_path(self.disk.sync_dir(&self.path))
    }

    /// Names in the folder.
    pub fn list(&self) -> Result<Vec<String>, StorageError> {
        self.at_path(self.disk.list(&self.path))
    }

    /// The result of an operation here, with the path in its error.
    pub(super) fn at_path<T>(&self, done: io::Result<T>) -> Result<T, StorageError> {
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
