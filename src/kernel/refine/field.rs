//! What saturation is asked for: wanted lengths, and where points may go.

use super::placement::PlacementRule;
use crate::mesh::End;
use tetdb_base::geom::{Aabb, Point};

/// Where the wanted length at a point that divides an edge comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lengths {
    /// From the size field.
    #[default]
    Field,
    /// Interpolated between the ends of the edge, hence from the vertices of the coarse mesh: the paper's way, section 1.1.
    /// Kept for comparison: what the vertices of the surface do not know is never seen.
    Ends,
}

/// What is wanted where, and where points may go.
pub struct Field<'a> {
    /// How the wanted length of an edge is found.
    pub lengths: Lengths,
    /// Wanted edge length at a position.
    pub h: &'a (dyn Fn(Point) -> f64 + Sync),
    /// Where points may go.
    pub place: &'a dyn PlacementRule,
    /// Box of the mesh, which fixes the order along the curve.
    pub bounds: Aabb,
}

impl Field<'_> {
    /// Whether points may go near a tetrahedron with these corners.
    #[inline(always)]
    pub(crate) fn reaches(&self, [a, b, c, d]: &[End; 4]) -> bool {
        // Spelled out: `map` on arrays is not always inlined.
        let points = [a.point, b.point, c.point, d.point];
        !self.place.is_partial() || self.place.reaches(&points, &[a.h, b.h, c.h, d.h])
    }
}
