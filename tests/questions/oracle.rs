//! Exact reference answers about solids in rational numbers, by other methods than the program's: clipping, nearest points.

use dashu::rational::RBig;

use tetdb_base::geom::Point;
use tetdb_store::query::Solid;

type Vector = [RBig; 3];

fn exact(p: Point) -> Vector {
    p.to_array().map(|x| RBig::try_from(x).expect("finite"))
}

fn minus(a: &Vector, b: &Vector) -> Vector {
    [0, 1, 2].map(|i| &a[i] - &b[i])
}

fn dot(a: &Vector, b: &Vector) -> RBig {
    &a[0] * &b[0] + &a[1] * &b[1] + &a[2] * &b[2]
}

fn cross(a: &Vector, b: &Vector) -> Vector {
    let minor = |i: usize, j: usize| &a[i] * &b[j] - &a[j] * &b[i];
    [minor(1, 2), minor(2, 0), minor(0, 1)]
}

/// `a + t (b - a)`.
fn between(a: &Vector, b: &Vector, t: &RBig) -> Vector {
    [0, 1, 2].map(|i| &a[i] + t * (&b[i] - &a[i]))
}

fn volume(t: &[Vector; 4]) -> RBig {
    let [u, v, w] = [1, 2, 3].map(|i| minus(&t[i], &t[0]));
    dot(&u, &cross(&v, &w))
}

/// Returns whether the closed tetrahedron contains the point.
pub(super) fn holds(corners: &[Point; 4], p: Point) -> bool {
    let (t, p) = (corners.map(exact), exact(p));
    (0..4).all(|i| {
        let mut with = t.clone();
        with[i] = p.clone();
        volume(&with) >= RBig::ZERO
    })
}

/// The square of the distance of a point from a segment.
fn from_segment(p: &Vector, a: &Vector, b: &Vector) -> RBig {
    let e = minus(b, a);
    let t = dot(&minus(p, a), &e) / dot(&e, &e);
    let t = t.clamp(RBig::ZERO, RBig::ONE);
    let d = minus(p, &between(a, b, &t));
    dot(&d, &d)
}

/// The square of the distance of a point from a triangle.
fn from_triangle(p: &Vector, [a, b, c]: [&Vector; 3]) -> RBig {
    let n = cross(&minus(b, a), &minus(c, a));
    let height = dot(&minus(p, a), &n) / dot(&n, &n);
    let foot = [0, 1, 2].map(|i| &p[i] - &height * &n[i]);
    let inward = |u: &Vector, v: &Vector| dot(&cross(&minus(v, u), &minus(&foot, u)), &n);
    if inward(a, b) >= RBig::ZERO && inward(b, c) >= RBig::ZERO && inward(c, a) >= RBig::ZERO {
        return &height * &height * dot(&n, &n);
    }
    let sides = [(a, b), (b, c), (c, a)].map(|(u, v)| from_segment(p, u, v));
    sides.into_iter().min().expect("three of them")
}

/// The part of a convex polygon where `axis` times `sign` is at most `limit` times `sign`.
fn clip(polygon: &[Vector], axis: usize, upper: bool, limit: &RBig) -> Vec<Vector> {
    let is_in = |p: &Vector| match upper {
        true => p[axis] <= *limit,
        false => p[axis] >= *limit,
    };
    let mut left = Vec::new();
    for (i, p) in polygon.iter().enumerate() {
        let q = &polygon[(i + 1) % polygon.len()];
        if is_in(p) {
            left.push(p.clone());
        }
        if is_in(p) != is_in(q) {
            let t = (limit - &p[axis]) / (&q[axis] - &p[axis]);
            left.push(between(p, q, &t));
        }
    }
    left
}

/// Returns whether the closed tetrahedron meets the solid.
pub(super) fn meets(solid: &Solid, corners: &[Point; 4]) -> bool {
    let t = corners.map(exact);
    let triangles = [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]];
    match *solid {
        Solid::Box(bounds) => {
            let (low, high) = (exact(bounds.low), exact(bounds.high));
            let surface = triangles.iter().any(|face| {
                let mut polygon: Vec<Vector> = face.iter().map(|&i| t[i].clone()).collect();
                for axis in 0..3 {
                    polygon = clip(&polygon, axis, true, &high[axis]);
                    polygon = clip(&polygon, axis, false, &low[axis]);
                }
                !polygon.is_empty()
            });
            surface || holds(corners, bounds.low)
        }
        Solid::Sphere { center, radius } => {
            let (c, r) = (exact(center), RBig::try_from(radius).expect("finite"));
            let nearest = triangles.iter().map(|f| from_triangle(&c, f.map(|i| &t[i]))).min();
            holds(corners, center) || nearest.is_some_and(|d| d <= &r * &r)
        }
        Solid::Plane { point, normal } => {
            let (p, n) = (exact(point), exact(normal));
            let heights = t.map(|c| dot(&minus(&c, &p), &n));
            heights.iter().any(|h| *h >= RBig::ZERO) && heights.iter().any(|h| *h <= RBig::ZERO)
        }
    }
}

/// Returns whether the tetrahedron lies inside the solid.
pub(super) fn within(solid: &Solid, corners: &[Point; 4]) -> bool {
    corners.iter().all(|&c| match *solid {
        Solid::Box(b) => (0..3).all(|i| b.low[i] <= c[i] && c[i] <= b.high[i]),
        Solid::Sphere { center, radius } => {
            let (d, r) =
                (minus(&exact(c), &exact(center)), RBig::try_from(radius).expect("finite"));
            dot(&d, &d) <= &r * &r
        }
        Solid::Plane { .. } => false,
    })
}
