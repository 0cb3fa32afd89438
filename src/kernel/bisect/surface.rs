//! Surfaces that divide space in two.

use tetdb_base::geom::Point;

/// A surface that cuts a sub-domain. Everything but the choice of a plane uses only this trait.
pub trait CuttingSurface {
    /// Signed distance of `p`, in input units: negative on the low side.
    fn distance(&self, p: Point) -> f64;

    /// Unit normal at `p`, pointing to the high side.
    fn normal(&self, p: Point) -> Point;
}

/// The plane `normal · x = offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Of length 1.
    pub normal: Point,
    /// Signed distance from the origin, in input units.
    pub offset: f64,
}

impl CuttingSurface for Plane {
    #[inline]
    fn distance(&self, p: Point) -> f64 {
        self.normal.dot(p) - self.offset
    }

    #[inline]
    fn normal(&self, _: Point) -> Point {
        self.normal
    }
}
