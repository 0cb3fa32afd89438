//! The narrowest place between triangles where recovery gave up, for the user.

use std::fmt;

use crate::mesh::{Mesh, MeshFacet};
use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::Pages;

/// Triangles examined; more pairs would take long, and the first show the cause.
const LOOKED_AT_MAX: usize = 256;

/// The narrowest place around facets that were not recovered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearness {
    /// Kind of the distance.
    pub kind: NearnessKind,
    /// Numbers of the triangles in the input, equal for [`NearnessKind::Height`].
    pub inputs: [u64; 2],
    /// Ends of the edge, or the two nearest positions.
    pub at: [Point; 2],
    /// Radians, or a length in shares of the longest edge; as exact as doubles are.
    pub value: f64,
}

/// Kind of a narrow place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NearnessKind {
    /// The dihedral angle at a shared edge.
    Angle,
    /// The distance between triangles.
    Gap,
    /// The height of a triangle.
    Height,
}

impl fmt::Display for Nearness {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([t, u], [a, b]) = (self.inputs, self.at.map(|p| p.to_array()));
        let value = self.value;
        match self.kind {
            NearnessKind::Angle => write!(
                f,
                "triangles {t} and {u} meet at a dihedral angle of {value:.1e} rad at the edge {a:?} {b:?}"
            ),
            NearnessKind::Gap => write!(
                f,
                "triangles {t} and {u} are {value:.1e} of their size apart near {a:?} {b:?}"
            ),
            NearnessKind::Height => {
                write!(f, "triangle {t} is {value:.1e} of its length high at the edge {a:?} {b:?}")
            }
        }
    }
}

/// The narrowest place among the facets whose boxes meet that of one of `facets`.
pub(super) fn narrowest<P: Pages>(mesh: &mut Mesh<P>, facets: &[u32]) -> Option<Nearness> {
    let corners = |mesh: &mut Mesh<P>, f: &MeshFacet| f.vertices.map(|v| mesh.point(v));
    let mut boxes = Vec::new();
    for &n in facets.iter().take(LOOKED_AT_MAX) {
        let f = mesh.facet(n);
        boxes.push(Aabb::around(corners(mesh, &f)));
    }
    let mut around: Vec<(MeshFacet, [Point; 3])> = Vec::new();
    for n in 0..mesh.n_facets() {
        let f = mesh.facet(n);
        let p = corners(mesh, &f);
        let own = Aabb::around(p);
        if around.len() < LOOKED_AT_MAX && boxes.iter().any(|b| b.meets(&own)) {
            around.push((f, p));
        }
    }
    let mut narrowest: Option<Nearness> = None;
    let mut note = |found: Nearness| {
        if narrowest.is_none_or(|known| found.value < known.value) {
            narrowest = Some(found);
        }
    };
    for (i, f) in around.iter().enumerate() {
        note(height(f));
        for g in &around[..i] {
            between(f, g).into_iter().for_each(&mut note);
        }
    }
    narrowest
}

fn height((f, p): &(MeshFacet, [Point; 3])) -> Nearness {
    let k = (0..3).max_by(|&i, &j| length(p, i).total_cmp(&length(p, j))).unwrap_or(0);
    let [a, b, c] = [0, 1, 2].map(|i| p[(k + i) % 3]);
    let along = b - a;
    Nearness {
        kind: NearnessKind::Height,
        inputs: [f.input; 2],
        at: [a, b],
        value: along.cross(c - a).length() / along.length_squared(),
    }
}

fn length(p: &[Point; 3], i: usize) -> f64 {
    p[i].distance(p[(i + 1) % 3])
}

/// The angle of two facets with a common edge, else their distance outside shared parts.
fn between((f, p): &(MeshFacet, [Point; 3]), (g, q): &(MeshFacet, [Point; 3])) -> Option<Nearness> {
    let shared = |v: u32| g.vertices.contains(&v);
    let inputs = [g.input, f.input];
    if f.vertices.iter().filter(|&&v| shared(v)).count() >= 2 {
        let k = (0..3).find(|&k| !shared(f.vertices[k]))?;
        let l = (0..3).find(|&l| !f.vertices.contains(&g.vertices[l]))?;
        let (a, b) = (p[(k + 1) % 3], p[(k + 2) % 3]);
        let [u, v] = [p[k], q[l]].map(|x| (x - a).reject_from(b - a));
        return Some(Nearness {
            kind: NearnessKind::Angle,
            inputs,
            at: [a, b],
            value: u.cross(v).length().atan2(u.dot(v)),
        });
    }
    let size = (0..3).map(|i| length(p, i).max(length(q, i))).fold(0.0, f64::max);
    let mut nearest: Option<[Point; 2]> = None;
    let mut note = |x: Point, y: Point| {
        if nearest.is_none_or(|[a, b]| x.distance(y) < a.distance(b)) {
            nearest = Some([x, y]);
        }
    };
    let side = |f: &MeshFacet, i: usize| [f.vertices[i], f.vertices[(i + 1) % 3]];
    for i in 0..3 {
        if !shared(f.vertices[i]) {
            on_triangle(p[i], q).into_iter().for_each(|y| note(p[i], y));
        }
        if !f.vertices.contains(&g.vertices[i]) {
            on_triangle(q[i], p).into_iter().for_each(|x| note(x, q[i]));
        }
        for j in 0..3 {
            if !side(f, i).iter().any(|v| side(g, j).contains(v)) {
                let [x, y] = nearest_on([p[i], p[(i + 1) % 3]], [q[j], q[(j + 1) % 3]]);
                note(x, y);
            }
        }
    }
    let at = nearest?;
    Some(Nearness { kind: NearnessKind::Gap, inputs, at, value: at[0].distance(at[1]) / size })
}

/// The foot of `x` on the triangle, if it is inside.
fn on_triangle(x: Point, [a, b, c]: &[Point; 3]) -> Option<Point> {
    let n = (*b - *a).cross(*c - *a);
    let inside =
        [(a, b), (b, c), (c, a)].into_iter().all(|(p, q)| (*q - *p).cross(x - *p).dot(n) >= 0.0);
    (inside && n != Point::ZERO).then(|| x - n * ((x - *a).dot(n) / n.length_squared()))
}

/// The nearest points of two segments.
fn nearest_on([a, b]: [Point; 2], [c, d]: [Point; 2]) -> [Point; 2] {
    let (u, v, w) = (b - a, d - c, a - c);
    let (uu, uv, vv, uw, vw) = (u.dot(u), u.dot(v), v.dot(v), u.dot(w), v.dot(w));
    let det = uu * vv - uv * uv;
    let s = if det > 0.0 { ((uv * vw - vv * uw) / det).clamp(0.0, 1.0) } else { 0.0 };
    let t = ((uv * s + vw) / vv).clamp(0.0, 1.0);
    // With one clamped, the other has to be found again.
    let s = ((uv * t - uw) / uu).clamp(0.0, 1.0);
    [a + u * s, c + v * t]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_are_nearest_where_they_pass_or_end() {
        let [x, y] = nearest_on(
            [Point::new(-1.0, 0.0, 0.0), Point::new(3.0, 0.0, 0.0)],
            [Point::new(0.0, -1.0, 1e-9), Point::new(0.0, 1.0, 1e-9)],
        );
        assert!((x.distance(y) - 1e-9).abs() < 1e-15);
        let [x, y] = nearest_on([Point::ZERO, Point::X], [Point::X * 2.0, Point::X * 3.0]);
        assert_eq!(x.distance(y), 1.0);
    }
}
