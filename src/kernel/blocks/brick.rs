//! Bricks: the unit in which blocks hand parts of the mesh to each other.

use std::sync::Arc;

use super::flat::{Attribute, Vertex};
use crate::mesh::Tet;

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

/// All bricks; those that a task does not change are shared with it.
pub(super) type Bricks = Vec<Arc<Brick>>;

/// A vertex or a tetrahedron: number of its brick, and slot.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Slot {
    pub brick: u32,
    pub slot: u32,
}
