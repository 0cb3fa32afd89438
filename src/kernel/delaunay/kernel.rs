//! The insertion kernel: its scratch data and its results.

use super::links::Links;
use crate::mesh::{FaceRef, Tet};
use tetdb_base::geom::Point;

/// Reasons why a point was not inserted; the mesh is unchanged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rejected {
    /// The walk left the mesh or started nowhere.
    Outside,
    /// The point is this vertex, bit by bit.
    Duplicate(u32),
    /// No star-shaped cavity keeps the required faces.
    Blocked,
    /// A vertex would lose its last tetrahedron.
    Buries,
    /// The cavity has more than a million tetrahedra.
    TooLarge,
    /// The caller refused a vertex of the cavity.
    Refused,
}

/// An outer face of the cavity.
#[derive(Clone, Copy, Debug)]
pub struct CavityFace {
    /// Vertex ids, counter-clockwise seen from outside the cavity.
    pub vertices: [u32; 3],
    /// The face from the other side.
    pub outside: FaceRef,
    /// The face from the inside: a tetrahedron of the cavity.
    pub inside: FaceRef,
    /// True if the face is required.
    pub required: bool,
}

/// Work done so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct KernelStats {
    /// Points inserted.
    pub inserted: u64,
    /// Faces crossed while locating.
    pub walk_steps: u64,
    /// Tetrahedra of all cavities.
    pub cavity_tets: u64,
    /// Tetrahedra of the largest cavity.
    pub cavity_largest: u64,
    /// Insphere tests.
    pub sphere_tests: u64,
    /// Cavities that had to shrink to be star-shaped.
    pub shrunk: u64,
}

/// Scratch of the insertion kernel; one per worker.
pub struct Kernel {
    pub(super) cavity: Vec<u32>,
    /// The face through which each tetrahedron of the cavity was entered.
    pub(super) entries: Vec<FaceRef>,
    /// The vertex each tetrahedron of the cavity brought in; none for the first.
    pub(super) apexes: Vec<u32>,
    /// Outer faces that the point does not see from inside.
    pub(super) blind: Vec<u32>,
    /// Local numbers of the outer faces' vertices, if they were given already.
    pub(super) locals: Vec<[u8; 3]>,
    pub(super) numbered: bool,
    pub(super) faces: Vec<CavityFace>,
    pub(super) links: Links,
    pub(super) new_tets: Vec<u32>,
    pub(super) outer: Vec<u32>,
    pub(super) suspects: Vec<u32>,
    pub(super) turn: u32,
    /// Work done since the kernel was created.
    pub stats: KernelStats,
}

impl Default for Kernel {
    fn default() -> Self {
        Self {
            cavity: Vec::new(),
            entries: Vec::new(),
            apexes: Vec::new(),
            blind: Vec::new(),
            locals: Vec::new(),
            numbered: false,
            faces: Vec::new(),
            links: Links::new(),
            new_tets: Vec::new(),
            outer: Vec::new(),
            suspects: Vec::new(),
            turn: 1,
            stats: KernelStats::default(),
        }
    }
}

/// End of a walk.
#[derive(Clone, Copy, Debug)]
pub struct PointLocation {
    /// Index of the tetrahedron.
    pub tet: u32,
    /// Its vertices and neighbors.
    pub record: Tet,
    /// Positions of its vertices.
    pub points: [Point; 4],
}
