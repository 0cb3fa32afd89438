//! One redb file of keyed values: a sub-domain in one generation.

use std::io::ErrorKind;
use std::mem::ManuallyDrop;
use std::path::Path;
use std::sync::Arc;

use redb::{
    Database, DatabaseError, Durability, ReadOnlyDatabase, ReadOnlyTable, ReadableDatabase,
    StorageBackend, TableDefinition,
};

use super::backend::{DiskFile, Private};
use super::{DiskPath, StorageError};

/// A check goes through a file once, so that a cache brings nothing.
const CHECK_CACHE_BYTES: usize = 1 << 20;

/// The only table of a file; see the schema's page on keys.
const PAGES: TableDefinition<u64, &[u8]> = TableDefinition::new("pages");

#[derive(Clone)]
enum Handle {
    Writer(Arc<Database>),
    Reader(Arc<ReadOnlyDatabase>),
}

/// Values by key in one redb file.
///
/// Invariant: every write is one commit. It is durable, except in a file from [`StoreFile::create_unsynced`]. Is not: a
/// cache. The cache is redb's and is bounded by the `cache_bytes` given at opening, which the caller has leased.
pub struct StoreFile {
    path: DiskPath,
    /// Always there until it is dropped.
    handle: Option<Handle>,
    /// Kept between reads; dropped at each commit, because it shows the state before it.
    table: Option<ReadOnlyTable<u64, &'static [u8]>>,
    /// The damage found first. Afterwards redb answers all reads with an error that names no cause.
    damage: Option<String>,
}

impl StoreFile {
    /// Creates a file that must not exist.
    ///
    /// Errors: [`StorageError::Io`] when it exists or its folder cannot be written.
    pub fn create(path: impl Into<DiskPath>, cache_bytes: usize) -> Result<Self, StorageError> {
        Self::fresh(path.into(), cache_bytes, true)
    }

    /// Creates a file that must not exist, for one process. Commits are not synced: the file is synced when the catalog
    /// lists it.
    ///
    /// Errors: as [`StoreFile::create`].
    pub fn create_unsynced(
        path: impl Into<DiskPath>,
        cache_bytes: usize,
    ) -> Result<Self, StorageError> {
        Self::fresh(path.into(), cache_bytes, false)
    }

    fn fresh(path: DiskPath, cache_bytes: usize, is_synced: bool) -> Result<Self, StorageError> {
        let mut builder = Database::builder();
        builder.set_cache_size(cache_bytes);
        let file = path.at_path(path.disk().create(path.path()))?;
        let db = guarded(|| builder.create_with_backend(DiskFile { file, is_synced }));
        let mut file = Self {
            handle: Some(Handle::Writer(Arc::new(db.map_err(|e| e.at(path.path()))?))),
            path,
            table: None,
            damage: None,
        };
        file.write(std::iter::empty())?;
        Ok(file)
    }

    /// Opens an existing file; read-only opening lets other readers in and creates nothing.
    ///
    /// Errors: [`StorageError::Busy`] while another process writes it, [`StorageError::Damaged`] when redb cannot read it.
    pub fn open(
        path: impl Into<DiskPath>,
        cache_bytes: usize,
        writable: bool,
    ) -> Result<Self, StorageError> {
        let access = match writable {
            true => Access::Write,
            false => Access::Share,
        };
        Self::open_for(path.into(), cache_bytes, access)
    }

    fn open_for(path: DiskPath, cache_bytes: usize, access: Access) -> Result<Self, StorageError> {
        let mut builder = Database::builder();
        builder.set_cache_size(cache_bytes);
        // redb follows its tree of free pages while it opens.
        let handle = guarded(|| match access {
            Access::Write => open_writable(&path, &builder).map(|db| Handle::Writer(Arc::new(db))),
            Access::Private => open_private(&path, &builder).map(|db| Handle::Writer(Arc::new(db))),
            Access::Share => match path.disk().open_shared(path.path(), &builder) {
                Some(db) => db.map(|db| Handle::Reader(Arc::new(db))),
                None => open_private(&path, &builder).map(|db| Handle::Writer(Arc::new(db))),
            },
        });
        let mut file = Self {
            handle: Some(handle.map_err(|e| e.at(path.path()))?),
            path,
            table: None,
            damage: None,
        };
        // redb writes once more when it closes a database opened for writing. On a damaged tree it panics then, and
        // panics again while unwinding, which ends the process. So a damaged file is never closed.
        if matches!(file.handle, Some(Handle::Writer(_)))
            && let Err(damage) = file.check()
        {
            std::mem::forget(file.handle.take());
            return Err(damage);
        }
        Ok(file)
    }

