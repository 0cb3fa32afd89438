//! The least q that a tetrahedron can have, given its required faces.
//!
//! **One required face.** A tetrahedron on triangle T with apex d has q = α L / r, with L its longest edge and r its inradius,
//! ```text
//!     1 / r = 1 / h + Σ eᵢ √(1 + (dᵢ / h)²) / (2 A)
//! ```
//! where A is the area of T, eᵢ its edges, h the height of d, and dᵢ the distances of its foot from the edges' lines. In
//! the coordinates (foot / h, 1 / h) this is convex, and so is "no edge longer than L" for each L: there is one minimum,
//! found by search (`climb`) from two starts. No tetrahedron is better than α ℓ / ρ (ℓ the longest edge of T, ρ the radius of its
//! inscribed circle), and a needle comes near that: [`face_floor`] is cheap and never above the minimum.
//!
//! **Two required faces** and more. Let two triangles meet at angle θ. A tetrahedron on one of them has a dihedral
//! angle of at most θ at their common edge. The bound of a face is then the least q of apexes within that angle: the
//! minimum above, if it lies within, else the least one on the plane at angle θ. Having both faces does not force the
//! tetrahedron: an inner vertex can divide it.
//!
//! The bound of a tetrahedron is the largest of those of its required faces, 1 without any. Four vertices on the surface
//! force nothing. *Excess* is q over the bound.

use super::anatomy::FACES;
use super::climb::Climb;
use super::quality::{face_bound, quality};
use crate::geom::Point;

/// Steps of a search. The minimum is then met within 1 in 1000 (see the tests), which suffices for the bound.
const STEPS: u32 = 160;

/// A triangle as the base of tetrahedra, moved and scaled: from the origin along x, then to y > 0; longest edge 1.
#[derive(Clone, Copy, Debug)]
struct Base {
    corners: [Point; 3],
}

impl Base {
    /// The triangle a b c with edge a b along x; `None` when it has no area in doubles.
    fn new([a, b, c]: [Point; 3]) -> Option<Self> {
        let (u, v, w) = (b - a, c - a, c - b);
        let longest = u.length().max(v.length()).max(w.length());
        let (u, v) = (u / longest, v / longest);
        let length = u.length();
        let (x, y) = (u.dot(v) / length, u.cross(v).length() / length);
        (y > 0.0 && x.is_finite()).then_some(Self {
            corners: [Point::ZERO, Point::new(length, 0.0, 0.0), Point::new(x, y, 0.0)],
        })
    }

    /// 1 / q with the apex at `d`; not positive below the plane.
    fn inverse_quality(&self, d: Point) -> f64 {
        let [a, b, c] = self.corners;
        if d.z > 0.0 { 1.0 / quality([a, b, c, d]) } else { -1.0 }
    }

    /// The middle of the inscribed circle.
    fn middle(&self) -> Point {
        let [a, b, c] = self.corners;
        let (ea, eb, ec) = ((b - c).length(), (a - c).length(), (a - b).length());
        (a * ea + b * eb + c * ec) / (ea + eb + ec)
    }

    /// Two apexes that are not far from the best.
    fn starts(&self) -> [Point; 2] {
        let [a, b, c] = self.corners;
        let middle = self.middle();
        let reach = |foot: Point| {
            let far = [a, b, c].map(|p| (p - foot).length_squared());
            far[0].max(far[1]).max(far[2])
        };
        // Over the middle of the inscribed circle as high as the longest edge allows, and over the centroid as high as a regular one.
        let high = (1.0 - reach(middle)).max(0.01).sqrt();
        let centroid = (a + b + c) / 3.0;
        [middle + Point::Z * high, centroid + Point::Z * (2.0f64 / 3.0).sqrt()]
    }

    /// The best apex and its goodness.
    fn best(&self) -> (Point, f64) {
        let [one, two] = self.starts().map(|start| self.climb(start, |p| p));
        if two.1 > one.1 { two } else { one }
    }

    /// The best apex on the half-plane through edge a b whose direction away from it is `out`, a unit vector.
    fn best_on(&self, out: Point) -> f64 {
        let [a, b, c] = self.corners;
        let start = Point::new((a.x + b.x + c.x) / 3.0, c.y.max(0.3), 0.0);
        self.climb(start, |p| Point::new(p.x, 0.0, 0.0) + out * p.y).1
    }

