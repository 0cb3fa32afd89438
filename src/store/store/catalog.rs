//! The directory of a store: creating and opening it, the names of its files, and removing files that are not listed.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use tetdb_schema::archive::{Archivable, from_archive};
use tetdb_schema::blob::Blob;
use tetdb_schema::chunk::is_box;
use tetdb_schema::digest::Digest;
use tetdb_schema::labels::LabelSet;
use tetdb_schema::page::FORMAT_VERSION;
use tetdb_schema::row::{self as rows, FORMAT_MAGIC, RowKind, blob_key, is_versioned};

use super::writer_lock::{LOCK, WriterLock};
use super::{Step, StoreError};
use crate::sealed::{CoarseSnapshot, Form, SealedError, Subdomain};
use tetdb_base::storage::{DiskPath, FileId, StoreFile, holder};
use tetdb_schema::catalog::{
    CoarseRow, FileRow, InterfaceRow, Job, JournalRow, RegionRow, StageRow, StoreState,
    SubdomainRow, TopologyRow, VersionRow, WiresRow,
};

/// The catalog is small: its redb cache need not be large.
const CACHE_BYTES: usize = 2 << 20;
const CATALOG: &str = "catalog.redb";
/// The catalog before its first commit, so that a visible catalog has its job.
const CATALOG_NEW: &str = "catalog.redb-new";
/// The next catalog of a finished store, before it replaces the current one.
const CATALOG_NEXT: &str = "catalog.redb-next";
/// Folder of sorted runs; everything in it is scratch.
const SCRATCH: &str = "scratch";
/// Folder of tasks for other processes; it is not needed once the store is finished.
const WORK: &str = "work";

/// The catalog of a store, open for reading or for writing.
///
/// At most one process writes at a time; it holds the [`WriterLock`] from before its first byte to after its last. Only [`Catalog::commit`]
/// changes the catalog. That of an unfinished store is changed in place, and cannot be read meanwhile. For a finished store, a commit writes a
/// new file and gives it the catalog's name. A reader keeps the file that it opened, so it sees one state of the store, and readers and writer
/// never wait for each other.
pub struct Catalog {
    dir: DiskPath,
    pub(super) file: StoreFile,
    /// Identity of `file`; another file has its name once the store has been changed.
    id: Option<FileId>,
    /// `None`: open for reading only.
    lock: Option<Arc<WriterLock>>,
    /// `false`: each commit writes a new file.
    in_place: bool,
    journal_rows: u32,
    /// For a reader of a version: the key of each of its rows, and the key of the row's copy.
    pub(super) version: Option<Arc<BTreeMap<u64, u64>>>,
}

/// Name of the coarse mesh's measure with the number of input triangles.
pub const INPUT_TRIANGLES: &str = "input_triangles";

impl Catalog {
    /// Creates a store: the directory, the catalog, the job.
    ///
    /// An empty directory is taken over. Errors: [`StoreError::Finished`], [`StoreError::Unfinished`],
    /// [`StoreError::NotOurs`] or [`StoreError::Busy`] say what is already there.
    pub fn create(dir: impl Into<DiskPath>, job: &Job) -> Result<Self, StoreError> {
        Self::create_with(dir, job, |_| ())
    }

    /// [`Catalog::create`], with more rows in the first commit.
    pub fn create_with(
        dir: impl Into<DiskPath>,
        job: &Job,
        describe: impl FnOnce(&mut Step),
    ) -> Result<Self, StoreError> {
        let dir = dir.into();
        match refuse_existing(&dir) {
            // The lock decides whether another process writes.
            Ok(()) | Err(StoreError::Unfinished { .. }) => {}
            Err(other) => return Err(other),
        }
        dir.create_dir_all()?;
        let lock = WriterLock::acquire(&dir)?;
        refuse_existing(&dir)?;
        let draft = dir.join(CATALOG_NEW);
        draft.remove_file()?;
        let mut catalog = Self {
            file: StoreFile::create(&draft, CACHE_BYTES)?,
            id: draft.id(),
            dir,
            lock: Some(lock),
            in_place: true,
            journal_rows: 0,
            version: None,
        };
        catalog.commit(|step| {
            let mut format = FORMAT_MAGIC.to_vec();
            format.extend_from_slice(&FORMAT_VERSION.to_le_bytes());
            step.put_bytes(RowKind::Format.key(0, 0), &format);
            step.set_state(StoreState::New);
            step.set_job(job);
            describe(step);
            Ok(())
        })?;
        catalog.file.rename(CATALOG)?;
        // An empty directory that was taken over may be as new as the store.
        catalog.dir.folder().sync_dir()?;
        Ok(catalog)
    }

