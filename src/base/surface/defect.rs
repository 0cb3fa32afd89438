//! Defects of a surface: message, place and suggestion.

use super::contact::ContactKind;
use super::embedded_set::EmbedError;
use super::triangles::SourceFile;
use crate::geom::Point;
use tetdb_schema::code::Code;

/// A surface that cannot be built or meshed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SurfaceError {
    /// There are too many vertices, triangles or labels to number.
    #[error("the surface has more than {limit} {what}")]
    TooLarge {
        /// Kind of the items.
        what: &'static str,
        /// The most allowed.
        limit: usize,
    },
    /// The surface exceeds the memory allowed.
    #[error(
        "{triangles} triangles and {vertices} vertices, and there are more, take more than the {bytes_max} bytes of memory allowed"
    )]
    Memory {
        /// Bytes allowed.
        bytes_max: u64,
        /// Triangles read so far.
        triangles: usize,
        /// Vertices read so far.
        vertices: usize,
    },
    /// The divided surface would exceed the memory allowed.
    #[error(
        "dividing the surface would give about {triangles} triangles, which take about {} MiB; it may take {} MiB", bytes >> 20, bytes_max >> 20
    )]
    SplitMemory {
        /// Bytes allowed.
        bytes_max: u64,
        /// Bytes predicted.
        bytes: u64,
        /// Triangles predicted.
        triangles: u64,
    },
    /// Edges or points to embed do not fit the memory allowed.
    #[error(
        "edges and points of {vertices} vertices, or more, take more than the {bytes_max} bytes of memory allowed"
    )]
    EmbedMemory {
        /// Bytes allowed.
        bytes_max: u64,
        /// Vertices known so far.
        vertices: usize,
    },
    /// A triangle names a vertex that is not there.
    #[error("triangle {triangle} names vertex {vertex}, but there are {n_vertices}")]
    NoSuchVertex {
        /// The triangle.
        triangle: u32,
        /// The vertex it names.
        vertex: u32,
        /// Number of vertices.
        n_vertices: usize,
    },
    /// A face of a mesh of volume cells belongs to more than two of them.
    #[error("cells {}, {} and {} share a face", cells[0], cells[1], cells[2])]
    SharedFace {
        /// Three of them.
        cells: [u32; 3],
    },
    /// A polygon or facet cannot be cut into triangles.
    #[error("a polygon or facet of {} corners, the first at {}, {reason}", points.len(), show(points.first().copied().unwrap_or_default()))]
    Polygon {
        /// The reason.
        reason: &'static str,
        /// Its corners.
        points: Vec<Point>,
    },
    /// The surface is too small to compute with exactly.
    #[error(
        "the surface is too small to compute with exactly: its longest extent is {extent:e}, expected above 1e-24"
    )]
    TooSmall {
        /// Its longest extent.
        extent: f64,
    },
    /// Validation found defects; the error has the first of the worst kind.
    #[error("{}", defect.in_words(files))]
    Invalid {
        /// The first defect of the worst kind.
        defect: Box<Defect>,
        /// Defects in all.
        n_defects: u64,
        /// The files of the surface.
        files: Vec<SourceFile>,
    },
    /// An embedded edge or point cannot be there.
    #[error(transparent)]
    Embed(Box<EmbedError>),
}

impl From<EmbedError> for SurfaceError {
    fn from(error: EmbedError) -> Self {
        Self::Embed(Box::new(error))
    }
}

/// Vertices and triangles of a surface at most: ids keep two bits free in the mesh.
const COUNT_MAX: usize = 1 << 30;

impl SurfaceError {
    /// Refuses more items of kind `what` than can be numbered.
    pub(super) fn check_size(what: &'static str, n: usize) -> Result<(), Self> {
        match n <= COUNT_MAX {
            true => Ok(()),
            false => Err(Self::TooLarge { what, limit: COUNT_MAX }),
        }
    }

    /// The word for this error.
    pub fn code(&self) -> Code {
        match self {
            Self::TooLarge { .. } => Code::SurfaceTooLarge,
            Self::Memory { .. } | Self::SplitMemory { .. } | Self::EmbedMemory { .. } => {
                Code::Memory
            }
            Self::NoSuchVertex { .. } => Code::IndexOutOfRange,
            Self::SharedFace { .. } => Code::UnsupportedContent,
            Self::Polygon { reason, .. } => super::polygon::code(reason),
            Self::TooSmall { .. } => Code::CoordinateRange,
            Self::Invalid { defect, .. } => defect.code(),
            Self::Embed(wire) => wire.code(),
        }
    }

    /// A suggestion for the user.
    pub fn help(&self) -> &'static str {
        match self {
            Self::TooLarge { .. } => "split the surface into parts and mesh them one by one",
            Self::Memory { .. } => "allow more memory, or take a coarser surface",
            Self::SplitMemory { .. } => {
                "ask for longer edges, or allow more memory; triangles grow with the square of the inverse length"
            }
            Self::EmbedMemory { .. } => "allow more memory, or take fewer edges and points",
            Self::NoSuchVertex { .. } => "write the file again from the program that made it",
            Self::SharedFace { .. } => "remove cells that are there twice or overlap others",
            Self::Polygon { .. } => {
                "give it as simple polygons or as triangles, in the program the surface comes from"
            }
            Self::TooSmall { .. } => "scale the surface to ordinary units, for example metres",
            Self::Invalid { defect, .. } => defect.help(),
            Self::Embed(wire) => wire.help(),
        }
    }
}

