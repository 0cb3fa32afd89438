//! Divides triangles at embedded vertices that lie on them, and moves embedded vertices onto them.
//!
//! A vertex inside a triangle divides it in three. A vertex on an edge divides each triangle at that edge in two. A
//! vertex that lies exactly there leaves the surface the same set of points. One that lies there but for rounding, or
//! was moved there, bends it by rounding. Which triangles it divides then follows from the triangles' vertices alone, so
//! the surface stays closed. Validation afterwards finds out, with exact signs, whether the bend does harm.

use std::collections::{HashMap, HashSet};

use super::box_pairs::tree_of;
use super::embedded::NEAR_SHARE;
use super::embedded_contact::{has_area, is_on_edge, point_at_triangle};
use super::seeker::{nearest_on_edge, nearest_point};
use super::split::swap_inside;
use super::vertex_table::VertexTable;
use super::{BoxTree, EmbeddedSet, Surface, SurfaceError};
use crate::geom::{Aabb, Point};
use crate::storage::ScratchSpace;

/// Distance from a triangle that counts as rounding, in units of the largest coordinate.
///
/// A point that was computed on a triangle, or turned with it, has errors of up to three roundings in each of its
/// coordinates, and so have the triangle's vertices. Together they are below 2 · √3 · 1.5 ε = 5.2 ε. Points a millionth
/// of the size apart, or written with fewer digits than a double has, are farther away.
const ROUNDING: f64 = 8.0 * f64::EPSILON;
/// Share of the distance within which vertices are moved: a vertex of the surface, or else an edge, not farther than
/// this from the nearest place on the surface is taken instead. With 0 moved vertices leave needles beside vertices and
/// edges. With 1 they leave the nearest place by as much as they were moved to it.
const FEATURE_SHARE: f64 = 0.25;

/// Counts of [`Surface::divide_at`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Divided {
    /// Vertices that divided triangles.
    pub divided: usize,
    /// Vertices that were moved.
    pub moved: usize,
    /// Greatest distance of a move, in input units.
    pub farthest: f64,
}

/// SurfacePlace of a vertex on the surface.
enum SurfacePlace {
    /// A vertex of the surface.
    Vertex(u32),
    /// The edge between two vertices.
    Edge([u32; 2]),
    /// Inside an undivided triangle.
    Triangle(u32),
}

