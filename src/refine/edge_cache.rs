//! Edges between fixed vertices that are known to need no point.
//!
//! Neither their ends nor the sizes along them nor the input's faces change, so what was decided once holds until vertices get other
//! numbers. Without this every edge of the surface is looked at twenty times, whenever a tetrahedron at it is new.

/// Places for each facet of the mesh: one and a half edges, and those between neighboring parts of the surface.
const PLACES_FACET: u32 = 3;
/// Most places: 4 MB. Where there are more edges, some are looked at again.
const PLACES_MAX: u32 = 1 << 19;

/// A table of such edges, in which one takes the place of another. What it forgets costs time alone.
pub(super) struct Settled {
    /// An edge as an ordered pair, or zero.
    edges: Vec<u64>,
}

impl Settled {
    /// A table for a mesh with so many facets.
    pub fn new(n_facets: u32) -> Self {
        let n = n_facets
            .saturating_mul(PLACES_FACET)
            .clamp(1 << 10, PLACES_MAX);
        Self {
            edges: vec![0; n.next_power_of_two() as usize],
        }
    }

    #[inline(always)]
    fn place(&self, edge: u64) -> usize {
        let mixed = (edge ^ edge >> 29).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        (mixed >> 32) as usize & (self.edges.len() - 1)
    }

    #[inline(always)]
    pub fn has(&self, edge: u64) -> bool {
        self.edges[self.place(edge)] == edge
    }

    pub fn add(&mut self, edge: u64) {
        let place = self.place(edge);
        self.edges[place] = edge;
    }

    /// Forgets all, for vertices have other numbers.
    pub fn clear(&mut self) {
        self.edges.fill(0);
    }
}
