//! Records as plain values, of working slots and of sealed chunks.

use crate::ids::{SubdomainId, VertexId};
use crate::page::{NONE, Slot, u32_le};

/// A tetrahedron of a working page, as stored: marks and required bits are still in the nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WorkingTet {
    /// Vertex ids with the required bits of the faces and the mark of the tetrahedron.
    pub node: [u32; 4],
    /// Face references across the four faces.
    pub neighbor: [u32; 4],
}

/// Region and flags of a working tetrahedron.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct TetAttribute {
    /// Number of its region.
    pub region: u32,
    /// Bits of the mesher; bit 0: frozen.
    pub flags: u32,
}

/// A vertex of a working page.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorkingVertex {
    /// Position.
    pub point: [f64; 3],
    /// Wanted edge length; 0 if not yet computed.
    pub h: f32,
    /// A tetrahedron that has the vertex, or [`NONE`].
    pub v2t: u32,
}

/// A facet of a working page.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct WorkingFacet {
    /// Vertex ids in the order of the input triangle.
    pub vertices: [u32; 3],
    /// Number of its label.
    pub label: u32,
    /// Number of the input triangle.
    pub triangle: u64,
    /// In front (where the normal points to) and behind.
    pub regions: [u32; 2],
}

impl WorkingTet {
    /// The words of a slot.
    pub fn from_slot(slot: &Slot) -> Self {
        let [a, b, c, d, e, f, g, h] = slot.map(u32_le::to_native);
        Self { node: [a, b, c, d], neighbor: [e, f, g, h] }
    }

    /// The inverse of [`WorkingTet::from_slot`].
    pub fn to_slot(self) -> Slot {
        let ([a, b, c, d], [e, f, g, h]) = (self.node, self.neighbor);
        [a, b, c, d, e, f, g, h].map(u32_le::from_native)
    }
}

impl TetAttribute {
    /// Attribute `place`, 0..4, of a slot.
    pub fn from_slot(slot: &Slot, place: usize) -> Self {
        Self { region: slot[2 * place].to_native(), flags: slot[2 * place + 1].to_native() }
    }
}

impl WorkingVertex {
    /// The words of a slot.
    pub fn from_slot(slot: &Slot) -> Self {
        let w = slot.map(u32_le::to_native);
        let axis = |i: usize| f64::from_bits(u64::from(w[i]) | u64::from(w[i + 1]) << 32);
        Self { point: [axis(0), axis(2), axis(4)], h: f32::from_bits(w[6]), v2t: w[7] }
    }

    /// The inverse of [`WorkingVertex::from_slot`].
    pub fn to_slot(self) -> Slot {
        let [x, y, z] = self.point.map(|c| [c.to_bits() as u32, (c.to_bits() >> 32) as u32]);
        [x[0], x[1], y[0], y[1], z[0], z[1], self.h.to_bits(), self.v2t].map(u32_le::from_native)
    }
}

impl WorkingFacet {
    /// The words of a slot.
    pub fn from_slot(slot: &Slot) -> Self {
        let w = slot.map(u32_le::to_native);
        Self {
            vertices: [w[0], w[1], w[2]],
            label: w[3],
            triangle: u64::from(w[4]) | u64::from(w[5]) << 32,
            regions: [w[6], w[7]],
        }
    }

    /// The inverse of [`WorkingFacet::from_slot`].
    pub fn to_slot(self) -> Slot {
        let [a, b, c] = self.vertices;
        let triangle = [self.triangle as u32, (self.triangle >> 32) as u32];
        let [front, behind] = self.regions;
        [a, b, c, self.label, triangle[0], triangle[1], front, behind].map(u32_le::from_native)
    }
}

/// Places of the vertices of face `i`, which lies opposite vertex `i`, counter-clockwise seen from outside.
pub const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// A tetrahedron of a sealed sub-domain; its number is its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct SealedTet {
    /// Vertex numbers in the sub-domain; positive volume in this order.
    pub nodes: [u32; 4],
    /// Number of its region.
    pub region: u32,
}

impl SealedTet {
    /// The tetrahedron with its nodes evenly permuted: the smallest vertex is first, and the second is the smallest of the other three.
    #[must_use]
    pub fn rotated(self) -> Self {
        // For each leading vertex, an even permutation that brings it to the front.
        const LEAD: [[usize; 4]; 4] = [[0, 1, 2, 3], [1, 0, 3, 2], [2, 0, 1, 3], [3, 0, 2, 1]];
        let n = self.nodes;
        let mut lead = 0;
        for i in 1..4 {
            if n[i] < n[lead] {
                lead = i;
            }
        }
        let [a, b, c, d] = LEAD[lead];
        let [a, b, c, d] = [n[a], n[b], n[c], n[d]];
        // The order of the three is as good as random: a table avoids mispredicted branches.
        let nodes = [[a, b, c, d], [a, c, d, b], [a, d, b, c]];
        let later = usize::from(b >= c) | usize::from(b >= d);
        let nodes = nodes[later * (1 + usize::from(c >= d))];
        Self { nodes, ..self }
    }
}

