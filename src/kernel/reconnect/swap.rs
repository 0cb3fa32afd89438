//! The flip 2-3: a face replaced by the edge that joins the two vertices opposite it.

use super::attribute::Inherited;
use crate::mesh::anatomy::{FACES, REQUIRED};
use crate::mesh::{FaceRef, Mesh, Tet};
use tetdb_base::geom::{Point, orient};
use tetdb_base::storage::Pages;

/// The two tetrahedra of a face, copied out of the mesh.
///
/// ```text
///       q          face x y z, counter-clockwise seen from q; below it p, above it q
///      /|\         before: (p's) and (q's)
///     x-y-z        after:  (p q x y) (p q y z) (p q z x)
///      \|/
///       p
/// ```
#[derive(Clone, Copy, Debug)]
pub struct FaceSwap {
    /// Id of the vertex on one side of the face.
    pub p: u32,
    /// Id of the vertex on the other side.
    pub q: u32,
    /// Counter-clockwise seen from q.
    pub face: [u32; 3],
    /// The face seen from the tetrahedron of p, then from that of q.
    sides: [FaceRef; 2],
    records: [Tet; 2],
}

impl FaceSwap {
    /// Gathers the two sides of a face; `None` on the hull and for a required face.
    #[inline]
    pub fn gather<P: Pages>(mesh: &mut Mesh<P>, face: FaceRef) -> Option<Self> {
        let record = mesh.tet(face.tet());
        Self::gather_from(mesh, face, &record)
    }

    /// [`FaceSwap::gather`] for a caller with the record of the face's tetrahedron.
    #[inline]
    pub fn gather_from<P: Pages>(mesh: &mut Mesh<P>, face: FaceRef, record: &Tet) -> Option<Self> {
        let i = face.face();
        let across = record.neighbor[i];
        if !across.exists() || record.is_required(i) {
            return None;
        }
        let other = mesh.tet(across.tet());
        Some(Self {
            p: record.vertex(i),
            q: other.vertex(across.face()),
            face: record.face(i),
            sides: [face, across],
            records: [*record, other],
        })
    }

    /// Positions of p, q and the face's vertices.
    #[inline]
    pub fn points<P: Pages>(&self, mesh: &mut Mesh<P>) -> (Point, Point, [Point; 3]) {
        let face = self.face.map(|v| mesh.point(v));
        (mesh.point(self.p), mesh.point(self.q), face)
    }

    /// Returns whether the three new tetrahedra are exactly positive: p q passes through the inside of the face.
    #[inline]
    pub fn is_positive(p: Point, q: Point, [x, y, z]: [Point; 3]) -> bool {
        orient(p, q, x, y) > 0.0 && orient(p, q, y, z) > 0.0 && orient(p, q, z, x) > 0.0
    }

    /// Applies the swap; returns the new tetrahedra `(p q x y) (p q y z) (p q z x)`.
    ///
    /// Requires [`FaceSwap::is_positive`] and the two records as they are in the mesh now.
    pub fn apply<P: Pages>(&self, mesh: &mut Mesh<P>) -> [u32; 3] {
        let [low, high] = self.sides;
        let old = [(low.tet(), self.records[0]), (high.tet(), self.records[1])];
        let inherited = Inherited::read(mesh, old.into_iter().map(|(t, r)| (t, r.vertices())));
        let new = [low.tet(), high.tet(), mesh.take_tet()];
        for k in 0..3 {
            let (x, y, z) = (self.face[k], self.face[(k + 1) % 3], self.face[(k + 2) % 3]);
            let mut tet = Tet {
                node: [self.p, self.q, x, y],
                // Opposite x: p q y, shared with the next; opposite y: p q x, shared with the one before.
                neighbor: [
                    FaceRef::NONE,
                    FaceRef::NONE,
                    FaceRef::new(new[(k + 1) % 3], 3),
                    FaceRef::new(new[(k + 2) % 3], 2),
                ],
            };
            // Opposite p is the face of q's side that lacks z, and the other way around.
            for (face, side) in [(0, 1), (1, 0)] {
                let record = &self.records[side];
                let lacks = record
                    .local(z)
                    .unwrap_or_else(|| panic!("face of {} and {} misses {z}", self.p, self.q));
                tet.node[face] |= record.node[lacks] & REQUIRED;
                let across = record.neighbor[lacks];
                tet.neighbor[face] = across;
                if across.exists() {
                    mesh.set_neighbor(across, FaceRef::new(new[k], face));
                }
            }
            mesh.set_tet(new[k], tet);
            inherited.write(mesh, new[k], tet.vertices());
            mesh.set_tet_of(x, new[k]);
        }
        mesh.set_tet_of(self.p, new[0]);
        mesh.set_tet_of(self.q, new[0]);
        new
    }
}

const _: () = assert!(FACES[0][0] == 1 && FACES[3][1] == 2);
