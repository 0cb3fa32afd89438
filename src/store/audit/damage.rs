//! All files and records that cannot be read as they were written, with their places.
//!
//! [`verify`](super::verify) reads the mesh itself, chunk by chunk. This module reads every file that counts, also kept ones:
//! coarse snapshots, versions, stages, fields.

use std::collections::BTreeSet;

use crate::store::{Catalog, StoreError};
use tetdb_base::storage::check_cancelled;
use tetdb_schema::catalog::{CoarseRow, FileRow, SubdomainRow};
use tetdb_schema::field::FieldPart;

/// Memory for chunks and redb's cache.
const MEMORY_BYTES: usize = 8 << 20;
/// Greatest number of listed faults.
const LISTED_MAX: usize = 1000;

/// Lists the damage in the files of sub-domains, coarse snapshots, stages, fields and versions, in that order.
///
/// Errors: a damaged catalog, because it lists the files; failures of the disk that are no damage.
pub fn damage(store: &mut Catalog) -> Result<Vec<StoreError>, StoreError> {
    let mut found = DamageFound(Vec::new());
    for row in store.subdomains()? {
        found.add_part(store, row)?;
    }
    found.add_snapshots(store)?;
    Ok(found.0)
}

/// Lists the damage in the files that are no part of the mesh. Errors: as [`damage`].
pub(super) fn snapshot_damage(store: &mut Catalog) -> Result<Vec<StoreError>, StoreError> {
    let mut found = DamageFound(Vec::new());
    found.add_snapshots(store)?;
    Ok(found.0)
}

/// Lists the damage in the sub-domains and fields that a version would bring back. Errors: as [`damage`].
pub fn damage_of_version(store: &mut Catalog, number: u32) -> Result<Vec<StoreError>, StoreError> {
    let mut found = DamageFound(Vec::new());
    if let Some(version) = store.versions()?.get(&number) {
        let mut then = store.at(version);
        let mut known = Known::default();
        known.meshes.extend(store.subdomains()?.iter().map(SubdomainRow::file));
        known.values.extend(store.field_parts()?.iter().map(FieldPart::file));
        found.add_state(&mut then, &mut known)?;
    }
    Ok(found.0)
}

struct DamageFound(Vec<StoreError>);

/// Files of sub-domains and of fields that need not be read any more.
#[derive(Default)]
struct Known {
    meshes: BTreeSet<FileRow>,
    values: BTreeSet<FileRow>,
}

impl DamageFound {
    /// Lists damage; returns other errors. Returns whether there was no damage.
    fn note<T, E: Into<StoreError>>(&mut self, read: Result<T, E>) -> Result<bool, StoreError> {
        check_cancelled();
        match read.map_err(E::into) {
            Ok(_) => Ok(true),
            Err(error) if error.is_damage() => {
                if self.0.len() < LISTED_MAX {
                    self.0.push(error);
                }
                Ok(false)
            }
            Err(error) => Err(error),
        }
    }

    /// Reads all chunks, until the list is full: a damaged count of chunks may be any number. Returns whether all were sound.
    fn all<T, E: Into<StoreError>>(
        &mut self,
        chunks: impl Iterator<Item = Result<T, E>>,
    ) -> Result<bool, StoreError> {
        let mut is_sound = true;
        for chunk in chunks {
            is_sound &= self.note(chunk)?;
            if self.0.len() >= LISTED_MAX {
                break;
            }
        }
        Ok(is_sound)
    }

    fn add_snapshots(&mut self, store: &mut Catalog) -> Result<(), StoreError> {
        for row in store.coarse_snapshots()? {
            self.add_snapshot(store, row)?;
        }
        for stage in store.stages()? {
            self.add_part(store, stage.row)?;
        }
        self.add_versions(store)
    }

    /// The fields of the store, and all that versions have besides.
    fn add_versions(&mut self, store: &mut Catalog) -> Result<(), StoreError> {
        let mut known = Known::default();
        known.meshes.extend(store.subdomains()?.iter().map(SubdomainRow::file));
        let mut states = vec![store.share()];
        states.extend(store.versions()?.values().map(|version| store.at(version)));
        states.iter_mut().try_for_each(|store| self.add_state(store, &mut known))
    }

    /// The sub-domains and fields of a state, but for `known` files; its own become known.
    fn add_state(&mut self, store: &mut Catalog, known: &mut Known) -> Result<(), StoreError> {
        let parts = store.field_parts()?;
        for row in store.subdomains()? {
            if known.meshes.insert(row.file()) {
                self.add_part(store, row.clone())?;
            }
            for field in store.fields()? {
                let is_its = |part: &&FieldPart| (part.field, part.rank) == (field.id, row.rank);
                let mut its = parts.iter().find(is_its).into_iter();
                if its.any(|part| !known.values.insert(part.file())) {
                    continue;
                }
                // A damaged sub-domain is listed elsewhere.
                let Ok(mesh) = store.open_row(row.clone(), MEMORY_BYTES) else { break };
                let opened = store.open_field(&field, &mesh, MEMORY_BYTES);
                let checked = opened.and_then(|mut values| Ok(values.check()?));
                self.note(checked)?;
            }
        }
        Ok(())
    }

    fn add_part(&mut self, store: &mut Catalog, row: SubdomainRow) -> Result<(), StoreError> {
        let [tets, vertices, facets, faces, ..] = row.chunks;
        let mut part = match store.open_row(row, MEMORY_BYTES) {
            Ok(part) => part,
            Err(error) => return self.note::<(), _>(Err(error)).map(drop),
        };
        let mut is_sound = self.all((0..vertices).map(|chunk| part.vertex_chunk(chunk)))?;
        is_sound &= self.all((0..tets).map(|chunk| part.tet_chunk(chunk)))?;
        is_sound &= self.all((0..facets).map(|chunk| part.facet_chunk(chunk)))?;
        is_sound &= self.all((0..faces).map(|chunk| part.interface_chunk(chunk)))?;
        // Damage of chunks was reported with their places before; the tree between them remains.
        if is_sound {
            self.note(part.check())?;
        }
        Ok(())
    }

    fn add_snapshot(&mut self, store: &mut Catalog, row: CoarseRow) -> Result<(), StoreError> {
        let mut snapshot = match store.open_coarse(row.rank, MEMORY_BYTES) {
            Ok(snapshot) => snapshot,
            Err(error) => return self.note::<(), StoreError>(Err(error)).map(drop),
        };
        let mut is_sound = self.all(snapshot.vertices())?;
        is_sound &= self.all(snapshot.tets())?;
        is_sound &= self.all(snapshot.facets())?;
        is_sound &= self.all(snapshot.faces())?;
        if is_sound {
            self.note(snapshot.check())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sealed::SealedError;

    #[test]
    fn a_count_without_end_is_not_followed_to_it() {
        let missing = || {
            Err::<(), _>(SealedError::Content {
                path: "part.redb".into(),
                subdomain: 0,
                what: "a chunk is missing".to_owned(),
            })
        };
        let mut found = DamageFound(Vec::new());
        let is_sound = found.all(std::iter::repeat_with(missing));
        assert!(!is_sound.expect("damage alone"));
        assert_eq!(found.0.len(), LISTED_MAX);
    }
}
