//! Embedded edges and points of a surface: adding, checking, supporting.
//!
//! An embedded point is a vertex that no triangle uses. An embedded edge that no triangle has gets a support triangle
//! (`support_triangles`).

use std::collections::HashMap;

use super::contact::ContactKind;
use super::embedded_contact::{
    EdgeAtTriangle, EmbeddedEdge, has_area, is_on_edge, point_at_triangle,
};
use super::embedded_set::{EmbedError, Embedded, EmbeddedSet};
use super::vertex_table::VertexTable;
use super::{BoxTree, Surface, SurfaceError};
use crate::geom::{Aabb, Point};
use crate::storage::ScratchSpace;

/// Edges and points nearer to another part than this share of the box diagonal are refused. A vertex next to them is
/// rounded to about 1e-16 of the diagonal, and directions need several correct digits.
pub(super) const NEAR_SHARE: f64 = 1e-10;

/// Bytes it takes to embed an edge or a point.
const BYTES_EACH: u64 = 256;

impl Surface {
    /// Returns whether it has embedded edges or points.
    pub fn has_embedded(&self) -> bool {
        !self.embedded.edges.is_empty() || !self.embedded.points.is_empty()
    }

    /// Points that no triangle uses, and how long edges there should be at most.
    pub fn isolated_points(&self) -> Vec<(u32, f64)> {
        let points = self.embedded.points.iter().zip(&self.embedded.sizes);
        let alone = points.filter(|(_, size)| **size > 0.0);
        alone.map(|(&[v, _], &size)| (v, size)).collect()
    }

    /// Returns whether triangle `t` is not part of the input, but supports an embedded edge.
    #[inline]
    pub fn is_support_triangle(&self, t: u32) -> bool {
        self.embedded.first_support.is_some_and(|[first, _]| t >= first)
    }

    /// Number of triangles, without support triangles.
    pub fn n_input_triangles(&self) -> usize {
        self.embedded.first_support.map_or(self.n_triangles(), |[first, _]| first as usize)
    }

    /// Number of vertices, without those of support triangles alone.
    pub fn n_input_vertices(&self) -> usize {
        self.embedded.first_support.map_or(self.n_vertices(), |[_, first]| first as usize)
    }

    /// Adds edges and points with their support triangles; vertices with the same coordinates become one.
    ///
    /// Labels are named as those of sheets: see [`Surface::embed`].
    ///
    /// # Errors
    /// [`SurfaceError::Embed`] with the place; [`SurfaceError::TooLarge`].
    pub fn embed_set(
        &mut self,
        other: &EmbeddedSet,
        name: &str,
        scratch: &ScratchSpace,
    ) -> Result<(), SurfaceError> {
        let first = self.add_labels(&other.label_names, &[], name);
        self.push_embedded(other, |label| first + label, scratch)?;
        self.add_support_triangles(scratch)
    }

    /// The embedded edges and points alone, numbered in the order in which they first appear.
    pub fn embedded_set(&self) -> EmbeddedSet {
        let mut set = EmbeddedSet::default();
        let (mut verts, mut labels) = (HashMap::new(), HashMap::new());
        let mut vert = |v: u32, points: &mut Vec<Point>| {
            *verts.entry(v).or_insert_with(|| {
                points.push(self.points[v as usize]);
                points.len() as u32 - 1
            })
        };
        let mut named = |label: u32, names: &mut Vec<String>| {
            *labels.entry(label).or_insert_with(|| {
                names.push(self.label_names[label as usize].clone());
                names.len() as u32 - 1
            })
        };
        for &[a, b, label] in &self.embedded.edges {
            let ends = [a, b].map(|v| vert(v, &mut set.points));
            let label = named(label, &mut set.label_names);
            set.edges.push([ends[0], ends[1], label]);
        }
        for &[v, label] in &self.embedded.points {
            let v = vert(v, &mut set.points);
            set.marks.push([v, named(label, &mut set.label_names)]);
        }
        set.mark_lines.clone_from(&self.embedded.point_lines);
        set
    }