    /// Returns whether a store can be created in `dir`: it is empty, or left by a run that was killed before its first commit.
    pub fn is_vacant(dir: impl Into<DiskPath>) -> bool {
        let names = dir.into().list();
        names.is_ok_and(|names| holds_nothing(&names))
    }

    /// Opens a store for reading; others may read and change it meanwhile.
    ///
    /// Errors: [`StoreError::NotFound`], [`StoreError::NotOurs`], [`StoreError::Busy`] while it is unfinished and written,
    /// [`StoreError::Format`].
    pub fn open(dir: impl Into<DiskPath>) -> Result<Self, StoreError> {
        let dir = dir.into();
        Self::open_as(&dir, false).map_err(|error| match error {
            StoreError::Busy { .. } => {
                let (path, writer) = (dir.path().to_owned(), holder(&dir.path().join(LOCK)));
                StoreError::Busy { path, writer }
            }
            other => other,
        })
    }

    /// Opens a store for writing, and removes files that an interrupted step left.
    ///
    /// Errors: as [`Catalog::open`]; [`StoreError::Busy`] while another process writes.
    pub fn open_writable(dir: impl Into<DiskPath>) -> Result<Self, StoreError> {
        let dir = dir.into();
        Self::find(&dir)?;
        let lock = WriterLock::acquire(&dir)?;
        Self::open_locked(dir, lock)
    }

    /// Opens a store for writing with its lock. Errors: as [`Catalog::open`].
    pub fn open_locked(
        dir: impl Into<DiskPath>,
        lock: Arc<WriterLock>,
    ) -> Result<Self, StoreError> {
        let dir = dir.into();
        let mut catalog = Self::open_as(&dir, false)?;
        if !catalog.state()?.is_finished() {
            drop(catalog);
            catalog = Self::open_as(&dir, true)?;
        }
        catalog.lock = Some(lock);
        catalog.purge()?;
        Ok(catalog)
    }

    /// The lock of the store, to be held longer than the catalog is open; `None` when it is open for reading.
    pub fn lock(&self) -> Option<Arc<WriterLock>> {
        self.lock.clone()
    }

    /// Returns another reader of the same state of the store.
    pub fn share(&self) -> Self {
        Self {
            dir: self.dir.clone(),
            file: self.file.share(),
            id: self.id,
            lock: None,
            in_place: false,
            journal_rows: self.journal_rows,
            version: self.version.clone(),
        }
    }

    /// Returns a reader of the same state of the store as it is, whatever version this one reads.
    pub fn now(&self) -> Self {
        Self { version: None, ..self.share() }
    }

    /// Returns a reader of the same state of the store, at a version.
    pub fn at(&self, version: &VersionRow) -> Self {
        let rows = version.rows.iter().map(|&[key, copy]| (key, copy));
        let rows = rows.filter(|&(key, _)| is_versioned(key)).collect();
        Self { version: Some(Arc::new(rows)), ..self.share() }
    }

    /// Returns whether the store is unchanged since it was opened.
    pub fn is_current(&self) -> bool {
        self.dir.join(CATALOG).id() == self.id
    }

    /// Returns whether a folder has a catalog.
    pub fn is_at(dir: impl Into<DiskPath>) -> bool {
        dir.into().join(CATALOG).is_file()
    }

    /// The path of the catalog in a folder. Errors: there is none.
    fn find(dir: &DiskPath) -> Result<DiskPath, StoreError> {
        let path = dir.join(CATALOG);
        if !dir.exists() {
            return Err(StoreError::NotFound { path: dir.path().to_owned() });
        }
        if !path.is_file() {
            let reason = match dir.join(CATALOG_NEW).exists() {
                true => StoreError::BARELY_BEGUN,
                false => "it has no catalog",
            };
            return Err(StoreError::NotOurs { path: dir.path().to_owned(), reason });
        }
        Ok(path)
    }

