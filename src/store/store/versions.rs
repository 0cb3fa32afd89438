//! Versions of a finished store: its rows and files that a change can replace.
//!
//! Sealed files never change, so a version is a list: for each row the key of a copy of its content, and the names of files. Equal contents
//! have one copy. [`Catalog::commit`] removes a file or a copy with the last that names it.

use std::collections::{BTreeMap, BTreeSet};

use tetdb_schema::archive::{Archivable, to_archive};
use tetdb_schema::blob::Blob;
use tetdb_schema::catalog::{FileRow, SubdomainRow, VersionRow};
use tetdb_schema::field::FieldPart;
use tetdb_schema::row::{RowKind, VERSIONED, blob_key, is_versioned};

use super::{Catalog, Step, StoreError};

/// Number of the version that undoing the last change brings back; it has no name.
pub const BEFORE: u32 = 0;

/// A version to set, and contents by the keys of their copies.
pub struct NewVersion {
    row: VersionRow,
    copies: BTreeMap<u64, Vec<u8>>,
}

impl NewVersion {
    /// Bytes of the copies.
    pub fn bytes(&self) -> u64 {
        self.copies.values().map(|content| content.len() as u64).sum()
    }
}

/// The rows and files that differ between the store as it is and a version.
pub struct Difference {
    rows: Vec<(u64, Option<Vec<u8>>)>,
    /// Files of sub-domains that the version has, and that it has not.
    meshes: [Vec<FileRow>; 2],
    /// Files of fields that the version has, and that it has not.
    fields: [Vec<FileRow>; 2],
}

impl Difference {
    /// Returns whether mesh and fields are the same.
    pub fn is_empty(&self) -> bool {
        self.rows.iter().all(|row| RowKind::State.keys().contains(&row.0))
    }
}

impl Catalog {
    /// The versions by number. Errors: damage.
    pub fn versions(&mut self) -> Result<BTreeMap<u32, VersionRow>, StoreError> {
        let rows = self.keyed(RowKind::Version)?.into_iter();
        let mut all: BTreeMap<u32, VersionRow> = rows.map(|(key, row)| (key as u32, row)).collect();
        if !all.contains_key(&BEFORE) {
            all.extend(self.before_in_rows()?.map(|row| (BEFORE, row)));
        }
        Ok(all)
    }

    /// The version of this name, with its number. Errors: [`StoreError::NoVersion`]; damage.
    pub fn version_called(&mut self, name: &str) -> Result<(u32, VersionRow), StoreError> {
        let mut all = self.versions()?;
        all.remove(&BEFORE);
        match all.iter().find(|(_, version)| version.name == name) {
            Some((&number, version)) => Ok((number, version.clone())),
            None => Err(StoreError::NoVersion {
                path: self.dir().to_owned(),
                name: name.to_owned(),
                known: all.into_values().map(|version| version.name).collect(),
            }),
        }
    }

    /// All rows of a kind, those of versions among them; equal ones may occur twice. Errors: damage.
    pub fn everywhere<T: Archivable>(&mut self, kind: RowKind) -> Result<Vec<T>, StoreError> {
        let mut all = self.rows(kind)?;
        let versions = self.versions()?;
        let rows = versions.values().flat_map(|version| &version.rows);
        let is_copy = |[key, copy]: &&[u64; 2]| kind.keys().contains(key) && !is_versioned(*copy);
        let copies: BTreeSet<u64> = rows.filter(is_copy).map(|row| row[1]).collect();
        for copy in copies {
            all.extend(self.row(copy)?);
        }
        Ok(all)
    }

    /// The store as it is, as a version. Errors: damage.
    pub fn version_now(&mut self, head: VersionRow) -> Result<NewVersion, StoreError> {
        let (meshes, fields) = self.named_files()?;
        let mut new = NewVersion {
            row: VersionRow { meshes, fields, rows: Vec::new(), ..head },
            copies: BTreeMap::new(),
        };
        for key in self.versioned_keys()? {
            let Some(content) = self.bytes(key)? else { continue };
            let mut copy = RowKind::copy_key(&content);
            loop {
                let known = match new.copies.get(&copy) {
                    Some(known) => Some(known.clone()),
                    None => self.bytes(copy)?,
                };
                match known {
                    None => drop(new.copies.insert(copy, content)),
                    Some(known) if known == content => {}
                    Some(_) => {
                        copy = RowKind::copy_key(&copy.to_le_bytes());
                        continue;
                    }
                }
                break;
            }
            new.row.rows.push([key, copy]);
        }
        Ok(new)
    }

