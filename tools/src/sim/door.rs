//! A disk in memory as a store sees it.

use std::io::{self, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use redb::{Builder, DatabaseError, ReadOnlyDatabase, StorageBackend};
use tetdb_base::storage::{Disk, DiskEntry, FileId, FileLock, Refused};

use super::SimDisk;
use super::state::{Call, Node, Pending, Told};

/// An open file.
#[derive(Debug)]
struct SimFile {
    disk: Arc<SimDisk>,
    file: usize,
}

impl StorageBackend for SimFile {
    fn len(&self) -> io::Result<u64> {
        Ok(self.disk.lock().files[self.file].now.len())
    }

    fn read(&self, offset: u64, out: &mut [u8]) -> io::Result<()> {
        let mut state = self.disk.lock();
        state.begin(Call::Read)?;
        let read = state.files[self.file].now.read(offset, out);
        match read == out.len() {
            true => Ok(()),
            false => Err(ErrorKind::UnexpectedEof.into()),
        }
    }

    fn set_len(&self, len: u64) -> io::Result<()> {
        let mut state = self.disk.lock();
        state.begin(Call::Resize)?;
        state.edit(self.file, |file| {
            file.now.set_len(len);
            file.pending.push(Pending::SetLen(len));
        });
        Ok(())
    }

    fn sync_data(&self) -> io::Result<()> {
        let mut state = self.disk.lock();
        if state.begin(Call::Sync)? == Told::Done {
            state.files[self.file].sync();
        }
        Ok(())
    }

    fn write(&self, offset: u64, data: &[u8]) -> io::Result<()> {
        self.disk.lock().write(self.file, offset, data)
    }
}

/// A file written or read from its beginning.
struct Stream {
    disk: Arc<SimDisk>,
    file: usize,
    at: u64,
}

impl Write for Stream {
    fn write(&mut self, data: &[u8]) -> io::Result<usize> {
        self.disk.lock().write(self.file, self.at, data)?;
        self.at += data.len() as u64;
        Ok(data.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Read for Stream {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let mut state = self.disk.lock();
        state.begin(Call::Read)?;
        let n = state.files[self.file].now.read(self.at, out);
        self.at += n as u64;
        Ok(n)
    }
}

/// The disk as paths see it: what is opened keeps it alive.
#[derive(Debug)]
pub(super) struct Door(pub Arc<SimDisk>);

impl Door {
    fn backend(&self, file: usize) -> Box<dyn StorageBackend> {
        let disk = self.0.clone();
        Box::new(SimFile { disk, file })
    }
}

impl Disk for Door {
    fn create(&self, path: &Path) -> io::Result<Box<dyn StorageBackend>> {
        let mut state = self.0.lock();
        state.begin(Call::Create)?;
        if state.names.contains_key(path) {
            return Err(ErrorKind::AlreadyExists.into());
        }
        let file = state.create(path)?;
        Ok(self.backend(file))
    }

    fn open(&self, path: &Path) -> io::Result<Box<dyn StorageBackend>> {
        let mut state = self.0.lock();
        state.begin(Call::Open)?;
        let file = state.file(path)?;
        Ok(self.backend(file))
    }

    fn open_read_only(&self, path: &Path) -> io::Result<Box<dyn StorageBackend>> {
        self.open(path)
    }

    fn open_shared(
        &self,
        _: &Path,
        _: &Builder,
    ) -> Option<Result<ReadOnlyDatabase, DatabaseError>> {
        None
    }

    fn create_stream(&self, path: &Path) -> io::Result<Box<dyn Write>> {
        let mut state = self.0.lock();
        state.begin(Call::Create)?;
        let (disk, file, at) = (self.0.clone(), state.create(path)?, 0);
        Ok(Box::new(Stream { disk, file, at }))
    }

    fn open_stream(&self, path: &Path) -> io::Result<Box<dyn Read + Send + Sync>> {
        let mut state = self.0.lock();
        state.begin(Call::Open)?;
        let (disk, file, at) = (self.0.clone(), state.file(path)?, 0);
        Ok(Box::new(Stream { disk, file, at }))
    }

    fn sync_file(&self, path: &Path) -> io::Result<()> {
        let mut state = self.0.lock();
        let told = state.begin(Call::SyncFile)?;
        let file = state.file(path)?;
        if told == Told::Done {
            state.files[file].sync();
        }
        Ok(())
    }

    fn sync_dir(&self, dir: &Path) -> io::Result<()> {
        let mut state = self.0.lock();
        let told = state.begin(Call::SyncDir)?;
        if state.node(dir)? != Node::Folder {
            return Err(ErrorKind::NotADirectory.into());
        }
        if told == Told::Lied {
            return Ok(());
        }
        let changes = std::mem::take(&mut state.name_changes);
        for change in changes {
            match change.folder == dir {
                true => change.apply(&mut state.names_synced),
                false => state.name_changes.push(change),
            }
        }
        Ok(())
    }

    fn create_dir(&self, dir: &Path) -> io::Result<()> {
        let mut state = self.0.lock();
        state.begin(Call::Create)?;
        if state.names.contains_key(dir) {
            return Err(ErrorKind::AlreadyExists.into());
        }
        state.node(dir.parent().unwrap_or(Path::new("")))?;
        state.change(None, Some((dir, Node::Folder)));
        Ok(())
    }

    fn remove_dir_all(&self, dir: &Path) -> io::Result<()> {
        let mut state = self.0.lock();
        state.begin(Call::Unlink)?;
        state.node(dir)?;
        let below: Vec<PathBuf> =
            (state.names.keys().rev()).filter(|path| path.starts_with(dir)).cloned().collect();
        for path in below {
            if let Some(&Node::File(f)) = state.names.get(&path) {
                state.unlink(f);
            }
            state.change(Some(&path), None);
        }
        Ok(())
    }

    fn remove_file(&self, path: &Path) -> io::Result<()> {
        let mut state = self.0.lock();
        state.begin(Call::Unlink)?;
        let file = state.file(path)?;
        state.unlink(file);
        state.change(Some(path), None);
        Ok(())
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        let mut state = self.0.lock();
        state.begin(Call::Rename)?;
        let file = state.file(from)?;
        state.change(Some(from), Some((to, Node::File(file))));
        Ok(())
    }

    /// One process uses it.
    fn lock(&self, _: &Path) -> Result<FileLock, Refused> {
        Ok(FileLock::unshared())
    }

    fn list(&self, dir: &Path) -> io::Result<Vec<String>> {
        let mut state = self.0.lock();
        state.begin(Call::List)?;
        state.node(dir)?;
        let names = state.names.keys().filter(|p| p.parent() == Some(dir));
        let name = |p: &PathBuf| p.file_name().map(|n| n.to_string_lossy().into_owned());
        Ok(names.filter_map(name).collect())
    }

    fn entry(&self, path: &Path) -> Option<DiskEntry> {
        let state = self.0.lock();
        match state.names.get(path)? {
            Node::Folder => Some(DiskEntry::Folder),
            Node::File(f) => Some(DiskEntry::File(state.files[*f].now.len())),
        }
    }

    fn id(&self, path: &Path) -> Option<FileId> {
        match self.0.lock().names.get(path)? {
            Node::Folder => None,
            Node::File(f) => Some((0, *f as u64)),
        }
    }
}
