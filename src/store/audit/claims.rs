//! Facets and interface faces name their tetrahedra; sorted by those, they are checked in one pass.

use std::iter::Peekable;
use std::path::Path;

use crate::sealed::sorted_face;
use crate::store::StoreError;
use tetdb_base::storage::{Sorted, Sorter, StorageError, sort_record};

/// What makes a face required.
pub(super) const FACET: u8 = 1;
/// See [`FACET`].
pub(super) const INTERFACE: u8 = 2;

sort_record! {
    /// A face that a tetrahedron is said to have.
    pub(super) struct Claim {
        pub tet: u32,
        /// Vertices ascending.
        pub face: [u32; 3],
        /// Parity of the face as seen from outside the tetrahedron.
        pub odd: bool,
        /// [`FACET`] or [`INTERFACE`].
        pub kind: u8,
    }
}

/// Claims under collection.
pub(super) struct Claims {
    sorter: Sorter<Claim>,
}

/// Claims by tetrahedron.
pub(super) struct SortedClaims {
    claims: Peekable<Sorted<Claim>>,
}

impl Claims {
    pub(super) fn new(dir: &Path, memory_bytes: usize) -> Self {
        Self { sorter: Sorter::new(dir, memory_bytes as u64) }
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
        let odd = odd != turned;
        self.sorter.push(Claim { tet, face, odd, kind })
    }

    pub(super) fn finish(self) -> Result<SortedClaims, StorageError> {
        Ok(SortedClaims { claims: self.sorter.finish()?.peekable() })
    }
}

impl SortedClaims {
    /// The next claim of a tetrahedron below `end`.
    pub(super) fn next_below(&mut self, end: u32) -> Result<Option<Claim>, StoreError> {
        let is_below = |claim: &Result<Claim, _>| claim.as_ref().map_or(true, |c| c.tet < end);
        Ok(self.claims.next_if(is_below).transpose()?)
    }
}