    /// Opens an existing file as [`StoreFile::open`] does, also one whose writer was killed: to be read, that is repaired in memory,
    /// so that neither the right to write nor space on the disk is needed.
    ///
    /// Errors: as [`StoreFile::open`].
    pub fn open_repaired(
        path: impl Into<DiskPath>,
        cache_bytes: usize,
        writable: bool,
    ) -> Result<Self, StorageError> {
        let path = &path.into();
        match Self::open(path, cache_bytes, writable) {
            Err(StorageError::Database { source, .. })
                if !writable
                    && matches!(source.downcast_ref(), Some(redb::Error::RepairAborted)) =>
            {
                Self::open_for(path.clone(), cache_bytes, Access::Private)
            }
            other => other,
        }
    }

    /// Renames the file within its folder, durably, replacing a file of that name; readers see the old name or the new.
    ///
    /// Errors: the system refuses.
    pub fn rename(&mut self, name: &str) -> Result<(), StorageError> {
        let to = self.path.folder().join(name);
        self.path.rename(&to)?;
        self.path = to;
        Ok(())
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        self.path.path()
    }

    /// Calls `use_bytes` with the value of `key`, or returns `None` when there is none.
    ///
    /// Effects: none on the file. Errors: reads that fail, and damage redb notices.
    pub fn read<T>(
        &mut self,
        key: u64,
        use_bytes: impl FnOnce(&[u8]) -> T,
    ) -> Result<Option<T>, StorageError> {
        let table = self.table()?;
        let found = guarded(|| table.get(key).map(|v| v.map(|v| use_bytes(v.value()))));
        found.map_err(|e| self.failed(e))
    }

    /// Calls `visit` with every key and value of `keys`, ascending, until it returns `false`.
    pub fn scan(
        &mut self,
        keys: std::ops::Range<u64>,
        mut visit: impl FnMut(u64, &[u8]) -> bool,
    ) -> Result<(), StorageError> {
        let table = self.table()?;
        let done = guarded(|| -> Result<(), redb::Error> {
            for entry in table.range(keys)? {
                let (key, value) = entry?;
                if !visit(key.value(), value.value()) {
                    break;
                }
            }
            Ok(())
        });
        done.map_err(|e| self.failed(e))
    }

    /// The error of a failed read. Once damage was found, redb refuses all reads; the error is then that damage.
    fn failed(&mut self, failure: RedbFailure) -> StorageError {
        let path = self.path.path();
        match (failure, &self.damage) {
            (RedbFailure::Error(redb::Error::PreviousIo), Some(reason)) => {
                StorageError::Damaged { path: path.to_owned(), reason: reason.clone() }
            }
            (failure, _) => {
                let error = failure.at(path);
                if let StorageError::Damaged { reason, .. } = &error {
                    self.damage = Some(reason.clone());
                }
                error
            }
        }
    }

    /// Writes `values` in one durable commit. Ascending keys are fastest.
    ///
    /// Errors: [`StorageError::Full`] when the disk is; the file then stands at its last commit.
    pub fn write<'a>(
        &mut self,
        values: impl Iterator<Item = (u64, &'a [u8])>,
    ) -> Result<(), StorageError> {
        self.change(values.map(|(key, value)| (key, Some(value))))
    }

    /// Writes the values that are there and removes the keys that have none, in one durable commit.
    ///
    /// Errors: as [`StoreFile::write`].
    pub fn change<'a>(
        &mut self,
        changes: impl Iterator<Item = (u64, Option<&'a [u8]>)>,
    ) -> Result<(), StorageError> {
        let Some(Handle::Writer(db)) = &self.handle else {
            unreachable!("{} is open for reading only", self.path().display());
        };
        self.table = None;
        let committed = guarded(|| -> Result<(), redb::Error> {
            let mut txn = db.begin_write()?;
            txn.set_durability(Durability::Immediate)?;
            txn.set_quick_repair(true);
            {
                let mut table = txn.open_table(PAGES)?;
                for (key, value) in changes {
                    match value {
                        Some(value) => drop(table.insert(key, value)?),
                        None => drop(table.remove(key)?),
                    }
                }
            }
            txn.commit()?;
            Ok(())
        });
        committed.map_err(|e| e.at(self.path.path()))
    }