impl Surface {
    /// Divides triangles where vertices of `set` lie on them, exactly or but for rounding.
    ///
    /// Vertices less than `within` away from a triangle are moved onto it first, in `set` as well: to the nearest
    /// place, or to a vertex or an edge near that place. With 0 only what lies there but for rounding is moved, if at
    /// all. Labels and sheets are kept; support triangles are dropped, see [`Surface::add_support_triangles`]. The parts
    /// of a triangle stand at its place in the order. Memory: about 200 bytes for each vertex and the tree.
    ///
    /// # Errors
    /// [`SurfaceError::TooLarge`].
    pub fn divide_at(
        &mut self,
        set: &mut EmbeddedSet,
        within: f64,
        scratch: &ScratchSpace,
    ) -> Result<Divided, SurfaceError> {
        self.drop_support_triangles();
        let tree = tree_of(self, scratch, |t| has_area(&self.corners(t)));
        let bounds = self.bounds();
        let largest = bounds.low.abs().max(bounds.high.abs()).max_element();
        let reach = SnapDistances {
            rounding: ROUNDING * largest,
            slack: NEAR_SHARE * largest,
            within,
            feature: (FEATURE_SHARE * within).max(ROUNDING * largest),
        };
        let mut table = VertexTable::new(&self.points);
        let mut points = std::mem::take(&mut self.points);
        let mut pieces = TrianglePieces::new(&self.triangles);
        let (mut vertices, mut by_place) = (HashMap::new(), HashMap::new());
        let mut taken = HashSet::new();
        let mut done = Divided::default();
        let ends = set.edges.iter().flat_map(|&[a, b, _]| [a, b]);
        for v in ends.chain(set.marks.iter().map(|&[v, _]| v)) {
            if vertices.contains_key(&v) {
                continue;
            }
            let given = set.points[v as usize] + Point::ZERO;
            if let Some(&vertex) = by_place.get(&given.to_array().map(f64::to_bits)) {
                vertices.insert(v, vertex);
                set.points[v as usize] = points[vertex as usize];
                continue;
            }
            let (mut p, mut places) = (given, Vec::new());
            if within == 0.0 {
                tree.meeting(&Aabb::around([p]), |t| places.extend(pieces.at(t, p, &points)));
            }
            if places.is_empty() && !(within == 0.0 && table.find(p, &points)) {
                let found = pieces.nearest(&tree, p, &points, &reach, &taken);
                places.extend(found.map(|(at, place)| {
                    p = at;
                    place
                }));
            }
            let n_before = points.len();
            let vertex = match places[..] {
                [SurfacePlace::Vertex(vertex)] => vertex,
                _ => table.find_or_add(p, &mut points),
            };
            vertices.insert(v, vertex);
            by_place.insert(given.to_array().map(f64::to_bits), vertex);
            taken.insert(vertex);
            if p != given {
                set.points[v as usize] = p;
                done.moved += 1;
                done.farthest = done.farthest.max(p.distance(given));
            }
            if points.len() == n_before {
                continue;
            }
            done.divided += usize::from(!places.is_empty());
            for place in places {
                pieces.divide_place(&place, vertex, &tree, &points, &reach);
            }
            SurfaceError::check_size("triangles", pieces.corners.len())?;
        }
        self.points = points;
        if done.divided > 0 {
            // New edges that are embedded edges are not swapped.
            let own = self.embedded.edges.len();
            let edges = set.edges.iter();
            (self.embedded.edges).extend(edges.map(|[a, b, _]| [vertices[a], vertices[b], 0]));
            self.take(&pieces);
            self.embedded.edges.truncate(own);
        }
        Ok(done)
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

/// Distances within which a vertex is on, or moved onto, a part of the surface.
struct SnapDistances {
    /// Greatest distance of a vertex that lies on a part but for rounding, in input units.
    rounding: f64,
    /// Margin of boxes: rounding takes pieces out of their triangle's box by less.
    slack: f64,
    /// Distance below which vertices are moved onto a part, in input units.
    within: f64,
    /// From the nearest place to a vertex or an edge that is taken instead.
    feature: f64,
}

/// The box of points not farther than `by` from `p` along each axis.
fn cube(p: Point, by: f64) -> Aabb {
    Aabb { low: p - Point::splat(by), high: p + Point::splat(by) }
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

    fn corners(&self, t: u32, points: &[Point]) -> [Point; 3] {
        self.corners[t as usize].map(|v| points[v as usize])
    }

    /// The edges of `t`, each with the opposite vertex behind it.
    fn turned(&self, t: u32) -> [[u32; 3]; 3] {
        let [a, b, c] = self.corners[t as usize];
        [[a, b, c], [b, c, a], [c, a, b]]
    }

    /// The places in `t` where `p`, which is no corner, lies exactly.
    fn at(&self, t: u32, p: Point, points: &[Point]) -> Vec<SurfacePlace> {
        let is_at = |t: u32| point_at_triangle(p, &self.corners(t, points)).is_some();
        let place = |t: u32| {
            let ends = self.turned(t).map(|[a, b, _]| [a, b]);
            let edge = (ends.into_iter()).find(|e| is_on_edge(p, e.map(|v| points[v as usize])));
            edge.map_or(SurfacePlace::Triangle(t), SurfacePlace::Edge)
        };
        self.reached(t, is_at).into_iter().map(place).collect()
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

    /// The undivided ones whose boxes come as near to `p` as `by`, and some that nearly do.
    fn around(
        &self,
        tree: &BoxTree,
        p: Point,
        by: f64,
        points: &[Point],
        reach: &SnapDistances,
    ) -> Vec<u32> {
        let near = cube(p, by + reach.slack);
        let is_near = |t: u32| Aabb::around(self.corners(t, points)).meets(&near);
        let mut found = Vec::new();
        tree.meeting(&near, |t| found.extend(self.reached(t, is_near)));
        found
    }

    /// The place within reach that `p` is moved to, and where it lies then. Vertices that other points have `taken` are not taken again.
    fn nearest(
        &self,
        tree: &BoxTree,
        p: Point,
        points: &[Point],
        reach: &SnapDistances,
        taken: &HashSet<u32>,
    ) -> Option<(Point, SurfacePlace)> {
        let near = |d: f64| d < reach.within || d <= reach.rounding;
        let around = self.around(tree, p, reach.within.max(reach.rounding), points, reach);
        let feet = around.iter().map(|&t| (t, nearest_point(self.corners(t, points), p)));
        let (t, foot) = feet
            .min_by(|(_, f), (_, g)| p.distance_squared(*f).total_cmp(&p.distance_squared(*g)))?;
        if !near(p.distance(foot)) {
            return None;
        }
        let best = |at: Point| {
            (at.distance(foot) <= reach.feature && near(at.distance(p))).then(|| at.distance(p))
        };
        let corners = around.iter().flat_map(|&t| self.corners[t as usize]);
        let corners = corners.filter(|v| !taken.contains(v));
        let corners = corners.filter_map(|v| Some((best(points[v as usize])?, v)));
        if let Some((_, v)) = corners.min_by(|a, b| a.0.total_cmp(&b.0)) {
            return Some((points[v as usize], SurfacePlace::Vertex(v)));
        }
        let edges = around.iter().flat_map(|&t| self.turned(t)).map(|[a, b, _]| {
            let at = nearest_on_edge(points[a as usize], points[b as usize], p);
            Some((best(at)?, at, [a, b]))
        });
        let edge = edges.flatten().min_by(|a, b| a.0.total_cmp(&b.0));
        let (at, place) = match edge {
            Some((_, at, edge)) => (at, SurfacePlace::Edge(edge)),
            None => (foot, SurfacePlace::Triangle(t)),
        };
        // A point that is there but for rounding stays, unless it alone does not lie there exactly.
        let is_exact = |x: Point| match place {
            SurfacePlace::Edge(e) => is_on_edge(x, e.map(|v| points[v as usize])),
            _ => point_at_triangle(x, &self.corners(t, points)).is_some(),
        };
        let stays = at.distance(p) <= reach.rounding && (is_exact(p) || !is_exact(at));
        Some((if stays { p } else { at }, place))
    }

    /// Divides all triangles at a place of vertex `v`.
    fn divide_place(
        &mut self,
        place: &SurfacePlace,
        v: u32,
        tree: &BoxTree,
        points: &[Point],
        reach: &SnapDistances,
    ) {
        let ends = match place {
            SurfacePlace::Vertex(_) => return,
            SurfacePlace::Triangle(t) => {
                let parts = self.turned(*t).map(|[a, b, _]| [a, b, v]);
                return self.replace(*t, &parts);
            }
            SurfacePlace::Edge(ends) => ends,
        };
        for t in self.around(tree, points[v as usize], 0.0, points, reach) {
            let turned = self.turned(t).into_iter();
            // Each triangle has an edge of its own sense. Divided ones no longer have it.
            let mut at = turned.filter(|[a, b, _]| ends.contains(a) && ends.contains(b));
            if let Some([a, b, c]) = at.next() {
                self.replace(t, &[[a, v, c], [v, b, c]]);
            }
        }
    }

    fn replace(&mut self, t: u32, parts: &[[u32; 3]]) {
        self.parts.insert(t, (self.corners.len() as u32, parts.len() as u32));
        self.corners.extend(parts);
    }
}