/// A defect that makes a surface unfit to bound volumes, with its triangles (input ids).
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Defect {
    /// The surface has no triangle.
    #[error("the surface has no triangles")]
    Empty,
    /// Two corners are one vertex, or the corners lie exactly on a line.
    #[error("triangle {triangle} has no area: {}", if *repeated { "a corner is repeated" } else { "its corners are exactly in line" })]
    Degenerate {
        /// The triangle.
        triangle: u32,
        /// True if two corners are one vertex.
        repeated: bool,
        /// Its corners.
        corners: [Point; 3],
    },
    /// Three vertices that occur twice in the same cyclic order.
    #[error("triangle {} repeats triangle {}", triangles[1], triangles[0])]
    Duplicate {
        /// The two triangles.
        triangles: [u32; 2],
        /// Their corners.
        corners: [Point; 3],
    },
    /// An edge with one triangle only: the surface has a hole there.
    #[error("the surface is open: the edge of triangle {triangle} from {} to {} has no second triangle{}", show(*from), show(*to),
        junction.map(|p| format!("; a vertex lies on it at {} (T-junction)", show(p))).unwrap_or_default())]
    OpenEdge {
        /// The triangle at the edge.
        triangle: u32,
        /// Vertices of the edge.
        vertices: [u32; 2],
        /// Begin of the edge.
        from: Point,
        /// End of the edge.
        to: Point,
        /// A vertex that lies on the edge, or nearly: a T-junction.
        junction: Option<Point>,
    },
    /// Two triangles touch elsewhere than in the vertices and edges they share.
    #[error("triangles {} and {} meet where they should not: {kind}", triangles[0], triangles[1])]
    SelfIntersection {
        /// The two triangles.
        triangles: [u32; 2],
        /// Kind of the contact.
        kind: ContactKind,
        /// A point where they touch.
        at: Point,
    },
}

/// The number of a triangle; of several files, its number in its own and the name of that.
pub fn triangle_name(files: &[SourceFile], t: u32) -> String {
    let next = files.partition_point(|file| file.triangle_first <= t);
    match files.get(next.wrapping_sub(1)) {
        Some(file) if files.len() > 1 => format!("{} of {}", t - file.triangle_first, file.name),
        _ => t.to_string(),
    }
}

/// A position for messages; very large and very small numbers have a power of ten.
pub fn show(p: Point) -> String {
    let [x, y, z] = p.to_array().map(show_number);
    format!("({x}, {y}, {z})")
}

/// A number, with a power of ten when it would be long without.
fn show_number(x: f64) -> String {
    if x == 0.0 || (1e-4..1e9).contains(&x.abs()) { format!("{x}") } else { format!("{x:e}") }
}

impl Defect {
    /// The word for this kind of defect.
    pub fn code(&self) -> Code {
        match self {
            Self::Empty => Code::EmptySurface,
            Self::Degenerate { .. } => Code::DegenerateTriangle,
            Self::Duplicate { .. } => Code::DuplicateTriangle,
            Self::OpenEdge { .. } => Code::OpenSurface,
            Self::SelfIntersection { .. } => Code::SelfIntersection,
        }
    }

    /// The triangles concerned, as input ids.
    pub fn triangles(&self) -> &[u32] {
        match self {
            Self::Empty => &[],
            Self::Degenerate { triangle, .. } | Self::OpenEdge { triangle, .. } => {
                std::slice::from_ref(triangle)
            }
            Self::Duplicate { triangles, .. } | Self::SelfIntersection { triangles, .. } => {
                triangles
            }
        }
    }

    /// A position where it can be seen.
    pub fn at(&self) -> Option<Point> {
        match self {
            Self::Empty => None,
            Self::Degenerate { corners, .. } | Self::Duplicate { corners, .. } => {
                Some((corners[0] + corners[1] + corners[2]) / 3.0)
            }
            Self::OpenEdge { from, to, junction, .. } => {
                Some(junction.unwrap_or_else(|| from.midpoint(*to)))
            }
            Self::SelfIntersection { at, .. } => Some(*at),
        }
    }

    /// The defect in words, its triangles by their numbers in `files`.
    pub fn in_words(&self, files: &[SourceFile]) -> String {
        let plain = self.to_string();
        let [first, rest @ ..] = self.triangles() else { return plain };
        let name = |t: u32| triangle_name(files, t);
        match self {
            _ if files.len() < 2 => plain,
            Self::SelfIntersection { kind, .. } => {
                let [a, b] = [name(*first), name(rest[0])];
                format!("triangle {a} and triangle {b} meet where they should not: {kind}")
            }
            Self::Duplicate { .. } => {
                format!("triangle {} repeats triangle {}", name(rest[0]), name(*first))
            }
            _ => plain.replacen(
                &format!("triangle {first}"),
                &format!("triangle {}", name(*first)),
                1,
            ),
        }
    }

    /// Ids and coordinates on one line, ids by their numbers in `files`.
    pub fn place(&self, files: &[SourceFile]) -> String {
        let ids: Vec<String> = self.triangles().iter().map(|&t| triangle_name(files, t)).collect();
        match (self.at(), ids.len()) {
            (None, _) => "nowhere: there is nothing to show".to_owned(),
            (Some(p), 1) => format!("triangle {} near {}", ids[0], show(p)),
            (Some(p), _) => format!("triangles {} near {}", ids.join(" and "), show(p)),
        }
    }

    /// A suggestion for the user.
    pub fn help(&self) -> &'static str {
        match self {
            Self::Empty => "choose a file that holds triangles",
            Self::Degenerate { .. } | Self::Duplicate { .. } => "a repair drops such triangles",
            Self::OpenEdge { junction: Some(_), .. } => {
                "a repair divides triangles where vertices lie exactly on their open edges"
            }
            Self::OpenEdge { .. } => {
                "a repair may close them by joining near points; otherwise close them where the surface was made"
            }
            Self::SelfIntersection { .. } => {
                "unite or separate the parts where the surface was made"
            }
        }
    }
}
