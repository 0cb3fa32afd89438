//! Exact signs of the orientation and sphere determinants.
//!
//! Each call first evaluates the determinant in doubles. It compares the result with a bound from the largest
//! coordinate differences of that very call. (Such a semi-static filter works on small tetrahedra, where a bound for
//! the whole bounding box fails.) Undecided cases go to whole numbers (`wide`, spheres only) where they fit, else to
//! the expansions of the crate `robust`.
//!
//! Zero sphere determinants are decided by raising the lift of the points symbolically, the
//! lexicographically smallest point by most (Devillers and Teillaud, "Perturbations for Delaunay and
//! weighted Delaunay 3D triangulations"): the triangulation is then a function of the point set alone.

use std::cmp::Ordering;

use robust::Coord3D;

use super::Point;
use super::wide::insphere_sign;

/// Forward error of the filtered orientation determinant, relative to the product of the largest
/// differences per axis (Meyer and Pion, "FPG: a code generator for fast and certified geometric predicates").
const ORIENT_BOUND: f64 = 5.110_712_782_997_33e-15;
/// Forward error of the filtered sphere determinant, relative to that product times the largest squared difference.
const INSPHERE_BOUND: f64 = 1.246_613_653_102_729_8e-13;
/// Below this difference a product can underflow and the bounds stop being bounds.
const DIFFERENCE_MIN: f64 = 1e-58;
/// Above this difference a product can overflow.
const DIFFERENCE_MAX: f64 = 1e61;
/// Squares of lengths within which the first, coarser filter neither underflows nor overflows: it bounds
/// every difference by the longest one and compares squares, which needs three comparisons instead of twelve.
const SQUARE_MIN: f64 = 1e-50;
/// See [`SQUARE_MIN`].
const SQUARE_MAX: f64 = 1e50;
/// Covers the rounding of the squares themselves.
const SLACK: f64 = 1.000_001;

/// The points times the power of two that brings the largest coordinate near one: expansions have its sign then, where
/// products of the last parts of very small or large coordinates would leave the range of doubles.
///
/// Also returns the inverse of that power.
fn scaled<const N: usize>(points: [Point; N]) -> ([Coord3D<f64>; N], f64) {
    let largest = points.iter().fold(0.0f64, |m, p| m.max(p.abs().max_element()));
    let exponent = (largest.to_bits() >> 52) as i32 - 1023;
    let power = |e: i32| f64::from_bits(((1023 + e) as u64) << 52);
    let exponent = exponent.clamp(-1000, 1000);
    let factor = power(-exponent);
    let points = points.map(|p| Coord3D { x: p.x * factor, y: p.y * factor, z: p.z * factor });
    (points, power(exponent))
}

/// Six times the signed volume of `a b c d`; the sign is exact, the magnitude is not.
///
/// Positive when `d` lies on the side of the plane `a b c` from which `a b c` turn counter-clockwise, that is
/// when `det(b-a, c-a, d-a) > 0`.
#[inline(always)]
pub fn orient(a: Point, b: Point, c: Point, d: Point) -> f64 {
    let (u, v, w) = (b - a, c - a, d - a);
    let det = u.dot(v.cross(w));
    let square = larger(larger(u.dot(u), v.dot(v)), w.dot(w));
    if square > SQUARE_MIN
        && square < SQUARE_MAX
        && det * det > (ORIENT_BOUND * ORIENT_BOUND * SLACK) * (square * square * square)
    {
        return det;
    }
    orient_slow(a, b, c, d)
}

/// The finer filter, for flat boxes of differences, and then the exact sign.
#[cold]
#[inline(never)]
fn orient_slow(a: Point, b: Point, c: Point, d: Point) -> f64 {
    let (u, v, w) = (b - a, c - a, d - a);
    let det = u.dot(v.cross(w));
    let m = u.abs().max(v.abs()).max(w.abs());
    if det.abs() > ORIENT_BOUND * (m.x * m.y * m.z)
        && m.min_element() > DIFFERENCE_MIN
        && m.max_element() < DIFFERENCE_MAX
    {
        return det;
    }
    let ([a, b, c, d], unit) = scaled([a, b, c, d]);
    let det = -robust::orient3d(a, b, c, d);
    if det == 0.0 {
        return 0.0;
    }
    // Back in input units, for callers that add volumes; a volume too small for a double keeps its sign.
    let volume = det * unit * unit * unit;
    volume.abs().clamp(f64::MIN_POSITIVE, f64::MAX).copysign(det)
}

