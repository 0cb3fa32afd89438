//! Finished sub-domains that were not sealed: the same records in the same order, in working pages.
//!
//! Record `n` is in slot `n % 2046` of page `n / 2046`; what else a record has, two words, stands four to a slot in pages of
//! another kind: attributes of tetrahedra and vertices, the tetrahedra on the sides of facets.

mod pack;
mod records;
#[cfg(test)]
mod tests;
mod unpack;

pub use pack::{PagePacker, PageSet};
pub use records::{PageRecord, TetPlace, Working};
pub use unpack::PageDecoder;

use crate::page::{RECORDS, SLOT_BITS, SLOT_MASK};

/// Second words of a slot, so many to a slot.
const BESIDE: usize = 4;

/// The page of second words that belongs to page `page`.
pub const fn beside_page(page: u32) -> u32 {
    page / BESIDE as u32
}

/// The id of record `n` in pages whose last two slots hold no record.
pub const fn sparse(n: u32) -> u32 {
    let (page, slot) = (n / RECORDS as u32, n % RECORDS as u32);
    page << SLOT_BITS | slot
}

/// The inverse of [`sparse`].
pub const fn dense(id: u32) -> u32 {
    (id >> SLOT_BITS) * RECORDS as u32 + (id & SLOT_MASK)
}
