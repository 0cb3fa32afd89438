//! The open edges of a surface: boundary loops of its holes, and vertices that lie on open edges.

use rayon::prelude::*;

use super::Surface;
use super::edges::{Closedness, ends, in_line, open_groups};
use super::point_tree::PointTree;
use crate::geom::{Aabb, Point};
use crate::storage::parallel;

/// Vertices as near as this to an open edge count as lying on it, as a share of the box diagonal.
///
/// Single precision rounds to 6e-8 of a coordinate; a vertex meant to lie on an edge is rarely farther off.
pub(super) const JUNCTION_SHARE: f64 = 1e-6;
/// Vertices as near as this to an end of an edge are meant to be that end, as a share of the box diagonal.
const GAP_SHARE: f64 = 1e-9;
/// A connected group of open edges: the boundary of a hole.
#[derive(Clone, Debug, PartialEq)]
pub struct BoundaryLoop {
    /// Number of edges.
    pub n_edges: usize,
    /// Sum of their lengths, in input units.
    pub length: f64,
    /// The first triangle along it.
    pub triangle: u32,
    /// The middle of that triangle's first open edge.
    pub at: Point,
}

/// A vertex on an open edge of a triangle that does not have it: the two sides of a seam are divided unlike.
#[derive(Clone, Debug, PartialEq)]
pub struct TJunction {
    /// Index of the vertex.
    pub vertex: u32,
    /// Its position.
    pub at: Point,
    /// The triangle and the edge (in its direction) the vertex lies on.
    pub triangle: u32,
    /// Vertices of the edge.
    pub edge: [u32; 2],
    /// From the vertex to the edge; 0 means exactly in line.
    pub distance: f64,
}

/// The boundary loops of all holes, the longest first.
pub fn boundary_loops(surface: &Surface, closedness: &Closedness) -> Vec<BoundaryLoop> {
    let groups = open_groups(&closedness.open);
    let n_groups = groups.iter().max().map_or(0, |&g| g as usize + 1);
    let mut boundary_loops: Vec<Option<BoundaryLoop>> = vec![None; n_groups];
    for (&group, &(triangle, edge)) in groups.iter().zip(&closedness.open) {
        let [a, b] = edge.map(|v| surface.points[v as usize]);
        let rim = boundary_loops[group as usize].get_or_insert(BoundaryLoop {
            n_edges: 0,
            length: 0.0,
            triangle,
            at: a.midpoint(b),
        });
        rim.n_edges += 1;
        rim.length += a.distance(b);
    }
    let mut boundary_loops: Vec<BoundaryLoop> = boundary_loops.into_iter().flatten().collect();
    boundary_loops.sort_by(|a, b| {
        let by_length = b.length.total_cmp(&a.length);
        by_length.then(a.triangle.cmp(&b.triangle))
    });
    boundary_loops
}

/// Vertices of open edges that lie on another open edge, not farther than `distance_max` from it, in order of the edges.
///
/// A vertex near an end of the edge is a gap, not a junction. Several vertices on one edge are all listed.
pub fn t_junctions(
    surface: &Surface,
    closedness: &Closedness,
    distance_max: f64,
) -> Vec<TJunction> {
    if closedness.open.is_empty() {
        return Vec::new();
    }
    let point = |v: u32| surface.points[v as usize];
    let ends = ends(&closedness.open);
    let tree = PointTree::new(ends.into_iter().map(|v| (v, point(v))).collect());
    let gap = GAP_SHARE * surface.bounds().diagonal();
    let margin = Point::splat(distance_max);
    let on_open_edge = |&(triangle, edge): &(u32, [u32; 2])| {
        let [a, b] = edge.map(point);
        let beside = Aabb { low: a.min(b) - margin, high: a.max(b) + margin };
        let mut found = Vec::new();
        tree.within(&beside, |vertex, at| {
            if edge.contains(&vertex) {
                return;
            }
            if let Some(distance) = on_edge(at, [a, b], distance_max, gap) {
                found.push(TJunction { vertex, at, triangle, edge, distance });
            }
        });
        found.sort_unstable_by_key(|junction| junction.vertex);
        found
    };
    let open = closedness.open.par_iter();
    parallel(|| open.flat_map_iter(on_open_edge).collect())
}

/// For each of the ascending `distances`, whether [`t_junctions`] would find more than the vertices exactly in line.
pub(super) fn has_near_junctions(
    surface: &Surface,
    closedness: &Closedness,
    distances: &[f64],
) -> Vec<bool> {
    let point = |v: u32| surface.points[v as usize];
    let farthest = distances.last().copied().unwrap_or(0.0);
    let tree = PointTree::new(ends(&closedness.open).into_iter().map(|v| (v, point(v))).collect());
    let gap = GAP_SHARE * surface.bounds().diagonal();
    let margin = Point::splat(farthest);
    let beside = |(_, edge): &(u32, [u32; 2])| {
        let [a, b] = edge.map(point);
        let bounds = Aabb { low: a.min(b) - margin, high: a.max(b) + margin };
        let mut found = vec![false; distances.len()];
        tree.within(&bounds, |vertex, p| {
            let to_end = p.distance(a).min(p.distance(b));
            if edge.contains(&vertex) || to_end <= gap {
                return;
            }
            let Some(distance) = to_inside([a, b], p).filter(|&d| d <= farthest) else {
                return;
            };
            let mut near = distances.iter().map(|&max| distance <= max && max < to_end);
            if near.clone().any(|n| n) && !in_line(a, p, b) {
                found.iter_mut().for_each(|f| *f |= near.next() == Some(true));
            }
        });
        found
    };
    let either = |a: Vec<bool>, b: Vec<bool>| a.iter().zip(b).map(|(a, b)| *a || b).collect();
    let open = closedness.open.par_iter();
    parallel(|| open.map(beside).reduce(|| vec![false; distances.len()], either))
}

/// Distance of `p` from the inside of the segment; `None` beyond `distance_max`, or near an end.
///
/// Exactly in line, only `gap` counts as near to an end.
fn on_edge(p: Point, [a, b]: [Point; 2], distance_max: f64, gap: f64) -> Option<f64> {
    let to_end = p.distance(a).min(p.distance(b));
    if in_line(a, p, b) {
        let is_between = a.min(b).cmple(p).all() && p.cmple(a.max(b)).all();
        return (is_between && to_end > gap).then_some(0.0);
    }
    if to_end <= distance_max.max(gap) {
        return None;
    }
    to_inside([a, b], p).filter(|&distance| distance <= distance_max)
}

/// Distance of `p` from the segment, if the nearest point lies between its ends.
fn to_inside([a, b]: [Point; 2], p: Point) -> Option<f64> {
    let share = (p - a).dot(b - a) / (b - a).length_squared();
    (share > 0.0 && share < 1.0).then(|| p.distance(a + (b - a) * share))
}
