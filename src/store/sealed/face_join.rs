//! Faces by their tetrahedra: facets and interface faces meet their tetrahedra in one pass.

use std::path::Path;

use super::{MergeReader, sorted_face};
use tetdb_base::storage::{Sorter, StorageError, sort_record};
use tetdb_schema::record::FACES;

sort_record! {
    /// A face of a tetrahedron, with a mark of the caller's.
    pub struct JoinedFace {
        /// Number of the tetrahedron.
        pub tet: u32,
        /// Ascending.
        pub vertices: [u32; 3],
        /// Parity of the face seen from outside the tetrahedron.
        pub is_odd: bool,
        /// Label or kind of the face.
        pub mark: u32,
    }
}

impl JoinedFace {
    /// Returns which face of the tetrahedron with these nodes it is; none of them if it is seen from the other side.
    pub fn place(&self, nodes: [u32; 4]) -> Option<usize> {
        let own = (self.vertices, self.is_odd);
        (0..4).find(|&i| sorted_face(FACES[i].map(|k| nodes[k])) == own)
    }
}

/// Faces being gathered for a [`FaceJoin`].
pub struct FaceJoinSorter(Sorter<JoinedFace>);

impl FaceJoinSorter {
    /// A sorter of `memory_bytes` with scratch in `dir`.
    pub fn new(dir: &Path, memory_bytes: u64) -> Self {
        Self(Sorter::new(dir, memory_bytes))
    }

    /// Adds a face of `tet`: `vertices` are counter-clockwise seen from outside the tetrahedron, or from inside if `is_turned`. Errors: the disk.
    pub fn push(
        &mut self,
        tet: u32,
        vertices: [u32; 3],
        is_turned: bool,
        mark: u32,
    ) -> Result<(), StorageError> {
        let (vertices, is_odd) = sorted_face(vertices);
        self.0.push(JoinedFace { tet, vertices, is_odd: is_odd != is_turned, mark })
    }

    /// Ends gathering. Errors: the disk.
    pub fn finish(self) -> Result<FaceJoin, StorageError> {
        Ok(FaceJoin(MergeReader::new(self.0.finish()?)))
    }
}

/// Faces in the order of their tetrahedra.
pub struct FaceJoin(MergeReader<JoinedFace>);

impl FaceJoin {
    /// The next face of a tetrahedron below `end`. Errors: the disk.
    pub fn next_below(&mut self, end: u32) -> Result<Option<JoinedFace>, StorageError> {
        self.0.next_if(|face| face.tet < end)
    }

    /// Marks which faces of tetrahedron `tet` are there, and skips those of earlier tetrahedra. Errors: the disk.
    pub fn faces_of(&mut self, tet: u32, nodes: [u32; 4]) -> Result<[bool; 4], StorageError> {
        let mut found = [false; 4];
        while let Some(face) = self.next_below(tet.saturating_add(1))? {
            if face.tet == tet {
                let own = super::face_of(face.vertices, nodes);
                found = [0, 1, 2, 3].map(|i| found[i] || own[i]);
            }
        }
        Ok(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_meet_their_tetrahedra_in_order() -> Result<(), Box<dyn std::error::Error>> {
        let dir = tempfile::tempdir()?;
        let nodes = [4, 2, 9, 7];
        let mut sorter = FaceJoinSorter::new(dir.path(), 0);
        for (i, face) in FACES.iter().enumerate().filter(|(i, _)| *i != 2) {
            sorter.push(5, face.map(|k| nodes[k]), false, i as u32)?;
        }
        // Seen from inside the tetrahedron, and the same face of another one.
        let [a, b, c] = FACES[2].map(|k| nodes[k]);
        sorter.push(5, [a, c, b], true, 2)?;
        sorter.push(3, [a, b, c], true, 0)?;
        let mut join = sorter.finish()?;
        assert_eq!(join.next_below(4)?.map(|face| (face.tet, face.place(nodes))), Some((3, None)));
        assert_eq!(join.next_below(5)?, None);
        let mut places = Vec::new();
        while let Some(face) = join.next_below(6)? {
            places.push((face.mark as usize, face.place(nodes)));
        }
        places.sort_unstable();
        assert_eq!(places, [0, 1, 2, 3].map(|i| (i, Some(i))));

        let mut sorter = FaceJoinSorter::new(dir.path(), 0);
        sorter.push(2, [1, 2, 3], false, 0)?;
        sorter.push(5, [a, b, c], true, 0)?;
        let mut join = sorter.finish()?;
        assert_eq!(join.faces_of(5, nodes)?, [false, false, true, false]);
        assert_eq!(join.faces_of(6, nodes)?, [false; 4]);
        Ok(())
    }
}
