//! Surfaces that divide space in two.

use tetdb_base::geom::Point;

/// A surface that cuts a sub-domain. Everything but the choice of a plane uses only this trait.
pub trait CuttingSurface {
    /// Signed distance of `p`, in input units: negative on the low side.
    fn distance(&self, p: Point) -> f64;

    /// Unit normal at `p`, pointing to the high side.
    fn normal(&self, p: Point) -> Point;

    /// The parameters between which the segment from `a` to `b` may be nearer than `width`; `None` if it never is.
    fn band(&self, a: Point, b: Point, width: f64) -> Option<[f64; 2]>;

    /// The parameter at which the segment from `a` to `b` is nearest.
    fn nearest(&self, a: Point, b: Point) -> f64;
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

    fn band(&self, a: Point, b: Point, width: f64) -> Option<[f64; 2]> {
        let (s, t) = (self.distance(a), self.distance(b));
        let slope = t - s;
        if slope == 0.0 {
            return (s.abs() <= width).then_some([0.0, 1.0]);
        }
        let (u, v) = ((-width - s) / slope, (width - s) / slope);
        let (from, to) = (u.min(v).max(0.0), u.max(v).min(1.0));
        (from <= to).then_some([from, to])
    }

    fn nearest(&self, a: Point, b: Point) -> f64 {
        let (s, t) = (self.distance(a), self.distance(b));
        if s == t {
            return 0.5;
        }
        (s / (s - t)).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_band_of_an_edge_is_where_it_is_near() {
        let plane = Plane { normal: Point::Z, offset: 1.0 };
        let (a, b) = (Point::ZERO, Point::new(3.0, 0.0, 4.0));
        let [from, to] = plane.band(a, b, 0.5).expect("it crosses the band");
        for (u, distance) in [(from, -0.5), (to, 0.5), (plane.nearest(a, b), 0.0)] {
            assert!((plane.distance(a + (b - a) * u) - distance).abs() < 1e-12);
        }
        assert_eq!(plane.band(a, Point::X, 0.5), None);
        assert_eq!(plane.band(Point::Z, Point::Z + Point::X, 0.5), Some([0.0, 1.0]));
    }
}
