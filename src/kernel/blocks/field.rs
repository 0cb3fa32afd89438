//! The wanted lengths of a saturation, and where points may go.

use super::placement::PlacementRule;
use crate::mesh::End;
use tetdb_base::geom::{Aabb, Point};

/// Wanted lengths, and where points may go.
pub struct Field<'a> {
    /// Wanted edge length at a position.
    pub h: &'a (dyn Fn(Point) -> f64 + Sync),
    /// Where points may go.
    pub place: &'a dyn PlacementRule,
    /// Box of the mesh, which fixes the order along the curve.
    pub bounds: Aabb,
}

impl Field<'_> {
    /// Whether points may go near a tetrahedron with these corners.
    pub(super) fn reaches(&self, corners: &[End; 4]) -> bool {
        let (points, sizes) = (corners.map(|c| c.point), corners.map(|c| c.h));
        !self.place.is_partial() || self.place.reaches(&points, &sizes)
    }
}
