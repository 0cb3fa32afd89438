//! Doubles of vertices on sheets: one vertex for each side of the sheets it is on.

use std::path::PathBuf;

use super::error::Result;
use super::stream::RecordReader;
use tetdb_base::storage::{Payload, sort_record};
use tetdb_schema::record::SealedVertex;

sort_record! {
    /// A tetrahedron that has the double of a vertex.
    pub(super) struct Change {
        pub tet: u64,
        pub vertex: u64,
        pub double: u64,
    }
}

sort_record! {
    /// A double; doubles follow all vertices in this order.
    pub(super) struct Double {
        /// The vertex it is of.
        pub vertex: u64,
        pub id: u64,
        pub tag: u32,
        pub h: f64,
        pub point: Payload<[f64; 3]>,
    }
}

/// All doubles, in scratch files.
pub(super) struct Doubles {
    pub n: u64,
    /// Changes by tetrahedron, and doubles.
    pub changes: PathBuf,
    pub vertices: PathBuf,
}

/// Changes, read one tetrahedron after the other.
pub(super) struct ChangeReader {
    records: RecordReader<Change>,
    next: Option<Change>,
}

impl Doubles {
    /// The changes, from the first one on. Errors: the disk.
    pub fn changes(&self) -> Result<ChangeReader> {
        let mut records = RecordReader::open(&self.changes, 0)?;
        Ok(ChangeReader { next: records.next()?, records })
    }

    /// Every double with its place among them. Errors: the disk, those of `each`.
    pub fn each(&self, mut each: impl FnMut(u64, &Double) -> Result<()>) -> Result<()> {
        let mut place = 0;
        RecordReader::open(&self.vertices, 0)?.each(|double| {
            place += 1;
            each(place - 1, double)
        })
    }
}

impl ChangeReader {
    /// Puts doubles into the vertices of tetrahedron `tet`, which is later than those of earlier calls. Errors: the disk.
    pub fn apply(&mut self, tet: u64, nodes: &mut [u64; 4]) -> Result<()> {
        while let Some(change) = self.next.filter(|change| change.tet <= tet) {
            if change.tet == tet {
                let node = nodes.iter_mut().find(|node| **node == change.vertex);
                node.into_iter().for_each(|node| *node = change.double);
            }
            self.next = self.records.next()?;
        }
        Ok(())
    }
}

impl Double {
    /// The double as a vertex: equal to the original but for its number.
    pub fn sealed(&self) -> SealedVertex {
        SealedVertex { point: self.point.0, h: self.h as f32, tag: self.tag, id: self.id }
    }
}
