//! The volume that two tetrahedra share.
//!
//! The one is seen in the barycentric coordinates of the other, in which each of the four half-spaces is a coordinate that is not negative.
//! Each plane divides what is left into tetrahedra again: no polyhedron is kept, and equal or touching faces need no care. A plane that
//! rounding moves is moved by some 1e-16 of the size of the tetrahedra, and what is cut off of one neighbor goes to the other.

use tetdb_base::geom::{Aabb, Point};

/// A tetrahedron that others are cut with.
pub struct Cutter {
    pub bounds: Aabb,
    /// Six times the volume.
    det: f64,
    origin: Point,
    /// Gradients of the last three barycentric coordinates.
    gradients: [Point; 3],
}

/// Barycentric coordinates.
type Shares = [f64; 4];

impl Cutter {
    /// A tetrahedron of positive volume; one that rounding leaves none shares none with any other.
    pub fn new(corners: &[Point; 4]) -> Self {
        let [a, b, c, d] = *corners;
        let (u, v, w) = (b - a, c - a, d - a);
        let det = u.dot(v.cross(w));
        let gradients = [v.cross(w) / det, w.cross(u) / det, u.cross(v) / det];
        Self { bounds: Aabb::around(*corners), det, origin: a, gradients }
    }

    /// Volume of the tetrahedron.
    pub fn volume(&self) -> f64 {
        self.det / 6.0
    }

    /// Volume of what it shares with another tetrahedron.
    #[inline]
    pub fn overlap(&self, other: &[Point; 4]) -> f64 {
        let [p, q, r, s] = *other;
        let (low, high) = (p.min(q).min(r.min(s)), p.max(q).max(r.max(s)));
        if !self.bounds.meets(&Aabb { low, high }) {
            return 0.0;
        }
        let tet = [self.shares(p), self.shares(q), self.shares(r), self.shares(s)];
        // Also true for what is not a number.
        if (0..4).any(|axis| !tet.iter().any(|share| share[axis] > 0.0)) {
            return 0.0;
        }
        let volume = (q - p).dot((r - p).cross(s - p)).abs() / 6.0;
        if self.det > 0.0 { within(&tet, 0, volume) } else { 0.0 }
    }

    #[inline]
    fn shares(&self, p: Point) -> Shares {
        let [b, c, d] = &self.gradients;
        let from = p - self.origin;
        let (b, c, d) = (b.dot(from), c.dot(from), d.dot(from));
        [1.0 - b - c - d, b, c, d]
    }
}

/// Volume of the points of `tet` whose coordinates from `axis` on are positive.
///
/// A plane leaves a corner `a` or a prism, which is three tetrahedra. Their volumes follow from where the plane crosses the edges: no
/// determinant is needed, and after the last plane no point either.
fn within(tet: &[Shares; 4], axis: usize, volume: f64) -> f64 {
    if axis == 4 || volume == 0.0 {
        return volume;
    }
    let mut order = [0; 4];
    let (mut n_inside, mut n_outside) = (0, 0);
    for (i, share) in tet.iter().enumerate() {
        if share[axis] > 0.0 {
            order[n_inside] = i;
            n_inside += 1;
        } else {
            n_outside += 1;
            order[4 - n_outside] = i;
        }
    }
    let [a, b, c, d] = [&tet[order[0]], &tet[order[1]], &tet[order[2]], &tet[order[3]]];
    let (is_last, next) = (axis == 3, axis + 1);
    match n_inside {
        0 => 0.0,
        1 => {
            let [t, u, v] = [along(a, b, axis), along(a, c, axis), along(a, d, axis)];
            let corner = [*a, at(a, b, t), at(a, c, u), at(a, d, v)];
            within(&corner, next, volume * t * u * v)
        }
        2 => {
            let [t, u] = [along(a, c, axis), along(a, d, axis)];
            let [v, w] = [along(b, c, axis), along(b, d, axis)];
            let volumes = [t * u, (1.0 - t) * u * v, (1.0 - u) * v * w];
            if is_last {
                return volume * (volumes[0] + volumes[1] + volumes[2]);
            }
            let (ac, ad, bc, bd) = (at(a, c, t), at(a, d, u), at(b, c, v), at(b, d, w));
            within(&[*a, ac, ad, *b], next, volume * volumes[0])
                + within(&[ac, ad, *b, bc], next, volume * volumes[1])
                + within(&[ad, *b, bc, bd], next, volume * volumes[2])
        }
        3 => {
            let [t, u, v] = [along(a, d, axis), along(b, d, axis), along(c, d, axis)];
            let volumes = [t, (1.0 - t) * u, (1.0 - t) * (1.0 - u) * v];
            if is_last {
                return volume * (volumes[0] + volumes[1] + volumes[2]);
            }
            let (ad, bd, cd) = (at(a, d, t), at(b, d, u), at(c, d, v));
            within(&[*a, *b, *c, ad], next, volume * volumes[0])
                + within(&[*b, *c, ad, bd], next, volume * volumes[1])
                + within(&[*c, ad, bd, cd], next, volume * volumes[2])
        }
        _ => within(tet, next, volume),
    }
}

