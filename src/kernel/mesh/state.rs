//! Ids of records, and the number of records of each kind.

use rkyv::{Archive, Deserialize, Serialize};
use tetdb_schema::page::{NONE, RECORDS, SLOT_BITS, SLOT_MASK};

/// Records of one kind: ids handed out in order, freed slots used again, last freed first.
#[derive(Archive, Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
pub(super) struct IdPool {
    /// The next id never used.
    pub fresh: u32,
    pub free_head: u32,
    pub n_live: u32,
}

impl Default for IdPool {
    fn default() -> Self {
        Self { fresh: 0, free_head: NONE, n_live: 0 }
    }
}

/// Numbers of a [`MeshState`].
pub const MESH_STATE_WORDS: usize = 12;

/// Counts that, with the pages, are the whole state of a working mesh.
#[derive(Archive, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq)]
pub struct MeshState {
    pub(super) tets: IdPool,
    pub(super) vertices: IdPool,
    pub(super) facets: IdPool,
    pub(super) interface_faces: IdPool,
}

impl MeshState {
    /// Counts of records numbered without gaps.
    pub(super) fn dense(
        n_tets: u32,
        n_vertices: u32,
        n_facets: u32,
        n_interface_faces: u32,
    ) -> Self {
        let pool = |n: u32| IdPool { fresh: sparse(n), free_head: NONE, n_live: n };
        Self {
            tets: pool(n_tets),
            vertices: pool(n_vertices),
            facets: pool(n_facets),
            interface_faces: pool(n_interface_faces),
        }
    }

    /// Returns whether so many pages of tetrahedra, vertices, facets and interface faces contain the ids counted here:
    /// false only for damage.
    pub fn fits(&self, n_pages: [u32; 4]) -> bool {
        let arenas = [self.tets, self.vertices, self.facets, self.interface_faces];
        arenas.iter().zip(n_pages).all(|(pool, n)| {
            let ids = u64::from(dense(pool.fresh));
            let is_free = pool.free_head == NONE || u64::from(dense(pool.free_head)) < ids;
            ids <= u64::from(n) * RECORDS as u64 && u64::from(pool.n_live) <= ids && is_free
        })
    }

    /// Tetrahedra in use.
    pub fn n_tets(&self) -> u32 {
        self.tets.n_live
    }

    /// The counts as numbers, to store with the pages.
    pub fn to_words(self) -> [u32; MESH_STATE_WORDS] {
        let mut words = [0; MESH_STATE_WORDS];
        let pools = [self.tets, self.vertices, self.facets, self.interface_faces];
        for (words, pool) in words.chunks_exact_mut(3).zip(pools) {
            words.copy_from_slice(&[pool.fresh, pool.free_head, pool.n_live]);
        }
        words
    }

    /// The inverse of [`MeshState::to_words`].
    pub fn from_words(w: [u32; MESH_STATE_WORDS]) -> Self {
        let pool = |i: usize| IdPool { fresh: w[i], free_head: w[i + 1], n_live: w[i + 2] };
        Self { tets: pool(0), vertices: pool(3), facets: pool(6), interface_faces: pool(9) }
    }
}

/// The id after `id` within pages whose last two slots hold no record.
#[inline]
pub fn next_id(id: u32) -> u32 {
    if (id & SLOT_MASK) as usize == RECORDS - 1 { id + 3 } else { id + 1 }
}

/// Position of record `id` when the unused slots are left out.
#[inline]
pub fn dense(id: u32) -> u32 {
    (id >> SLOT_BITS) * RECORDS as u32 + (id & SLOT_MASK)
}

/// The id at position `n`; inverse of [`dense`].
#[inline]
pub fn sparse(n: u32) -> u32 {
    ((n / RECORDS as u32) << SLOT_BITS) | (n % RECORDS as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unused_slots_are_never_ids() {
        for n in [0, 1, 2045, 2046, 4091, 4092, 100_000] {
            assert_eq!(dense(sparse(n)), n);
            assert!((sparse(n) & SLOT_MASK) < RECORDS as u32);
        }
        let mut id = 0;
        for n in 0..10_000 {
            assert_eq!(id, sparse(n));
            id = next_id(id);
        }
    }
}
