//! Vertices that stand twice or more often, once for each side of the sheets they are on.

use std::path::PathBuf;

use super::error::Result;
use super::stream::Records;
use tetdb_base::storage::{Payload, SortRecord, sort_record};
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

const CHANGE_BYTES: usize = size_of::<<Change as SortRecord>::Bytes>();
const DOUBLE_BYTES: usize = size_of::<<Double as SortRecord>::Bytes>();

/// All of them, in scratch files.
pub(super) struct Doubles {
    pub n: u64,
    /// Changes by tetrahedron, and doubles.
    pub changes: PathBuf,
    pub vertices: PathBuf,
}

/// Changes, read one tetrahedron after the other.
pub(super) struct Changes {
    records: Records<CHANGE_BYTES>,
    next: Option<Change>,
}

impl Doubles {
    pub fn changes(&self) -> Result<Changes> {
        let mut records = Records::open(&self.changes, 0)?;
        let next = records.next()?;
        let next = next.map(|bytes| Change::from_bytes(&bytes));
        Ok(Changes { records, next })
    }

    /// Every double with its place among them. Errors: the disk, those of `each`.
    pub fn each(&self, mut each: impl FnMut(u64, &Double) -> Result<()>) -> Result<()> {
        let mut records = Records::<DOUBLE_BYTES>::open(&self.vertices, 0)?;
        let mut place = 0;
        while let Some(bytes) = records.next()? {
            each(place, &Double::from_bytes(&bytes))?;
            place += 1;
        }
        Ok(())
    }
}

impl Changes {
    /// The vertices of tetrahedron `tet`, which follows those asked for before.
    pub fn apply(&mut self, tet: u64, nodes: &mut [u64; 4]) -> Result<()> {
        while let Some(change) = self.next.filter(|change| change.tet <= tet) {
            if change.tet == tet {
                let node = nodes.iter_mut().find(|node| **node == change.vertex);
                node.into_iter().for_each(|node| *node = change.double);
            }
            let next = self.records.next()?;
            self.next = next.map(|bytes| Change::from_bytes(&bytes));
        }
        Ok(())
    }
}

impl Double {
    /// What it says as a vertex: all but its number is that of the one it is of.
    pub fn sealed(&self) -> SealedVertex {
        SealedVertex { point: self.point.0, h: self.h as f32, tag: self.tag, id: self.id }
    }
}
