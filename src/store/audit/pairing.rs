//! Faces that no chunk could match within itself, matched by an external sort.

use std::path::Path;

use crate::sealed::MergeReader;
use crate::store::StoreError;
use tetdb_base::storage::{Sorter, StorageError, check_cancelled, sort_record};

sort_record! {
    /// One side of a face.
    pub(super) struct OpenSide {
        /// Vertices ascending.
        pub face: [u32; 3],
        /// Face reference: 4 * tetrahedron + face.
        pub reference: u32,
        /// The vertex of the tetrahedron that is not on the face.
        pub apex: u32,
        pub region: u32,
        pub odd: bool,
        /// Bits: the reasons for which the face is required.
        pub mark: u8,
    }
}

/// Open sides under collection.
pub(super) struct OpenSides {
    sorter: Sorter<OpenSide>,
}

impl OpenSides {
    pub(super) fn new(dir: &Path, memory_bytes: usize) -> Self {
        Self { sorter: Sorter::new(dir, memory_bytes as u64) }
    }

    pub(super) fn push(&mut self, side: &OpenSide) -> Result<(), StorageError> {
        self.sorter.push(*side)
    }

    /// Calls `visit` with the sides of each face, faces ascending.
    pub(super) fn for_each_face(
        self,
        mut visit: impl FnMut(&[OpenSide]) -> Result<(), StoreError>,
    ) -> Result<(), StoreError> {
        let (mut reader, mut sides) = (MergeReader::new(self.sorter.finish()?), Vec::new());
        while reader.next_group(&mut sides, |a, b| a.face == b.face)? {
            check_cancelled();
            visit(&sides)?;
        }
        Ok(())
    }
}
