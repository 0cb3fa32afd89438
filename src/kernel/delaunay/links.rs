//! Joins the new tetrahedra of one insertion to each other in constant time per edge.
//!
//! The outer faces of a cavity form a closed surface in which each directed edge occurs once, its
//! reverse in the face next to it. The few vertices of that surface get small local numbers, and a
//! matrix over pairs of them answers "which face has the edge b → a". A cavity with more vertices
//! than the matrix holds (long edges in a coarse mesh) sorts its edges instead.

/// Vertices the matrix can number: 0.8 % of cavities exceed 64 in the worst insertion order, none in the usual one.
const LOCAL_MAX: usize = 64;
const TABLE: usize = 256;

/// Scratch for the edges of one cavity surface.
pub(super) struct Links {
    /// `epoch << 40 | vertex << 8 | local` of each occupied place; older epochs are empty places.
    places: [u64; TABLE],
    epoch: u64,
    n_local: usize,
    /// `matrix[a * LOCAL_MAX + b]` = half-face of the directed edge a → b.
    matrix: Vec<u32>,
    /// Used instead of the matrix by large cavities.
    sorted: Vec<(u32, u32, u32)>,
}

impl Links {
    pub fn new() -> Self {
        Self {
            places: [0; TABLE],
            epoch: 0,
            n_local: 0,
            matrix: vec![0; LOCAL_MAX * LOCAL_MAX],
            sorted: Vec::new(),
        }
    }

    /// Starts a new surface.
    pub fn begin(&mut self) {
        self.n_local = 0;
        self.sorted.clear();
        self.epoch += 1;
        if self.epoch == 1 << 24 {
            self.places = [0; TABLE];
            self.epoch = 1;
        }
    }

    /// The slot of `v` or the empty slot for it, its value, and whether `v` is in it.
    #[inline(always)]
    fn find(&self, v: u32) -> (usize, u64, bool) {
        let key = self.epoch << 32 | u64::from(v);
        let mut at = (v.wrapping_mul(0x9E37_79B1) >> 24) as usize;
        loop {
            let found = self.places[at % TABLE];
            if found >> 8 == key {
                return (at % TABLE, found, true);
            }
            if found >> 40 != self.epoch {
                return (at % TABLE, key << 8, false);
            }
            at += 1;
        }
    }

    /// The local number of vertex `v`, given at its first call; `None` when there are too many.
    #[inline(always)]
    pub fn local(&mut self, v: u32) -> Option<u8> {
        let (at, found, is_there) = self.find(v);
        if is_there {
            return Some(found as u8);
        }
        if self.n_local == LOCAL_MAX {
            return None;
        }
        self.places[at] = found | self.n_local as u64;
        self.n_local += 1;
        Some(self.n_local as u8 - 1)
    }

    /// Returns whether `v` has a local number in this surface.
    #[inline]
    pub fn knows(&self, v: u32) -> bool {
        self.find(v).2
    }

    /// Vertices numbered so far.
    pub fn n_local(&self) -> usize {
        self.n_local
    }

    /// Enters the half-face of the edge between two local numbers.
    #[inline]
    pub fn set(&mut self, a: u8, b: u8, half_face: u32) {
        self.matrix[(usize::from(a) % LOCAL_MAX) * LOCAL_MAX + usize::from(b) % LOCAL_MAX] =
            half_face;
    }

    /// The half-face of the edge a → b.
    #[inline]
    pub fn get(&self, a: u8, b: u8) -> u32 {
        self.matrix[(usize::from(a) % LOCAL_MAX) * LOCAL_MAX + usize::from(b) % LOCAL_MAX]
    }

    /// Enters an edge of a surface too large for the matrix.
    pub fn push_sorted(&mut self, a: u32, b: u32, half_face: u32) {
        self.sorted.push((a, b, half_face));
    }

    /// Ends entering; [`Links::find_sorted`] may follow.
    pub fn sort(&mut self) {
        self.sorted.sort_unstable();
    }

    /// The half-face of the edge a → b of a large surface.
    pub fn find_sorted(&self, a: u32, b: u32) -> Option<u32> {
        let at = self.sorted.binary_search_by_key(&(a, b), |&(a, b, _)| (a, b));
        at.ok().map(|i| self.sorted[i].2)
    }
}