/// The larger of two numbers that are not NaN: one instruction, where `f64::max` takes five.
#[inline(always)]
pub fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The sign of [`orient`] as an ordering against zero.
#[inline]
pub fn orient_sign(a: Point, b: Point, c: Point, d: Point) -> Ordering {
    orient(a, b, c, d).partial_cmp(&0.0).expect("coordinates are finite")
}

/// A point as seen from another: the difference and its square.
#[derive(Clone, Copy, Debug)]
pub struct RelativePoint {
    d: Point,
    square: f64,
}

impl RelativePoint {
    /// `a` as seen from `e`.
    #[inline(always)]
    pub fn new(a: Point, e: Point) -> Self {
        let d = a - e;
        Self { d, square: d.dot(d) }
    }
}

/// Sphere determinant of four points seen from a fifth; positive when the fifth is inside.
#[inline(always)]
fn relative_determinant(
    a: &RelativePoint,
    b: &RelativePoint,
    c: &RelativePoint,
    d: &RelativePoint,
) -> f64 {
    let (a1, b1, c1, d1) = (a.d, b.d, c.d, d.d);
    let ab = a1.x * b1.y - b1.x * a1.y;
    let bc = b1.x * c1.y - c1.x * b1.y;
    let cd = c1.x * d1.y - d1.x * c1.y;
    let da = d1.x * a1.y - a1.x * d1.y;
    let ac = a1.x * c1.y - c1.x * a1.y;
    let bd = b1.x * d1.y - d1.x * b1.y;
    let abc = a1.z * bc - b1.z * ac + c1.z * ab;
    let bcd = b1.z * cd - c1.z * bd + d1.z * bc;
    let cda = c1.z * da + d1.z * ac + a1.z * cd;
    let dab = d1.z * ab + a1.z * bd + b1.z * da;
    (c.square * dab - d.square * abc) + (a.square * bcd - b.square * cda)
}

/// [`insphere`] of four points already seen from the fifth; zero also when the doubles cannot decide.
#[inline(always)]
pub fn insphere_filtered(
    a: &RelativePoint,
    b: &RelativePoint,
    c: &RelativePoint,
    d: &RelativePoint,
) -> f64 {
    let det = relative_determinant(a, b, c, d);
    let square = larger(larger(a.square, b.square), larger(c.square, d.square));
    let fourth = (square * square) * (square * square);
    if square > SQUARE_MIN
        && square < SQUARE_MAX
        && det * det > (INSPHERE_BOUND * INSPHERE_BOUND * SLACK) * (fourth * square)
    {
        return det;
    }
    0.0
}

/// Sphere determinant of the positive tetrahedron `a b c d` and `e`: positive when `e` is inside.
///
/// The sign is exact, the magnitude is not; zero means that the five points lie on one sphere.
#[inline(always)]
pub fn insphere(a: Point, b: Point, c: Point, d: Point, e: Point) -> f64 {
    let [s, t, u, v] = [
        RelativePoint::new(a, e),
        RelativePoint::new(b, e),
        RelativePoint::new(c, e),
        RelativePoint::new(d, e),
    ];
    let det = insphere_filtered(&s, &t, &u, &v);
    if det != 0.0 { det } else { insphere_slow(a, b, c, d, e) }
}

