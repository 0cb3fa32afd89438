//! Changes of the catalog in one step.

use std::collections::{BTreeMap, BTreeSet};

use tetdb_schema::archive::Archivable;
use tetdb_schema::blob::Blob;
use tetdb_schema::catalog::{
    CoarseRow, FileRow, InterfaceRow, Job, JournalRow, RegionRow, StageRow, StoreState,
    SubdomainRow, TopologyRow, VersionRow, WiresRow,
};
use tetdb_schema::labels::LabelSet;
use tetdb_schema::row::{self as rows, BLOB_PIECE, RowKind, blob_key};

/// Rows and versions to set and remove, files to list and forget; applied together by [`crate::store::Catalog::commit`].
pub struct Step {
    pub(super) changes: BTreeMap<u64, Option<Vec<u8>>>,
    pub(super) listed: BTreeSet<FileRow>,
    pub(super) unlisted: BTreeSet<FileRow>,
    /// Coarse snapshots to list.
    pub(super) coarse_listed: BTreeSet<FileRow>,
    /// Files of fields to list.
    pub(super) field_listed: BTreeSet<FileRow>,
    /// Files of fields to remove after the commit.
    pub(super) field_unlisted: BTreeSet<FileRow>,
    /// Versions to set and to remove, by number.
    pub(super) versions: BTreeMap<u32, Option<VersionRow>>,
    pub(super) journal_rows: u32,
}

impl Step {
    pub(super) fn new(journal_rows: u32) -> Self {
        Self {
            changes: BTreeMap::new(),
            listed: BTreeSet::new(),
            unlisted: BTreeSet::new(),
            coarse_listed: BTreeSet::new(),
            field_listed: BTreeSet::new(),
            field_unlisted: BTreeSet::new(),
            versions: BTreeMap::new(),
            journal_rows,
        }
    }

    /// The rows it sets, and the keys of those it removes.
    pub(super) fn rows(&self) -> impl Iterator<Item = (u64, Option<&[u8]>)> {
        self.changes.iter().map(|(&key, row)| (key, row.as_deref()))
    }

    pub(super) fn put_bytes(&mut self, key: u64, bytes: &[u8]) {
        self.changes.insert(key, Some(rows::guarded_bytes(key, bytes)));
    }

    pub(super) fn put(&mut self, key: u64, row: &impl Archivable) {
        self.changes.insert(key, Some(rows::encode(key, row)));
    }

    /// Sets the state of the store after this step.
    pub fn set_state(&mut self, state: StoreState) {
        self.put(RowKind::State.key(0, 0), &state);
    }

    /// Sets the job.
    pub fn set_job(&mut self, job: &Job) {
        self.put(RowKind::Job.key(0, 0), job);
    }

    /// Sets the names of the labels.
    pub fn set_labels(&mut self, labels: &Vec<String>) {
        self.put(RowKind::Labels.key(0, 0), labels);
    }

    /// Sets the labels that stand for several.
    pub fn set_label_sets(&mut self, sets: &Vec<LabelSet>) {
        self.put(RowKind::LabelSets.key(0, 0), sets);
    }

    /// Sets the regions.
    pub fn set_regions(&mut self, regions: &Vec<RegionRow>) {
        self.put(RowKind::Regions.key(0, 0), regions);
    }

    /// Sets the names of regions from region 1 on.
    pub fn set_region_names(&mut self, names: &Vec<String>) {
        self.put(RowKind::RegionNames.key(0, 0), names);
    }

    /// Sets the embedded edges and points.
    pub fn set_wires(&mut self, wires: &WiresRow) {
        self.put(RowKind::Embedded.key(0, 0), wires);
    }

    /// Sets the row of a sub-domain.
    pub fn set_subdomain(&mut self, row: &SubdomainRow) {
        self.put(RowKind::Subdomain.key(0, row.rank), row);
    }

    /// Lists a file; it is synced before the commit.
    pub fn list_file(&mut self, subdomain: u32, generation: u32) {
        let file = FileRow { subdomain, generation };
        self.put(RowKind::File.key(subdomain, generation), &file);
        self.unlisted.remove(&file);
        self.listed.insert(file);
    }

    /// Unlists a file; it is removed after the commit.
    pub fn unlist_file(&mut self, subdomain: u32, generation: u32) {
        let file = FileRow { subdomain, generation };
        self.changes.insert(RowKind::File.key(subdomain, generation), None);
        self.listed.remove(&file);
        self.unlisted.insert(file);
    }

    /// Lists a coarse snapshot; its file is synced before the commit.
    pub fn list_coarse(&mut self, row: &CoarseRow) {
        self.put(RowKind::Coarse.key(0, row.rank), row);
        self.coarse_listed.insert(FileRow { subdomain: row.rank, generation: row.generation });
    }

    /// Sets all interfaces of one cut.
    pub fn set_interfaces(&mut self, cut: u32, interfaces: &Vec<InterfaceRow>) {
        self.put(RowKind::Interface.key(0, cut), interfaces);
    }

    /// Sets the neighbors of one sub-domain.
    pub fn set_topology(&mut self, row: &TopologyRow) {
        self.put(RowKind::Topology.key(0, row.subdomain), row);
    }

    /// Sets the stage of a mesh that is kept.
    pub fn set_stage(&mut self, stage: &StageRow) {
        self.put(RowKind::Stage.key(stage.stage as u32, stage.cut), stage);
    }

    /// Appends to the journal.
    pub fn append_journal(&mut self, row: &JournalRow) {
        self.put(RowKind::Journal.key(0, self.journal_rows), row);
        self.journal_rows += 1;
    }

    /// Keeps the bytes of a blob.
    ///
    /// Replaces a blob of any length: the piece after its last is removed, and reading stops there.
    pub fn set_blob(&mut self, blob: Blob, bytes: &[u8]) {
        let mut pieces = 0;
        for piece in bytes.chunks(BLOB_PIECE) {
            self.put_bytes(blob_key(blob, pieces), piece);
            pieces += 1;
        }
        if pieces == 0 {
            self.put_bytes(blob_key(blob, 0), &[]);
            pieces = 1;
        }
        self.changes.insert(blob_key(blob, pieces), None);
    }
}