    /// The rows and files that [`Step::restore`] changes. Errors: damage.
    pub fn difference(&mut self, version: &VersionRow) -> Result<Difference, StoreError> {
        let mut then = self.at(version);
        let mut keys: BTreeSet<u64> = self.versioned_keys()?.into_iter().collect();
        keys.extend(then.versioned_keys()?);
        let mut rows = Vec::new();
        for key in keys {
            let content = then.bytes(key)?;
            if content != self.bytes(key)? {
                rows.push((key, content));
            }
        }
        let (now, then) = (self.named_files()?, then.named_files()?);
        let apart = |a: &[FileRow], b: &[FileRow]| {
            let b: BTreeSet<&FileRow> = b.iter().collect();
            a.iter().filter(|file| !b.contains(file)).copied().collect()
        };
        Ok(Difference {
            rows,
            meshes: [apart(&then.0, &now.0), apart(&now.0, &then.0)],
            fields: [apart(&then.1, &now.1), apart(&now.1, &then.1)],
        })
    }

    /// The versions that name an old file of these sub-domains, with the new file of the same mesh instead. Errors: damage.
    pub fn versions_with(
        &mut self,
        rows: &[[SubdomainRow; 2]],
    ) -> Result<Vec<(u32, NewVersion)>, StoreError> {
        let mut edited = Vec::new();
        for (number, mut row) in self.versions()? {
            let mut copies = BTreeMap::new();
            for &[key, copy] in row.rows.iter().filter(|row| !is_versioned(row[1])) {
                let of_rank = |rows: &&[SubdomainRow; 2]| rows[0].rank == key as u32;
                let Some([old, new]) = rows.iter().find(of_rank) else { continue };
                if RowKind::Subdomain.keys().contains(&key) {
                    if self.row::<SubdomainRow>(copy)?.as_ref() == Some(old) {
                        copies.insert(copy, to_archive(new).to_vec());
                    }
                } else if RowKind::FieldPart.keys().contains(&key)
                    && let Some(part) = self.row::<FieldPart>(copy)?
                    && part.generation == old.generation
                {
                    let part = FieldPart { generation: new.generation, ..part };
                    copies.insert(copy, to_archive(&part).to_vec());
                }
            }
            if !copies.is_empty() {
                for file in &mut row.meshes {
                    let found = rows.iter().find(|[old, _]| old.file() == *file);
                    *file = found.map_or(*file, |[_, new]| new.file());
                }
                edited.push((number, NewVersion { row, copies }));
            }
        }
        Ok(edited)
    }

    /// Keeps what versions name, and drops what only versions named that the step replaces or removes.
    pub(super) fn settle(&mut self, step: &mut Step) -> Result<(), StoreError> {
        let (mut after, mut gone) = (self.versions()?, Vec::new());
        for (&number, version) in &step.versions {
            gone.extend(match version {
                Some(version) => after.insert(number, version.clone()),
                None => after.remove(&number),
            });
        }
        let after = || after.values();
        let meshes: BTreeSet<FileRow> = after().flat_map(|v| v.meshes.iter().copied()).collect();
        let fields: BTreeSet<FileRow> = after().flat_map(|v| v.fields.iter().copied()).collect();
        if !gone.is_empty() {
            let copies: BTreeSet<u64> = after().flat_map(|v| &v.rows).map(|row| row[1]).collect();
            let (now_meshes, now_fields) = self.named_files()?;
            for version in gone {
                for copy in
                    version.rows.iter().map(|row| row[1]).filter(|&copy| !is_versioned(copy))
                {
                    if !copies.contains(&copy) {
                        step.changes.insert(copy, None);
                    }
                }
                for &file in version.meshes.iter().filter(|file| !now_meshes.contains(file)) {
                    if !step.listed.contains(&file) {
                        step.unlist_file(file.subdomain, file.generation);
                    }
                }
                for &file in version.fields.iter().filter(|file| !now_fields.contains(file)) {
                    if !step.field_listed.contains(&file) {
                        step.field_unlisted.insert(file);
                    }
                }
            }
        }
        for file in &meshes {
            if step.unlisted.remove(file) {
                step.changes.remove(&RowKind::File.key(file.subdomain, file.generation));
            }
        }
        step.field_unlisted.retain(|file| !fields.contains(file));
        Ok(())
    }

