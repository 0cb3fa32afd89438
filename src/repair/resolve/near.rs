//! Triangles that nearly touch are made to share what they nearly touch in.
//!
//! ```text
//!     ------*------ f         Walls of two parts that were meant to be one plane, and are off it by rounding, cross in a line of no
//!          / \                meaning, and rounding makes new such lines. So a vertex near an edge or a triangle becomes a vertex of
//!     ----*---*---- e         it, and edges near each other get a common vertex. What the walls share is the same triangles then.
//! ```

use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};

use super::{Resolved, edges_of};
use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::{ScratchSpace, check_cancelled};
use tetdb_base::surface::{
    BoxTree, Surface, VertexTable, drop_unused_points, replace_triangles, weld_near,
};

/// Rounds at most: each divides one edge of a triangle, or the triangle at one vertex.
const ROUNDS_MAX: usize = 64;

/// A vertex that others are divided at, or a place where two edges are.
#[derive(Clone, Copy)]
enum Touch {
    /// A vertex near an edge.
    Edge([u32; 2], u32),
    /// A vertex near a triangle, and not near its edges.
    Face(u32, u32),
    /// Two edges near each other.
    Edges([u32; 2], [u32; 2]),
}

/// Joins vertices, and divides edges and triangles, that are nearer to each other than `reach`.
pub fn join_near(surface: &mut Surface, reach: f64, scratch: &ScratchSpace, done: &mut Resolved) {
    for _ in 0..ROUNDS_MAX {
        check_cancelled();
        weld_near(surface, reach);
        done.merge(surface);
        let found = touches(surface, reach, scratch);
        if found.is_empty() {
            break;
        }
        done.divided += divide(surface, &found);
        done.moved_most = done.moved_most.max(reach);
    }
    drop_unused_points(surface);
}

fn touches(surface: &Surface, reach: f64, scratch: &ScratchSpace) -> Vec<Touch> {
    let around = |t: u32| {
        let Aabb { low, high } = Aabb::around(surface.corners(t));
        Aabb { low: low - Point::splat(reach), high: high + Point::splat(reach) }
    };
    let n = surface.n_triangles() as u32;
    let tree = BoxTree::new(&surface.bounds(), n, scratch, |_| true, around);
    let (found, _) = tree.pairs(usize::MAX, |a, b| {
        let mut found = Vec::new();
        for (t, other) in [(a, b), (b, a)] {
            of_vertices(surface, t, other, reach, &mut found);
        }
        of_edges(surface, a, b, reach, &mut found);
        (!found.is_empty()).then_some(found)
    });
    let mut found: Vec<Touch> = found.into_iter().flatten().collect();
    // The apex of a triangle without height is on its longest edge.
    for t in 0..n {
        let corners = surface.triangles[t as usize];
        for k in 0..3 {
            let [a, b, c] = [corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]];
            if is_inside(surface, [a, b], c, reach) {
                found.push(Touch::Edge([a.min(b), a.max(b)], c));
            }
        }
    }
    found
}

fn at(surface: &Surface, v: u32) -> Point {
    surface.points[v as usize]
}

/// The point of a segment nearest to `p`.
fn nearest_on([a, b]: [Point; 2], p: Point) -> Point {
    let along = b - a;
    a + along * ((p - a).dot(along) / along.length_squared()).clamp(0.0, 1.0)
}

/// Returns whether vertex `v` is near an edge and not near its ends.
fn is_inside(surface: &Surface, edge: [u32; 2], v: u32, reach: f64) -> bool {
    let (ends, p) = (edge.map(|v| at(surface, v)), at(surface, v));
    p.distance(nearest_on(ends, p)) <= reach && ends.iter().all(|end| end.distance(p) > reach)
}

/// Vertices of `other` near `t`.
fn of_vertices(surface: &Surface, t: u32, other: u32, reach: f64, found: &mut Vec<Touch>) {
    let corners = surface.triangles[t as usize];
    let points = surface.corners(t);
    let normal = (points[1] - points[0]).cross(points[2] - points[0]).normalize_or_zero();
    for v in surface.triangles[other as usize] {
        let p = at(surface, v);
        if corners.contains(&v) || points.iter().any(|q| q.distance(p) <= reach) {
            continue;
        }
        // A triangle without height has no direction, and its vertices are near its edges.
        if (p - points[0]).dot(normal).abs() > 2.0 * reach {
            continue;
        }
        let edge = edges_of(corners).into_iter().find(|&edge| is_inside(surface, edge, v, reach));
        if let Some(edge) = edge {
            found.push(Touch::Edge(edge, v));
            continue;
        }
        let is_within = (0..3).all(|k| {
            let (a, b) = (points[k], points[(k + 1) % 3]);
            normal.cross(b - a).dot(p - a) > 0.0
        });
        if is_within && (p - points[0]).dot(normal).abs() <= reach {
            found.push(Touch::Face(t, v));
        }
    }
}

