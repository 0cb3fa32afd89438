//! Counts of what saturation tried and did.

use crate::optimize::OperationCounts;

/// Counts of one saturation in blocks.
#[derive(Clone, Copy, Debug, Default)]
pub struct BlockReport {
    /// Points tried and inserted.
    pub refine: RefineReport,
    /// Operations on bad tetrahedra.
    pub operations: OperationCounts,
}

/// Counts of one saturation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RefineReport {
    /// Most rounds of a block.
    pub rounds: u32,
    /// Points tried.
    pub candidates: u64,
    /// Points inserted.
    pub inserted: u64,
    /// Too near to a vertex or a required face.
    pub near: u64,
    /// No cavity that keeps the required faces, or a walk that left the mesh.
    pub blocked: u64,
    /// Put off by a block for a neighbor, because they reach out of its margin.
    pub put_off: u64,
    /// Tetrahedra whose points no block had room for in its margin, not even in a wide one.
    pub unexamined: u64,
    /// Refused for nothing but their place.
    pub out_of_place: u64,
    /// Cavities, made star-shaped and allowed where they lie, that held a tetrahedron frozen beside an interface.
    pub frozen_hits: u64,
    /// Tetrahedra with two required faces or more in the end: none of their edges could be divided. Not counted where
    /// only a part of the mesh is divided.
    pub over_constrained: u64,
}

impl RefineReport {
    /// Adds the counts of another part of the mesh.
    pub fn add(&mut self, other: &Self) {
        self.rounds = self.rounds.max(other.rounds);
        self.candidates += other.candidates;
        self.inserted += other.inserted;
        self.near += other.near;
        self.blocked += other.blocked;
        self.put_off += other.put_off;
        self.unexamined += other.unexamined;
        self.out_of_place += other.out_of_place;
        self.frozen_hits += other.frozen_hits;
        self.over_constrained += other.over_constrained;
    }
}