    /// Files that the rows of sub-domains and of fields name.
    fn named_files(&mut self) -> Result<(Vec<FileRow>, Vec<FileRow>), StoreError> {
        let meshes = self.subdomains()?.iter().map(SubdomainRow::file).collect();
        Ok((meshes, self.field_parts()?.iter().map(FieldPart::file).collect()))
    }

    /// Keys of all rows that a version has, ascending.
    fn versioned_keys(&mut self) -> Result<Vec<u64>, StoreError> {
        if let Some(rows) = &self.version {
            return Ok(rows.keys().copied().collect());
        }
        let mut found = Vec::new();
        for keys in VERSIONED {
            self.file.scan(keys, |key, _| {
                found.push(key);
                true
            })?;
        }
        Ok(found)
    }

    /// The version before the last change, of a store that has it in rows and blobs of its own.
    fn before_in_rows(&mut self) -> Result<Option<VersionRow>, StoreError> {
        let changed: Vec<SubdomainRow> = self.rows(RowKind::Previous)?;
        if changed.is_empty() {
            return Ok(None);
        }
        let keys = self.versioned_keys()?.into_iter();
        let mut rows: BTreeMap<u64, u64> =
            keys.filter_map(|key| Some((key, self.place_of(key)?))).collect();
        for SubdomainRow { rank, .. } in &changed {
            rows.insert(RowKind::Subdomain.key(0, *rank), RowKind::Previous.key(0, *rank));
            for blobs in Blob::versioned(*rank) {
                let [now, previous] = blobs.map(|blob| blob_key(blob, 0)..blob_key(blob, u32::MAX));
                rows.retain(|key, _| !now.contains(key));
                self.file.scan(previous.clone(), |key, _| {
                    rows.insert(key - previous.start + now.start, key);
                    true
                })?;
            }
        }
        let parts: Vec<FieldPart> = self.rows(RowKind::PreviousFieldPart)?;
        for field in self.fields()? {
            let id = field.id;
            let is_there = |row: &SubdomainRow| {
                parts.iter().any(|part| (part.field, part.rank) == (id, row.rank))
            };
            match changed.iter().all(is_there) {
                true => rows.extend(changed.iter().map(|row| {
                    let [now, previous] = [RowKind::FieldPart, RowKind::PreviousFieldPart];
                    (now.key(id, row.rank), previous.key(id, row.rank))
                })),
                // It was added after the change.
                false => rows.retain(|&key, _| {
                    let of_field = RowKind::FieldPart.key(id, 0)..RowKind::FieldPart.key(id + 1, 0);
                    key != RowKind::Field.key(0, id) && !of_field.contains(&key)
                }),
            }
        }
        let rows = rows.into_iter().map(|(key, place)| [key, place]).collect();
        // Files that rows of now name need no second owner.
        let meshes = changed.iter().map(SubdomainRow::file).collect();
        let fields = parts.iter().map(FieldPart::file).collect();
        Ok(Some(VersionRow { rows, meshes, fields, ..VersionRow::default() }))
    }
}

impl Step {
    /// Sets a version.
    pub fn set_version(&mut self, number: u32, new: &NewVersion) {
        new.copies.iter().for_each(|(&copy, content)| self.put_bytes(copy, content));
        self.put(RowKind::Version.key(0, number), &new.row);
        self.versions.insert(number, Some(new.row.clone()));
    }

    /// Removes a version. What only it names goes after the commit.
    pub fn remove_version(&mut self, number: u32) {
        self.changes.insert(RowKind::Version.key(0, number), None);
        self.versions.insert(number, None);
    }

    /// Makes rows and files those of a version.
    pub fn restore(&mut self, difference: &Difference) {
        for (key, content) in &difference.rows {
            match content {
                Some(content) => self.put_bytes(*key, content),
                None => drop(self.changes.insert(*key, None)),
            }
        }
        let [new, old] = &difference.meshes;
        new.iter().for_each(|file| self.list_file(file.subdomain, file.generation));
        old.iter().for_each(|file| self.unlist_file(file.subdomain, file.generation));
        let [new, old] = &difference.fields;
        self.field_listed.extend(new);
        self.field_unlisted.extend(old);
    }
}
