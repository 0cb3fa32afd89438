//! Whatever cannot be read as it was written, all of it, with its places.
//!
//! The mesh itself is read by [`verify`](super::verify), chunk by chunk; here every file that counts is, also those that are only kept:
//! coarse snapshots, previous versions, stages.

use crate::storage::check_cancelled;
use crate::store::{Catalog, StoreError};
use tetdb_schema::catalog::{CoarseRow, SubdomainRow};

/// For chunks and what redb holds of a file.
const MEMORY_BYTES: usize = 8 << 20;
/// More are not listed.
const LISTED_MAX: usize = 1000;

/// What is damaged in the files of sub-domains, coarse snapshots, previous versions and stages, in that order; nothing in a sound store.
///
/// Errors: a damaged catalog, which tells what files there are; failures of the disk that are no damage.
pub fn damage(store: &mut Catalog) -> Result<Vec<StoreError>, StoreError> {
    let mut found = DamageFound(Vec::new());
    for row in store.subdomains()? {
        found.of_part(store, row)?;
    }
    found.of_snapshots(store)?;
    Ok(found.0)
}

/// The same of the files that are no part of the mesh. Errors: as [`damage`].
pub(super) fn damage_of_snapshots(store: &mut Catalog) -> Result<Vec<StoreError>, StoreError> {
    let mut found = DamageFound(Vec::new());
    found.of_snapshots(store)?;
    Ok(found.0)
}

struct DamageFound(Vec<StoreError>);

impl DamageFound {
    /// Takes damage; hands other errors on. Whether there was none.
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

    fn of_snapshots(&mut self, store: &mut Catalog) -> Result<(), StoreError> {
        for row in store.coarse_snapshots()? {
            self.of_snapshot(store, row)?;
        }
        for row in store.previous()? {
            self.of_part(store, row)?;
        }
        for stage in store.stages()? {
            self.of_part(store, stage.row)?;
        }
        Ok(())
    }

    fn of_part(&mut self, store: &mut Catalog, row: SubdomainRow) -> Result<(), StoreError> {
        let [tets, vertices, facets, faces, ..] = row.chunks;
        let mut part = match store.open_row(row, MEMORY_BYTES) {
            Ok(part) => part,
            Err(error) => return self.note::<(), _>(Err(error)).map(drop),
        };
        let mut is_sound = true;
        for chunk in 0..vertices {
            is_sound &= self.note(part.vertex_chunk(chunk))?;
        }
        for chunk in 0..tets {
            is_sound &= self.note(part.tet_chunk(chunk))?;
        }
        for chunk in 0..facets {
            is_sound &= self.note(part.facet_chunk(chunk))?;
        }
        for chunk in 0..faces {
            is_sound &= self.note(part.interface_chunk(chunk))?;
        }
        // Damage of chunks was reported with their places by now; what is left is in the tree between them.
        if is_sound {
            self.note(part.check())?;
        }
        Ok(())
    }

    fn of_snapshot(&mut self, store: &mut Catalog, row: CoarseRow) -> Result<(), StoreError> {
        let mut leaf = match store.open_coarse(row.rank, MEMORY_BYTES) {
            Ok(leaf) => leaf,
            Err(error) => return self.note::<(), StoreError>(Err(error)).map(drop),
        };
        let mut is_sound = true;
        for chunk in leaf.vertices() {
            is_sound &= self.note(chunk)?;
        }
        for chunk in leaf.tets() {
            is_sound &= self.note(chunk)?;
        }
        for chunk in leaf.facets() {
            is_sound &= self.note(chunk)?;
        }
        for chunk in leaf.faces() {
            is_sound &= self.note(chunk)?;
        }
        if is_sound {
            self.note(leaf.check())?;
        }
        Ok(())
    }
}