    fn open_as(dir: &DiskPath, in_place: bool) -> Result<Self, StoreError> {
        let path = Self::find(dir)?;
        let (file, id) = loop {
            let id = path.id();
            let file = StoreFile::open_repaired(&path, CACHE_BYTES, in_place)?;
            // The name may have changed to another file between the two looks.
            if path.id() == id {
                break (file, id);
            }
        };
        let mut catalog = Self {
            dir: dir.clone(),
            file,
            id,
            lock: None,
            in_place,
            journal_rows: 0,
            version: None,
        };
        catalog.check_format()?;
        if !in_place {
            // A file opened for writing has been checked.
            catalog.file.check()?;
        }
        let file = &mut catalog.file;
        let mut journal_rows = 0;
        file.scan(RowKind::Journal.keys(), |_, _| {
            journal_rows += 1;
            true
        })?;
        catalog.journal_rows = journal_rows;
        Ok(catalog)
    }

    fn check_format(&mut self) -> Result<(), StoreError> {
        let key = RowKind::Format.key(0, 0);
        let Some(format) = self.bytes(key)? else {
            // In a damaged file it may only not be found.
            self.file.check()?;
            return Err(StoreError::NotOurs {
                path: self.dir().to_owned(),
                reason: "its catalog has no format row",
            });
        };
        let version = format.strip_prefix(FORMAT_MAGIC).and_then(|v| v.try_into().ok());
        let Some(version) = version.map(u16::from_le_bytes) else {
            return Err(StoreError::NotOurs {
                path: self.dir().to_owned(),
                reason: "its catalog is another program's",
            });
        };
        if version != FORMAT_VERSION {
            return Err(StoreError::Format {
                path: self.dir().to_owned(),
                expected: FORMAT_VERSION,
                found: version,
            });
        }
        Ok(())
    }

    /// The directory of the store, with the disk it is on.
    pub fn disk_path(&self) -> &DiskPath {
        &self.dir
    }

    /// The directory of the store.
    pub fn dir(&self) -> &Path {
        self.dir.path()
    }

    /// The name of a sub-domain's file in a generation.
    pub fn file_name(subdomain: u32, generation: u32) -> String {
        FileRow { subdomain, generation }.subdomain_name()
    }

    /// The name of a coarse snapshot's file in a generation.
    pub fn coarse_name(subdomain: u32, generation: u32) -> String {
        FileRow { subdomain, generation }.coarse_name()
    }

    /// Path of the file of a sub-domain in a generation, which may not exist.
    pub fn file_path(&self, subdomain: u32, generation: u32) -> DiskPath {
        self.dir.join(Self::file_name(subdomain, generation))
    }

    /// Path of the file of a coarse snapshot in a generation, which may not exist.
    pub fn coarse_path(&self, subdomain: u32, generation: u32) -> DiskPath {
        self.dir.join(Self::coarse_name(subdomain, generation))
    }

    /// A folder for sorted runs, created when it is not there; removed when the store is next opened for writing.
    ///
    /// Errors: the folder cannot be created.
    pub fn scratch_dir(&self) -> Result<DiskPath, StoreError> {
        let path = self.dir.join(SCRATCH);
        path.create_dir_all()?;
        Ok(path)
    }

    /// The folder of tasks, whether it is there or not.
    pub fn work_dir(&self) -> DiskPath {
        self.dir.join(WORK)
    }

    /// The folder of tasks of a store that is not opened.
    pub fn work_dir_at(dir: impl Into<DiskPath>) -> DiskPath {
        dir.into().join(WORK)
    }

