//! A point that divides an edge.

use crate::geom::Point;

/// A point to insert.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub point: Point,
    pub h: f32,
    /// A tetrahedron that had the divided edge.
    pub tet: u32,
    /// Length class (long first), then the position along the curve.
    pub key: u64,
}
