//! Finished sub-domains that were not sealed: working pages with the same records in the same order.
//!
//! Record `n` is in slot `n % 2046` of page `n / 2046`. Some kinds of records have two more words in pages of another kind, four
//! records to a slot. These are the attributes of tetrahedra and vertices, and the tetrahedra on the sides of facets.

mod pack;
mod records;
#[cfg(test)]
mod tests;
mod unpack;

pub use pack::{PagePacker, PageSet};
pub use records::{PageRecord, TetLinks, WorkingWords};
pub use unpack::PageDecoder;

/// Records whose extra words share a slot.
const EXTRA_PER_SLOT: usize = 4;

/// The page with the extra words of the records in page `page`.
pub const fn extra_page(page: u32) -> u32 {
    page / EXTRA_PER_SLOT as u32
}
