//! Finished sub-domains as files: written once, read chunk by chunk.
//!
//! A file holds vertices, tetrahedra, facets and interface faces, packed into chunks or kept as working pages ([`Form`]), with a
//! summary of every chunk. Reading streams, so memory stays bounded whatever the size of the sub-domain. The coarse snapshot a
//! sub-domain was meshed from is kept beside it in the same way. Is not: the list of what counts, which is the catalog's.

#![warn(missing_docs)]

mod batch;
mod bit_set;
mod coarse_snapshot;
mod error;
mod face_join;
mod face_pairs;
mod field;
mod form;
mod merge_reader;
mod shape;
mod subdomain;
mod totals;
mod vertex_cache;
mod writer;

pub use bit_set::BitSet;
pub use coarse_snapshot::{CoarseSnapshot, CoarseWriter};
pub use error::SealedError;
pub use face_join::{FaceJoin, FaceJoinSorter, JoinedFace};
pub use face_pairs::{FacePairs, Paired, face_of, sorted_face, sorted_faces};
pub use field::{FieldColumn, FieldFile, FieldWriter};
pub use form::Form;
pub use merge_reader::MergeReader;
pub use shape::{Shape, quality_bin};
pub use subdomain::{Chunk, Chunks, Subdomain};
pub use totals::SubdomainTotals;
pub use vertex_cache::{Corner, VertexCache, input_index};
pub use writer::{Sealed, SealedWriter};