    /// Reads the whole file and compares every page of redb's tree with its checksum. Nothing else does: a value read
    /// by key is right or missing, but a range of keys may silently lack some.
    ///
    /// Effects: none on the file. Errors: [`StorageError::Damaged`].
    pub fn check(&self) -> Result<(), StorageError> {
        let mut builder = Database::builder();
        builder.set_cache_size(CHECK_CACHE_BYTES);
        // As in opening: one that is damaged is not closed, or a panic while it is could end the process.
        let sound = guarded(|| {
            let mut db = ManuallyDrop::new(open_private(&self.path, &builder)?);
            let is_sound = db.check_integrity()?;
            if is_sound {
                drop(ManuallyDrop::into_inner(db));
            }
            Ok::<_, DatabaseError>(is_sound)
        });
        match sound.map_err(|e| e.at(self.path())) {
            Ok(true) => Ok(()),
            Ok(false) | Err(StorageError::Damaged { .. }) => Err(StorageError::Damaged {
                path: self.path().to_owned(),
                reason: "its tree of pages does not match its checksums".to_owned(),
            }),
            Err(other) => Err(other),
        }
    }

    /// A handle for another reader, with the state that this handle shows.
    pub fn share(&self) -> Self {
        Self {
            path: self.path.clone(),
            handle: self.handle.clone(),
            table: None,
            damage: self.damage.clone(),
        }
    }

    /// Writes all it holds, then the changes, into a new file at `to`, which lasts and is closed when this returns.
    ///
    /// Memory: a batch of values. Errors: as [`StoreFile::create`] and [`StoreFile::write`]; damage.
    pub fn rewrite<'a>(
        &mut self,
        to: &DiskPath,
        cache_bytes: usize,
        changes: impl Iterator<Item = (u64, Option<&'a [u8]>)>,
    ) -> Result<(), StorageError> {
        /// Values of so many bytes are read before they are written.
        const BATCH_BYTES: usize = 1 << 20;
        let mut new = Self::create_unsynced(to, cache_bytes)?;
        let mut from = Some(0);
        while let Some(first) = from.take() {
            let (mut batch, mut bytes) = (Vec::new(), 0);
            self.scan(first..u64::MAX, |key, value| {
                if bytes > BATCH_BYTES {
                    from = Some(key);
                    return false;
                }
                bytes += value.len();
                batch.push((key, value.to_vec()));
                true
            })?;
            new.write(batch.iter().map(|(key, value)| (*key, &value[..])))?;
        }
        new.change(changes)?;
        new.compact()?;
        to.sync_file()
    }

    /// Shrinks the file to its content, and closes it.
    pub fn compact(mut self) -> Result<(), StorageError> {
        self.table = None;
        if let Some(Handle::Writer(db)) = &mut self.handle {
            let db = Arc::get_mut(db).expect("what is written is not shared");
            let done = guarded(|| db.compact().map_err(redb::Error::from));
            done.map_err(|e| e.at(self.path.path()))?;
        }
        Ok(())
    }

    fn table(&mut self) -> Result<&ReadOnlyTable<u64, &'static [u8]>, StorageError> {
        if self.table.is_none() {
            let opened = guarded(|| -> Result<_, redb::Error> {
                let txn = match self.handle.as_ref().expect("a file that is not dropped") {
                    Handle::Writer(db) => db.begin_read()?,
                    Handle::Reader(db) => db.begin_read()?,
                };
                Ok(txn.open_table(PAGES)?)
            });
            self.table = Some(opened.map_err(|e| self.failed(e))?);
        }
        Ok(self.table.as_ref().expect("just opened"))
    }
}

impl Drop for StoreFile {
    fn drop(&mut self) {
        self.table = None;
        let handle = self.handle.take();
        // redb checks its tree once more when it closes. Damage found there was reported before, or is found when the
        // file is opened next.
        let _ = caught(|| drop(handle));
    }
}

/// The purpose of opening a file.
#[derive(Clone, Copy)]
enum Access {
    /// For writing, exclusively.
    Write,
    /// For reading, shared with other readers.
    Share,
    /// For reading, with redb's changes kept in memory.
    Private,
}

/// Opens an existing file. An empty file is refused: redb would create a database in it.
fn open_writable(path: &DiskPath, builder: &redb::Builder) -> Result<Database, DatabaseError> {
    let file = path.disk().open(path.path()).map_err(redb::StorageError::Io)?;
    refuse_empty(&*file)?;
    builder.create_with_backend(DiskFile { file, is_synced: true })
}

/// Opens an existing file without changing it.
fn open_private(path: &DiskPath, builder: &redb::Builder) -> Result<Database, DatabaseError> {
    let file = path.disk().open_read_only(path.path());
    let file = file.map_err(redb::StorageError::Io)?;
    refuse_empty(&*file)?;
    builder.create_with_backend(Private::new(file).map_err(redb::StorageError::Io)?)
}

fn refuse_empty(file: &dyn StorageBackend) -> Result<(), redb::StorageError> {
    match file.len()? {
        0 => Err(redb::StorageError::Io(ErrorKind::InvalidData.into())),
        _ => Ok(()),
    }
}

