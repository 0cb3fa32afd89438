//! The surface that a generator returns.

use tetdb_base::geom::Point;
use tetdb_base::surface::{Embedded, Surface};

/// A closed labeled surface in memory.
///
/// Shape: `labels` runs parallel to `triangles` and indexes `label_names`. Invariant: every point is
/// used, no two points are equal, none has a −0.0, each edge is shared by two triangles in opposite
/// directions, sheets set aside; points are numbered in the order in which triangles first name them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sample {
    /// Positions of the vertices.
    pub points: Vec<Point>,
    /// Counter-clockwise seen from outside the filled part.
    pub triangles: Vec<[u32; 3]>,
    /// Label of each triangle, as an index into `label_names`.
    pub labels: Vec<u32>,
    /// Names of the labels.
    pub label_names: Vec<String>,
    /// True if each triangle is part of a sheet in it; empty where none is.
    pub sheets: Vec<bool>,
    /// The vertices of each edge inside, and its label.
    pub edges: Vec<[u32; 3]>,
    /// The vertex of each point inside, and its label.
    pub marks: Vec<[u32; 2]>,
}

impl From<Sample> for Surface {
    /// The surface of the sample, from no file; [`Surface::add_support_triangles`] completes its embedded edges.
    fn from(sample: Sample) -> Self {
        Self {
            points: sample.points,
            triangles: sample.triangles,
            labels: sample.labels,
            label_names: sample.label_names,
            sheets: sample.sheets,
            embedded: Embedded { edges: sample.edges, points: sample.marks, ..Embedded::default() },
            ..Self::default()
        }
    }
}

impl Sample {
    /// Volume enclosed, by the divergence theorem; positive for the orientation promised here.
    #[cfg(test)]
    pub fn signed_volume(&self) -> f64 {
        let corner = |v: u32| self.points[v as usize];
        let six: f64 =
            self.triangles.iter().map(|t| corner(t[0]).dot(corner(t[1]).cross(corner(t[2])))).sum();
        six / 6.0
    }
}