    /// Adds edges and points whose labels are called as they are.
    ///
    /// # Errors
    /// As [`Surface::embed_set`].
    pub fn embed_named(
        &mut self,
        set: &EmbeddedSet,
        scratch: &ScratchSpace,
    ) -> Result<(), SurfaceError> {
        let known = self.label_names.iter().cloned().zip(0u32..);
        let mut known: HashMap<String, u32> = known.collect();
        let mut labels = Vec::new();
        for name in &set.label_names {
            let next = self.label_names.len() as u32;
            let label = *known.entry(name.clone()).or_insert(next);
            if label == next {
                self.label_names.push(name.clone());
            }
            labels.push(label);
        }
        self.push_embedded(set, |label| labels[label as usize], scratch)?;
        self.add_support_triangles(scratch)
    }

    fn push_embedded(
        &mut self,
        other: &EmbeddedSet,
        label_of: impl Fn(u32) -> u32,
        scratch: &ScratchSpace,
    ) -> Result<(), SurfaceError> {
        // Tables of its vertices, edges and points, and trees over them.
        let needed = other.bytes() + BYTES_EACH * (other.edges.len() + other.marks.len()) as u64;
        if needed > scratch.available() {
            return Err(SurfaceError::EmbedMemory {
                bytes_max: scratch.available(),
                vertices: other.points.len(),
            });
        }
        self.drop_support_triangles();
        let mut table = VertexTable::new(&self.points);
        let mut vert = |points: &mut Vec<Point>, v: u32| {
            table.find_or_add(other.points[v as usize] + Point::ZERO, points)
        };
        for &[a, b, label] in &other.edges {
            let ends = [a, b].map(|v| vert(&mut self.points, v));
            self.embedded.edges.push([ends[0], ends[1], label_of(label)]);
        }
        self.embedded.point_lines.resize(self.embedded.points.len(), 0);
        self.embedded.point_lines.extend_from_slice(&other.mark_lines);
        for &[v, label] in &other.marks {
            let v = vert(&mut self.points, v);
            self.embedded.points.push([v, label_of(label)]);
        }
        SurfaceError::check_size("vertices", self.points.len() + self.embedded.edges.len())?;
        SurfaceError::check_size("triangles", self.n_triangles() + self.embedded.edges.len())
    }

    /// Removes support triangles and their vertices.
    pub(super) fn drop_support_triangles(&mut self) {
        if let Some([triangle, vertex]) = self.embedded.first_support.take() {
            self.triangles.truncate(triangle as usize);
            self.labels.truncate(triangle as usize);
            self.sheets.truncate(triangle as usize);
            self.points.truncate(vertex as usize);
        }
        if self.sheets.iter().all(|&is_sheet| !is_sheet) {
            self.sheets.clear();
        }
    }

    /// A copy without embedded edges and points.
    pub fn without_embedded(&self) -> Self {
        let mut plain = self.clone();
        plain.drop_support_triangles();
        plain.embedded = Embedded::default();
        super::weld::drop_unused_points(&mut plain);
        super::label_sets::drop_unused_labels(&mut plain);
        plain
    }

    /// Checks edges and points, adds support triangles, and finds the sizes at points.
    ///
    /// # Errors
    /// As [`Surface::embed_set`].
    pub fn add_support_triangles(&mut self, scratch: &ScratchSpace) -> Result<(), SurfaceError> {
        self.drop_support_triangles();
        if !self.has_embedded() {
            return Ok(());
        }
        self.refuse_repeated()?;
        let triangles = super::box_pairs::tree_of(self, scratch, |t| has_area(&self.corners(t)));
        let edges = self.embedded_edge_tree(scratch, |_| true);
        let is_free = self.refuse_contacts(&triangles, &edges)?;
        drop(edges);
        self.push_support_triangles(&is_free, triangles, scratch)?;
        self.set_point_sizes(scratch)
    }

    /// Embedded edge `e`.
    pub(super) fn embedded_edge(&self, e: u32) -> EmbeddedEdge {
        let [a, b, _] = self.embedded.edges[e as usize];
        let ids = [a, b];
        EmbeddedEdge { ids, ends: ids.map(|v| self.points[v as usize]) }
    }

    /// A tree over the embedded edges that `keep` accepts.
    pub(super) fn embedded_edge_tree(
        &self,
        scratch: &ScratchSpace,
        keep: impl Fn(u32) -> bool + Sync,
    ) -> BoxTree {
        let box_of = |e: u32| Aabb::around(self.embedded_edge(e).ends);
        BoxTree::new(&self.bounds(), self.embedded.edges.len() as u32, scratch, keep, box_of)
    }

    /// Name of edge `e` in messages: its number among the edges of its label.
    pub fn edge_name(&self, e: usize) -> String {
        let labels = self.embedded.edges[..=e].iter().map(|edge| edge[2]);
        self.name_of("edge", labels)
    }

