//! Reads a page of records.

use super::{EXTRA_PER_SLOT, PageRecord, WorkingWords, extra_page};
use crate::page::{
    PageAddress, PageError, PageKind, RECORDS, SLOTS, Slot, open_page, page_count, page_key, u32_le,
};

/// Reads pages of one sub-domain in one generation.
pub struct PageDecoder {
    subdomain: u32,
    generation: u32,
    main: Vec<Slot>,
    extra: Vec<Slot>,
}

impl PageDecoder {
    /// A decoder with frames of its own.
    pub fn new(subdomain: u32, generation: u32) -> Self {
        let empty = [u32_le::from_native(0); 8];
        Self { subdomain, generation, main: vec![empty; SLOTS], extra: vec![empty; SLOTS] }
    }

    /// Keys of the values that hold page `page` of records `R`.
    pub fn keys<R: PageRecord>(page: u32) -> (u64, Option<u64>) {
        let extra = R::EXTRA.map(|kind| page_key(kind, extra_page(page)));
        (page_key(R::PAGE, page), extra)
    }

    /// Takes the value of page `page` and checks it. Errors: any difference in length, checksum or header.
    pub fn open<R: PageRecord>(&mut self, page: u32, value: &[u8]) -> Result<(), PageError> {
        let address = self.address(R::PAGE, page);
        let found = open_page(value, address, &mut self.main)?;
        self.check(address, found)
    }

    /// Takes the value with the extra words of page `page` and checks it. Errors: as [`PageDecoder::open`].
    pub fn open_extra<R: PageRecord>(&mut self, page: u32, value: &[u8]) -> Result<(), PageError> {
        let Some(kind) = R::EXTRA else { return Ok(()) };
        let address = self.address(kind, extra_page(page));
        let found = open_page(value, address, &mut self.extra)?;
        self.check(address, found)
    }

    /// Replaces `records` by those of page `page`, which was opened with its extra words; returns the number of the first.
    ///
    /// Errors: a slot without a record, as in a mesh that is not finished.
    pub fn records<R: PageRecord>(
        &self,
        page: u32,
        records: &mut Vec<R>,
    ) -> Result<u32, PageError> {
        records.clear();
        let wrong = |expected: u32, found: u32| PageError::Header {
            address: self.address(R::PAGE, page),
            field: "records",
            expected,
            found,
        };
        let count = page_count(&self.main);
        if count == 0 || count > RECORDS as u32 {
            return Err(wrong(RECORDS as u32, count));
        }
        let first = page * RECORDS as u32;
        let shift = page as usize % EXTRA_PER_SLOT * RECORDS;
        for at in 0..count as usize {
            let word = |i: usize| {
                self.extra[(shift + at) / EXTRA_PER_SLOT][(shift + at) % EXTRA_PER_SLOT * 2 + i]
            };
            let working = WorkingWords {
                slot: self.main[at],
                extra: [word(0).to_native(), word(1).to_native()],
            };
            let n = first + at as u32;
            let record = R::from_working(&working, self.subdomain, n);
            records.push(record.ok_or_else(|| wrong(count, at as u32))?);
        }
        Ok(first)
    }

    fn address(&self, kind: PageKind, page: u32) -> PageAddress {
        PageAddress { kind, subdomain: self.subdomain, page }
    }

    fn check(&self, address: PageAddress, found: u32) -> Result<(), PageError> {
        if found == self.generation {
            return Ok(());
        }
        Err(PageError::Header { address, field: "generation", expected: self.generation, found })
    }
}
