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
        let gradients = [v.cross(w), w.cross(u), u.cross(v)].map(|normal| normal / det);
        Self { bounds: Aabb::around(*corners), det, origin: a, gradients }
    }

    /// Volume of the tetrahedron.
    pub fn volume(&self) -> f64 {
        self.det / 6.0
    }

    /// Volume of what it shares with another tetrahedron.
    pub fn overlap(&self, other: &[Point; 4]) -> f64 {
        let shares = other.map(|p| {
            let [b, c, d] = self.gradients.map(|gradient| gradient.dot(p - self.origin));
            [1.0 - b - c - d, b, c, d]
        });
        let is_beyond = |i: usize| shares.iter().all(|share| share[i] <= 0.0);
        // Also false for what is not a number.
        match self.det > 0.0 && !(0..4).any(is_beyond) {
            true => within(shares, 0) * self.volume(),
            false => 0.0,
        }
    }
}

/// Volume, as a multiple of the unit tetrahedron's, of the points of `tet` whose coordinates from `axis` on are positive.
fn within(tet: [Shares; 4], axis: usize) -> f64 {
    if axis == 4 {
        let [a, b, c, d] = tet.map(|[_, x, y, z]| Point::new(x, y, z));
        return (b - a).dot((c - a).cross(d - a)).abs();
    }
    let mut order = [0; 4];
    let (mut n_inside, mut n_outside) = (0, 0);
    for i in 0..4 {
        if tet[i][axis] > 0.0 {
            order[n_inside] = i;
            n_inside += 1;
        } else {
            n_outside += 1;
            order[4 - n_outside] = i;
        }
    }
    let [a, b, c, d] = order.map(|i| tet[i]);
    // Where the edge from a point inside to one outside crosses the plane.
    let cut = |inside: Shares, outside: Shares| {
        let t = inside[axis] / (inside[axis] - outside[axis]);
        let mut at = [0, 1, 2, 3].map(|i| inside[i] + t * (outside[i] - inside[i]));
        at[axis] = 0.0;
        at
    };
    let prism = |[a, b, c]: [Shares; 3], [d, e, f]: [Shares; 3]| {
        within([a, b, c, d], axis + 1)
            + within([b, c, d, e], axis + 1)
            + within([c, d, e, f], axis + 1)
    };
    match n_inside {
        0 => 0.0,
        1 => within([a, cut(a, b), cut(a, c), cut(a, d)], axis + 1),
        2 => prism([a, cut(a, c), cut(a, d)], [b, cut(b, c), cut(b, d)]),
        3 => prism([a, b, c], [cut(a, d), cut(b, d), cut(c, d)]),
        _ => within(tet, axis + 1),
    }
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
