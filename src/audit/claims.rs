//! Facets and interface faces name their tetrahedra; sorted by those, they are checked in one pass.

use std::iter::Peekable;
use std::path::Path;

use crate::sealed::sorted_face;
use crate::storage::{Sorted, Sorter, StorageError};
use crate::store::StoreError;

/// Tetrahedron, vertices ascending, parity, kind: 4 + 12 + 1 + 1 bytes.
const BYTES: usize = 18;

/// What makes a face required.
pub(super) const FACET: u8 = 1;
/// See [`FACET`].
pub(super) const INTERFACE: u8 = 2;

/// A face that a tetrahedron is said to have.
#[derive(Clone, Copy, Debug)]
pub(super) struct Claim {
    pub tet: u32,
    pub face: [u32; 3],
    /// Parity of the face as seen from outside the tetrahedron.
    pub odd: bool,
    /// [`FACET`] or [`INTERFACE`].
    pub kind: u8,
}

/// Claims under collection.
pub(super) struct Claims {
    sorter: Sorter<BYTES>,
}

/// Claims by tetrahedron.
pub(super) struct SortedClaims {
    claims: Peekable<Sorted<BYTES>>,
}

pub(super) fn word(record: &[u8], place: usize) -> u32 {
    let bytes = record[4 * place..][..4].try_into();
    u32::from_be_bytes(bytes.expect("four bytes"))
}

impl Claims {
    pub(super) fn new(dir: &Path, memory_bytes: usize) -> Self {
        Self {
            sorter: Sorter::new(dir, memory_bytes as u64),
        }
    }

    /// A face with these vertices, counter-clockwise seen from outside the tetrahedron, or from inside when `turned`.
    pub(super) fn push(
        &mut self,
        tet: u32,
        vertices: [u32; 3],
        turned: bool,
        kind: u8,
    ) -> Result<(), StorageError> {
        let (face, odd) = sorted_face(vertices);
        let mut record = [0; BYTES];
        record[..4].copy_from_slice(&tet.to_be_bytes());
        for (bytes, v) in record[4..16].chunks_exact_mut(4).zip(face) {
            bytes.copy_from_slice(&v.to_be_bytes());
        }
        record[16] = u8::from(odd != turned);
        record[17] = kind;
        self.sorter.push(record)
    }

    pub(super) fn finish(self) -> Result<SortedClaims, StorageError> {
        Ok(SortedClaims {
            claims: self.sorter.finish()?.peekable(),
        })
    }
}

impl SortedClaims {
    /// The next claim of a tetrahedron below `end`.
    pub(super) fn next_below(&mut self, end: u32) -> Result<Option<Claim>, StoreError> {
        let next = self
            .claims
            .next_if(|r| r.as_ref().is_ok_and(|r| word(r, 0) < end) || r.is_err());
        let Some(record) = next.transpose()? else {
            return Ok(None);
        };
        Ok(Some(Claim {
            tet: word(&record, 0),
            face: [1, 2, 3].map(|i| word(&record, i)),
            odd: record[16] != 0,
            kind: record[17],
        }))
    }
}
