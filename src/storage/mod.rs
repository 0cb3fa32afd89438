//! Pages, cache, budget, transactions. This room knows bytes and records, not geometry.
//!
//! # How failure travels
//! A record is read some twenty million times a second, and nearly always from a resident frame. The
//! accessors of [`Pages`] therefore return records, not results: when a page cannot be loaded, the
//! pager unwinds with the [`StorageError`] as its payload, and [`attempt`], which surrounds each step,
//! turns that back into a value. A step is atomic, so what it leaves half-done in memory is dropped
//! with it. Nothing but [`attempt`] may catch such an unwinding. A request to stop travels the same way.

mod backend;
mod budget;
mod cancel;
mod disk;
mod error;
mod file;
mod flat;
mod page_table;
mod paged_vec;
mod pager;
mod places;
mod real_disk;
mod run_context;
mod scratch;
mod sort;
mod space;
mod spill;
mod spill_vec;

pub use budget::{Budget, Lease};
pub use cancel::{CancelToken, attempt, check_cancelled, raise};
pub use disk::{Disk, DiskPath, Entry};
pub use error::StorageError;
pub use file::StoreFile;
pub use flat::FlatPages;
pub use pager::{Pager, PagerStats};
pub use places::Backing;
pub use run_context::{CaughtPanic, RunContext, in_place_scope, n_threads, parallel};
pub use sort::{Sorted, Sorter};
pub use space::available_bytes;
pub use spill_vec::{FrozenSpillVec, ScratchSpace, SpillVec, SpillVecBuilder};

use tetdb_schema::page::Slot;

/// Kinds of working pages an accessor may name, as positions in a page table.
pub mod kind {
    use tetdb_schema::page::PageKind;

    pub const TETS: usize = 0;
    pub const TET_ATTRIBUTES: usize = 1;
    pub const VERTICES: usize = 2;
    pub const VERTEX_ATTRIBUTES: usize = 3;
    pub const FACETS: usize = 4;
    pub const INTERFACE_FACES: usize = 5;
    pub const SCRATCH: usize = 6;
    /// The page kinds in that order.
    pub const ALL: [PageKind; 7] = [
        PageKind::Tets,
        PageKind::TetAttributes,
        PageKind::Vertices,
        PageKind::VertexAttributes,
        PageKind::Facets,
        PageKind::InterfaceFaces,
        PageKind::Scratch,
    ];
}

/// Random access to records by id, whatever holds them.
///
/// The borrow ends before the next access: no reference into a page survives it.
pub trait Pages {
    /// Reads record `id` of kind `K` (one of [`kind`]).
    fn read<const K: usize>(&mut self, id: u32) -> &Slot;
    /// Reads four records of kind `K` at once, which is cheaper than one after another.
    fn read_four<const K: usize>(&mut self, ids: [u32; 4]) -> [&Slot; 4];
    /// Opens record `id` of kind `K` for change; its page is dirty from then on.
    fn write<const K: usize>(&mut self, id: u32) -> &mut Slot;
    /// Number of pages of kind `K`.
    fn n_pages<const K: usize>(&self) -> u32;
    /// Appends a zeroed page of kind `K` and returns its number.
    fn append_page<const K: usize>(&mut self) -> u32;
    /// Forgets the first `n` pages of kind `K`; the others move up to take their numbers.
    fn drop_front<const K: usize>(&mut self, n: u32);
    /// Forgets all pages of kind `K`, as if there had never been one.
    fn clear<const K: usize>(&mut self);
}