/// A tetrahedron of a coarse snapshot, the working mesh a sub-domain is meshed from; its number is its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct CoarseTet {
    /// Vertex numbers in the snapshot, in the working mesh's order.
    pub nodes: [u32; 4],
    /// Bits 0..4: face i is required. Bits 4..8: the mark of node i.
    pub bits: u8,
    /// Number of its region.
    pub region: u32,
    /// Flags of its attribute.
    pub flags: u32,
}

/// A vertex of a coarse snapshot; its number is its place. Its wanted length follows from the size field.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct CoarseVertex {
    /// Position.
    pub point: [f64; 3],
    /// The words of its attribute: tag (and the cut it lies on), index within the owner.
    pub tag: u32,
    /// Number within the owner.
    pub owner: u32,
}

/// An interface face of a coarse snapshot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct CoarseFace {
    /// Vertex numbers in the snapshot, in the working mesh's order.
    pub vertices: [u32; 3],
    /// Number of the cut, from 1.
    pub cut: u32,
    /// Number of the face in the cut.
    pub index: u32,
    /// Side of the cut where the snapshot is: 0 low, 1 high.
    pub side: u32,
}

/// Tags of vertices.
pub mod tag {
    /// Added inside; may move and vanish.
    pub const FREE: u32 = 0;
    /// A vertex of the input surface.
    pub const SURFACE: u32 = 1;
    /// On an interface: final since its cut.
    pub const INTERFACE: u32 = 2;
    /// Added by boundary recovery.
    pub const STEINER: u32 = 3;
    /// A corner of the box around everything, while the coarse mesh is built.
    pub const ENCLOSING: u32 = 4;
}

/// A vertex of a sealed sub-domain; its number is its place.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct SealedVertex {
    /// Position.
    pub point: [f64; 3],
    /// Wanted edge length.
    pub h: f32,
    /// One of [`tag`].
    pub tag: u32,
    /// Its lasting name, as [`VertexId::number`].
    pub id: u64,
}

impl SealedVertex {
    /// The id of a vertex that `subdomain` itself owns, at position `local`.
    pub fn own_id(subdomain: SubdomainId, local: u32) -> u64 {
        VertexId { owner: crate::ids::Owner::Subdomain(subdomain), index: local }.number()
    }
}

/// An input triangle that appears in a sealed sub-domain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct SealedFacet {
    /// Vertex numbers in the sub-domain, in the order of the input triangle.
    pub vertices: [u32; 3],
    /// Number of its label.
    pub label: u32,
    /// Number of the input triangle.
    pub triangle: u64,
    /// In front (where the normal points to) and behind.
    pub regions: [u32; 2],
    /// The tetrahedron on each side, or [`NONE`] if that side is not filled or belongs to another sub-domain.
    pub tets: [u32; 2],
}

/// A face of a sealed sub-domain shared with another one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct InterfaceFace {
    /// Vertex numbers in this sub-domain, counter-clockwise seen from outside it.
    pub vertices: [u32; 3],
    /// Number of the cut, 1.., and of the face in it: the same in both sub-domains.
    pub cut: u32,
    /// Number of the face in the cut.
    pub index: u32,
    /// The sub-domain on the other side.
    pub other: u32,
    /// The tetrahedron on this side.
    pub tet: u32,
}

/// Stands for no tetrahedron.
pub const NO_TET: u32 = NONE;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slots_and_records_are_the_same_thing() {
        let slot: Slot = std::array::from_fn(|i| u32_le::from_native(0x4100_0000 + 77 * i as u32));
        assert_eq!(WorkingTet::from_slot(&slot).to_slot(), slot);
        assert_eq!(WorkingVertex::from_slot(&slot).to_slot(), slot);
        assert_eq!(WorkingFacet::from_slot(&slot).to_slot(), slot);
        assert_eq!(TetAttribute::from_slot(&slot, 1).region, slot[2].to_native());
    }

    #[test]
    fn rotations_are_even() {
        let parity = |p: [u32; 4]| {
            let mut odd = false;
            for i in 0..4 {
                for j in 0..i {
                    odd ^= p[j] > p[i];
                }
            }
            odd
        };
        for code in 0..256u32 {
            let nodes = [code & 3, code >> 2 & 3, code >> 4 & 3, code >> 6 & 3];
            let mut sorted = nodes;
            sorted.sort_unstable();
            if sorted != [0, 1, 2, 3] {
                continue;
            }
            let turned = SealedTet { nodes, region: 0 }.rotated().nodes;
            assert_eq!(turned[..2], [0, 1]);
            assert_eq!(parity(turned), parity(nodes));
        }
    }
}
