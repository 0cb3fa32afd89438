//! Pages without a cap or a disk, for measurements.

use tetdb_schema::page::{SLOTS, Slot, u32_le};

use super::{Pages, kind};

/// The accessors of [`Pages`] over plain arrays, without a cap: the baseline for measuring the cost of paging.
#[derive(Clone, Default)]
pub struct FlatPages {
    arrays: [Vec<Slot>; kind::ALL.len()],
}

impl Pages for FlatPages {
    #[inline(always)]
    fn read<const K: usize>(&mut self, id: u32) -> &Slot {
        &self.arrays[K][id as usize]
    }

    #[inline(always)]
    fn read_four<const K: usize>(&mut self, [a, b, c, d]: [u32; 4]) -> [&Slot; 4] {
        let array = &self.arrays[K];
        [&array[a as usize], &array[b as usize], &array[c as usize], &array[d as usize]]
    }

    #[inline(always)]
    fn write<const K: usize>(&mut self, id: u32) -> &mut Slot {
        &mut self.arrays[K][id as usize]
    }

    fn n_pages<const K: usize>(&self) -> u32 {
        (self.arrays[K].len() / SLOTS) as u32
    }

    fn append_page<const K: usize>(&mut self) -> u32 {
        let page = self.n_pages::<K>();
        let len = self.arrays[K].len() + SLOTS;
        self.arrays[K].resize(len, [u32_le::from_native(0); 8]);
        page
    }

    fn drop_front<const K: usize>(&mut self, n: u32) {
        self.arrays[K].drain(..n as usize * SLOTS);
    }

    fn clear<const K: usize>(&mut self) {
        self.arrays[K] = Vec::new();
    }
}