    /// One atomic step: files first, then the rows `describe` sets, in one commit; then files go that neither a row nor a version names.
    ///
    /// Errors: what `describe` returns, before anything is written; failures of the commit, after which the
    /// store is as it was before the step.
    pub fn commit(
        &mut self,
        describe: impl FnOnce(&mut Step) -> Result<(), StoreError>,
    ) -> Result<(), StoreError> {
        assert!(self.lock.is_some(), "{} is open for reading only", self.dir().display());
        let mut step = Step::new(self.journal_rows);
        describe(&mut step)?;
        self.settle(&mut step)?;
        for file in &step.listed {
            self.file_path(file.subdomain, file.generation).sync_file()?;
        }
        for file in &step.coarse_listed {
            self.coarse_path(file.subdomain, file.generation).sync_file()?;
        }
        for &file in &step.field_listed {
            self.field_path(file).sync_file()?;
        }
        self.dir.sync_dir()?;
        match self.in_place {
            true => self.file.change(step.rows())?,
            false => self.replace_file(&step)?,
        }
        self.journal_rows = step.journal_rows;
        for file in &step.unlisted {
            self.file_path(file.subdomain, file.generation).remove_file()?;
        }
        for &file in &step.field_unlisted {
            self.field_path(file).remove_file()?;
        }
        Ok(())
    }

    /// Writes the catalog as it is after a step, and gives it the name of the one that readers have.
    fn replace_file(&mut self, step: &Step) -> Result<(), StoreError> {
        let next = self.dir.join(CATALOG_NEXT);
        next.remove_file()?;
        let written = self.file.rewrite(&next, CACHE_BYTES, step.rows());
        let opened = written.and_then(|()| {
            let id = next.id();
            let mut file = StoreFile::open(&next, CACHE_BYTES, false)?;
            file.rename(CATALOG)?;
            Ok((file, id))
        });
        match opened {
            Ok((file, id)) => {
                (self.file, self.id) = (file, id);
                Ok(())
            }
            Err(error) => {
                let _ = next.remove_file();
                Err(error.into())
            }
        }
    }

    /// Removes files of sub-domains and fields the catalog does not list, what an interrupted commit left, and scratch.
    fn purge(&mut self) -> Result<(), StoreError> {
        let is_finished = self.state()?.is_finished();
        let listed = self.files()?;
        let coarse: Vec<FileRow> = (self.coarse_snapshots()?.iter()).map(CoarseRow::file).collect();
        let fields = self.field_files()?;
        for name in self.dir.list()? {
            let path = self.dir.join(&name);
            let is_stray = |file: Option<FileRow>, listed: &[FileRow]| {
                file.is_some_and(|f| !listed.contains(&f))
            };
            let is_draft = [CATALOG_NEW, CATALOG_NEXT].contains(&&*name);
            if is_draft
                || is_stray(FileRow::from_subdomain_name(&name), &listed)
                || is_stray(FileRow::from_coarse_name(&name), &coarse)
                || is_stray(FileRow::from_field_name(&name), &fields)
            {
                path.remove_file()?;
            } else if name == SCRATCH || name == WORK && is_finished {
                path.remove_dir_all()?;
            }
        }
        Ok(())
    }

    /// State of the store.
    pub fn state(&mut self) -> Result<StoreState, StoreError> {
        self.needed(RowKind::State)
    }

    /// The job: source and options of the mesh.
    pub fn job(&mut self) -> Result<Job, StoreError> {
        self.needed(RowKind::Job)
    }

    /// Names of the labels; a facet's label is a position here.
    pub fn labels(&mut self) -> Result<Vec<String>, StoreError> {
        Ok(self.row(RowKind::Labels.key(0, 0))?.unwrap_or_default())
    }

    /// Labels that stand for several, ascending; none where no triangle has two.
    pub fn label_sets(&mut self) -> Result<Vec<LabelSet>, StoreError> {
        Ok(self.row(RowKind::LabelSets.key(0, 0))?.unwrap_or_default())
    }

    /// The regions, as they were set.
    pub fn regions(&mut self) -> Result<Vec<RegionRow>, StoreError> {
        Ok(self.row(RowKind::Regions.key(0, 0))?.unwrap_or_default())
    }

    /// Names of regions 1, 2, …, empty for a region without a name; shorter where the last have none.
    pub fn region_names(&mut self) -> Result<Vec<String>, StoreError> {
        let names = self.row(RowKind::RegionNames.key(0, 0))?;
        Ok(names.unwrap_or_default())
    }

    /// Edges and points that are edges and vertices of the mesh.
    pub fn wires(&mut self) -> Result<WiresRow, StoreError> {
        let wires = self.row(RowKind::Embedded.key(0, 0))?;
        Ok(wires.unwrap_or(WiresRow { fin_first: u64::MAX, ..WiresRow::default() }))
    }

