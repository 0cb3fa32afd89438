//! Whatever cannot be read as it was written, all of it, with its places.
//!
//! The mesh itself is read by [`verify`](super::verify), chunk by chunk; here every file that counts is, also those that are only kept:
//! coarse leaves, previous versions, stages.

use crate::catalog::{CatalogError, CoarseLeaf, CoarseRow, Store, Subdomain, SubdomainRow};
use crate::store::stop_if_requested;

/// For chunks and what redb holds of a file.
const MEMORY_BYTES: usize = 8 << 20;
/// More are not listed.
const LISTED_MAX: usize = 1000;

/// What is damaged in the files of sub-domains, coarse leaves, previous versions and stages, in that order; nothing in a sound store.
///
/// Errors: a damaged catalog, which tells what files there are; failures of the disk that are no damage.
pub fn damage(store: &mut Store) -> Result<Vec<CatalogError>, CatalogError> {
    let mut found = Found(Vec::new());
    for row in store.catalog().subdomains()? {
        found.of_part(store, row)?;
    }
    found.of_kept(store)?;
    Ok(found.0)
}

/// The same of the files that are no part of the mesh. Errors: as [`damage`].
pub(super) fn damage_of_kept(store: &mut Store) -> Result<Vec<CatalogError>, CatalogError> {
    let mut found = Found(Vec::new());
    found.of_kept(store)?;
    Ok(found.0)
}

struct Found(Vec<CatalogError>);

impl Found {
    /// Takes damage; hands other errors on. Whether there was none.
    fn note<T>(&mut self, read: Result<T, CatalogError>) -> Result<bool, CatalogError> {
        stop_if_requested();
        match read {
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

    fn of_kept(&mut self, store: &mut Store) -> Result<(), CatalogError> {
        for row in store.catalog().coarse_leaves()? {
            self.of_leaf(store, row)?;
        }
        for row in store.catalog().before()? {
            self.of_part(store, row)?;
        }
        for stage in store.catalog().stages()? {
            self.of_part(store, stage.row)?;
        }
        Ok(())
    }

    fn of_part(&mut self, store: &mut Store, row: SubdomainRow) -> Result<(), CatalogError> {
        let [tets, vertices, facets, faces, ..] = row.chunks;
        let mut part = match Subdomain::open_row(store.catalog(), row, MEMORY_BYTES) {
            Ok(part) => part,
            Err(error) => return self.note::<()>(Err(error)).map(drop),
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
        // Damage of chunks is told with their places by now; what is left is in the tree between them.
        if is_sound {
            self.note(part.check())?;
        }
        Ok(())
    }

    fn of_leaf(&mut self, store: &mut Store, row: CoarseRow) -> Result<(), CatalogError> {
        let path = store.catalog().coarse_path(row.rank, row.generation);
        let mut leaf = match CoarseLeaf::open_at(&path, row, MEMORY_BYTES) {
            Ok(leaf) => leaf,
            Err(error) => return self.note::<()>(Err(error)).map(drop),
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
