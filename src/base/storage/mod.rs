//! Pages, cache, budget, transactions. The module handles bytes and records, not geometry.
//!
//! # How failure travels
//! A record is read some twenty million times a second, and nearly always from a resident frame. The accessors of
//! [`Pages`] therefore return records, not results. If a page cannot be loaded, the pager unwinds with the
//! [`StorageError`] as its payload; [`attempt`], which surrounds each step, turns that back into a value. A step is
//! atomic, so its unfinished state in memory is dropped with it. Nothing but [`attempt`] may catch such an unwinding. A
//! request to stop travels the same way.

#![warn(missing_docs)]

mod backend;
mod budget;
mod cancel;
mod cancel_token;
mod disk;
mod disk_path;
mod draft_pages;
mod error;
mod file;
mod file_lock;
mod flat;
mod free_space;
mod page_files;
mod page_table;
mod paged_vec;
mod pager;
mod pages;
mod parallel_sort;
mod real_disk;
mod remote;
mod reserve;
mod run_context;
mod scratch;
mod shelf;
mod sort;
mod sort_record;
mod spill;
mod spill_vec;
mod step_clock;

pub use budget::{Budget, Lease};
pub use cancel::{OrRaise, attempt, check_cancelled, raise};
pub use cancel_token::CancelToken;
pub use disk::{Disk, DiskEntry, FileId};
pub use disk_path::DiskPath;
pub use draft_pages::DraftPages;
pub use error::StorageError;
pub use file::StoreFile;
pub use file_lock::{FileLock, Refused, holder, host_name, is_process_gone};
pub use flat::FlatPages;
pub use free_space::available_bytes;
pub use page_files::Backing;
pub use pager::{Pager, PagerStats};
pub use pages::{Pages, SharedPages, kind};
pub use parallel_sort::sort_unstable_by;
pub use remote::RemoteFailure;
pub use reserve::{filled, push, reserve};
pub use run_context::{
    CaughtPanic, RunContext, for_each_mut, in_place_scope, join, map_into, map_long, n_threads,
    parallel, shared_tasks, spare_threads,
};
pub use shelf::{Shelf, Shelved};
pub use sort::{Sorted, Sorter};
pub use sort_record::sort_record;
pub use sort_record::{KeyedId, Payload, SortBytes, SortField, SortRecord, total_order};
pub use spill_vec::{FrozenSpillVec, ScratchSpace, SpillVec, SpillVecBuilder, SpillVecReader};
pub use step_clock::{SharedSeconds, StepClock};
