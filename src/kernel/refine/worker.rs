//! The worker of one block, which divides edges: the insertion kernel and its scratch data.

use super::activity::Activity;
use super::candidate::Candidates;
use super::edge_cache::EdgeCache;
use super::recent::Recent;
use crate::delaunay::Kernel;
use tetdb_base::geom::HilbertFrame;

pub(super) struct Worker {
    pub kernel: Kernel,
    pub order: HilbertFrame,
    /// Scratch: (edge as ordered pair, a tetrahedron that has it).
    pub edges: Vec<(u64, u32)>,
    pub candidates: Candidates,
    pub recent: Recent,
    pub active: Activity,
    /// Edges between fixed vertices that need no point, which holds until vertices get other numbers: neither their ends change, nor
    /// the sizes along them, nor the input's faces.
    pub settled: EdgeCache,
    /// Whether points move to the nearest place of the pattern.
    pub placing: bool,
    /// Whether tetrahedra are examined again.
    pub examined_too: bool,
    /// A tetrahedron in use, where a walk can start when its own start is gone.
    pub last: u32,
}