    /// Triangles of the input, which sub-domains have each for itself: one on a face between two counts in both. None in a store that does
    /// not say: one of several sub-domains from before this was on record.
    pub fn n_input_triangles(&mut self) -> Result<Option<u64>, StoreError> {
        let journal = self.journal()?;
        let mut measures = journal.iter().flat_map(|row| &row.measures);
        if let Some(found) = measures.find(|measure| measure.name == INPUT_TRIANGLES) {
            return Ok(Some(found.value as u64));
        }
        let wires = self.wires()?;
        if wires.fin_first != u64::MAX {
            return Ok(Some(wires.fin_first));
        }
        let rows = self.subdomains()?;
        Ok((rows.len() == 1).then(|| rows.iter().map(|row| row.facets).sum()))
    }

    /// All sub-domains by rank.
    pub fn subdomains(&mut self) -> Result<Vec<SubdomainRow>, StoreError> {
        let rows: Vec<SubdomainRow> = self.rows(RowKind::Subdomain)?;
        rows.iter().try_for_each(|row| self.check_row(row))?;
        Ok(rows)
    }

    /// Refuses a row that no sub-domain can have, before it is used.
    fn check_row(&self, row: &SubdomainRow) -> Result<(), StoreError> {
        let is_finished = Form::from_state(row.state).is_some() && row.vertices > 0;
        let is_sound = is_box(&row.bounds) && !row.volume.is_nan() && !row.quality.worst.is_nan();
        let counts = [row.tets, row.vertices, row.facets, row.interface_faces];
        let reason = match !is_finished || is_sound {
            false => "gives a sub-domain a box, volume or quality that none can have",
            true if !are_counts(counts) => "counts more than a sub-domain can have",
            true => return Ok(()),
        };
        Err(self.damaged_row(RowKind::Subdomain.key(0, row.rank), reason))
    }

    /// Refuses a row that no coarse snapshot can have.
    fn check_coarse(&self, row: &CoarseRow) -> Result<(), StoreError> {
        match are_counts([row.tets, row.vertices, row.facets, row.interface_faces]) {
            true => Ok(()),
            false => {
                let reason = "counts more than a sub-domain can have";
                Err(self.damaged_row(RowKind::Coarse.key(0, row.rank), reason))
            }
        }
    }

    /// One sub-domain.
    ///
    /// Errors: [`StoreError::NoSubdomain`].
    pub fn subdomain(&mut self, rank: u32) -> Result<SubdomainRow, StoreError> {
        let row: Option<SubdomainRow> = self.row(RowKind::Subdomain.key(0, rank))?;
        let row = row.ok_or_else(|| StoreError::NoSubdomain {
            path: self.dir().to_owned(),
            subdomain: rank,
        })?;
        self.check_row(&row)?;
        Ok(row)
    }

    /// Opens a sealed sub-domain with `memory_bytes` for redb's cache and decoded vertices.
    ///
    /// Errors: [`StoreError::NoSubdomain`]; unfinished; damage.
    pub fn open_subdomain(
        &mut self,
        rank: u32,
        memory_bytes: usize,
    ) -> Result<Subdomain, StoreError> {
        let row = self.subdomain(rank)?;
        self.open_row(row, memory_bytes)
    }

    /// Opens the sub-domain of a row, which may be that of a [`StageRow`]. Errors: unfinished; damage.
    pub fn open_row(
        &self,
        row: SubdomainRow,
        memory_bytes: usize,
    ) -> Result<Subdomain, StoreError> {
        let path = self.file_path(row.rank, row.generation);
        let opened = Subdomain::open(&path, row.clone(), memory_bytes);
        self.of_one_state(opened, |now| {
            Ok(now.everywhere(RowKind::Subdomain)?.contains(&row)
                || now.stages()?.iter().any(|stage| stage.row == row))
        })
    }

    /// Checks that an opened file is still the one that this catalog lists.
    ///
    /// Names of unlisted files may be used again, also by a new store at the same path. So when the store has been
    /// changed, a file is valid only if the new catalog has the same row for it. Errors: [`StoreError::Changed`]; that of `opened`.
    pub(super) fn of_one_state<T>(
        &self,
        opened: Result<T, SealedError>,
        is_listed: impl FnOnce(&mut Self) -> Result<bool, StoreError>,
    ) -> Result<T, StoreError> {
        let is_ours = self.is_current()
            || Self::open(&self.dir).is_ok_and(|mut now| is_listed(&mut now).unwrap_or(false));
        match is_ours {
            true => Ok(opened?),
            false => Err(StoreError::Changed { path: self.dir().to_owned() }),
        }
    }

