//! Fills pages with a stream of records.

use super::{EXTRA_PER_SLOT, PageRecord, WorkingWords};
use crate::page::{
    NONE, PageAddress, PageKind, RECORDS, SLOTS, Slot, page_key, seal_full_page, stored_bytes,
    u32_le,
};

/// A page of records ready to be stored, with the page of extra words if that is full too.
pub struct PageSet<R> {
    /// Number of the page.
    pub page: u32,
    /// Number of the first record.
    pub first: u32,
    /// Its records, in order.
    pub records: Vec<R>,
    /// Keys and values of these pages.
    pub values: Vec<(u64, Vec<u8>)>,
}

/// Collects records and fills pages with them; the counterpart of [`Packer`](crate::chunk::Packer).
pub struct PagePacker<R> {
    subdomain: u32,
    generation: u32,
    /// Number of records in pages that were returned.
    first: u32,
    pending: Vec<R>,
    slots: Vec<Slot>,
    extra: Vec<[u32; 2]>,
    extra_pages: u32,
}

impl<R: PageRecord> PagePacker<R> {
    /// A packer for the records of one sub-domain in one generation.
    pub fn new(subdomain: u32, generation: u32) -> Self {
        Self {
            subdomain,
            generation,
            first: 0,
            pending: Vec::new(),
            slots: Vec::new(),
            extra: Vec::new(),
            extra_pages: 0,
        }
    }

    /// Number of records taken so far.
    pub fn count(&self) -> u64 {
        u64::from(self.first) + self.pending.len() as u64
    }

    /// Number of pages of records so far.
    pub fn pages(&self) -> u32 {
        self.first.div_ceil(RECORDS as u32)
    }

    /// Takes a record and its words; returns a page when one is full.
    pub fn push(&mut self, record: R, working: WorkingWords) -> Option<PageSet<R>> {
        self.pending.push(record);
        self.slots.push(working.slot);
        if R::EXTRA.is_some() {
            self.extra.push(working.extra);
        }
        (self.pending.len() == RECORDS).then(|| self.page(false))
    }

    /// The last page; `None` when no record is left.
    pub fn cut(&mut self) -> Option<PageSet<R>> {
        (!self.pending.is_empty()).then(|| self.page(true))
    }

    fn page(&mut self, last: bool) -> PageSet<R> {
        let page = self.first / RECORDS as u32;
        // Free slots of tetrahedra are marked. For other records, only the count marks the end.
        let empty = [u32_le::from_native(if R::PAGE == PageKind::Tets { NONE } else { 0 }); 8];
        let mut values = vec![self.sealed(R::PAGE, page, &self.slots, empty)];
        self.slots.clear();
        if let Some(kind) = R::EXTRA
            && (self.extra.len() == EXTRA_PER_SLOT * RECORDS || last)
        {
            let slots: Vec<Slot> = (self.extra.chunks(EXTRA_PER_SLOT))
                .map(|four| {
                    std::array::from_fn(|i| {
                        u32_le::from_native(four.get(i / 2).map_or(0, |two| two[i % 2]))
                    })
                })
                .collect();
            let zero = [u32_le::from_native(0); 8];
            values.push(self.sealed(kind, self.extra_pages, &slots, zero));
            self.extra.clear();
            self.extra_pages += 1;
        }
        let records = std::mem::take(&mut self.pending);
        let first = self.first;
        self.first += records.len() as u32;
        PageSet { page, first, records, values }
    }

    fn sealed(&self, kind: PageKind, page: u32, slots: &[Slot], empty: Slot) -> (u64, Vec<u8>) {
        let mut frame = vec![empty; SLOTS];
        frame[..slots.len()].copy_from_slice(slots);
        let address = PageAddress { kind, subdomain: self.subdomain, page };
        seal_full_page(&mut frame, address, self.generation, slots.len() as u32);
        (page_key(kind, page), stored_bytes(&frame).to_vec())
    }
}