/// A failure inside redb: an error it returned, or a panic on a tree it could not follow.
enum RedbFailure {
    Error(redb::Error),
    Panic(String),
}

impl RedbFailure {
    fn at(self, path: &Path) -> StorageError {
        let path = path.to_owned();
        match self {
            Self::Panic(reason) => StorageError::Damaged { path, reason },
            Self::Error(redb::Error::Corrupted(reason)) => StorageError::Damaged { path, reason },
            Self::Error(redb::Error::DatabaseAlreadyOpen) => StorageError::Busy { path },
            Self::Error(redb::Error::Io(e)) if e.kind() == ErrorKind::NotFound => {
                StorageError::Missing { path, what: "the file".to_owned() }
            }
            // A foreign, truncated or empty file: redb does not find its header or its pages.
            Self::Error(redb::Error::Io(e))
                if matches!(e.kind(), ErrorKind::InvalidData | ErrorKind::UnexpectedEof) =>
            {
                StorageError::Damaged { path, reason: e.to_string() }
            }
            Self::Error(redb::Error::Io(e)) => StorageError::io(&path, e),
            // Every file has its one table from its first commit on.
            Self::Error(
                e @ (redb::Error::TableDoesNotExist(_)
                | redb::Error::TableTypeMismatch { .. }
                | redb::Error::TableIsMultimap(_)
                | redb::Error::TableIsNotMultimap(_)
                | redb::Error::TypeDefinitionChanged { .. }
                | redb::Error::UpgradeRequired(_)),
            ) => StorageError::Damaged { path, reason: e.to_string() },
            Self::Error(source) => StorageError::Database { path, source: Box::new(source) },
        }
    }
}

/// Calls redb and converts its failures to one type.
fn guarded<T, E: Into<redb::Error>>(call: impl FnOnce() -> Result<T, E>) -> Result<T, RedbFailure> {
    match caught(call) {
        Ok(result) => result.map_err(|e| RedbFailure::Error(e.into())),
        Err(reason) => Err(RedbFailure::Panic(reason)),
    }
}

/// Runs a call into redb; on a damaged tree redb may panic, which is damage and not our bug. Its words are of its own code.
fn caught<T>(call: impl FnOnce() -> T) -> Result<T, String> {
    let caught = std::panic::catch_unwind(std::panic::AssertUnwindSafe(call));
    caught.map_err(|_| "its pages do not fit together".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_come_back_from_a_closed_file() -> Result<(), Box<dyn std::error::Error>> {
        let dir = tempfile::tempdir()?;
        let path = dir.path().join("a.redb");
        let mut file = StoreFile::create(&path, 1 << 20)?;
        let value = vec![5u8; 1000];
        file.write([(3, &value[..]), (9, &value[..10])].into_iter())?;
        assert_eq!(file.read(9, <[u8]>::len)?, Some(10));
        assert!(matches!(StoreFile::open(&path, 0, true), Err(StorageError::Busy { .. })));
        file.compact()?;
        let mut file = StoreFile::open(&path, 1 << 20, false)?;
        assert_eq!(file.read(3, <[u8]>::to_vec)?, Some(value));
        assert_eq!(file.read(4, <[u8]>::len)?, None);
        let mut keys = Vec::new();
        file.scan(0..u64::MAX, |key, _| {
            keys.push(key);
            true
        })?;
        assert_eq!(keys, [3, 9]);
        assert!(StoreFile::create(&path, 0).is_err());
        Ok(())
    }

    /// Every read of a damaged tree reports the damage, not only the first one.
    #[test]
    fn damage_stays_damage() -> Result<(), Box<dyn std::error::Error>> {
        let dir = tempfile::tempdir()?;
        let path = dir.path().join("a.redb");
        let value = [7u8; 500];
        let mut file = StoreFile::create(&path, 1 << 20)?;
        file.write((0..40).map(|key| (key, &value[..])))?;
        file.compact()?;
        let good = std::fs::read(&path)?;
        let (mut n_opened, mut n_damaged) = (0, 0);
        for at in (4096..good.len()).step_by(61).filter(|&at| good[at] != 7) {
            let mut bad = good.clone();
            bad[at] ^= 0x10;
            std::fs::write(&path, &bad)?;
            let mut file = match StoreFile::open_repaired(&path, 1 << 16, false) {
                Err(StorageError::Damaged { .. }) => continue,
                other => other?,
            };
            n_opened += 1;
            for key in 0..40 {
                match file.read(key, <[u8]>::len) {
                    Err(StorageError::Damaged { .. }) => n_damaged += 1,
                    other => drop(other?),
                }
            }
        }
        assert!(n_opened > 0 && n_damaged > 0, "{n_opened} {n_damaged}");
        Ok(())
    }
}