    /// Opens the coarse snapshot of a sub-domain with `cache_bytes` for redb.
    ///
    /// Errors: [`StoreError::NoCoarseSnapshot`]; damage.
    pub fn open_coarse(
        &mut self,
        rank: u32,
        cache_bytes: usize,
    ) -> Result<CoarseSnapshot, StoreError> {
        let row = self.coarse_snapshot(rank)?;
        let row = row.ok_or_else(|| StoreError::NoCoarseSnapshot {
            path: self.dir().to_owned(),
            subdomain: rank,
        })?;
        let path = self.coarse_path(rank, row.generation);
        let opened = CoarseSnapshot::open(&path, row, cache_bytes);
        self.of_one_state(opened, |now| Ok(now.coarse_snapshots()?.contains(&row)))
    }

    /// The digest of the tetrahedra and of the interface faces, from the rows of the sub-domains.
    ///
    /// A face counts in each of its two sub-domains. Errors: a damaged catalog, unfinished sub-domains.
    pub fn digest(&mut self) -> Result<[Digest; 2], StoreError> {
        let mut both = [Digest::default(); 2];
        for row in self.subdomains()? {
            if Form::from_state(row.state).is_none() {
                return Err(StoreError::Sealed(SealedError::NotSealed {
                    path: self.dir().to_owned(),
                    subdomain: row.rank,
                }));
            }
            both[0].merge(&Digest { lanes: row.digest });
            both[1].merge(&Digest { lanes: row.interface_digest });
        }
        Ok(both)
    }

    /// The files that count, by sub-domain and generation.
    pub fn files(&mut self) -> Result<Vec<FileRow>, StoreError> {
        self.rows(RowKind::File)
    }

    /// The coarse snapshots that were kept, by sub-domain.
    pub fn coarse_snapshots(&mut self) -> Result<Vec<CoarseRow>, StoreError> {
        let rows: Vec<CoarseRow> = self.rows(RowKind::Coarse)?;
        rows.iter().try_for_each(|row| self.check_coarse(row))?;
        Ok(rows)
    }

    /// The coarse snapshot of one sub-domain, if it was kept.
    pub fn coarse_snapshot(&mut self, rank: u32) -> Result<Option<CoarseRow>, StoreError> {
        let row: Option<CoarseRow> = self.row(RowKind::Coarse.key(0, rank))?;
        row.iter().try_for_each(|row| self.check_coarse(row))?;
        Ok(row)
    }

    /// The interfaces by cut, then by ranks.
    pub fn interfaces(&mut self) -> Result<Vec<InterfaceRow>, StoreError> {
        let rows: Vec<Vec<InterfaceRow>> = self.rows(RowKind::Interface)?;
        Ok(rows.into_iter().flatten().collect())
    }

    /// Neighbors of each sub-domain, by rank.
    pub fn topology(&mut self) -> Result<Vec<TopologyRow>, StoreError> {
        self.rows(RowKind::Topology)
    }

    /// Kept stages of meshes, the coarse ones first, by cut.
    pub fn stages(&mut self) -> Result<Vec<StageRow>, StoreError> {
        let stages: Vec<StageRow> = self.rows(RowKind::Stage)?;
        stages.iter().try_for_each(|stage| self.check_row(&stage.row))?;
        Ok(stages)
    }

    /// All steps done so far, in order.
    pub fn journal(&mut self) -> Result<Vec<JournalRow>, StoreError> {
        self.rows(RowKind::Journal)
    }

    /// Bytes kept with [`Step::set_blob`], or `None`.
    pub fn blob(&mut self, blob: Blob) -> Result<Option<Vec<u8>>, StoreError> {
        let mut whole = None::<Vec<u8>>;
        for piece in 0.. {
            let Some(bytes) = self.bytes(blob_key(blob, piece))? else {
                break;
            };
            whole.get_or_insert_default().extend_from_slice(&bytes);
        }
        Ok(whole)
    }

