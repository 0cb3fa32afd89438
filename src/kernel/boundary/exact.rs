//! Points that are combinations of input points, kept without rounding.
//!
//! A point on a segment or a facet, `a + s (b - a) + t (c - a)`, has coordinates that are whole numbers times powers of
//! two when `s` and `t` are. Signs of orientations of such points are found without rounding.
//! They exist in memory only, while a patch is at work.

use tetdb_base::geom::{DoublePair, Dyadic, Point, orient};

/// A point whose coordinates are exact values.
#[derive(Clone, Debug)]
pub(super) struct ExactPoint {
    exact: [Dyadic; 3],
    /// The exact point, rounded; and the remainder, rounded.
    rounded: Point,
    rest: Point,
}

impl ExactPoint {
    fn new(exact: [Dyadic; 3]) -> Self {
        let rounded = Point::from_array([0, 1, 2].map(|i| exact[i].estimate()));
        let known = rounded.to_array().map(Dyadic::from);
        let rest = Point::from_array([0, 1, 2].map(|i| exact[i].minus(&known[i]).estimate()));
        Self { exact, rounded, rest }
    }

    /// A point as it is.
    pub fn explicit(p: Point) -> Self {
        Self { exact: p.to_array().map(Dyadic::from), rounded: p, rest: Point::ZERO }
    }

    /// `base + Σ share · (to - base)`.
    pub fn combination(base: Point, shares: &[(Point, &Dyadic)]) -> Self {
        let from = base.to_array().map(Dyadic::from);
        let mut sum = from.clone();
        for (to, share) in shares {
            let to = to.to_array().map(Dyadic::from);
            for i in 0..3 {
                sum[i] = sum[i].plus(&to[i].minus(&from[i]).times(share));
            }
        }
        Self::new(sum)
    }

    /// `self + by`, of few bits: each coordinate is off by less than `slack`.
    pub fn moved(&self, by: Point, slack: &Dyadic) -> Self {
        let by = by.to_array().map(Dyadic::from);
        Self::new([0, 1, 2].map(|i| self.exact[i].plus(&by[i]).shortened(slack)))
    }

    /// From `self` to `other`, rounded after the subtraction.
    pub fn offset(&self, other: &Self) -> Point {
        Point::from_array([0, 1, 2].map(|i| other.exact[i].minus(&self.exact[i]).estimate()))
    }

    /// Rounded to the nearest doubles or nearly so.
    pub fn rounded(&self) -> Point {
        self.rounded
    }
}

/// A position, rounded, with the exact one where they differ.
#[derive(Clone, Copy)]
pub(super) struct PlacedPoint<'a> {
    pub point: Point,
    pub exact: Option<&'a ExactPoint>,
}

/// Forward error of the determinant in doubles, as in `geom`.
const ORIENT_BOUND: f64 = 5.2e-15;
const EPSILON: f64 = f64::EPSILON;
/// Forward error of the determinant in pairs of doubles: nine products of 2^-102 and their sums of 2^-104, with slack.
const PAIR_BOUND: f64 = EPSILON * EPSILON * 1024.0;
/// Error of a coordinate difference in pairs, as a share of the coordinates: the rests are at most 2^-53 of them, and
/// rounded a few times.
const PAIR_OFF: f64 = EPSILON * EPSILON * 4.0;

/// Six times the signed volume; the sign is exact.
#[cfg(test)]
pub(super) fn orient_placed(p: [PlacedPoint<'_>; 4]) -> f64 {
    (orient_filtered(p).or_else(|| orient_in_pairs(p)))
        .unwrap_or_else(|| orient_exact(p).estimate())
}

/// Six times the signed volume, where doubles suffice for its sign.
pub(super) fn orient_filtered(p: [PlacedPoint<'_>; 4]) -> Option<f64> {
    if p.iter().all(|p| p.exact.is_none()) {
        return Some(orient(p[0].point, p[1].point, p[2].point, p[3].point));
    }
    let a = p[0].point;
    let (u, v, w) = (p[1].point - a, p[2].point - a, p[3].point - a);
    let det = u.dot(v.cross(w));
    // Rounding of positions moves each coordinate by less than this.
    let off = 2.0 * EPSILON * p.iter().map(|p| p.point.abs().max_element()).fold(0.0, f64::max);
    let m = u.abs().max(v.abs()).max(w.abs()) + Point::splat(2.0 * off);
    let pairs = m.x * m.y + m.y * m.z + m.z * m.x;
    let is_sure = det.abs() > ORIENT_BOUND * (m.x * m.y * m.z) + 24.0 * off * pairs
        && m.min_element() > 1e-58
        && m.max_element() < 1e61;
    is_sure.then_some(det)
}

/// Six times the signed volume, where twice the bits of doubles suffice for its sign.
pub(super) fn orient_in_pairs(p: [PlacedPoint<'_>; 4]) -> Option<f64> {
    let [a, b, c, d] = p.map(|p| match p.exact {
        Some(exact) => (exact.rounded, exact.rest),
        None => (p.point, Point::ZERO),
    });
    let [u, v, w] = [b, c, d]
        .map(|q| [0, 1, 2].map(|i| DoublePair::difference(q.0[i], a.0[i], q.1[i] - a.1[i])));
    let terms = [(0, 1, 2), (1, 2, 0), (2, 0, 1)];
    let [x, y, z] = terms.map(|(i, j, k)| u[i].times(v[j].times(w[k]).minus(v[k].times(w[j]))));
    let det = x.plus(y).plus(z).value();
    let largest = [a, b, c, d].map(|q| q.0.abs().max_element());
    let off = PAIR_OFF * largest.into_iter().fold(0.0, f64::max);
    let size =
        |i: usize| [u, v, w].map(|x| x[i].value().abs()).into_iter().fold(2.0 * off, f64::max);
    let m = [0, 1, 2].map(size);
    let pairs = m[0] * m[1] + m[1] * m[2] + m[2] * m[0];
    let is_sure = det.abs() > PAIR_BOUND * (m[0] * m[1] * m[2]) + 24.0 * off * pairs
        && m.iter().all(|m| (1e-58..1e61).contains(m));
    is_sure.then_some(det)
}

/// Six times the signed volume, without rounding.
#[cold]
pub(super) fn orient_exact(p: [PlacedPoint<'_>; 4]) -> Dyadic {
    let [a, b, c, d] = p.map(|p| match p.exact {
        Some(exact) => exact.clone(),
        None => ExactPoint::explicit(p.point),
    });
    let [u, v, w] = [b, c, d].map(|q| [0, 1, 2].map(|i| q.exact[i].minus(&a.exact[i])));
    let mut det = Dyadic::default();
    for (i, u) in u.iter().enumerate() {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let minor = v[j].times(&w[k]).minus(&v[k].times(&w[j]));
        det = det.plus(&u.times(&minor));
    }
    det
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
        let place = |point| PlacedPoint { point, exact: None };
        for k in 1..50 {
            let [s, t] = [97.3, 131.7].map(|n| Dyadic::from(f64::from(k) / n));
            let on_edge = ExactPoint::combination(a, &[(b, &s)]);
            let in_face = ExactPoint::combination(a, &[(b, &s), (c, &t)]);
            let x = PlacedPoint { point: on_edge.rounded(), exact: Some(&on_edge) };
            let y = PlacedPoint { point: in_face.rounded(), exact: Some(&in_face) };
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
