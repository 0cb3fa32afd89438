//! Pages that many threads read at once, while nobody changes them.

use tetdb_schema::page::Slot;

use super::page_table::PageTable;
use super::{Pages, kind};

/// A view of pages that are all in memory. Is not: a way to change them; those methods panic.
#[derive(Clone, Copy)]
pub struct SharedPages<'a> {
    frames: &'a [Slot],
    tables: [&'a PageTable; kind::ALL.len()],
}

impl<'a> SharedPages<'a> {
    /// Every page of the tables must be readable at once.
    pub(super) fn new(frames: &'a [Slot], tables: &'a [PageTable; kind::ALL.len()]) -> Self {
        Self {
            frames,
            tables: tables.each_ref(),
        }
    }
}

impl Pages for SharedPages<'_> {
    #[inline(always)]
    fn read<const K: usize>(&mut self, id: u32) -> &Slot {
        &self.frames[self.tables[K].to_read(id)]
    }

    #[inline(always)]
    fn read_four<const K: usize>(&mut self, [a, b, c, d]: [u32; 4]) -> [&Slot; 4] {
        let (frames, table) = (self.frames, self.tables[K]);
        [
            &frames[table.to_read(a)],
            &frames[table.to_read(b)],
            &frames[table.to_read(c)],
            &frames[table.to_read(d)],
        ]
    }

    fn write<const K: usize>(&mut self, id: u32) -> &mut Slot {
        unreachable!("record {id} is shared")
    }

    fn n_pages<const K: usize>(&self) -> u32 {
        self.tables[K].len() as u32
    }

    fn append_page<const K: usize>(&mut self) -> u32 {
        unreachable!("pages are shared")
    }

    fn drop_front<const K: usize>(&mut self, _: u32) {
        unreachable!("pages are shared")
    }

    fn clear<const K: usize>(&mut self) {
        unreachable!("pages are shared")
    }
}