    /// Bytes of the catalog's file.
    pub fn file_bytes(&self) -> Result<u64, StoreError> {
        Ok(self.dir.join(CATALOG).bytes()?)
    }

    /// Shrinks the catalog and closes it.
    pub fn close(self) -> Result<(), StoreError> {
        Ok(self.file.compact()?)
    }

    pub(super) fn damaged_row(&self, key: u64, reason: impl Into<String>) -> StoreError {
        StoreError::Row { path: self.file.path().to_owned(), key, reason: reason.into() }
    }

    /// The only row of a kind. Errors: damage, or there is none.
    fn needed<T: Archivable>(&mut self, kind: RowKind) -> Result<T, StoreError> {
        let key = kind.key(0, 0);
        self.row(key)?.ok_or_else(|| self.damaged_row(key, "is missing"))
    }

    /// The key of a row, or of its copy in the version that is read.
    pub(super) fn place_of(&self, key: u64) -> Option<u64> {
        match &self.version {
            Some(rows) if is_versioned(key) => rows.get(&key).copied(),
            _ => Some(key),
        }
    }

    fn content<T>(
        &mut self,
        key: u64,
        open: impl FnOnce(&[u8]) -> Result<T, String>,
    ) -> Result<Option<T>, StoreError> {
        let Some(place) = self.place_of(key) else { return Ok(None) };
        let read =
            self.file.read(place, |value| rows::checked_bytes(place, value).and_then(open))?;
        match read {
            None if place != key => Err(self.damaged_row(place, "is missing")),
            read => read.transpose().map_err(|e| self.damaged_row(place, e)),
        }
    }

    pub(super) fn bytes(&mut self, key: u64) -> Result<Option<Vec<u8>>, StoreError> {
        self.content(key, |bytes| Ok(bytes.to_vec()))
    }

    pub(super) fn row<T: Archivable>(&mut self, key: u64) -> Result<Option<T>, StoreError> {
        self.content(key, from_archive)
    }

    pub(super) fn rows<T: Archivable>(&mut self, kind: RowKind) -> Result<Vec<T>, StoreError> {
        Ok(self.keyed(kind)?.into_iter().map(|(_, row)| row).collect())
    }

    /// Rows of a kind with their keys, ascending.
    pub(super) fn keyed<T: Archivable>(
        &mut self,
        kind: RowKind,
    ) -> Result<Vec<(u64, T)>, StoreError> {
        let mut all = Vec::new();
        if let Some(version) = self.version.clone()
            && is_versioned(kind.key(0, 0))
        {
            for &key in version.range(kind.keys()).map(|(key, _)| key) {
                all.extend(self.row(key)?.map(|row| (key, row)));
            }
            return Ok(all);
        }
        let mut wrong = None;
        self.file.scan(kind.keys(), |key, value| {
            match rows::decode(key, value) {
                Ok(row) => all.push((key, row)),
                Err(reason) => wrong = Some((key, reason)),
            }
            wrong.is_none()
        })?;
        match wrong {
            Some((key, reason)) => Err(self.damaged_row(key, reason)),
            None => Ok(all),
        }
    }
}

/// Refuses a folder where no store can be created.
fn refuse_existing(dir: &DiskPath) -> Result<(), StoreError> {
    let path = dir.path().to_owned();
    if !dir.exists() {
        return Ok(());
    }
    if !dir.is_dir() {
        let reason = "it is a file";
        return Err(StoreError::NotOurs { path, reason });
    }
    // A folder that cannot be listed may hold anything.
    if holds_nothing(&dir.list()?) {
        return Ok(());
    }
    match Catalog::open(dir)?.state()?.is_finished() {
        true => Err(StoreError::Finished { path }),
        false => Err(StoreError::Unfinished { path }),
    }
}

/// Returns whether a store can be created in a folder with these names.
fn holds_nothing(names: &[String]) -> bool {
    let is_left_over = |name: &String| [CATALOG_NEW, LOCK].contains(&&**name);
    names.iter().all(is_left_over)
}

/// First words of the names of files.
/// Whether records can be counted so: their numbers have 32 bits.
fn are_counts(counts: [u64; 4]) -> bool {
    counts.iter().all(|&n| n <= u64::from(u32::MAX))
}
