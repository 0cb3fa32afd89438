//! Faces that no chunk could match within itself, matched by an external sort.

use std::path::Path;

use super::claims::word;
use crate::storage::{Sorter, StorageError, check_cancelled};
use crate::store::StoreError;

/// Vertices ascending, reference, opposite vertex, region, parity, mark.
const BYTES: usize = 26;

/// One side of a face.
#[derive(Clone, Copy, Debug)]
pub(super) struct Side {
    pub face: [u32; 3],
    pub odd: bool,
    /// Face reference: 4 * tetrahedron + face.
    pub reference: u32,
    /// The vertex of the tetrahedron that is not on the face.
    pub apex: u32,
    pub region: u32,
    /// Bits of `claims`: what makes the face required.
    pub mark: u8,
}

/// Open sides under collection.
pub(super) struct OpenSides {
    sorter: Sorter<BYTES>,
}

impl OpenSides {
    pub(super) fn new(dir: &Path, memory_bytes: usize) -> Self {
        Self {
            sorter: Sorter::new(dir, memory_bytes as u64),
        }
    }

    pub(super) fn push(&mut self, side: &Side) -> Result<(), StorageError> {
        let mut record = [0; BYTES];
        let [a, b, c] = side.face;
        let words = [a, b, c, side.reference, side.apex, side.region];
        for (bytes, word) in record.chunks_exact_mut(4).zip(words) {
            bytes.copy_from_slice(&word.to_be_bytes());
        }
        record[24] = u8::from(side.odd);
        record[25] = side.mark;
        self.sorter.push(record)
    }

    /// Calls `visit` with the sides of each face, faces ascending.
    pub(super) fn for_each_face(
        self,
        mut visit: impl FnMut(&[Side]) -> Result<(), StoreError>,
    ) -> Result<(), StoreError> {
        let mut sides: Vec<Side> = Vec::new();
        for record in self.sorter.finish()? {
            check_cancelled();
            let record = record?;
            let side = Side {
                face: [0, 1, 2].map(|i| word(&record, i)),
                reference: word(&record, 3),
                apex: word(&record, 4),
                region: word(&record, 5),
                odd: record[24] != 0,
                mark: record[25],
            };
            if sides.first().is_some_and(|s| s.face != side.face) {
                visit(&sides)?;
                sides.clear();
            }
            sides.push(side);
        }
        if !sides.is_empty() {
            visit(&sides)?;
        }
        Ok(())
    }
}
