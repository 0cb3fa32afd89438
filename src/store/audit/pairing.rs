//! Faces that no chunk could match within itself, matched by an external sort.

use std::path::Path;

use crate::store::StoreError;
use tetdb_base::storage::{Sorter, StorageError, check_cancelled, sort_record};

sort_record! {
    /// One side of a face.
    pub(super) struct Side {
        /// Vertices ascending.
        pub face: [u32; 3],
        /// Face reference: 4 * tetrahedron + face.
        pub reference: u32,
        /// The vertex of the tetrahedron that is not on the face.
        pub apex: u32,
        pub region: u32,
        pub odd: bool,
        /// Bits of `claims`: what makes the face required.
        pub mark: u8,
    }
}

/// Open sides under collection.
pub(super) struct OpenSides {
    sorter: Sorter<Side>,
}

impl OpenSides {
    pub(super) fn new(dir: &Path, memory_bytes: usize) -> Self {
        Self { sorter: Sorter::new(dir, memory_bytes as u64) }
    }

    pub(super) fn push(&mut self, side: &Side) -> Result<(), StorageError> {
        self.sorter.push(*side)
    }

    /// Calls `visit` with the sides of each face, faces ascending.
    pub(super) fn for_each_face(
        self,
        mut visit: impl FnMut(&[Side]) -> Result<(), StoreError>,
    ) -> Result<(), StoreError> {
        let mut sides: Vec<Side> = Vec::new();
        for side in self.sorter.finish()? {
            check_cancelled();
            let side = side?;
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
