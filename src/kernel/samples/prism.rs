//! Flat polygons, cut into triangles by their callers, and the walls between two of them.

use std::collections::HashSet;

use super::build::Builder;
use tetdb_base::geom::Point;

/// Triangles of a polygon in a plane: counter-clockwise seen from the side of `+w`.
pub(super) struct Flat {
    /// In the plane.
    pub points: Vec<[f64; 2]>,
    pub triangles: Vec<[u32; 3]>,
}

/// Frame of a prism: `at(u, v, w)` is the position of a polygon's `u`, `v` at the height `w`; `u`, `v` and `w` are
/// right-handed.
pub(super) struct Prism<'a> {
    pub at: &'a dyn Fn(f64, f64, f64) -> Point,
    /// Heights of the polygons at its lower and its upper end.
    pub heights: [f64; 2],
    /// Labels of lower end, upper end and walls.
    pub labels: [u32; 3],
}

impl Prism<'_> {
    /// Adds the prism between two triangulations of one polygon: equal points, numbered alike, and equal outer edges.
    pub fn push(&self, build: &mut Builder, lower: &Flat, upper: &[[u32; 3]]) {
        let [low, high] = self.heights.map(|w| -> Vec<u32> {
            let place = |p: &[f64; 2]| (self.at)(p[0], p[1], w);
            lower.points.iter().map(|p| build.point(place(p))).collect()
        });
        for t in &lower.triangles {
            build.triangle(t.map(|v| low[v as usize]), true, self.labels[0]);
        }
        for t in upper {
            build.triangle(t.map(|v| high[v as usize]), false, self.labels[1]);
        }
        for [v, w] in outer_edges(&lower.triangles) {
            let [v, w] = [v as usize, w as usize];
            build.triangle([low[v], low[w], high[w]], false, self.labels[2]);
            build.triangle([low[v], high[w], high[v]], false, self.labels[2]);
        }
    }
}

/// Edges with one triangle, in its direction and in the order of triangles.
fn outer_edges(triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let edges = |t: &[u32; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
    let all: HashSet<[u32; 2]> = triangles.iter().flat_map(edges).collect();
    let is_outer = |[v, w]: &[u32; 2]| !all.contains(&[*w, *v]);
    triangles.iter().flat_map(edges).filter(is_outer).collect()
}

/// Lengths of `n` pieces of 1, drawn between 1 and `ratio` times each other.
pub(super) fn pieces(n: usize, mut draw: impl FnMut() -> f64) -> Vec<f64> {
    let parts: Vec<f64> = (0..n).map(|_| draw()).collect();
    let sum: f64 = parts.iter().sum();
    parts.into_iter().map(|part| part / sum).collect()
}
