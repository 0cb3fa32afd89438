//! The one convention of tetrahedra, and their record.
//!
//! `tetdb_base::shape` draws the convention. A face reference is 4 * tetrahedron + face.

pub use tetdb_base::shape::{EDGE_OF, EDGES, FACES};
use tetdb_schema::page::{NONE, Slot, u32_le};

/// Bit of a node: the face opposite it is required.
pub const REQUIRED: u32 = 1 << 31;
/// Bit of a node: see the byte page; node 0 marks the cavity, node 1 "examined", 2 and 3 are free.
pub const MARK: u32 = 1 << 30;

/// Flag of a tetrahedron's attribute: it has a face on an interface, and no later vertex may destroy it.
pub const FROZEN: u32 = 1;

/// Meaning of the [`MARK`] of each node: four notes about a tetrahedron, one owner each.
pub mod mark {
    /// It is in the cavity being gathered. Owner: the Delaunay kernel, down between its calls.
    pub const IN_CAVITY: usize = 0;
    /// It was examined, and nothing near it changed since. Owner: refinement, then optimization.
    pub const EXAMINED: usize = 1;
    /// It stays in the cavity being shrunk. Owner: the Delaunay kernel, down between its calls.
    pub const STAYS: usize = 2;
    /// Dear operations were tried on it. Owner: optimization.
    pub const RESCUED: usize = 3;
}
/// The vertex id of a node.
pub const VERTEX_MASK: u32 = MARK - 1;

/// A face of a tetrahedron, `4 * tet + face`, or [`FaceRef::NONE`].
#[derive(
    Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, bytemuck::Pod, bytemuck::Zeroable,
)]
#[repr(transparent)]
pub struct FaceRef(pub u32);

impl FaceRef {
    /// No face: beyond the hull of the mesh.
    pub const NONE: Self = Self(NONE);

    /// Face `face` of tetrahedron `tet`.
    #[inline]
    pub const fn new(tet: u32, face: usize) -> Self {
        Self(tet << 2 | face as u32)
    }
    /// The tetrahedron.
    #[inline]
    pub const fn tet(self) -> u32 {
        self.0 >> 2
    }
    /// The face's number in it.
    #[inline]
    pub const fn face(self) -> usize {
        (self.0 & 3) as usize
    }
    /// Returns whether there is a tetrahedron.
    #[inline]
    pub const fn exists(self) -> bool {
        self.0 != NONE
    }
}

/// A tetrahedron's record, copied out of its page.
#[derive(Clone, Copy, PartialEq, Eq, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Tet {
    /// Vertex ids with flag bits.
    pub node: [u32; 4],
    /// The face on the other side of each face.
    pub neighbor: [FaceRef; 4],
}

impl Tet {
    /// The four vertex ids, flags removed.
    #[inline]
    pub fn vertices(&self) -> [u32; 4] {
        let [a, b, c, d] = self.node;
        [a & VERTEX_MASK, b & VERTEX_MASK, c & VERTEX_MASK, d & VERTEX_MASK]
    }
    /// Vertex id `i`.
    #[inline]
    pub fn vertex(&self, i: usize) -> u32 {
        self.node[i & 3] & VERTEX_MASK
    }
    /// Returns whether face `i` is required.
    #[inline]
    pub fn is_required(&self, i: usize) -> bool {
        self.node[i] & REQUIRED != 0
    }
    /// The required faces, a bit for each.
    #[inline]
    pub fn required_faces(&self) -> u8 {
        (0..4).fold(0, |bits, i| bits | u8::from(self.is_required(i)) << i)
    }
    /// The vertices of face `i`, counter-clockwise seen from outside.
    #[inline]
    pub fn face(&self, i: usize) -> [u32; 3] {
        let [a, b, c] = FACES[i & 3];
        [self.vertex(a), self.vertex(b), self.vertex(c)]
    }
    /// The local number of vertex `v`, if it has it.
    #[inline]
    pub fn local(&self, v: u32) -> Option<usize> {
        (0..4).find(|&i| self.vertex(i) == v)
    }
    /// Returns whether the slot is in use.
    #[inline]
    pub fn is_live(&self) -> bool {
        self.node[0] != NONE
    }

    /// Opens a record.
    #[inline(always)]
    pub fn from_slot(slot: &Slot) -> Self {
        let w = |i: usize| slot[i].to_native();
        Self {
            node: [w(0), w(1), w(2), w(3)],
            neighbor: [FaceRef(w(4)), FaceRef(w(5)), FaceRef(w(6)), FaceRef(w(7))],
        }
    }
    /// Packs the record.
    #[inline(always)]
    pub fn to_slot(self) -> Slot {
        let (n, m) = (self.node, self.neighbor);
        [
            u32_le::from_native(n[0]),
            u32_le::from_native(n[1]),
            u32_le::from_native(n[2]),
            u32_le::from_native(n[3]),
            u32_le::from_native(m[0].0),
            u32_le::from_native(m[1].0),
            u32_le::from_native(m[2].0),
            u32_le::from_native(m[3].0),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tetdb_base::geom::{Point, orient};

    #[test]
    fn faces_are_seen_from_outside_and_edges_agree() {
        let v = [Point::ZERO, Point::X, Point::Y, Point::Z];
        for (i, f) in FACES.iter().enumerate() {
            // Seen from outside counter-clockwise: the opposite vertex makes it positive with the face leading.
            assert!(orient(v[f[0]], v[f[1]], v[f[2]], v[i]) < 0.0);
        }
        for (e, [a, b]) in EDGES.into_iter().enumerate() {
            assert_eq!((EDGE_OF[a][b], EDGE_OF[b][a]), (e, e));
            let [c, d] = EDGES[5 - e];
            assert_eq!(a + b + c + d, 6);
        }
    }
}
