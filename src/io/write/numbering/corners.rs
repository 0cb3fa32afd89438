//! Dense numbers for the vertices of chosen elements: one sort of their corners by vertex, one back by place.

use std::path::{Path, PathBuf};

use crate::write::error::Result;
use tetdb_base::storage::{Payload, Sorted, Sorter, sort_record};

sort_record! {
    /// A corner of an element by its vertex.
    struct ElementCorner {
        vertex: u64,
        /// Number of corners pushed before.
        place: u64,
        position: Payload<[f64; 3]>,
    }
}

sort_record! {
    /// A corner and the dense number of its vertex.
    struct CornerNumber {
        place: u64,
        number: u64,
    }
}

/// Corners being gathered. Memory: the given bytes, twice while they are numbered.
pub(in crate::write) struct CornerSorter {
    by_vertex: Sorter<ElementCorner>,
    n: u64,
    dir: PathBuf,
    memory_bytes: u64,
}

/// Dense numbers of the vertices of all corners, in the order in which these were pushed.
pub(in crate::write) struct DenseCorners(Sorted<CornerNumber>);

impl CornerSorter {
    /// A sorter with scratch in `dir`.
    pub fn new(dir: &Path, memory_bytes: u64) -> Self {
        let by_vertex = Sorter::new(dir, memory_bytes);
        Self { by_vertex, n: 0, dir: dir.to_owned(), memory_bytes }
    }

    /// Adds the next corner, at the position of its vertex. Errors: the disk.
    pub fn push(&mut self, vertex: u64, position: [f64; 3]) -> Result<()> {
        self.n += 1;
        let corner = ElementCorner { vertex, place: self.n - 1, position: Payload(position) };
        Ok(self.by_vertex.push(corner)?)
    }

    /// Calls `each` with every vertex once, ascending; returns the number of vertices and the corners. Errors: the disk, those of `each`.
    pub fn finish(
        self,
        mut each: impl FnMut(u64, [f64; 3]) -> Result<()>,
    ) -> Result<(u64, DenseCorners)> {
        let mut by_place = Sorter::new(&self.dir, self.memory_bytes);
        let (mut n_vertices, mut last) = (0, None);
        for corner in self.by_vertex.finish()? {
            let ElementCorner { vertex, place, position } = corner?;
            if last.replace(vertex) != Some(vertex) {
                n_vertices += 1;
                each(vertex, position.0)?;
            }
            by_place.push(CornerNumber { place, number: n_vertices - 1 })?;
        }
        Ok((n_vertices, DenseCorners(by_place.finish()?)))
    }
}

impl Iterator for DenseCorners {
    type Item = Result<u64>;

    fn next(&mut self) -> Option<Self::Item> {
        Some(self.0.next()?.map(|corner| corner.number).map_err(Into::into))
    }
}
