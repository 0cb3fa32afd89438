//! The catalog of a store: the job, the steps, sub-domain rows; one commit for each step.
//!
//! A store is a directory. Its catalog lists the files that count. A step of the mesher writes new files and then changes the catalog in one
//! commit, so that a store is always in the state after some step.

#![warn(missing_docs)]

mod catalog;
mod error;
mod fields;
mod periodic;
mod step;
#[cfg(test)]
mod tests;
mod two;
mod versions;
mod writer_lock;

pub use catalog::Catalog;
pub use catalog::INPUT_TRIANGLES;
pub use error::StoreError;
pub use step::Step;
pub use tetdb_schema::catalog::{
    CoarseRow, FileRow, InterfaceRow, Job, JournalRow, Measure, NeighborRow, QUALITY_BINS,
    QualityRow, RegionRow, Stage, StageRow, StoreState, SubdomainRow, SubdomainState,
    SurfaceSource, TopologyRow, VersionRow,
};
#[doc(hidden)]
pub use two::two_subdomains;
pub use versions::{BEFORE, Difference, NewVersion};
pub use writer_lock::WriterLock;
