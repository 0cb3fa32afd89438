//! Corners of some tetrahedra in arrays by coordinate, so that loops over them become vector instructions.

use tetdb_base::geom::{Point, larger};

/// Tetrahedra side by side.
pub(super) const N: usize = 64;

/// Coordinates of four corners.
pub(super) struct Corners([[f64; N]; 12]);

impl Corners {
    pub fn new() -> Self {
        Self([[0.0; N]; 12])
    }

    /// Sets corner `i` of tetrahedron `k`.
    #[inline(always)]
    pub fn set(&mut self, k: usize, i: usize, p: Point) {
        self.0[3 * i][k] = p.x;
        self.0[3 * i + 1][k] = p.y;
        self.0[3 * i + 2][k] = p.z;
    }

    #[inline(always)]
    pub fn corner(&self, k: usize, i: usize) -> Point {
        Point::new(self.0[3 * i][k], self.0[3 * i + 1][k], self.0[3 * i + 2][k])
    }

    /// The edges from the first corner to the others.
    #[inline(always)]
    pub fn edges(&self, k: usize) -> [Point; 3] {
        let a = self.corner(k, 0);
        [self.corner(k, 1) - a, self.corner(k, 2) - a, self.corner(k, 3) - a]
    }
}

/// Six times the volume, and that times twice the circumcenter, both seen from the first corner.
#[inline(always)]
pub(super) fn volume_and_center([u, v, w]: [Point; 3]) -> (f64, Point) {
    let (vw, wu, uv) = (v.cross(w), w.cross(u), u.cross(v));
    (u.dot(vw), vw * u.dot(u) + wu * v.dot(v) + uv * w.dot(w))
}

/// The sum of the coordinates without their signs.
#[inline(always)]
pub(super) fn reach(p: Point) -> f64 {
    p.x.abs() + p.y.abs() + p.z.abs()
}

/// The largest reach.
#[inline(always)]
pub(super) fn reach_of([u, v, w]: [Point; 3]) -> f64 {
    larger(larger(reach(u), reach(v)), reach(w))
}
