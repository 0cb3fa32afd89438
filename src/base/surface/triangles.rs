//! An indexed triangle surface in memory.

use std::fmt;
use std::mem::size_of;

use super::Seed;
use super::embedded_set::Embedded;
use crate::geom::{Aabb, Point, counted};
use tetdb_schema::labels::LabelSet;

/// An indexed triangle surface with a label on each triangle.
///
/// Shape: `labels` runs parallel to `triangles` and indexes `label_names`; a triangle's position is its input id: file
/// order, polygons fanned from their first vertex, files one after the other. Invariant (of a surface from
/// [`SurfaceBuilder`](super::SurfaceBuilder)): points are finite, pairwise different and free of −0.0. Each is used by
/// a triangle or an embedded part. They are in order of first appearance in the files. Is not: validated. A triangle
/// may be degenerate, the surface open; see [`validate`](super::validate).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surface {
    /// Positions of the vertices.
    pub points: Vec<Point>,
    /// Vertices of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Label of each triangle, as an index into `label_names`.
    pub labels: Vec<u32>,
    /// Names of the labels.
    pub label_names: Vec<String>,
    /// Labels of triangles in several groups, ascending.
    pub label_sets: Vec<LabelSet>,
    /// The files read, in order.
    pub files: Vec<SourceFile>,
    /// True if each triangle is part of an embedded sheet; empty where none is.
    pub sheets: Vec<bool>,
    /// Embedded edges and points, and their support triangles.
    pub embedded: Embedded,
    /// Notes of the readers, in order.
    pub notes: Vec<Note>,
    /// Seeds from the files, in order.
    pub seeds: Vec<Seed>,
    /// Without another rule, volumes without a seed are filled, as in TetGen's files; else they stay empty where there are seeds.
    pub fills_rest: bool,
    /// Lengths that the files ask for, with the names of their regions.
    pub region_sizes: Vec<(String, f64)>,
}

/// One file of a surface and the triangles that came from it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SourceFile {
    /// The path as it was given.
    pub name: String,
    /// Its triangles are `triangle_first ..` up to the next file's first.
    pub triangle_first: u32,
}

impl Surface {
    /// Number of triangles.
    pub fn n_triangles(&self) -> usize {
        self.triangles.len()
    }

    /// Number of vertices.
    pub fn n_vertices(&self) -> usize {
        self.points.len()
    }

    /// Positions of the three vertices of triangle `t`.
    #[inline]
    pub fn corners(&self, t: u32) -> [Point; 3] {
        self.triangles[t as usize].map(|v| self.points[v as usize])
    }

    /// Name of the label of triangle `t`.
    pub fn label_name(&self, t: u32) -> &str {
        &self.label_names[self.labels[t as usize] as usize]
    }

    /// The file triangle `t` came from and its number in that file, counted from 0.
    pub fn source(&self, t: u32) -> Option<(&str, u32)> {
        let next = self.files.partition_point(|f| f.triangle_first <= t);
        let file = self.files.get(next.checked_sub(1)?)?;
        Some((&file.name, t - file.triangle_first))
    }

    /// The smallest box around all vertices.
    pub fn bounds(&self) -> Aabb {
        Aabb::around(self.points.iter().copied())
    }

    /// Gives back memory kept for more triangles to come.
    pub fn shrink(&mut self) {
        self.points.shrink_to_fit();
        self.triangles.shrink_to_fit();
        self.labels.shrink_to_fit();
        self.sheets.shrink_to_fit();
    }

    /// Bytes of memory held, for the budget.
    pub fn bytes(&self) -> usize {
        let names: usize =
            self.label_names.iter().map(|n| n.capacity() + size_of::<String>()).sum();
        self.points.capacity() * size_of::<Point>()
            + self.triangles.capacity() * size_of::<[u32; 3]>()
            + self.labels.capacity() * size_of::<u32>()
            + self.sheets.capacity()
            + self.embedded.edges.capacity() * size_of::<[u32; 3]>()
            + self.embedded.points.capacity() * size_of::<[u32; 4]>()
            + names
    }
}

/// An action or omission of a reader that the user should see; not an error.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// The file it is about; empty for what is said of no file.
    pub file: String,
    /// The action or omission.
    pub kind: NoteKind,
}

