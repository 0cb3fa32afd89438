//! Facets and interface faces that a child inherits.
//!
//! A facet with a vertex that only one child has lies in that child, with all its tetrahedra. Only those at the core, whose vertices both
//! may have, are looked up among the required faces there.

use super::child_builder::ChildBuilder;
use super::core::SHARED;
use crate::mesh::anatomy::FROZEN;
use crate::mesh::{FaceRef, Workspace, dense};
use tetdb_base::storage::{Pages, Sorted, Sorter, StorageError, sort_record};
use tetdb_schema::page::NONE;

sort_record! {
    /// A required face of the child.
    struct ChildFace {
        /// Ascending.
        vertices: [u32; 3],
        /// A [`FaceRef`].
        place: u32,
    }
}

sort_record! {
    /// A facet or interface face of the host.
    struct CarriedFace {
        /// In the child, ascending.
        vertices: [u32; 3],
        /// [`FACET`] or [`INTERFACE`].
        kind: u8,
        number: u32,
        /// The core has all its vertices, so that its place must be looked up.
        in_core: bool,
    }
}

const FACET: u8 = 0;
const INTERFACE: u8 = 1;

/// Adds the host's facets and interface faces that have a tetrahedron in the child, and to the low one facets that have none anywhere.
///
/// Errors: the disk, while sorting.
pub(super) fn inherit<P: Pages, Q: Pages, R: Pages>(
    split: &mut ChildBuilder<P, Q, R>,
    space: &Workspace,
) -> Result<(), StorageError> {
    let mut inherited = Sorter::new(space.dir, space.memory / 3);
    let mut loose = None;
    for n in 0..split.host.n_facets() {
        let facet = split.host.facet(n);
        if facet.regions == [0, 0] {
            // Between two empty regions: kept on the low side.
            if !split.high {
                let base = *loose.get_or_insert_with(|| split.loose_vertices());
                let mut copy = facet;
                copy.vertices = facet.vertices.map(|v| split.loose_vertex(base, v));
                split.child.add_facet(copy);
            }
            continue;
        }
        split.candidate(&mut inherited, facet.vertices, FACET, n)?;
    }
    for n in 0..split.host.n_interface_faces() {
        let face = split.host.interface_face(n);
        split.candidate(&mut inherited, face.vertices, INTERFACE, n)?;
    }
    let mut faces = split.required_faces(space)?.peekable();
    for candidate in inherited.finish()? {
        let candidate = candidate?;
        if !candidate.in_core {
            split.inherit_face(candidate, None);
            continue;
        }
        let is_before = |face: &ChildFace| face.vertices < candidate.vertices;
        while let Some(face) = faces.next_if(|f| f.as_ref().map_or(true, is_before)) {
            face?;
        }
        let Some(Ok(face)) = faces.peek() else {
            continue;
        };
        if face.vertices == candidate.vertices {
            split.inherit_face(candidate, Some(FaceRef(face.place)));
        }
    }
    Ok(())
}

impl<P: Pages, Q: Pages, R: Pages> ChildBuilder<'_, P, Q, R> {
    /// The child's numbers of three vertices of a face, and whether the core has them all; `None` when the child lacks one.
    fn child_face(&mut self, vertices: [u32; 3]) -> Option<([u32; 3], bool)> {
        let mut numbers = [NONE; 3];
        let mut in_core = true;
        for (number, v) in numbers.iter_mut().zip(vertices) {
            *number = self.host.scratch(dense(v));
            if *number & SHARED == 0 {
                // All of its tetrahedra are on its side, and so are those of the face.
                if in_core && !self.is_on_side(v) {
                    return None;
                }
                in_core = false;
            } else if *number != NONE {
                *number = self.core.scratch(dense(*number & !SHARED));
            }
            if *number == NONE {
                return None;
            }
        }
        Some((numbers, in_core))
    }

    fn candidate(
        &mut self,
        inherited: &mut Sorter<CarriedFace>,
        vertices: [u32; 3],
        kind: u8,
        number: u32,
    ) -> Result<(), StorageError> {
        let Some((mut vertices, in_core)) = self.child_face(vertices) else {
            return Ok(());
        };
        vertices.sort_unstable();
        inherited.push(CarriedFace { vertices, kind, number, in_core })
    }

    /// Extends the host's scratch map for the numbers of vertices without tetrahedra; returns the begin of that part.
    fn loose_vertices(&mut self) -> u32 {
        let base = self.host_base + dense(self.host.tet_ids_end());
        for n in 0..self.host_base {
            self.host.set_scratch(base + n, NONE);
        }
        base
    }

    /// The child's number of a vertex of a facet that has no tetrahedra.
    fn loose_vertex(&mut self, base: u32, v: u32) -> u32 {
        if let Some(([number, ..], _)) = self.child_face([v; 3]) {
            return number;
        }
        let word = self.host.scratch(base + dense(v));
        if word != NONE {
            return word;
        }
        let number = self.add_host_vertex(v);
        self.host.set_scratch(base + dense(v), number);
        number
    }

    /// The child's required faces whose three vertices the core has.
    fn required_faces(&mut self, space: &Workspace) -> Result<Sorted<ChildFace>, StorageError> {
        let mut faces = Sorter::new(space.dir, space.memory / 3);
        for n in 0..dense(self.core.tet_ids_end()) {
            let number = self.core.scratch(self.core_base + n);
            if number != NONE {
                self.push_required(&mut faces, number)?;
            }
        }
        for k in 0..self.tets_at_core.len() {
            let number = self.tets_at_core[k];
            self.push_required(&mut faces, number)?;
        }
        faces.finish()
    }

    fn push_required(&mut self, faces: &mut Sorter<ChildFace>, t: u32) -> Result<(), StorageError> {
        let tet = self.child.tet(t);
        for i in (0..4).filter(|&i| tet.is_required(i)) {
            let mut vertices = tet.face(i);
            vertices.sort_unstable();
            let place = FaceRef::new(t, i).0;
            faces.push(ChildFace { vertices, place })?;
        }
        Ok(())
    }

    /// Copies a facet or interface face to the child; `face` is its place if it was at the core.
    fn inherit_face(&mut self, candidate: CarriedFace, face: Option<FaceRef>) {
        let listed = "listed with its vertices";
        if candidate.kind == FACET {
            let mut facet = self.host.facet(candidate.number);
            facet.vertices = self.child_face(facet.vertices).expect(listed).0;
            self.child.add_facet(facet);
            return;
        }
        let mut kept = self.host.interface_face(candidate.number);
        kept.vertices = self.child_face(kept.vertices).expect(listed).0;
        self.child.add_interface_face(kept);
        // Tetrahedra copied from the host are frozen already.
        if let Some(face) = face {
            let (region, _) = self.child.tet_attribute(face.tet());
            self.child.set_tet_attribute(face.tet(), region, FROZEN);
        }
    }
}
