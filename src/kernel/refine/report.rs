//! Counts of what saturation tried and did.

/// Counts of one saturation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RefineReport {
    /// Passes over the mesh.
    pub passes: u32,
    /// Points tried.
    pub candidates: u64,
    /// Points inserted.
    pub inserted: u64,
    /// Of those, inside of pieces of the pattern set in whole.
    pub set_in: u64,
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
    /// Tetrahedra with two required faces or more when the passes ended: none of their edges could be divided. Not counted where
    /// only a part of the mesh is divided.
    pub over_constrained: u64,
}

impl RefineReport {
    /// Adds the counts of another part of the mesh.
    pub fn add(&mut self, other: &Self) {
        self.passes = self.passes.max(other.passes);
        self.candidates += other.candidates;
        self.inserted += other.inserted;
        self.set_in += other.set_in;
        self.near += other.near;
        self.blocked += other.blocked;
        self.put_off += other.put_off;
        self.unexamined += other.unexamined;
        self.out_of_place += other.out_of_place;
        self.frozen_hits += other.frozen_hits;
        self.over_constrained += other.over_constrained;
    }
}
