//! Proofs that a tetrahedron and a triangle share no point.
//!
//! A direction along which the two lie apart by more than the rounding of their projections is a proof, whatever the direction. If none of
//! those tried is, the answer is "perhaps".

use tetdb_base::geom::{Aabb, Point};

use super::delaunay::FACES;

/// Rounding of a projection relative to direction and extent: three products, two sums and a difference, seven roundings of 2⁻⁵³.
const ROUNDING: f64 = 4e-15;
/// Edges of a tetrahedron.
const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// A tetrahedron and the directions across its faces.
pub struct Cell {
    origin: Point,
    /// Corners seen from the first.
    corners: [Point; 4],
    bounds: Aabb,
    normals: [Point; 4],
    /// The largest difference of coordinates.
    extent: f64,
}

impl Cell {
    /// The cell of four corners.
    pub fn new(points: [Point; 4]) -> Self {
        let origin = points[0];
        let corners = points.map(|p| p - origin);
        let normals = FACES.map(|[a, b, c]| {
            (corners[b] - corners[a]).cross(corners[c] - corners[a]).normalize_or_zero()
        });
        let extent = corners.iter().fold(0.0f64, |m, c| m.max(c.abs().max_element()));
        Self { origin, corners, bounds: Aabb::around(points), normals, extent }
    }

    /// Whether a face of the cell, or an axis, surely has the box beyond it.
    pub fn is_apart_from_box(&self, b: &Aabb) -> bool {
        if !b.meets(&self.bounds) {
            return true;
        }
        let (middle, half) = ((b.low + b.high) * 0.5 - self.origin, (b.high - b.low) * 0.5);
        let reach = self.extent + (middle.abs() + half).max_element();
        self.normals.iter().zip(FACES).any(|(normal, [a, ..])| {
            let nearest = normal.dot(middle - self.corners[a]) - normal.abs().dot(half);
            nearest > 16.0 * ROUNDING * reach
        })
    }

    /// Whether the closed triangle surely shares no point with the closed cell.
    pub fn is_apart_from(&self, t: &[Point; 3]) -> bool {
        if !Aabb::around(*t).meets(&self.bounds) {
            return true;
        }
        let t = t.map(|p| p - self.origin);
        let reach = t.iter().fold(self.extent, |m, c| m.max(c.abs().max_element()));
        if self.normals.iter().any(|n| self.is_between(*n, &t, reach)) {
            return true;
        }
        let sides = [t[1] - t[0], t[2] - t[1], t[0] - t[2]];
        if self.is_between(sides[0].cross(sides[1]), &t, reach) {
            return true;
        }
        EDGES.iter().any(|&[a, b]| {
            let edge = self.corners[b] - self.corners[a];
            sides.iter().any(|side| self.is_between(edge.cross(*side), &t, reach))
        })
    }

    /// Whether the two lie apart along `direction`.
    fn is_between(&self, direction: Point, t: &[Point; 3], reach: f64) -> bool {
        let along = t.map(|p| direction.dot(p));
        let own = self.corners.map(|p| direction.dot(p));
        let low = |all: &[f64]| all.iter().copied().fold(f64::INFINITY, f64::min);
        let high = |all: &[f64]| all.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let gap = (low(&along) - high(&own)).max(low(&own) - high(&along));
        gap > 8.0 * ROUNDING * direction.abs().max_element() * reach
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tetdb_base::geom::{mix, orient};

    #[test]
    fn nothing_apart_has_a_common_point_and_most_that_miss_are_found() {
        let at = |k: u64| (mix(k) >> 11) as f64 / (1u64 << 53) as f64;
        let point = |k: u64| Point::new(at(3 * k), at(3 * k + 1), at(3 * k + 2));
        let mut n_apart = 0;
        for k in 0..2000u64 {
            let k = 40 * k;
            let mut corners = [0, 1, 2, 3].map(|i| point(k + i));
            if orient(corners[0], corners[1], corners[2], corners[3]) < 0.0 {
                corners.swap(0, 1);
            }
            let t = [4, 5, 6].map(|i| point(k + i) + point(k + 7) * 0.5);
            let cell = Cell::new(corners);
            let holds = |p: Point| {
                FACES.iter().all(|&[a, b, c]| orient(p, corners[a], corners[b], corners[c]) >= 0.0)
            };
            let mut meets = false;
            for i in 0..=20 {
                for j in 0..=20 - i {
                    let (u, v) = (f64::from(i) / 20.0, f64::from(j) / 20.0);
                    meets |= holds(t[0] * u + t[1] * v + t[2] * (1.0 - u - v));
                }
            }
            let apart = cell.is_apart_from(&t);
            assert!(!(apart && meets), "{corners:?} {t:?}");
            n_apart += u32::from(apart);
            assert!(!cell.is_apart_from_box(&Aabb::around(t)) || apart || !meets);
            // A corner on a face.
            let on = [corners[0], t[1] + Point::splat(9.0), t[2] + Point::splat(9.0)];
            assert!(!cell.is_apart_from(&on));
        }
        assert!((500..1900).contains(&n_apart), "{n_apart}");
    }
}
