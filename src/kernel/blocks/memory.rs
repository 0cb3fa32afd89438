//! How a saturation shares its memory among pages, bricks and visits.

use super::partition::{KdPartition, TOO_STEEP};
use crate::mesh::Mesh;
use tetdb_base::storage::{Pages, StorageError, raise, spare_threads};

/// Bytes of memory by use, and threads.
pub(super) struct Memory {
    /// Of the bricks.
    pub bricks: usize,
    /// Of the pages while blocks are visited, and while bricks are made of them or they of bricks.
    pub pages: u64,
    pub pages_at_first: u64,
    pub threads: usize,
}

/// Bytes of a visit, and per predicted tetrahedron of a large region: its arrays, and its bricks twice. Regions are large in large
/// sub-domains, since the number of blocks is bounded, and where lengths change steeply.
const VISIT_BYTES: u64 = 16 << 20;
const VISIT_TET_BYTES: f64 = 160.0;
/// Bytes of bricks per predicted tetrahedron.
const TET_BYTES: u64 = 50;

impl Memory {
    /// Divides what the pages may use.
    pub fn of<P: Pages>(mesh: &Mesh<P>, partition: &KdPartition) -> Self {
        let threads = spare_threads();
        let Some([used, most]) = mesh.pages().bytes_used() else {
            return Self { bricks: usize::MAX, pages: u64::MAX, pages_at_first: u64::MAX, threads };
        };
        let most = most.saturating_sub(partition.bytes_listed()).max(most / 2);
        let load = partition.load();
        let visit = VISIT_BYTES.max((partition.largest_region() * VISIT_TET_BYTES) as u64);
        // Where lengths change steeply, predictions of regions are several times too high.
        if visit > VISIT_BYTES && visit / 8 > most {
            raise(StorageError::Budget { what: TOO_STEEP, needed: visit, available: most });
        }
        let wanted = (1.5 * load) as u64 * TET_BYTES;
        if used + 2 * wanted + threads as u64 * visit <= most {
            return Self { bricks: usize::MAX, pages: most, pages_at_first: most, threads };
        }
        let threads = threads.min((most / 2 / visit).max(1) as usize);
        let rest = most.saturating_sub(threads as u64 * visit).max(most / 4);
        Self {
            bricks: (rest - rest / 8) as usize,
            pages: rest / 8,
            pages_at_first: most / 2,
            threads,
        }
    }
}
