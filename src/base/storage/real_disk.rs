//! The disk of the operating system.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::Path;

use redb::backends::FileBackend;
use redb::{Builder, DatabaseError, ReadOnlyDatabase, StorageBackend};

use super::disk::{Disk, DiskEntry, FileId};
use super::file_lock::{FileLock, Refused};

/// Files and folders of this machine, with redb's own locks on database files.
#[derive(Clone, Copy, Debug)]
pub(super) struct RealDisk;

fn backend(file: File) -> io::Result<Box<dyn StorageBackend>> {
    match FileBackend::new(file) {
        Ok(backend) => Ok(Box::new(backend)),
        Err(e) => Err(io::Error::other(e)),
    }
}

impl Disk for RealDisk {
    fn create(&self, path: &Path) -> io::Result<Box<dyn StorageBackend>> {
        let mut options = OpenOptions::new();
        backend(options.read(true).write(true).create_new(true).open(path)?)
    }

    fn open(&self, path: &Path) -> io::Result<Box<dyn StorageBackend>> {
        backend(OpenOptions::new().read(true).write(true).open(path)?)
    }

    fn open_read_only(&self, path: &Path) -> io::Result<Box<dyn StorageBackend>> {
        backend(File::open(path)?)
    }

    fn open_shared(
        &self,
        path: &Path,
        builder: &Builder,
    ) -> Option<Result<ReadOnlyDatabase, DatabaseError>> {
        Some(builder.open_read_only(path))
    }

    fn create_stream(&self, path: &Path) -> io::Result<Box<dyn Write>> {
        Ok(Box::new(File::create(path)?))
    }

    fn open_stream(&self, path: &Path) -> io::Result<Box<dyn Read + Send + Sync>> {
        Ok(Box::new(File::open(path)?))
    }

    fn sync_file(&self, path: &Path) -> io::Result<()> {
        File::open(path)?.sync_all()
    }

    fn sync_dir(&self, dir: &Path) -> io::Result<()> {
        File::open(dir)?.sync_all()
    }

    fn create_dir(&self, dir: &Path) -> io::Result<()> {
        fs::create_dir(dir)
    }

    fn remove_dir_all(&self, dir: &Path) -> io::Result<()> {
        fs::remove_dir_all(dir)
    }

    fn remove_file(&self, path: &Path) -> io::Result<()> {
        fs::remove_file(path)
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        fs::rename(from, to)
    }

    fn link(&self, from: &Path, to: &Path) -> io::Result<()> {
        fs::hard_link(from, to)
    }

    fn lock(&self, path: &Path) -> Result<FileLock, Refused> {
        FileLock::acquire(path)
    }

    fn list(&self, dir: &Path) -> io::Result<Vec<String>> {
        fs::read_dir(dir)?
            .map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned()))
            .collect()
    }

    fn entry(&self, path: &Path) -> Option<DiskEntry> {
        let metadata = fs::metadata(path).ok()?;
        match metadata.is_dir() {
            true => Some(DiskEntry::Folder),
            false => Some(DiskEntry::File(metadata.len())),
        }
    }

    #[cfg(unix)]
    fn id(&self, path: &Path) -> Option<FileId> {
        use std::os::unix::fs::MetadataExt;
        let metadata = fs::metadata(path).ok()?;
        Some((metadata.dev(), metadata.ino()))
    }

    /// By when and how large it was written, where the system has no other numbers.
    #[cfg(not(unix))]
    fn id(&self, path: &Path) -> Option<FileId> {
        let metadata = fs::metadata(path).ok()?;
        let since = metadata.modified().ok()?.duration_since(std::time::UNIX_EPOCH);
        Some((metadata.len(), since.ok()?.as_nanos() as u64))
    }
}