    /// Name of point `p` in messages: its label and its line, or its number among the points of its label.
    pub fn point_name(&self, p: usize) -> String {
        if let Some(&line @ 1..) = self.embedded.point_lines.get(p) {
            let label = &self.label_names[self.embedded.points[p][1] as usize];
            return format!("the point {label:?} in line {line} of its file");
        }
        let labels = self.embedded.points[..=p].iter().map(|point| point[1]);
        self.name_of("point", labels)
    }

    /// `labels`: labels of all edges (or points) up to the one to be named.
    fn name_of(&self, kind: &str, labels: impl DoubleEndedIterator<Item = u32>) -> String {
        let mut labels = labels.rev();
        let label = labels.next().unwrap_or_default();
        let number = labels.filter(|&other| other == label).count();
        format!("{kind} {number} of {:?}", self.label_names[label as usize])
    }

    fn refuse_repeated(&self) -> Result<(), EmbedError> {
        let mut known = HashMap::new();
        for (e, &[a, b, _]) in self.embedded.edges.iter().enumerate() {
            let at = self.points[a as usize].midpoint(self.points[b as usize]);
            if a == b {
                return Err(EmbedError::NoLength { edge: self.edge_name(e), at });
            }
            if let Some(other) = known.insert([a.min(b), a.max(b)], e) {
                let [what, other] = [e, other].map(|e| self.edge_name(e));
                return Err(EmbedError::Repeated { what, other, at });
            }
        }
        let mut known = HashMap::new();
        for (p, &[v, _]) in self.embedded.points.iter().enumerate() {
            if let Some(other) = known.insert(v, p) {
                let [what, other] = [p, other].map(|p| self.point_name(p));
                return Err(EmbedError::Repeated { what, other, at: self.points[v as usize] });
            }
        }
        Ok(())
    }

    /// Returns for each edge whether no triangle has it. Errors: contacts of edges and points with triangles or edges
    /// outside common vertices.
    fn refuse_contacts(
        &self,
        triangles: &BoxTree,
        edges: &BoxTree,
    ) -> Result<Vec<bool>, EmbedError> {
        let mut first = None;
        let mut n = 0;
        let mut touch = |what: &dyn Fn() -> String, other: &dyn Fn() -> String, kind, at| {
            n += 1;
            first.get_or_insert_with(|| (what(), other(), kind, at));
        };
        let triangle_name = |t: u32| format!("triangle {t} of {:?}", self.label_name(t));
        let mut is_free = vec![true; self.embedded.edges.len()];
        for (e, is_free) in is_free.iter_mut().enumerate() {
            let edge = self.embedded_edge(e as u32);
            let bounds = Aabb::around(edge.ends);
            let what = || self.edge_name(e);
            triangles.meeting(&bounds, |t| {
                match edge.at_triangle(self.corners(t), self.triangles[t as usize]) {
                    EdgeAtTriangle::Apart => {}
                    EdgeAtTriangle::Side => *is_free = false,
                    EdgeAtTriangle::Touching(c) => touch(&what, &|| triangle_name(t), c.kind, c.at),
                }
            });
            edges.meeting(&bounds, |f| {
                if let Some(c) =
                    (f as usize > e).then(|| edge.at_edge(&self.embedded_edge(f))).flatten()
                {
                    touch(&what, &|| self.edge_name(f as usize), c.kind, c.at);
                }
            });
        }
        for (i, &[v, _]) in self.embedded.points.iter().enumerate() {
            let p = self.points[v as usize];
            let bounds = Aabb::around([p]);
            let what = || self.point_name(i);
            triangles.meeting(&bounds, |t| {
                if !self.triangles[t as usize].contains(&v)
                    && let Some(c) = point_at_triangle(p, &self.corners(t))
                {
                    touch(&what, &|| triangle_name(t), c.kind, p);
                }
            });
            edges.meeting(&bounds, |e| {
                let edge = self.embedded_edge(e);
                if !edge.ids.contains(&v) && is_on_edge(p, edge.ends) {
                    touch(&what, &|| self.edge_name(e as usize), ContactKind::VertexOnEdge, p);
                }
            });
        }
        match first {
            None => Ok(is_free),
            Some((what, other, kind, at)) => Err(EmbedError::Touching { what, other, kind, at, n }),
        }
    }
}
