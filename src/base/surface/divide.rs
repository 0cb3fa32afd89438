//! Divides triangles at embedded vertices that lie on them.
//!
//! A vertex exactly inside a triangle divides it in three. A vertex exactly on an edge divides each triangle at that
//! edge in two. The surface stays the same set of points. A vertex off the triangle by a rounding error would bend the
//! surface, so it divides nothing.

use std::collections::HashMap;

use super::box_pairs::tree_of;
use super::embedded_contact::{has_area, is_on_edge, point_at_triangle};
use super::point_table::PointTable;
use super::split::swap_inside;
use super::{EmbeddedSet, Surface, SurfaceError};
use crate::geom::{Aabb, Point};
use crate::storage::ScratchSpace;

impl Surface {
    /// Divides triangles where vertices of `set` lie exactly on them; returns how many of these there are.
    ///
    /// Labels and sheets are kept; support triangles are dropped, see [`Surface::add_support_triangles`]. The parts of
    /// a triangle stand at its place in the order. Memory: about 200 bytes for each vertex and the tree.
    ///
    /// # Errors
    /// [`SurfaceError::TooLarge`].
    pub fn divide_at(
        &mut self,
        set: &EmbeddedSet,
        scratch: &ScratchSpace,
    ) -> Result<usize, SurfaceError> {
        self.drop_support_triangles();
        let tree = tree_of(self, scratch, |t| has_area(&self.corners(t)));
        let mut table = PointTable::new(&self.points);
        let mut points = std::mem::take(&mut self.points);
        let mut pieces = TrianglePieces::new(&self.triangles);
        let mut vertices = HashMap::new();
        let mut n = 0;
        let ends = set.edges.iter().flat_map(|&[a, b, _]| [a, b]);
        for v in ends.chain(set.marks.iter().map(|&[v, _]| v)) {
            let (p, n_before) = (set.points[v as usize] + Point::ZERO, points.len());
            let vertex = table.find_or_add(p, &mut points);
            vertices.insert(v, vertex);
            if points.len() == n_before {
                continue;
            }
            let mut at = Vec::new();
            tree.meeting(&Aabb::around([p]), |t| at.extend(pieces.at(t, p, &points)));
            at.iter().for_each(|&t| pieces.divide(t, vertex, &points));
            n += usize::from(!at.is_empty());
            SurfaceError::check_size("triangles", pieces.corners.len())?;
        }
        self.points = points;
        if n > 0 {
            // New edges that are embedded edges are not swapped.
            let own = self.embedded.edges.len();
            let edges = set.edges.iter();
            (self.embedded.edges).extend(edges.map(|[a, b, _]| [vertices[a], vertices[b], 0]));
            self.take(&pieces);
            self.embedded.edges.truncate(own);
        }
        Ok(n)
    }

    /// Replaces each divided triangle by its pieces.
    fn take(&mut self, pieces: &TrianglePieces) {
        let n = self.triangles.len() as u32;
        let mut whole = std::mem::take(self);
        whole.triangles = Vec::with_capacity(pieces.corners.len());
        let labels = std::mem::take(&mut whole.labels);
        let sheets = std::mem::take(&mut whole.sheets);
        let mut parent = Vec::with_capacity(pieces.corners.len());
        for t in 0..n {
            for piece in pieces.leaves(t) {
                whole.triangles.push(pieces.corners[piece as usize]);
                whole.labels.push(labels[t as usize]);
                whole.sheets.extend(sheets.get(t as usize));
                parent.push(t);
            }
        }
        *self = swap_inside(whole, parent, |t| pieces.parts.contains_key(&t));
    }
}

/// Triangles, pieces of them and pieces of pieces.
struct TrianglePieces {
    corners: Vec<[u32; 3]>,
    /// The parts of a divided triangle: number of the first, and count.
    parts: HashMap<u32, (u32, u32)>,
}

impl TrianglePieces {
    fn new(triangles: &[[u32; 3]]) -> Self {
        Self { corners: triangles.to_vec(), parts: HashMap::new() }
    }

    /// The undivided ones in `t` that `p`, which is no corner, lies on.
    fn at(&self, t: u32, p: Point, points: &[Point]) -> Vec<u32> {
        let corners = |t: u32| self.corners[t as usize].map(|v| points[v as usize]);
        self.reached(t, |t| point_at_triangle(p, &corners(t)).is_some())
    }

    /// The undivided ones in `t`.
    fn leaves(&self, t: u32) -> Vec<u32> {
        self.reached(t, |_| true)
    }

    fn reached(&self, t: u32, is_meant: impl Fn(u32) -> bool) -> Vec<u32> {
        let (mut stack, mut found) = (vec![t], Vec::new());
        while let Some(t) = stack.pop() {
            match self.parts.get(&t) {
                _ if !is_meant(t) => {}
                Some(&(first, n)) => stack.extend((first..first + n).rev()),
                None => found.push(t),
            }
        }
        found
    }

    /// Divides `t` at a vertex that lies on it.
    fn divide(&mut self, t: u32, v: u32, points: &[Point]) {
        let corners = self.corners[t as usize];
        let first = self.corners.len() as u32;
        let turned = |k: usize| [0, 1, 2].map(|i| corners[(k + i) % 3]);
        let p = points[v as usize];
        let edge = [0, 1, 2].into_iter().find(|&k| {
            let [a, b, _] = turned(k).map(|v| points[v as usize]);
            is_on_edge(p, [a, b])
        });
        match edge.map(turned) {
            Some([a, b, c]) => self.corners.extend([[a, v, c], [v, b, c]]),
            None => (self.corners).extend([0, 1, 2].map(|k| [corners[k], corners[(k + 1) % 3], v])),
        }
        self.parts.insert(t, (first, self.corners.len() as u32 - first));
    }
}
