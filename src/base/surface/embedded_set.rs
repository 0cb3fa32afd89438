//! Embedded edges and points: edges and vertices that the mesh must have inside a volume.

use super::contact::ContactKind;
use crate::geom::Point;
use tetdb_schema::code::Code;

/// Embedded edges and points: not parts of triangles, or parts with a name of their own.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Embedded {
    /// The vertices of each edge, and its label.
    pub edges: Vec<[u32; 3]>,
    /// The vertex of each point, and its label.
    pub points: Vec<[u32; 2]>,
    /// The line of its file for each of the first points, 0 where it is not known.
    pub point_lines: Vec<u32>,
    /// Largest edge length at each point; 0 for a vertex of triangles, which define it.
    pub sizes: Vec<f64>,
    /// The first support triangle, and the first vertex that only support triangles have.
    pub first_support: Option<[u32; 2]>,
}

/// Edges and points read from a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EmbeddedSet {
    /// Positions of the vertices, equal ones among them.
    pub points: Vec<Point>,
    /// The vertices of each edge, and its label.
    pub edges: Vec<[u32; 3]>,
    /// The vertices that are points, and their labels.
    pub marks: Vec<[u32; 2]>,
    /// The line of the file for each of the first of these points, 0 where it is not known.
    pub mark_lines: Vec<u32>,
    /// Names of the labels.
    pub label_names: Vec<String>,
}

impl EmbeddedSet {
    /// Bytes of memory held, for the budget.
    pub fn bytes(&self) -> u64 {
        let names = self.label_names.len() * 2 * size_of::<String>();
        let points = self.points.capacity() * size_of::<Point>();
        let edges = self.edges.capacity() * size_of::<[u32; 3]>();
        let marks = self.marks.capacity() * size_of::<[u32; 2]>() + 4 * self.mark_lines.capacity();
        (names + points + edges + marks) as u64
    }
}

/// Reasons why edges and points cannot be embedded.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EmbedError {
    /// Both ends of an edge are one vertex.
    #[error("{edge} has no length")]
    NoLength {
        /// The edge.
        edge: String,
        /// Where.
        at: Point,
    },
    /// An edge or a point is given twice.
    #[error("{what} is there twice: it is {other} too")]
    Repeated {
        /// The later one.
        what: String,
        /// The earlier one.
        other: String,
        /// Where.
        at: Point,
    },
    /// A contact outside common vertices.
    #[error("{what} and {other} meet where they should not: {kind}{}", more(*n))]
    Touching {
        /// The edge or the point.
        what: String,
        /// The triangle or the edge.
        other: String,
        /// Kind of the contact.
        kind: ContactKind,
        /// Where.
        at: Point,
        /// Number of such pairs.
        n: usize,
    },
    /// A tetrahedron there would be too small to compute.
    #[error("{what} is nearer to something else than can be meshed{}{}", far(*distance), more(*n))]
    TooNear {
        /// The first of them, and at most nine others.
        what: String,
        /// Where.
        at: Point,
        /// Distance of the first one, if known.
        distance: Option<f64>,
        /// Number of such edges or points.
        n: usize,
    },
}

fn more(n: usize) -> String {
    match n {
        0 | 1 => String::new(),
        n => format!(" (and {} more)", n - 1),
    }
}

fn far(distance: Option<f64>) -> String {
    distance.map_or(String::new(), |distance| format!(": {distance:.1e} from it"))
}

impl EmbedError {
    /// The word for this error.
    pub fn code(&self) -> Code {
        match self {
            Self::NoLength { .. } => Code::DegenerateEdge,
            Self::Repeated { .. } => Code::DuplicateWire,
            Self::Touching { .. } => Code::WireContact,
            Self::TooNear { .. } => Code::WireTooNear,
        }
    }

    /// Position of the error.
    pub fn at(&self) -> Point {
        match self {
            Self::NoLength { at, .. }
            | Self::Repeated { at, .. }
            | Self::Touching { at, .. }
            | Self::TooNear { at, .. } => *at,
        }
    }

    /// A suggestion for the user.
    pub fn help(&self) -> &'static str {
        match self {
            Self::NoLength { .. } | Self::Repeated { .. } => {
                "give each edge and each point once, of different vertices"
            }
            Self::Touching { .. } => {
                "edges and points meet triangles, and edges each other, in common vertices alone: divide the triangle or the edge there"
            }
            Self::TooNear { .. } => {
                "join what is meant to meet, or move it apart: what is farther from a triangle than by rounding is beside it, \
                 so give the triangle a vertex there"
            }
        }
    }
}