/// Edges of two triangles near each other, away from their ends.
fn of_edges(surface: &Surface, t: u32, other: u32, reach: f64, found: &mut Vec<Touch>) {
    for e in edges_of(surface.triangles[t as usize]) {
        for f in edges_of(surface.triangles[other as usize]) {
            if e.iter().any(|v| f.contains(v)) {
                continue;
            }
            let (e, f) = (e.min(f), e.max(f));
            let Some([p, q]) = closest(e.map(|v| at(surface, v)), f.map(|v| at(surface, v))) else {
                continue;
            };
            let is_free = |edge: [u32; 2], x: Point| {
                edge.into_iter().all(|v| at(surface, v).distance(x) > reach)
            };
            if p.distance(q) <= reach && is_free(e, p) && is_free(f, q) {
                found.push(Touch::Edges(e, f));
            }
        }
    }
}

/// The points at which the lines through two segments are closest, if both are inside these.
fn closest([a, b]: [Point; 2], [c, d]: [Point; 2]) -> Option<[Point; 2]> {
    let (u, v, w) = (b - a, d - c, c - a);
    let across = u.cross(v);
    let square = across.length_squared();
    let (s, t) = (w.cross(v).dot(across) / square, w.cross(u).dot(across) / square);
    let inside = |x: f64| x > 0.0 && x < 1.0;
    (square > 0.0 && inside(s) && inside(t)).then(|| [a + u * s, c + v * t])
}

/// Divides triangles at the vertices on one of their edges, or else at one vertex on them.
fn divide(surface: &mut Surface, found: &[Touch]) -> usize {
    let mut on_edges: BTreeMap<[u32; 2], BTreeSet<u32>> = BTreeMap::new();
    let mut on_faces: BTreeMap<u32, u32> = BTreeMap::new();
    let mut crossings: BTreeSet<[[u32; 2]; 2]> = BTreeSet::new();
    for touch in found {
        match *touch {
            Touch::Edge(edge, v) => _ = on_edges.entry(edge).or_default().insert(v),
            Touch::Face(t, v) => _ = on_faces.entry(t).and_modify(|w| *w = v.min(*w)).or_insert(v),
            Touch::Edges(e, f) => _ = crossings.insert([e, f]),
        }
    }
    let mut table = VertexTable::new(&surface.points);
    let is_busy: BTreeSet<[u32; 2]> = on_edges.keys().copied().collect();
    for [e, f] in crossings {
        // Vertices near one of them come first; the next round sees what is left.
        let ends = [e, f].map(|edge| edge.map(|v| at(surface, v)));
        if let (false, Some([p, q])) =
            (is_busy.contains(&e) || is_busy.contains(&f), closest(ends[0], ends[1]))
        {
            let v = table.find_or_add(p.midpoint(q) + Point::ZERO, &mut surface.points);
            on_edges.entry(e).or_default().insert(v);
            on_edges.entry(f).or_default().insert(v);
        }
    }
    let points = surface.points.clone();
    let n = Cell::new(0);
    replace_triangles(surface, |t, triangle, pieces| {
        let [a, b, c] = triangle;
        let sides = [[a, b, c], [b, c, a], [c, a, b]];
        let divided = sides.into_iter().find_map(|[a, b, apex]| {
            let on = on_edges.get(&[a.min(b), a.max(b)])?;
            Some((a, b, apex, on))
        });
        if let Some((a, b, apex, on)) = divided {
            let from = points[a as usize];
            let along = |v: u32| (points[v as usize] - from).dot(points[b as usize] - from);
            let mut chain: Vec<u32> = on.iter().copied().collect();
            chain.sort_by(|&v, &w| along(v).total_cmp(&along(w)).then(v.cmp(&w)));
            chain.insert(0, a);
            chain.push(b);
            n.set(n.get() + 1);
            let fan = chain.windows(2).map(|pair| [pair[0], pair[1], apex]);
            pieces.extend(fan.filter(|[p, q, r]| p != q && q != r && r != p));
        } else if let Some(&v) = on_faces.get(&t) {
            pieces.extend(sides.map(|[a, b, _]| [a, b, v]));
            n.set(n.get() + 1);
        } else {
            pieces.push(triangle);
        }
    });
    n.get()
}
