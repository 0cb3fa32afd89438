//! What a child takes over of facets and interface faces.
//!
//! A facet with a vertex that only one child has lies in that child, with all its tetrahedra. Only those at the core, whose vertices both
//! may have, are looked up among the required faces there.

use super::child::Split;
use super::core::SHARED;
use crate::mesh::anatomy::FROZEN;
use crate::mesh::{FaceRef, Workspace, dense};
use tetdb_base::storage::{Pages, Sorted, Sorter, StorageError, sort_record};
use tetdb_schema::page::NONE;

sort_record! {
    /// A required face of the child.
    struct RequiredFace {
        /// Ascending.
        vertices: [u32; 3],
        /// A [`FaceRef`].
        place: u32,
    }
}

sort_record! {
    /// A facet or interface face of the host.
    struct Claim {
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
    split: &mut Split<P, Q, R>,
    space: &Workspace,
) -> Result<(), StorageError> {
    let mut claims = Sorter::new(space.dir, space.memory / 3);
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
        split.claim(&mut claims, facet.vertices, FACET, n)?;
    }
    for n in 0..split.host.n_interface_faces() {
        let face = split.host.interface_face(n);
        split.claim(&mut claims, face.vertices, INTERFACE, n)?;
    }
    let mut faces = split.required_faces(space)?.peekable();
    for claim in claims.finish()? {
        let claim = claim?;
        if !claim.in_core {
            split.inherit_face(claim, None);
            continue;
        }
        let is_before = |face: &RequiredFace| face.vertices < claim.vertices;
        while let Some(face) = faces.next_if(|f| f.as_ref().map_or(true, is_before)) {
            face?;
        }
        let Some(Ok(face)) = faces.peek() else {
            continue;
        };
        if face.vertices == claim.vertices {
            split.inherit_face(claim, Some(FaceRef(face.place)));
        }
    }
    Ok(())
}

impl<P: Pages, Q: Pages, R: Pages> Split<'_, P, Q, R> {
    /// The child's numbers of three vertices of a face, and whether the core has them all; `None` when the child lacks one.
    fn known_face(&mut self, vertices: [u32; 3]) -> Option<([u32; 3], bool)> {
        let mut numbers = [NONE; 3];
        let mut in_core = true;
        for (number, v) in numbers.iter_mut().zip(vertices) {
            *number = self.host.scratch(dense(v));
            if *number & SHARED == 0 {
                // All of its tetrahedra are on its side, and so are those of the face.
                if in_core && !self.is_beside(v) {
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

    fn claim(
        &mut self,
        claims: &mut Sorter<Claim>,
        vertices: [u32; 3],
        kind: u8,
        number: u32,
    ) -> Result<(), StorageError> {
        let Some((mut vertices, in_core)) = self.known_face(vertices) else {
            return Ok(());
        };
        vertices.sort_unstable();
        claims.push(Claim { vertices, kind, number, in_core })
    }

    /// Makes room behind the host's scratch map for the numbers of vertices without tetrahedra; returns where.
    fn loose_vertices(&mut self) -> u32 {
        let base = self.host_base + dense(self.host.tet_ids_end());
        for n in 0..self.host_base {
            self.host.set_scratch(base + n, NONE);
        }
        base
    }

    /// The child's number of a vertex of a facet that has no tetrahedra.
    fn loose_vertex(&mut self, base: u32, v: u32) -> u32 {
        if let Some(([number, ..], _)) = self.known_face([v; 3]) {
            return number;
        }
        let known = self.host.scratch(base + dense(v));
        if known != NONE {
            return known;
        }
        let number = self.add_host_vertex(v);
        self.host.set_scratch(base + dense(v), number);
        number
    }

    /// The child's required faces whose three vertices the core has.
    fn required_faces(&mut self, space: &Workspace) -> Result<Sorted<RequiredFace>, StorageError> {
        let mut faces = Sorter::new(space.dir, space.memory / 3);
        for n in 0..dense(self.core.tet_ids_end()) {
            let number = self.core.scratch(self.core_base + n);
            if number != NONE {
                self.push_required(&mut faces, number)?;
            }
        }
        for k in 0..self.at_core.len() {
            let number = self.at_core[k];
            self.push_required(&mut faces, number)?;
        }
        faces.finish()
    }

    fn push_required(
        &mut self,
        faces: &mut Sorter<RequiredFace>,
        t: u32,
    ) -> Result<(), StorageError> {
        let tet = self.child.tet(t);
        for i in (0..4).filter(|&i| tet.is_required(i)) {
            let mut vertices = tet.face(i);
            vertices.sort_unstable();
            let place = FaceRef::new(t, i).0;
            faces.push(RequiredFace { vertices, place })?;
        }
        Ok(())
    }

    /// Takes a facet or interface face over; `face` is where it is, for one that was at the core.
    fn inherit_face(&mut self, claim: Claim, face: Option<FaceRef>) {
        let known = "claimed with its vertices";
        if claim.kind == FACET {
            let mut facet = self.host.facet(claim.number);
            facet.vertices = self.known_face(facet.vertices).expect(known).0;
            self.child.add_facet(facet);
            return;
        }
        let mut kept = self.host.interface_face(claim.number);
        kept.vertices = self.known_face(kept.vertices).expect(known).0;
        self.child.add_interface_face(kept);
        // What was copied out of the host is frozen already.
        if let Some(face) = face {
            let (region, _) = self.child.tet_attribute(face.tet());
            self.child.set_tet_attribute(face.tet(), region, FROZEN);
        }
    }
}
