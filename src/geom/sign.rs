//! Signs of the orientation and sphere determinants, never wrong.
//!
//! Each call first evaluates the determinant in doubles and compares it with a bound made from the
//! largest coordinate differences of that very call (a semi-static filter: a bound for the whole
//! bounding box never succeeds on small tetrahedra). What the filter cannot decide goes to the
//! expansions of the crate `robust`.
//!
//! Zero sphere determinants are decided by raising the lift of the points symbolically, the
//! lexicographically smallest point by most (Devillers and Teillaud, "Perturbations for Delaunay and
//! weighted Delaunay 3D triangulations"): the triangulation is then a function of the point set alone.

use std::cmp::Ordering;

use robust::Coord3D;

use super::Point;

/// Forward error of the filtered orientation determinant, relative to the product of the largest
/// differences per axis (Meyer and Pion, "FPG: a code generator for fast and certified geometric predicates").
const ORIENT_BOUND: f64 = 5.110_712_782_997_329_9e-15;
/// The same for the sphere determinant, relative to that product times the largest squared difference.
const INSPHERE_BOUND: f64 = 1.246_613_653_102_729_8e-13;
/// Below this difference a product can underflow and the bounds stop being bounds.
const DIFFERENCE_MIN: f64 = 1e-58;
/// Above this difference a product can overflow.
const DIFFERENCE_MAX: f64 = 1e61;

fn coord(p: Point) -> Coord3D<f64> {
    Coord3D {
        x: p.x,
        y: p.y,
        z: p.z,
    }
}

#[cold]
#[inline(never)]
fn orient_exact(a: Point, b: Point, c: Point, d: Point) -> f64 {
    -robust::orient3d(coord(a), coord(b), coord(c), coord(d))
}

#[cold]
#[inline(never)]
fn insphere_exact(a: Point, b: Point, c: Point, d: Point, e: Point) -> f64 {
    -robust::insphere(coord(a), coord(b), coord(c), coord(d), coord(e))
}

/// Six times the signed volume of `a b c d`; the sign is exact, the magnitude is not.
///
/// Positive when `d` lies on the side of the plane `a b c` from which `a b c` turn clockwise, that is
/// when `det(b-a, c-a, d-a) > 0`.
#[inline]
pub fn orient(a: Point, b: Point, c: Point, d: Point) -> f64 {
    let (u, v, w) = (b - a, c - a, d - a);
    let det = u.dot(v.cross(w));
    let m = u.abs().max(v.abs()).max(w.abs());
    if det.abs() > ORIENT_BOUND * (m.x * m.y * m.z)
        && m.min_element() > DIFFERENCE_MIN
        && m.max_element() < DIFFERENCE_MAX
    {
        return det;
    }
    orient_exact(a, b, c, d)
}

/// The sign of [`orient`] as an ordering against zero.
#[inline]
pub fn orient_sign(a: Point, b: Point, c: Point, d: Point) -> Ordering {
    orient(a, b, c, d)
        .partial_cmp(&0.0)
        .expect("coordinates are finite")
}

/// Sphere determinant of the positive tetrahedron `a b c d` and `e`: positive when `e` is inside.
///
/// The sign is exact, the magnitude is not; zero means that the five points lie on one sphere.
#[inline]
pub fn insphere(a: Point, b: Point, c: Point, d: Point, e: Point) -> f64 {
    let (a1, b1, c1, d1) = (a - e, b - e, c - e, d - e);
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
    let (al, bl, cl, dl) = (a1.dot(a1), b1.dot(b1), c1.dot(c1), d1.dot(d1));
    let det = -((dl * abc - cl * dab) + (bl * cda - al * bcd));
    let m = a1.abs().max(b1.abs()).max(c1.abs()).max(d1.abs());
    let largest = m.max_element();
    if det.abs() > INSPHERE_BOUND * (m.x * m.y * m.z) * (largest * largest)
        && m.min_element() > DIFFERENCE_MIN
        && largest < DIFFERENCE_MAX
    {
        return det;
    }
    insphere_exact(a, b, c, d, e)
}

/// Lexicographic order of coordinates, the rank that decides all ties.
#[inline]
pub fn lex_cmp(a: Point, b: Point) -> Ordering {
    (a.x, a.y, a.z)
        .partial_cmp(&(b.x, b.y, b.z))
        .expect("coordinates are finite")
}

/// Whether `e` is strictly inside the perturbed sphere of the positive tetrahedron `a b c d`.
///
/// The five points must be pairwise different. Never undecided.
#[inline]
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
        assert!(insphere_exact(o, x, y, z, Point::splat(0.3)) > 0.0);
        assert!(orient_exact(o, x, y, z) > 0.0);
    }
}
