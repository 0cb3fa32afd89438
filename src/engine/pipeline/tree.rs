//! The bisection tree as stored in the catalog, and the working meshes of its subtrees.

use crate::pipeline::error::PipelineError;
use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::{Backing, DiskPath, Pager, StoreFile};
use tetdb_kernel::mesh::Mesh;
use tetdb_schema::blob::{Blob, BlobContent};
use tetdb_schema::page::STORED_BYTES;
use tetdb_schema::tree::{CutPlane, RankRange, SubtreeMesh};
use tetdb_store::sealed::SealedError;
use tetdb_store::store::{Catalog, StoreError};

/// Difference between the generation of a subtree's mesh and that of the files written from it.
pub const DONE: u32 = 2;

/// Reads a blob. Errors: the blob is missing or damaged.
pub fn read_blob<T: BlobContent>(catalog: &mut Catalog, blob: Blob) -> Result<T, StoreError> {
    read_blob_with(catalog, blob, T::from_bytes)
}

fn read_blob_with<T>(
    catalog: &mut Catalog,
    blob: Blob,
    content: impl FnOnce(&[u8]) -> Option<T>,
) -> Result<T, StoreError> {
    let bytes = catalog.blob(blob)?;
    bytes.as_deref().and_then(content).ok_or_else(|| {
        StoreError::Sealed(SealedError::Content {
            path: catalog.dir().to_owned(),
            subdomain: blob.index(),
            what: format!("missing or damaged in the catalog: {blob}"),
        })
    })
}

/// The number of sub-domains on record; 1 until it is decided.
pub fn recorded_n_subdomains(catalog: &mut Catalog) -> Result<u32, StoreError> {
    let bytes = catalog.blob(Blob::SubdomainCount)?;
    Ok(bytes.as_deref().and_then(u32::from_bytes).unwrap_or(1))
}

/// All working meshes of a store of `n` sub-domains, in order of rank.
pub fn subtrees(catalog: &mut Catalog, n: u32) -> Result<Vec<SubtreeMesh>, StoreError> {
    let mut subtrees = Vec::new();
    let mut first = 0;
    while first < n {
        let subtree = read_blob_with(catalog, Blob::Subtree(first), |bytes| {
            SubtreeMesh::from_bytes(first, bytes).filter(|subtree| subtree.ranks.is_in_tree(n))
        })?;
        first += subtree.ranks.count;
        subtrees.push(subtree);
    }
    Ok(subtrees)
}

/// The corners of a box in the form in which a blob stores them.
pub fn corners(bounds: &Aabb) -> [[f64; 3]; 2] {
    [bounds.low, bounds.high].map(|p| p.to_array())
}

/// The bounding box of the surface.
pub fn bounds(catalog: &mut Catalog) -> Result<Aabb, StoreError> {
    let corners: [[f64; 3]; 2] = read_blob(catalog, Blob::Bounds)?;
    let [low, high] = corners.map(Point::from_array);
    Ok(Aabb { low, high })
}

/// The planes of the cuts above a subtree, in a store of `n` sub-domains.
pub fn zones_above(
    catalog: &mut Catalog,
    ranks: RankRange,
    n: u32,
) -> Result<Vec<CutPlane>, StoreError> {
    let cuts = ranks.cuts_above(n).into_iter();
    let plane = |cut| {
        read_blob_with(catalog, Blob::CutPlane(cut), |bytes| CutPlane::from_bytes(cut, bytes))
    };
    cuts.map(plane).collect()
}

/// Checks the extents of a mesh before a page table is allocated. Errors: more pages than the file has bytes for, or more records
/// than the pages hold.
fn check_extents(mesh: &SubtreeMesh, base: &DiskPath) -> Result<(), StoreError> {
    if mesh.is_sound() && mesh.n_pages() * STORED_BYTES as u64 <= base.bytes()? {
        return Ok(());
    }
    Err(StoreError::Sealed(SealedError::Content {
        path: base.path().to_owned(),
        subdomain: mesh.ranks.first,
        what: "its row in the bisection tree says of more pages or records than there are"
            .to_owned(),
    }))
}

/// Opens the working mesh of a subtree from the file `base`.
pub fn open_subtree(
    mesh: SubtreeMesh,
    base: DiskPath,
    mut backing: Backing,
    frames: u64,
) -> Result<Mesh, PipelineError> {
    check_extents(&mesh, &base)?;
    backing.base = Some(StoreFile::open_repaired(&base, backing.cache_bytes / 2, false)?);
    let mut pager = Pager::new(frames, Some(backing));
    pager.adopt(mesh.extents);
    Ok(Mesh::with_state(pager, mesh.state))
}

#[cfg(test)]
mod tests {
    use super::*;
    use tetdb_base::storage::kind;
    use tetdb_schema::tree::{MESH_STATE_WORDS, MeshState, WORKING_KINDS};

    #[test]
    fn a_mesh_has_no_more_pages_than_its_file_has_bytes_for() {
        let dir = tempfile::tempdir().expect("a folder");
        let path = dir.path().join("base.redb");
        std::fs::write(&path, vec![0; 5 * STORED_BYTES]).expect("room");
        let base = DiskPath::from(path.as_path());
        let mut mesh = SubtreeMesh {
            ranks: RankRange::root(1),
            generation: 1,
            state: MeshState::default(),
            extents: [[0; 2]; WORKING_KINDS.len()],
            load: 1.0,
        };
        mesh.extents[1] = [7, 2];
        mesh.extents[2] = [0, 3];
        assert!(check_extents(&mesh, &base).is_ok());
        for extent in [[0, 4], [0, u32::MAX], [u32::MAX, 3]] {
            mesh.extents[2] = extent;
            let refused = check_extents(&mesh, &base);
            assert!(refused.is_err_and(|e| e.is_damage()), "{extent:?}");
        }
        mesh.extents[2] = [0, 3];
        for (word, number) in [(0, 1), (3, 3 << 11 | 1), (2, 7), (4, 5)] {
            let mut words = [0; MESH_STATE_WORDS];
            for free_head in [1, 4, 7, 10] {
                words[free_head] = u32::MAX;
            }
            mesh.state = MeshState::from_words(words);
            assert!(check_extents(&mesh, &base).is_ok());
            words[word] = number;
            mesh.state = MeshState::from_words(words);
            let refused = check_extents(&mesh, &base);
            assert!(refused.is_err_and(|e| e.is_damage()), "{word} {number}");
        }
    }

    #[test]
    fn pagers_have_the_kinds_of_the_schema() {
        assert_eq!(kind::ALL, WORKING_KINDS);
    }
}
