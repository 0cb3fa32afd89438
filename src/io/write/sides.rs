//! Boundary faces as sides of elements, for formats whose surfaces are lists of these.

use std::path::Path;

use super::error::Result;
use super::merged::{Merged, MergedTet};
use tetdb_base::storage::{Sorted, Sorter, sort_record};
use tetdb_store::sealed::{FaceJoin, FaceJoinSorter};

sort_record! {
    /// A face of an element in the surface of a label.
    pub(super) struct ElementSide {
        pub label: u32,
        /// Number of the element in the file.
        pub element: u64,
        /// The format's name of the face.
        pub side: u8,
    }
}

/// Sides being gathered while the tetrahedra pass. All numbers have 31 bits.
pub(super) struct SideSorter {
    faces: FaceJoin,
    groups: std::collections::BTreeMap<u32, Vec<u32>>,
    sides: Sorter<ElementSide>,
    opposite: [u8; 4],
    /// Tetrahedra so far.
    n: u32,
}

impl SideSorter {
    /// `opposite` has the format's names of the faces opposite each node. Errors: the disk.
    pub fn new(mesh: &Merged, dir: &Path, opposite: [u8; 4]) -> Result<Self> {
        let mut sorter = FaceJoinSorter::new(dir, mesh.sorter_bytes());
        mesh.faces().each(|face| {
            let vertices = face.vertices.map(|v| v as u32);
            Ok(sorter.push(face.tet as u32, vertices, false, face.label)?)
        })?;
        let sides = Sorter::new(dir, mesh.sorter_bytes() / 2);
        Ok(Self { faces: sorter.finish()?, groups: mesh.members(), sides, opposite, n: 0 })
    }

    /// Adds the sides of the next tetrahedron, which has the number `element` in the file. Errors: the disk.
    pub fn add(&mut self, tet: &MergedTet, element: u64) -> Result<()> {
        self.n += 1;
        while let Some(face) = self.faces.next_below(self.n)? {
            let outside = |v: &u64| !face.vertices.contains(&(*v as u32));
            let opposite = tet.nodes.iter().position(outside).unwrap_or(0);
            let side = self.opposite[opposite];
            for &label in &self.groups[&face.mark] {
                self.sides.push(ElementSide { label, element, side })?;
            }
        }
        Ok(())
    }

    /// The sides by label and element. Errors: the disk.
    pub fn finish(self) -> Result<Sorted<ElementSide>> {
        Ok(self.sides.finish()?)
    }
}
