//! Boxes, balls and planes, and which tetrahedra meet them: exactly, touching is meeting.

use std::cmp::Ordering;

use tetdb_schema::record::FACES;

use super::exact::{Near, Ring, Vector, not_negative};
use tetdb_base::geom::{Aabb, Dyadic, Point, orient_sign};

/// A closed set of points. Invariant: its numbers are finite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Solid {
    /// An axis-aligned box.
    Box(Aabb),
    /// A full sphere.
    Sphere {
        /// Center.
        center: Point,
        /// Radius, in input units.
        radius: f64,
    },
    /// The plane through a point, orthogonal to a direction that is not zero.
    Plane {
        /// A point of the plane.
        point: Point,
        /// The direction orthogonal to it; any length but zero.
        normal: Point,
    },
}

/// Corners of the six edges.
const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

impl Solid {
    /// A box around the solid, or `None` where it is not bounded.
    pub fn bounds(&self) -> Option<Aabb> {
        match *self {
            Self::Box(bounds) => Some(bounds),
            Self::Sphere { center, radius } => {
                let outward =
                    |p: Point, to: fn(f64) -> f64| Point::from_array(p.to_array().map(to));
                Some(Aabb {
                    low: outward(center - radius, f64::next_down),
                    high: outward(center + radius, f64::next_up),
                })
            }
            Self::Plane { .. } => None,
        }
    }

    /// Returns whether a tetrahedron within `bounds` may meet the solid; false is certain.
    pub fn may_meet(&self, bounds: &Aabb) -> bool {
        match *self {
            Self::Box(own) => own.meets(bounds),
            Self::Sphere { center, radius } => {
                let nearest = center.clamp(bounds.low, bounds.high);
                (center - nearest).length_squared() <= radius * radius * (1.0 + 1e-12)
                    && self.bounds().is_some_and(|own| own.meets(bounds))
            }
            Self::Plane { point, normal } => {
                let (low, high) = (bounds.low - point, bounds.high - point);
                let (a, b) = (low * normal, high * normal);
                let slack = 1e-12 * (a.abs().max(b.abs())).element_sum();
                let (least, most) = (a.min(b).element_sum(), a.max(b).element_sum());
                // Also true when something is not a number.
                !(least > slack || most < -slack)
            }
        }
    }

    /// Returns whether a tetrahedron has a point in common with the solid. `corners` are positive.
    pub fn meets(&self, corners: &[Point; 4]) -> bool {
        let around = Aabb::around(*corners);
        if !self.may_meet(&around) {
            return false;
        }
        match *self {
            Self::Box(own) => box_meets(&own, &around, corners),
            Self::Sphere { center, radius } => ball_meets::<Near>(center, radius, corners)
                .or_else(|| ball_meets::<Dyadic>(center, radius, corners))
                .expect("exact signs are known"),
            Self::Plane { point, normal } => {
                let signs = corners.map(|c| side(point, normal, c));
                !(signs.iter().all(|s| s.is_gt()) || signs.iter().all(|s| s.is_lt()))
            }
        }
    }

    /// Returns whether a tetrahedron is wholly in the solid; never in a plane.
    pub fn holds(&self, corners: &[Point; 4]) -> bool {
        match *self {
            Self::Box(own) => {
                corners.iter().all(|c| own.low.cmple(*c).all() && c.cmple(own.high).all())
            }
            Self::Sphere { center, radius } => {
                corners.iter().all(|&c| is_within(center, radius, c))
            }
            Self::Plane { .. } => false,
        }
    }
}

fn side(point: Point, normal: Point, c: Point) -> Ordering {
    fn sign<R: Ring>(point: Point, normal: Point, c: Point) -> Option<Ordering> {
        Vector::<R>::between(point, c).dot(&Vector::from_point(normal)).sign()
    }
    sign::<Near>(point, normal, c)
        .or_else(|| sign::<Dyadic>(point, normal, c))
        .expect("exact signs are known")
}

fn is_within(center: Point, radius: f64, c: Point) -> bool {
    fn within<R: Ring>(center: Point, radius: f64, c: Point) -> Option<bool> {
        let to = Vector::<R>::between(center, c);
        not_negative(&R::from_f64(radius).times(&R::from_f64(radius)).minus(&to.dot(&to)))
    }
    within::<Near>(center, radius, c)
        .or_else(|| within::<Dyadic>(center, radius, c))
        .expect("exact signs are known")
}