/// Kinds of a [`Note`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum NoteKind {
    /// A text STL ended without `endsolid`.
    MissingEndsolid {
        /// The line where the file ended.
        line: u64,
    },
    /// An indexed file held vertices with identical coordinates, now one each.
    WeldedVertices {
        /// Vertices that were joined to others.
        n: u64,
    },
    /// Vertices that no triangle uses were left out.
    UnusedVertices {
        /// Number of vertices.
        n: u64,
    },
    /// Polygons with more than three corners were cut into fans.
    FannedPolygons {
        /// Number of polygons.
        n: u64,
    },
    /// Corners of polygons that repeat the corner before were left out.
    RepeatedCorners {
        /// Number of polygons.
        n: u64,
    },
    /// Polygons with dents or with corners in line were cut otherwise.
    CutPolygons {
        /// Number of polygons.
        n: u64,
    },
    /// Elements that are no part of a surface (tetrahedra, lines, …) were left out.
    SkippedElements {
        /// The kind of element.
        what: &'static str,
        /// Number of elements.
        n: u64,
    },
    /// Points that mark holes or regions of the volume.
    VolumePoints {
        /// Holes or regions.
        points: VolumePoints,
        /// Number of points.
        n: u64,
    },
    /// The surface is the boundary of a mesh of volume cells.
    BoundaryOfCells {
        /// Number of cells.
        n: u64,
    },
    /// Words of the caller.
    Said(String),
    /// Regions whose solid elements belong to several groups have no name.
    MixedRegions {
        /// Number of regions.
        n: u64,
    },
    /// Groups some of whose volumes belong to another group too, which gives them their name.
    OtherGroups {
        /// Names of the groups.
        names: String,
    },
    /// Bytes behind the content of a file were left out.
    TrailingBytes {
        /// Number of bytes.
        n: u64,
    },
    /// Curved faces were taken as flat ones between their corners.
    CurvedFaces {
        /// Number of faces.
        n: u64,
    },
    /// Facets of several polygons or with holes were cut as a whole.
    CutFacets {
        /// Number of facets.
        n: u64,
    },
    /// Polygons of two corners are edges to embed.
    Edges {
        /// Number of edges.
        n: u64,
    },
}

/// Meaning of points inside the volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VolumePoints {
    /// Volumes to leave empty.
    Holes,
    /// Volumes with an attribute or a size of their own.
    Regions,
}

impl NoteKind {
    fn text(&self) -> String {
        let (n, sentence) = match self {
            Self::WeldedVertices { n } => (
                *n,
                "[vertex repeats|vertices repeat] the coordinates of another and [was|were] joined to it",
            ),
            Self::UnusedVertices { n } => {
                (*n, "[vertex belongs|vertices belong] to no triangle and [was|were] left out")
            }
            Self::FannedPolygons { n } => {
                (*n, "[polygon was|polygons were] cut into triangles from the first vertex")
            }
            Self::RepeatedCorners { n } => {
                (*n, "[polygon repeats|polygons repeat] a corner, which was left out")
            }
            Self::CutPolygons { n } => (
                *n,
                "[polygon|polygons] with dents or corners in line [was|were] cut into the triangles of the plane",
            ),
            Self::MixedRegions { n } => (
                *n,
                "[region holds|regions hold] elements of several groups with no triangles between them, and [gets|get] no name",
            ),
            Self::TrailingBytes { n } => {
                (*n, "[byte|bytes] behind the declared content [was|were] left out")
            }
            Self::CurvedFaces { n } => (
                *n,
                "[curved face was taken as a flat one|curved faces were taken as flat ones] between the corners",
            ),
            Self::CutFacets { n } => {
                (*n, "[facet|facets] of several polygons or with holes [was|were] cut as a whole")
            }
            Self::Edges { n } => (
                *n,
                "[polygon of two corners is an edge|polygons of two corners are edges], embedded where the surface is meshed",
            ),
            Self::MissingEndsolid { line } => {
                return format!(
                    "the text ends at line {line} without `endsolid`; all facets were read"
                );
            }
            Self::SkippedElements { what, n } => {
                let (words, was) = if *n == 1 { ("of the ", "was") } else { ("", "were") };
                return format!("{n} {words}{what} {was} left out; only the surface is read");
            }
            Self::VolumePoints { points: VolumePoints::Holes, n } => {
                return format!(
                    "hole points ({n}) leave their regions empty, unless another rule fills regions"
                );
            }
            Self::VolumePoints { points: VolumePoints::Regions, n } => {
                return format!(
                    "regions of the file ({n}) are filled and named so, unless another rule fills regions"
                );
            }
            Self::BoundaryOfCells { n } => {
                let cells = counted(*n, "volume [cell|cells]");
                return format!(
                    "the boundary of {cells}, and faces between regions, are the surface"
                );
            }
            Self::OtherGroups { names } => {
                return format!(
                    "volumes of the groups {names} belong to another group before, and have its name"
                );
            }
            Self::Said(text) => return text.clone(),
        };
        counted(n, sentence)
    }
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.file.is_empty() {
            write!(f, "{}: ", self.file)?;
        }
        f.write_str(&self.kind.text())
    }
}