/// The finer filter, for flat boxes of differences, and then the exact sign.
#[cold]
#[inline(never)]
fn insphere_slow(a: Point, b: Point, c: Point, d: Point, e: Point) -> f64 {
    let [s, t, u, v] = [
        RelativePoint::new(a, e),
        RelativePoint::new(b, e),
        RelativePoint::new(c, e),
        RelativePoint::new(d, e),
    ];
    let det = relative_determinant(&s, &t, &u, &v);
    let m = s.d.abs().max(t.d.abs()).max(u.d.abs()).max(v.d.abs());
    let largest = m.max_element();
    if det.abs() > INSPHERE_BOUND * (m.x * m.y * m.z) * (largest * largest)
        && m.min_element() > DIFFERENCE_MIN
        && largest < DIFFERENCE_MAX
    {
        return det;
    }
    match insphere_sign(a, b, c, d, e) {
        Some(sign) => f64::from(sign as i8),
        None => {
            let ([a, b, c, d, e], _) = scaled([a, b, c, d, e]);
            -robust::insphere(a, b, c, d, e)
        }
    }
}

/// Lexicographic order of coordinates, the rank that decides all ties.
#[inline]
pub fn lex_cmp(a: Point, b: Point) -> Ordering {
    (a.x, a.y, a.z).partial_cmp(&(b.x, b.y, b.z)).expect("coordinates are finite")
}

/// Returns whether `e` is strictly inside the perturbed sphere of the positive tetrahedron `a b c d`.
///
/// The five points must be pairwise different. Never undecided.
#[inline(always)]
pub fn in_sphere_perturbed(a: Point, b: Point, c: Point, d: Point, e: Point) -> bool {
    let det = insphere(a, b, c, d, e);
    if det != 0.0 {
        return det > 0.0;
    }
    break_tie(a, b, c, d, e)
}

#[cold]
#[inline(never)]
fn break_tie(a: Point, b: Point, c: Point, d: Point, e: Point) -> bool {
    // The determinant is linear in each point's lift; these are the coefficients' points and signs.
    let points = [a, b, c, d, e];
    let mut rank = [0usize, 1, 2, 3, 4];
    rank.sort_unstable_by(|&i, &j| lex_cmp(points[i], points[j]));
    for i in rank {
        let coefficient = match i {
            0 => -orient(b, c, d, e),
            1 => orient(a, c, d, e),
            2 => -orient(a, b, d, e),
            3 => orient(a, b, c, e),
            _ => -orient(a, b, c, d),
        };
        if coefficient != 0.0 {
            return coefficient > 0.0;
        }
    }
    unreachable!("a b c d is positive, so the coefficient of e is not zero: {points:?}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sign_convention_holds() {
        let (o, x, y, z) = (Point::ZERO, Point::X, Point::Y, Point::Z);
        assert!(orient(o, x, y, z) > 0.0);
        assert!(orient(x, o, y, z) < 0.0);
        assert!(insphere(o, x, y, z, Point::splat(0.3)) > 0.0);
        assert!(insphere(o, x, y, z, Point::splat(2.0)) < 0.0);
        assert_eq!(insphere(o, x, y, z, Point::ONE), 0.0);
        // Beyond the range of the filters, and of expansions of such numbers.
        for scale in [1e-150, 1e-60, 1e-40, 1e40, 1e60] {
            let (x, y, z) = (x * scale, y * scale, z * scale);
            assert!(insphere(o, x, y, z, Point::splat(0.3) * scale) > 0.0);
            assert!(orient(o, x, y, z) > 0.0);
            assert!(orient(x, y, z, Point::splat(0.4) * scale) > 0.0);
            assert!(orient(x, y, z, Point::splat(0.3) * scale) < 0.0);
        }
    }

    #[test]
    fn volumes_the_filters_do_not_decide_are_in_input_units() {
        let flat = 2f64.powi(-48);
        for scale in [2f64.powi(-30), 1.0, 2f64.powi(30)] {
            let [a, b, c] = [Point::ONE, Point::new(2.0, 1.0, 1.0), Point::new(1.0, 2.0, 1.0)];
            let [a, b, c] = [a, b, c].map(|p| p * scale);
            let d = Point::new(1.5, 1.5, 1.0 + flat) * scale;
            let volume = orient(a, b, c, d) / (flat * scale.powi(3));
            assert!((volume - 1.0).abs() < 1e-9, "{volume} at scale {scale}");
        }
    }
}
