//! Four sums at each vertex of a part of the mesh, to be added to those of the other parts.

use tetdb_schema::page::{Slot, u32_le};

use crate::mesh::Mesh;
use tetdb_base::geom::IdMap;
use tetdb_base::storage::{Pages, kind};

/// Vertices whose sums lie together: along the curve they are neighbors, so most are needed when one is.
const BLOCK: usize = 8;
/// Blocks found without asking the map. A page of tetrahedra has about 50 blocks; with 64 a third more time goes by.
const RECENT: usize = 256;

/// Four numbers beside a vertex: first the sum of weighted circumcenters times two and the sum of weights (both as
/// six volumes), then the position before the move and what is left of its patience: 1 when moved, 0 when not.
#[inline(always)]
pub(super) fn four(slot: &Slot) -> [f64; 4] {
    let f = |i: usize| {
        let (low, high) = (slot[i].to_native(), slot[i + 1].to_native());
        f64::from_bits(u64::from(low) | u64::from(high) << 32)
    };
    [f(0), f(2), f(4), f(6)]
}

#[inline(always)]
pub(super) fn set_four(slot: &mut Slot, numbers: [f64; 4]) {
    for (i, number) in numbers.into_iter().enumerate() {
        let bits = number.to_bits();
        slot[2 * i] = u32_le::from_native(bits as u32);
        slot[2 * i + 1] = u32_le::from_native((bits >> 32) as u32);
    }
}

/// Sums by vertex.
pub(super) struct Sums {
    blocks: Vec<(u32, [[f64; 4]; BLOCK])>,
    places: IdMap<u32, u32>,
    /// Blocks used lately and their places, by the last bits of their numbers.
    recent: Box<[(u32, u32); RECENT]>,
}

impl Default for Sums {
    fn default() -> Self {
        Self {
            blocks: Vec::new(),
            places: IdMap::default(),
            recent: Box::new([(u32::MAX, 0); RECENT]),
        }
    }
}

impl Sums {
    /// Adds to the sums of `v`.
    #[inline(always)]
    pub(super) fn add(&mut self, v: u32, terms: [f64; 4]) {
        let block = v / BLOCK as u32;
        let (known, mut place) = self.recent[block as usize % RECENT];
        if known != block {
            place = self.find(block);
        }
        let sums = &mut self.blocks[place as usize].1[v as usize % BLOCK];
        sums[0] += terms[0];
        sums[1] += terms[1];
        sums[2] += terms[2];
        sums[3] += terms[3];
    }

    #[inline(never)]
    fn find(&mut self, block: u32) -> u32 {
        let place = *self.places.entry(block).or_insert_with(|| {
            self.blocks.push((block, [[0.0; 4]; BLOCK]));
            self.blocks.len() as u32 - 1
        });
        self.recent[block as usize % RECENT] = (block, place);
        place
    }

    /// Adds the sums to those in the scratch pages, vertex by vertex: their order does not matter.
    pub(super) fn add_to<P: Pages>(self, mesh: &mut Mesh<P>) {
        for (block, sums) in self.blocks {
            for (k, sums) in (0..).zip(sums) {
                if sums == [0.0; 4] {
                    continue;
                }
                let slot = mesh.pages_mut().write::<{ kind::SCRATCH }>(block * BLOCK as u32 + k);
                let mut total = four(slot);
                for (total, sum) in total.iter_mut().zip(sums) {
                    *total += sum;
                }
                set_four(slot, total);
            }
        }
    }
}