/// How far along the edge from a point inside to one outside the plane crosses it.
#[inline]
fn along(inside: &Shares, outside: &Shares, axis: usize) -> f64 {
    inside[axis] / (inside[axis] - outside[axis])
}

/// The point of an edge.
#[inline]
fn at(from: &Shares, to: &Shares, t: f64) -> Shares {
    let mut point = *from;
    for i in 0..4 {
        point[i] += t * (to[i] - from[i]);
    }
    point
}

#[cfg(test)]
mod tests {
    use super::*;
    use tetdb_base::geom::mix;

    fn random(k: u64) -> [Point; 4] {
        let at = |i: u64| (mix(k * 12 + i) >> 11) as f64 / (1u64 << 53) as f64;
        let mut tet = [0, 1, 2, 3].map(|i| Point::new(at(3 * i), at(3 * i + 1), at(3 * i + 2)));
        if Cutter::new(&tet).det < 0.0 {
            tet.swap(0, 1);
        }
        tet
    }

    /// The six tetrahedra of the unit cube fill it, so what they share with any tetrahedron inside is all of it.
    #[test]
    fn pieces_of_a_cube_share_all_of_what_is_inside() {
        let [x, y, z] = [Point::X, Point::Y, Point::Z];
        for k in 0..500 {
            let tet = random(k);
            for scale in [1e-6, 1.0, 1e6] {
                let mut sum = 0.0;
                for [u, v, w] in [[x, y, z], [x, z, y], [y, x, z], [y, z, x], [z, x, y], [z, y, x]]
                {
                    let mut part = [Point::ZERO, u, u + v, u + v + w].map(|p| p * scale);
                    if Cutter::new(&part).det < 0.0 {
                        part.swap(0, 1);
                    }
                    sum += Cutter::new(&part).overlap(&tet.map(|p| p * scale));
                }
                let volume = Cutter::new(&tet.map(|p| p * scale)).volume();
                assert!((sum - volume).abs() < 1e-14 * scale.powi(3), "{k}: {sum} {volume}");
            }
        }
    }

    #[test]
    fn both_see_the_same_volume_and_one_shares_all_with_itself() {
        for k in 0..2000 {
            let (a, b) = (random(2 * k), random(2 * k + 1));
            let (cut_a, cut_b) = (Cutter::new(&a), Cutter::new(&b));
            assert!((cut_a.overlap(&b) - cut_b.overlap(&a)).abs() < 1e-13, "{k}");
            assert!((cut_a.overlap(&a) - cut_a.volume()).abs() < 1e-15, "{k}");
            let apart = b.map(|p| p + Point::new(1.0, 0.0, 0.0));
            assert!(cut_a.overlap(&apart) <= cut_a.volume());
            assert_eq!(cut_a.overlap(&b.map(|p| p + Point::splat(2.0))), 0.0);
        }
    }
}