/// Returns whether a ball meets a tetrahedron: the center is in it, or a corner, edge or face is near enough.
///
/// Each test is about the position and distance of a nearest point; `None` when a sign is not known.
fn ball_meets<R: Ring>(center: Point, radius: f64, corners: &[Point; 4]) -> Option<bool> {
    let behind = |f: &[usize; 3]| {
        let [a, b, c] = f.map(|i| corners[i]);
        orient_sign(a, b, c, center).is_le()
    };
    // Faces turn counter-clockwise seen from outside, where `orient` is positive.
    if FACES.iter().all(behind) {
        return Some(true);
    }
    let square = R::from_f64(radius).times(&R::from_f64(radius));
    let to: [Vector<R>; 4] = corners.map(|c| Vector::between(c, center));
    let mut doubt = false;
    let mut settle = |answer: Option<bool>| {
        doubt |= answer.is_none();
        answer == Some(true)
    };
    for to in &to {
        if settle(not_negative(&square.minus(&to.dot(to)))) {
            return Some(true);
        }
    }
    for [i, j] in EDGES {
        if settle(edge_is_near(corners[i], corners[j], &to[i], &square)) {
            return Some(true);
        }
    }
    for face in FACES {
        let [a, b, c] = face.map(|i| corners[i]);
        let [ta, tb, tc] = face.map(|i| &to[i]);
        if settle(face_is_near([a, b, c], [ta, tb, tc], &square)) {
            return Some(true);
        }
    }
    (!doubt).then_some(false)
}

/// The nearest point of the line is between `a` and `b`, and within the square of the radius.
fn edge_is_near<R: Ring>(a: Point, b: Point, to: &Vector<R>, square: &R) -> Option<bool> {
    let edge = Vector::<R>::between(a, b);
    let (along, length) = (edge.dot(to), edge.dot(&edge));
    let between = and(not_negative(&along), not_negative(&length.minus(&along)));
    let distance = to.dot(to).times(&length).minus(&along.times(&along));
    and(between, not_negative(&square.times(&length).minus(&distance)))
}

/// The nearest point of the plane is in the triangle, and within the square of the radius.
fn face_is_near<R: Ring>([a, b, c]: [Point; 3], to: [&Vector<R>; 3], square: &R) -> Option<bool> {
    let normal = Vector::<R>::between(a, b).cross(&Vector::between(a, c));
    let mut above = Some(true);
    for (u, v, to) in [(a, b, to[0]), (b, c, to[1]), (c, a, to[2])] {
        let inward = Vector::between(u, v).cross(to).dot(&normal);
        above = and(above, not_negative(&inward));
    }
    let height = to[0].dot(&normal);
    let reach = square.times(&normal.dot(&normal));
    and(above, not_negative(&reach.minus(&height.times(&height))))
}

/// Conjunction where it is known: one false operand decides.
fn and(a: Option<bool>, b: Option<bool>) -> Option<bool> {
    match (a, b) {
        (Some(false), _) | (_, Some(false)) => Some(false),
        (Some(true), Some(true)) => Some(true),
        _ => None,
    }
}

/// Returns whether a box meets a tetrahedron: no face plane and no direction orthogonal to an edge of each separates them.
///
/// The box is first cut to that of the tetrahedron, which changes nothing and brings its numbers near.
fn box_meets(own: &Aabb, around: &Aabb, corners: &[Point; 4]) -> bool {
    let cut = Aabb { low: own.low.max(around.low), high: own.high.min(around.high) };
    let ends = [cut.low, cut.high];
    let of_box =
        |bits: usize| Point::new(ends[bits & 1].x, ends[bits >> 1 & 1].y, ends[bits >> 2 & 1].z);
    let apart = |f: &[usize; 3]| {
        let [a, b, c] = f.map(|i| corners[i]);
        (0..8).all(|bits| orient_sign(a, b, c, of_box(bits)).is_gt())
    };
    if FACES.iter().any(apart) {
        return false;
    }
    let height = (around.high - around.low).max_element();
    (0..3).all(|axis| EDGES.iter().all(|edge| !apart_along(axis, *edge, corners, &ends, height)))
}

/// Returns whether, seen along an axis, the line through an edge has the tetrahedron on one side and the box on the other.
fn apart_along(
    axis: usize,
    [i, j]: [usize; 2],
    corners: &[Point; 4],
    ends: &[Point; 2],
    height: f64,
) -> bool {
    let flat = |p: Point| match axis {
        0 => [p.y, p.z],
        1 => [p.z, p.x],
        _ => [p.x, p.y],
    };
    let (a, b) = (flat(corners[i]), flat(corners[j]));
    // The sign of an area is that of a volume of any height; one like the others suits the filters of `orient`.
    let point = |[x, y]: [f64; 2]| Point::new(x, y, 0.0);
    let (p, q) = (point(a), point(b));
    let turn = |c: [f64; 2]| orient_sign(p, q, point(c), Point::new(a[0], a[1], height));
    let mut own = Ordering::Equal;
    for k in (0..4).filter(|&k| k != i && k != j) {
        let sign = turn(flat(corners[k]));
        if sign != Ordering::Equal {
            if own == sign.reverse() {
                return false;
            }
            own = sign;
        }
    }
    let [low, high] = [flat(ends[0]), flat(ends[1])];
    let rectangle = [low, [high[0], low[1]], high, [low[0], high[1]]];
    own != Ordering::Equal && rectangle.iter().all(|&c| turn(c) == own.reverse())
}
