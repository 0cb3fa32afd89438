//! Points that divide edges.

use tetdb_base::geom::Point;
use tetdb_base::storage::sort_unstable_by;

/// A point to insert.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub point: Point,
    pub h: f32,
    /// A tetrahedron that had the divided edge.
    pub tet: u32,
}

/// Some candidates in the order of their edges, and the key of each: length class (long first), then the position along the curve.
#[derive(Default)]
pub(super) struct Keyed {
    pub candidates: Vec<Candidate>,
    pub keys: Vec<u64>,
}

/// Bits for the place in a part, which is of fewer candidates.
const PLACE_BITS: u32 = 16;

/// The points of one block in order of insertion: as they were found, part by part, and an order. Where lengths fall fast nearly every edge
/// has its five, and copies of them would not fit small leases.
#[derive(Default)]
pub(super) struct Candidates {
    parts: Vec<Vec<Candidate>>,
    /// Key, then part and place in it: points that share a key stay in the order of their edges.
    order: Vec<(u64, u32)>,
}

impl Candidates {
    /// Replaces them by those of `parts`.
    pub fn set(&mut self, parts: Vec<Keyed>) {
        self.parts.clear();
        self.order.clear();
        let n = parts.iter().map(|part| part.keys.len()).sum();
        self.order.reserve_exact(n);
        for (number, part) in (0u32..).zip(parts) {
            assert!(part.keys.len() < 1 << PLACE_BITS, "parts are small");
            let places = (0u32..).map(|place| number << PLACE_BITS | place);
            self.order.extend(part.keys.into_iter().zip(places));
            self.parts.push(part.candidates);
        }
        sort_unstable_by(&mut self.order, Ord::cmp);
    }

    /// Each once, although points of many edges have moved to the same place.
    pub fn iter(&self) -> impl Iterator<Item = &Candidate> {
        let in_order = self.order.iter().map(|&(_, at)| {
            let place = at & ((1 << PLACE_BITS) - 1);
            &self.parts[(at >> PLACE_BITS) as usize][place as usize]
        });
        let mut last = None;
        in_order.filter(move |c| last.replace(c.point) != Some(c.point))
    }
}
