//! Periodic pairs of labels in the catalog.

use tetdb_schema::blob::{Blob, BlobContent};
use tetdb_schema::periodic::PeriodicRow;
use tetdb_schema::row::{BLOB_PIECE, RowKind, blob_key};

use super::{Catalog, Step, StoreError};
use tetdb_base::geom::Point;
use tetdb_base::storage::{StorageError, check_cancelled};
use tetdb_base::surface::{Patch, PatchTriangle};

/// Bytes of a sub-domain that is read for its facets.
const READ_BYTES: usize = 8 << 20;

impl Catalog {
    /// All periodic pairs, in the order in which they were recorded. Errors: damage.
    pub fn periodic(&mut self) -> Result<Vec<PeriodicRow>, StoreError> {
        self.rows(RowKind::Periodic)
    }

    /// The pairs of vertices, by their numbers in the input. Errors: damage.
    pub fn periodic_vertices(&mut self, row: &PeriodicRow) -> Result<Vec<[u32; 2]>, StoreError> {
        self.pairs(Blob::PeriodicVertices(row.id), row.vertices)
    }

    /// The pairs of triangles, by their numbers in the input. Errors: damage.
    pub fn periodic_triangles(&mut self, row: &PeriodicRow) -> Result<Vec<[u64; 2]>, StoreError> {
        self.pairs(Blob::PeriodicTriangles(row.id), row.triangles)
    }

    fn pairs<T>(&mut self, blob: Blob, n: u64) -> Result<Vec<T>, StoreError>
    where
        Vec<T>: BlobContent,
    {
        let bytes = self.blob(blob)?.unwrap_or_default();
        let pairs = Vec::<T>::from_bytes(&bytes).filter(|pairs| pairs.len() as u64 == n);
        pairs.ok_or_else(|| {
            self.damaged_row(blob_key(blob, 0), "has not the pairs that its row counts")
        })
    }

    /// The triangles of two labels, within `memory` bytes. Errors: more memory is needed; damage.
    pub fn patches(&mut self, labels: [u32; 2], memory: u64) -> Result<[Patch; 2], StoreError> {
        let support_first = self.wires()?.fin_first;
        let mut lists = [Vec::new(), Vec::new()];
        for row in self.subdomains()? {
            let mut part = self.open_row(row, READ_BYTES)?;
            for chunk in 0..part.row().chunks[2] {
                check_cancelled();
                for facet in part.facet_chunk(chunk)?.records {
                    let which = labels.iter().position(|&label| label == facet.label);
                    let Some(which) = which.filter(|_| facet.triangle < support_first) else {
                        continue;
                    };
                    let corners = part.corners(facet.vertices)?;
                    let [Some(a), Some(b), Some(c)] = corners.map(|corner| corner.input_index())
                    else {
                        let what = format!(
                            "triangle {} has a vertex that is not the input's",
                            facet.triangle
                        );
                        return Err(part.damaged(what).into());
                    };
                    let points: [Point; 3] = corners.map(|corner| corner.point);
                    let (number, vertices) = (facet.triangle, [a, b, c]);
                    lists[which].push(PatchTriangle { number, vertices, points });
                }
                let needed = Patch::BYTES_EACH * (lists[0].len() + lists[1].len()) as u64;
                if needed > memory {
                    let what = "triangles of periodic labels";
                    return Err(StorageError::Budget { what, needed, available: memory }.into());
                }
            }
        }
        Ok(lists.map(Patch::new))
    }
}

impl Step {
    /// Sets a periodic pair. One with its number must have been removed before.
    pub fn set_periodic(
        &mut self,
        row: &PeriodicRow,
        vertices: &Vec<[u32; 2]>,
        triangles: &Vec<[u64; 2]>,
    ) {
        self.put(RowKind::Periodic.key(0, row.id), row);
        self.set_blob(Blob::PeriodicVertices(row.id), &vertices.to_bytes());
        self.set_blob(Blob::PeriodicTriangles(row.id), &triangles.to_bytes());
    }

    /// Removes a periodic pair.
    pub fn remove_periodic(&mut self, row: &PeriodicRow) {
        self.changes.insert(RowKind::Periodic.key(0, row.id), None);
        let blobs = [
            (Blob::PeriodicVertices(row.id), 8 * row.vertices),
            (Blob::PeriodicTriangles(row.id), 16 * row.triangles),
        ];
        for (blob, bytes) in blobs {
            let pieces = bytes.div_ceil(BLOB_PIECE as u64).max(1);
            for piece in 0..pieces as u32 {
                self.changes.insert(blob_key(blob, piece), None);
            }
        }
    }
}
