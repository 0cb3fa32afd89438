//! Points that are combinations of input points, kept without rounding.
//!
//! A point on a segment or a facet, `a + s (b - a) + t (c - a)` with doubles `s` and `t`, has coordinates
//! that are short sums of doubles. Signs of orientations of such points are found by sums and products of such
//! sums (J. R. Shewchuk, "Adaptive precision floating-point arithmetic and fast robust geometric predicates", 1997).
//! They exist in memory only, while a patch is at work.

use crate::geom::{Point, orient};

/// An exact value: the sum of doubles that do not overlap, smallest first, none zero.
#[derive(Clone, Debug, Default)]
pub(super) struct Expansion(Vec<f64>);

fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let x = a + b;
    let bv = x - a;
    (x, (a - (x - bv)) + (b - bv))
}

fn split(a: f64) -> (f64, f64) {
    let c = 134_217_729.0 * a;
    let high = c - (c - a);
    (high, a - high)
}

fn two_product(a: f64, b: f64) -> (f64, f64) {
    let x = a * b;
    let ((ah, al), (bh, bl)) = (split(a), split(b));
    (x, al * bl - (((x - ah * bh) - al * bh) - ah * bl))
}

impl Expansion {
    fn of(a: f64) -> Self {
        Self(if a == 0.0 { Vec::new() } else { vec![a] })
    }

    fn add_double(&mut self, b: f64) {
        let mut q = b;
        let mut sum = Vec::with_capacity(self.0.len() + 1);
        for &e in &self.0 {
            let (x, y) = two_sum(q, e);
            if y != 0.0 {
                sum.push(y);
            }
            q = x;
        }
        if q != 0.0 {
            sum.push(q);
        }
        self.0 = sum;
    }

    fn add(&mut self, other: &Self) {
        for &e in &other.0 {
            self.add_double(e);
        }
    }

    fn minus(&self, other: &Self) -> Self {
        let mut r = self.clone();
        for &e in &other.0 {
            r.add_double(-e);
        }
        r
    }

    fn scaled(&self, b: f64) -> Self {
        let mut r = Self::default();
        for &e in &self.0 {
            let (x, y) = two_product(e, b);
            r.add_double(y);
            r.add_double(x);
        }
        r
    }

    fn times(&self, other: &Self) -> Self {
        let mut r = Self::default();
        for &e in &other.0 {
            r.add(&self.scaled(e));
        }
        r
    }

    /// The value rounded; its sign is exact.
    pub(super) fn estimate(&self) -> f64 {
        self.0.iter().sum()
    }
}

/// A point whose coordinates are exact values.
#[derive(Clone, Debug)]
pub(super) struct ExactPoint([Expansion; 3]);

impl ExactPoint {
    /// A point as it is.
    pub(super) fn explicit(p: Point) -> Self {
        Self(p.to_array().map(Expansion::of))
    }

    /// `base + Σ share · (to - base)`.
    pub(super) fn combination(base: Point, shares: &[(Point, f64)]) -> Self {
        let from = base.to_array();
        Self([0, 1, 2].map(|axis| {
            let mut sum = Expansion::of(from[axis]);
            for &(to, share) in shares {
                let (x, y) = two_sum(to.to_array()[axis], -from[axis]);
                let mut difference = Expansion::of(y);
                difference.add_double(x);
                sum.add(&difference.scaled(share));
            }
            sum
        }))
    }

    /// Rounded to the nearest doubles or nearly so.
    pub(super) fn rounded(&self) -> Point {
        Point::from_array([0, 1, 2].map(|i| self.0[i].estimate()))
    }
}

/// A position, rounded, with the exact one where they differ.
#[derive(Clone, Copy)]
pub(super) struct Placed<'a> {
    pub point: Point,
    pub exact: Option<&'a ExactPoint>,
}

/// Forward error of the determinant in doubles, as in `geom`.
const ORIENT_BOUND: f64 = 5.2e-15;
const EPSILON: f64 = f64::EPSILON;

/// Six times the signed volume; the sign is exact.
pub(super) fn orient_placed(p: [Placed<'_>; 4]) -> f64 {
    if p.iter().all(|p| p.exact.is_none()) {
        return orient(p[0].point, p[1].point, p[2].point, p[3].point);
    }
    let a = p[0].point;
    let (u, v, w) = (p[1].point - a, p[2].point - a, p[3].point - a);
    let det = u.dot(v.cross(w));
    // Rounding of positions moves each coordinate by less than this.
    let off = 2.0
        * EPSILON
        * p.iter()
            .map(|p| p.point.abs().max_element())
            .fold(0.0, f64::max);
    let m = u.abs().max(v.abs()).max(w.abs()) + Point::splat(2.0 * off);
    let pairs = m.x * m.y + m.y * m.z + m.z * m.x;
    if det.abs() > ORIENT_BOUND * (m.x * m.y * m.z) + 24.0 * off * pairs
        && m.min_element() > 1e-58
        && m.max_element() < 1e61
    {
        return det;
    }
    orient_exact(p)
}

#[cold]
pub(super) fn orient_exact(p: [Placed<'_>; 4]) -> f64 {
    let [a, b, c, d] = p.map(|p| match p.exact {
        Some(exact) => exact.clone(),
        None => ExactPoint::explicit(p.point),
    });
    let [u, v, w] = [b, c, d].map(|q| [0, 1, 2].map(|i| q.0[i].minus(&a.0[i])));
    let mut det = Expansion::default();
    for (i, u) in u.iter().enumerate() {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let minor = v[j].times(&w[k]).minus(&v[k].times(&w[j]));
        det.add(&u.times(&minor));
    }
    det.estimate()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_on_an_edge_and_a_triangle_are_exactly_there() {
        let a = Point::new(0.1, 0.7, -0.3);
        let b = Point::new(1.9, -0.2, 0.45);
        let c = Point::new(-0.6, 0.33, 1.7);
        let d = Point::new(0.2, 0.9, 5.3);
        let place = |point| Placed { point, exact: None };
        for k in 1..50 {
            let (s, t) = (f64::from(k) / 97.3, f64::from(k) / 131.7);
            let on_edge = ExactPoint::combination(a, &[(b, s)]);
            let in_face = ExactPoint::combination(a, &[(b, s), (c, t)]);
            let x = Placed {
                point: on_edge.rounded(),
                exact: Some(&on_edge),
            };
            let y = Placed {
                point: in_face.rounded(),
                exact: Some(&in_face),
            };
            assert_eq!(orient_placed([place(a), place(b), x, place(d)]), 0.0);
            assert_eq!(orient_placed([place(a), place(b), place(c), y]), 0.0);
            assert_eq!(orient_placed([x, place(b), place(c), y]), 0.0);
            let (p, q) = (
                orient_placed([place(a), place(b), y, place(d)]),
                orient_placed([place(b), place(a), y, place(d)]),
            );
            assert!(p * q < 0.0);
        }
    }
}
