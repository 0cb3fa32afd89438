//! Where points may go.

use tetdb_base::geom::Point;

/// A part of space in which tetrahedra are divided.
pub trait PlacementRule: Sync {
    /// Whether [`PlacementRule::reaches`] is worth asking: most tetrahedra are out of reach.
    fn is_partial(&self) -> bool {
        false
    }

    /// Whether points near this tetrahedron may be of use; `sizes` are those of its corners.
    fn reaches(&self, _points: &[Point; 4], _sizes: &[f32; 4]) -> bool {
        true
    }

    /// True if this tetrahedron is tried again in wider regions when no block could divide it.
    fn needs(&self, _points: &[Point; 4], _sizes: &[f32; 4]) -> bool {
        true
    }

    /// The length for which coarse points around the part are spread, where the wanted length is `h`: it grows away from the part.
    fn coarse_length(&self, _p: Point, h: f64) -> f64 {
        h
    }

    /// Whether a point with that wanted length is to be tried. Asked first: what it refuses costs nothing and is not counted.
    fn admits(&self, p: Point, h: f64) -> bool;

    /// Whether a point that could be inserted is refused all the same; such points are counted.
    fn forbids(&self, p: Point, h: f64) -> bool;
}

/// Everywhere in the mesh.
#[derive(Clone, Copy, Debug, Default)]
pub struct Everywhere;

impl PlacementRule for Everywhere {
    fn admits(&self, _: Point, _: f64) -> bool {
        true
    }
    fn forbids(&self, _: Point, _: f64) -> bool {
        false
    }
}
