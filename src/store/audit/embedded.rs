//! The mesh against the embedded edges and points: every edge is an edge of a tetrahedron, every point a vertex, bit for bit.

use std::collections::HashMap;

use super::{Finding, Report};
use crate::sealed::Corner;
use tetdb_base::surface::Surface;

/// Bytes for each edge and point.
const BYTES_EACH: u64 = 100;

/// A search for embedded edges and points.
pub(super) struct EmbeddedSearch<'a> {
    surface: &'a Surface,
    /// Embedded edges by their vertices, the lower number first: number of the edge, and true if the mesh has it.
    edges: HashMap<[u32; 2], (usize, bool)>,
    /// Vertices of embedded edges and points: number of the point, if it is one, and true if the mesh has the vertex.
    vertices: HashMap<u32, (Option<usize>, bool)>,
}

/// The edges and points of one part of the mesh.
#[derive(rkyv::Archive, rkyv::Serialize, rkyv::Deserialize, Clone, Debug)]
pub(super) struct FoundEmbedded {
    /// The vertices of each edge, the lower number first.
    edges: Vec<[u32; 2]>,
    vertices: Vec<u32>,
}

/// Bytes of the search for the edges and points of a surface.
pub fn wire_bytes(surface: &Surface) -> u64 {
    let wires = &surface.embedded;
    BYTES_EACH * (wires.edges.len() + wires.points.len()) as u64
}

impl<'a> EmbeddedSearch<'a> {
    /// Returns `None` where the surface has no embedded edges and points.
    pub fn new(surface: &'a Surface) -> Option<Self> {
        let wires = &surface.embedded;
        let edges = wires.edges.iter().enumerate();
        let ends = wires.edges.iter().flat_map(|&[a, b, _]| [a, b]);
        let mut vertices: HashMap<u32, _> = ends.map(|v| (v, (None, false))).collect();
        let points = wires.points.iter().enumerate();
        vertices.extend(points.map(|(i, &[v, _])| (v, (Some(i), false))));
        surface.has_embedded().then(|| Self {
            surface,
            edges: edges.map(|(e, &[a, b, _])| ([a.min(b), a.max(b)], (e, false))).collect(),
            vertices,
        })
    }

    /// Searches the vertices and edges of a tetrahedron.
    pub fn see(&mut self, corners: &[Corner; 4]) {
        let bits = |p: tetdb_base::geom::Point| p.to_array().map(f64::to_bits);
        let found = corners.each_ref().map(|corner| {
            let v = corner.input_index()?;
            let (_, is_found) = self.vertices.get_mut(&v)?;
            let is_there = bits(self.surface.points[v as usize]) == bits(corner.point);
            *is_found |= is_there;
            is_there.then_some(v)
        });
        for i in 0..4 {
            for j in i + 1..4 {
                if let (Some(a), Some(b)) = (found[i], found[j])
                    && let Some((_, is_found)) = self.edges.get_mut(&[a.min(b), a.max(b)])
                {
                    *is_found = true;
                }
            }
        }
    }

    /// Returns the found edges and vertices, for [`add`](Self::add) in another process.
    pub fn into_found(self) -> FoundEmbedded {
        let edges = self.edges.into_iter().filter(|(_, (_, is_found))| *is_found);
        let vertices = (self.vertices.into_iter()).filter(|(_, (_, is_found))| *is_found);
        FoundEmbedded {
            edges: edges.map(|(ends, _)| ends).collect(),
            vertices: vertices.map(|(v, _)| v).collect(),
        }
    }

    /// Adds the edges and vertices found in another part of the mesh.
    pub fn add(&mut self, other: &FoundEmbedded) {
        for ends in &other.edges {
            if let Some((_, is_found)) = self.edges.get_mut(ends) {
                *is_found = true;
            }
        }
        for v in &other.vertices {
            if let Some((_, is_found)) = self.vertices.get_mut(v) {
                *is_found = true;
            }
        }
    }

    /// Counts the found edges and points; reports the missing ones.
    pub fn finish(self, report: &mut Report) {
        let wires = &self.surface.embedded;
        let mut edges = vec![false; wires.edges.len()];
        self.edges.values().for_each(|&(e, is_found)| edges[e] = is_found);
        let mut points = vec![false; wires.points.len()];
        for &(point, is_found) in self.vertices.values() {
            if let Some(i) = point {
                points[i] = is_found;
            }
        }
        report.edges_present = edges.iter().filter(|&&is_found| is_found).count() as u64;
        report.points_present = points.iter().filter(|&&is_found| is_found).count() as u64;
        report.edges_missing = edges.len() as u64 - report.edges_present;
        report.points_missing = points.len() as u64 - report.points_present;
        let mut lose = |finding, what: String, vertices: &[u32]| {
            let point = |&v: &u32| self.surface.points[v as usize];
            report.find(finding, None, what).with_points(vertices.iter().map(point));
        };
        for (e, _) in edges.iter().enumerate().filter(|(_, is_found)| !**is_found) {
            let [a, b, _] = wires.edges[e];
            let what =
                format!("embedded {} is no edge of a tetrahedron", self.surface.edge_name(e));
            lose(Finding::MissingEdge, what, &[a, b]);
        }
        for (i, _) in points.iter().enumerate().filter(|(_, is_found)| !**is_found) {
            let what =
                format!("embedded {} is no vertex of a tetrahedron", self.surface.point_name(i));
            lose(Finding::MissingPoint, what, &wires.points[i][..1]);
        }
    }
}