    fn climb(&self, start: Point, place: impl Fn(Point) -> Point) -> (Point, f64) {
        let climb = Climb { start, step: 0.2, steps: STEPS, enough: 1.0 };
        let floor = self.inverse_quality(place(start));
        climb.run(floor, |p, _| self.inverse_quality(place(p))).unwrap_or((start, floor))
    }
}

/// A q that no tetrahedron on this triangle can be below: α · longest edge / radius of the inscribed circle. Cheap; an equilateral triangle
/// allows 1 and has 0.71 here.
pub fn face_floor(corners: [Point; 3]) -> f64 {
    1.0 / face_bound(corners)
}

/// The least q of any tetrahedron that stands on this triangle, infinite for one without area in doubles.
pub fn face_least(corners: [Point; 3]) -> f64 {
    Base::new(corners).map_or(f64::INFINITY, |base| 1.0 / base.best().1)
}

/// A number that [`face_least`] is not above, without a search.
pub fn face_most(corners: [Point; 3]) -> f64 {
    Base::new(corners).map_or(f64::INFINITY, |base| {
        let [one, two] = base.starts().map(|apex| base.inverse_quality(apex));
        1.0 / one.max(two)
    })
}

/// The least q of tetrahedra on triangle a b c whose dihedral angle at a b is at most that of apex d.
fn wedge_least([a, b, c]: [Point; 3], d: Point) -> f64 {
    let Some(base) = Base::new([a, b, c]) else {
        return f64::INFINITY;
    };
    let (free, good) = base.best();
    // Directions from the edge towards c and d, square to it.
    let along = (b - a).normalize();
    let square = |p: Point| (p - a) - along * (p - a).dot(along);
    let (to_c, to_d) = (square(c).normalize(), square(d).normalize());
    let (cos, sin) = (to_c.dot(to_d), to_c.cross(to_d).length());
    // The angle of the best apex: within, if the direction to d is beyond it or along it.
    let is_within = cos * free.z - sin * free.y <= 0.0;
    if is_within || !cos.is_finite() || !sin.is_finite() {
        1.0 / good
    } else {
        1.0 / base.best_on(Point::new(0.0, cos, sin))
    }
}

/// The bound of a positive tetrahedron: the least q that its required faces allow, and 1 at least.
///
/// Never above its own q.
pub fn least(points: [Point; 4], required: [bool; 4]) -> f64 {
    let own = quality(points);
    let several = required.iter().filter(|&&r| r).count() > 1;
    let mut bound = 1.0f64;
    for i in (0..4).filter(|&i| required[i]) {
        let face = FACES[i].map(|k| points[k]);
        if !several {
            bound = bound.max(face_least(face));
            continue;
        }
        // The face turned so that its edge with each other required face j comes first: that edge lacks i and j.
        for turn in 0..3 {
            let j = FACES[i][(turn + 2) % 3];
            if required[j] {
                let turned = [0, 1, 2].map(|k| face[(turn + k) % 3]);
                bound = bound.max(wedge_least(turned, points[i]));
            }
        }
    }
    bound.min(own)
}

