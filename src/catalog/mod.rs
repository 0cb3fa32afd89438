//! What a store knows about itself, and how it is read: the job, stages, sub-domain rows; sealed sub-domains.
//!
//! A store is a directory. Its catalog names the files that count; a step of the mesher writes new
//! files and then flips the catalog in one commit, so that a store is at any moment as one of its
//! steps left it. [`Store`] is the reader for everybody, [`SealedWriter`] makes what it reads.

mod batch;
mod coarse;
mod error;
mod faces;
mod form;
mod layout;
mod reader;
mod records;
mod rows;
mod shape;
mod step;
#[cfg(test)]
mod tests;
mod totals;
mod vertex_cache;
mod writer;

pub use coarse::{CoarseLeaf, CoarseWriter};
pub use error::CatalogError;
pub use faces::{FacePairs, Paired, sorted_face};
pub use form::Form;
pub use layout::Catalog;
pub use reader::{Chunk, Chunks, Store, Subdomain};
pub use records::{
    CoarseRow, FileRow, InterfaceRow, Job, JournalRow, Measure, NeighborRow, QualityRow, RegionRow,
    Stage, StageRow, StoreState, SubdomainRow, SubdomainState, SurfaceSource, TopologyRow,
};
pub use shape::{QUALITY_BINS, Shape, quality_bin};
pub use step::Step;
#[cfg(test)]
pub(crate) use tests::two_subdomains;
pub use vertex_cache::{Corner, VertexCache};
pub use writer::{InterfaceSide, RegionTotals, Sealed, SealedWriter};
