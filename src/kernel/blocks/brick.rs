//! Bricks: the unit in which blocks hand parts of the mesh to each other.

use super::flat::{Attribute, Vertex};
use crate::mesh::{FaceRef, Tet};
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
    /// True if it may hold a tetrahedron that is to be mended.
    pub to_mend: bool,
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
        let [near, tets, vertices, attributes] = counts.map(|n| n as u32);
        // A length and an order in which all records lie aligned in an aligned buffer.
        let head: Head =
            [near, tets, vertices, attributes, self.unexamined, u32::from(self.to_mend)];
        out.extend_from_slice(bytemuck::cast_slice(&head));
        out.extend_from_slice(bytemuck::cast_slice(&self.vertices));
        out.extend_from_slice(bytemuck::cast_slice(&self.tets));
        out.extend_from_slice(bytemuck::cast_slice(&self.near));
        for &(region, flags) in &self.attributes[..n_attributes] {
            out.extend_from_slice(bytemuck::cast_slice(&[region, flags]));
        }
    }

    fn read(bytes: &[u8]) -> Self {
        let mut rest = bytes;
        let head = records::<Head>(&mut rest, 1)[0];
        let [n_near, n_tets, n_vertices, n_attributes, unexamined, to_mend] = head;
        let vertices = records(&mut rest, n_vertices);
        let tets = records(&mut rest, n_tets);
        let near = records(&mut rest, n_near);
        let pairs: Vec<[u32; 2]> = records(&mut rest, n_attributes);
        let mut attributes: Vec<Attribute> = pairs.into_iter().map(|[r, f]| (r, f)).collect();
        if let [common] = attributes[..] {
            attributes.resize(n_tets as usize, common);
        }
        Self { near, tets, attributes, vertices, unexamined, to_mend: to_mend != 0 }
    }
}

/// Counts of references, tetrahedra, vertices and attributes; tetrahedra not examined; whether something is to be mended.
type Head = [u32; 6];

/// Takes `n` records from the front of what was written.
fn records<R: bytemuck::Pod>(rest: &mut &[u8], n: u32) -> Vec<R> {
    let bytes = rest.split_off(..n as usize * size_of::<R>()).expect("all of it was written");
    match bytemuck::try_cast_slice(bytes) {
        Ok(records) => records.to_vec(),
        Err(_) => bytemuck::pod_collect_to_vec(bytes),
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

    /// The brick of the first of a tetrahedron's vertices, by bricks.
    #[inline(always)]
    pub fn home(&self, tet: &Tet) -> u32 {
        let [a, b, c, d] = tet.vertices().map(|v| self.near[(v >> SLOT_BITS) as usize]);
        a.min(b).min(c.min(d))
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