/// q over the bound: 1 for a tetrahedron of the best quality that the surface allows.
pub fn excess(points: [Point; 4], required: [bool; 4]) -> f64 {
    let (q, bound) = (quality(points), least(points, required));
    if bound.is_finite() { q / bound } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The least q over a grid of apexes around the best of a coarser one, finer each time.
    fn brute_force([a, b, c]: [Point; 3]) -> f64 {
        let longest = (b - a).length().max((c - a).length()).max((c - b).length());
        let normal = (b - a).cross(c - a).normalize();
        let x = (b - a).normalize();
        let y = normal.cross(x);
        let mut center = [0.5, 0.0, 0.8];
        let mut half = 1.3;
        let mut best = f64::INFINITY;
        for _ in 0..9 {
            let around = center;
            for i in 0..27 * 27 * 27 {
                let [i, j, k] = [i % 27, i / 27 % 27, i / 729].map(|i| f64::from(i - 13) / 13.0);
                let at =
                    [around[0] + half * i, around[1] + half * j, (around[2] + half * k).max(1e-3)];
                let d = a + (x * at[0] + y * at[1] + normal * at[2]) * longest;
                let q = quality([a, b, c, d]);
                if q < best {
                    (best, center) = (q, at);
                }
            }
            half *= 0.4;
        }
        best
    }

    const SHAPES: [[[f64; 2]; 3]; 6] = [
        [[0.0, 0.0], [1.0, 0.0], [0.5, 0.866_025_403_784]],
        [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
        [[0.0, 0.0], [1.0, 0.0], [0.98, 0.03]],
        [[0.0, 0.0], [1.0, 0.0], [0.5, 0.01]],
        [[0.0, 0.0], [1.0, 0.0], [1.0, 0.1]],
        [[0.0, 0.0], [1.0, 0.0], [0.2, 1e-4]],
    ];

    #[test]
    fn the_bound_of_a_triangle_is_what_trying_every_apex_finds() {
        for shape in SHAPES {
            let corners = shape.map(|[x, y]| Point::new(x, y, 0.0));
            let wanted = brute_force(corners);
            let found = face_least(corners);
            assert!(
                found <= wanted * 1.002 && found >= wanted * 0.998,
                "{shape:?}: {found}, by brute force {wanted}"
            );
            assert!(face_floor(corners) <= found && found <= face_most(corners));
        }
    }

    #[test]
    fn bounds_do_not_depend_on_scale_place_or_turn() {
        for shape in SHAPES {
            let corners = shape.map(|[x, y]| Point::new(x, y, 0.0));
            let wanted = face_least(corners);
            for scale in [2f64.powi(-30), 3.0, 2f64.powi(30)] {
                for turn in 0..3 {
                    let moved = [0, 1, 2].map(|k| {
                        let p = corners[(k + turn) % 3];
                        Point::new(0.6 * p.x, p.y, 0.8 * p.x) * scale
                    });
                    let found = face_least(moved);
                    assert!(
                        (found / wanted - 1.0).abs() < 2e-3,
                        "{shape:?} at {scale}, turned {turn}: {found}, not {wanted}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_triangle_without_area_forces_everything() {
        let line = [0.0, 1.0, 3.0].map(|x| Point::new(x, 2.0 * x, -x));
        assert_eq!(face_least(line), f64::INFINITY);
        let tip = Point::new(1.0, 1.0, 1.0);
        let [a, b, c] = line;
        let flat = [a, b, c, tip];
        assert_eq!(excess(flat, [false, false, false, true]), 1.0);
    }

    #[test]
    fn a_sharp_wedge_forces_and_a_flat_one_does_not() {
        // Two equal triangles that share an edge, at 5 and at nearly 180 degrees.
        let wedge = |degrees: f64| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            [
                Point::new(-0.5, 0.0, 0.0),
                Point::new(0.5, 0.0, 0.0),
                Point::new(0.0, 0.866, 0.0),
                Point::new(0.0, 0.866 * cos, 0.866 * sin),
            ]
        };
        let both = [false, false, true, true];
        let sharp = least(wedge(5.0), both);
        assert!(sharp > 5.0 && excess(wedge(5.0), both) < 1.7, "{sharp}");
        let flat = least(wedge(179.9), both);
        assert!(flat < 1.01 && excess(wedge(179.9), both) > 100.0, "{flat}");
        let none = excess(wedge(179.9), [false; 4]);
        assert!((none / quality(wedge(179.9)) - 1.0).abs() < 1e-12);
        // The result does not depend on which vertex of the wedge comes first.
        let [a, b, c, d] = wedge(5.0);
        let turned = least([c, d, a, b], [true, true, false, false]);
        assert!((turned / sharp - 1.0).abs() < 2e-3, "{turned} {sharp}");
    }

    #[test]
    fn no_tetrahedron_is_below_its_bound() {
        let mut state = 3u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        for k in 0..400 {
            let flat = 10f64.powi(-(k % 5));
            let p = [0; 4].map(|_| Point::new(next(), next() * flat, next()));
            let q = quality(p);
            if !q.is_finite() {
                continue;
            }
            for i in 0..4 {
                let face = face_least(FACES[i].map(|k| p[k]));
                assert!(q >= face * 0.998, "{p:?}: {q} on a face of {face}");
                let wedge = FACES[i].map(|k| p[k]);
                let wedge = wedge_least(wedge, p[i]);
                assert!(q >= wedge * 0.998, "{p:?}: {q} in a wedge of {wedge}");
            }
        }
    }
}
