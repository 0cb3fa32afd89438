//! Bricks: the unit in which blocks hand parts of the mesh to each other.

use tetdb_schema::page::u32_le;

use super::flat::{Attribute, Vertex};
use crate::mesh::{FaceRef, Tet};
use tetdb_base::geom::Point;
use tetdb_base::storage::{Shelf, Shelved};

/// Bits of a vertex's or a tetrahedron's slot in its brick. The bits above, in a reference, are a place in the
/// table [`Brick::near`] of the brick that holds the reference.
pub(super) const SLOT_BITS: u32 = 15;
/// The slot of a reference.
pub(super) const SLOT_MASK: u32 = (1 << SLOT_BITS) - 1;

/// Vertices and tetrahedra of a cell of the partition.
///
/// A vertex lies in the brick of the place where it was added, for ever and in the same slot. A tetrahedron lies in the
/// brick of one of its vertices.
#[derive(Clone, Debug, Default)]
pub(super) struct Brick {
    /// Numbers of the bricks that the tetrahedra refer to.
    pub near: Vec<u32>,
    /// Vertices and neighbors are references: place in `near`, then slot.
    pub tets: Vec<Tet>,
    pub attributes: Vec<Attribute>,
    pub vertices: Vec<Vertex>,
    /// Tetrahedra that division has not examined yet.
    pub unexamined: u32,
}

/// All bricks. Those that a task does not change are shared with it.
pub(super) type Bricks = Shelf<Brick>;

impl Shelved for Brick {
    fn bytes(&self) -> usize {
        self.near.len() * 4 + self.tets.len() * 40 + self.vertices.len() * 32
    }

    fn write(&self, out: &mut Vec<u8>) {
        // Most bricks lie in one region.
        let common = self.attributes.first().copied().unwrap_or_default();
        let n_attributes = match self.attributes.iter().all(|&a| a == common) {
            true => self.attributes.len().min(1),
            false => self.attributes.len(),
        };
        let counts = [self.near.len(), self.tets.len(), self.vertices.len(), n_attributes];
        let mut put = |word: u32| out.extend_from_slice(&word.to_le_bytes());
        counts.into_iter().for_each(|n| put(n as u32));
        put(self.unexamined);
        self.near.iter().for_each(|&n| put(n));
        for &(region, flags) in &self.attributes[..n_attributes] {
            put(region);
            put(flags);
        }
        for tet in &self.tets {
            tet.to_slot().into_iter().for_each(|word| put(word.to_native()));
        }
        for vertex in &self.vertices {
            for x in vertex.point.to_array() {
                put(x.to_bits() as u32);
                put((x.to_bits() >> 32) as u32);
            }
            put(vertex.words()[0]);
            put(vertex.words()[1]);
        }
    }

    fn read(bytes: &[u8]) -> Self {
        let mut words = bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        let mut next = || words.next().expect("all of it was written");
        let [n_near, n_tets, n_vertices, n_attributes, unexamined] = [(); 5].map(|()| next());
        let near = (0..n_near).map(|_| next()).collect();
        let mut attributes: Vec<Attribute> = (0..n_attributes).map(|_| (next(), next())).collect();
        if let [common] = attributes[..] {
            attributes.resize(n_tets as usize, common);
        }
        let tets = (0..n_tets)
            .map(|_| Tet::from_slot(&[(); 8].map(|()| u32_le::from_native(next()))))
            .collect();
        let vertices = (0..n_vertices)
            .map(|_| {
                let mut coordinate = || f64::from_bits(u64::from(next()) | u64::from(next()) << 32);
                let point = Point::new(coordinate(), coordinate(), coordinate());
                Vertex::of_words(point, [next(), next()])
            })
            .collect();
        Self { near, tets, attributes, vertices, unexamined }
    }
}

impl Brick {
    /// The reference to a slot of a brick, which is added to the table if it is not there.
    pub fn refer(&mut self, to: Slot) -> u32 {
        let known = self.near.iter().position(|&n| n == to.brick);
        let at = known.unwrap_or_else(|| {
            self.near.push(to.brick);
            self.near.len() - 1
        });
        (at as u32) << SLOT_BITS | to.slot
    }

    /// The slot that a reference names.
    #[inline(always)]
    pub fn resolve(&self, reference: u32) -> Slot {
        let brick = self.near[(reference >> SLOT_BITS) as usize];
        Slot { brick, slot: reference & SLOT_MASK }
    }

    /// Where the neighbor across a face is, if there is one.
    #[inline(always)]
    pub fn across(&self, face: FaceRef) -> Option<Slot> {
        face.exists().then(|| self.resolve(face.tet()))
    }
}

/// A vertex or a tetrahedron: number of its brick, and slot.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Slot {
    pub brick: u32,
    pub slot: u32,
}
