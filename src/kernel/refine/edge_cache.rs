//! Edges met before, in a table that forgets.

/// Edges as ordered pairs of vertices; one takes the place of another. What it forgets costs time alone.
pub(super) struct EdgeCache {
    /// Zero where there is none.
    edges: Vec<u64>,
}

impl EdgeCache {
    /// A table with at least so many places.
    pub fn new(places: usize) -> Self {
        Self { edges: vec![0; places.next_power_of_two()] }
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

    /// Adds an edge; whether it was not there.
    #[inline(always)]
    pub fn add(&mut self, edge: u64) -> bool {
        let place = self.place(edge);
        std::mem::replace(&mut self.edges[place], edge) != edge
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.edges.fill(0);
    }
}
