//! Sealed chunks: records of one kind, differences and varints, zstd, a checksummed head.
//!
//! [`Packer`] cuts a stream of records into well filled chunks. [`Encoder`] and [`Decoder`] process one chunk.
//!
//! A decoder accepts any bytes that a disk returns. Damage is an error, never a panic, and the checked count of the head bounds the
//! allocation.

mod codec;
mod column;
mod columns;
mod packer;
mod records;
mod summaries;
#[cfg(test)]
mod tests;
mod values;

pub use codec::{Decoder, Encoder};
pub use columns::{ColumnWriter, Malformed};
pub use packer::{PackedChunk, Packer};
pub use summaries::{FieldSummary, RangeSummary, TetSummary, VertexSummary, is_box};
pub use values::FieldWord;

use thiserror::Error;

/// Longest stored value: with redb's 16 bytes it stays in 64 KiB.
pub const CHUNK_BYTES_MAX: usize = 65_520;
/// Bytes of the head.
pub const HEAD_BYTES: usize = 48;

const _: () = assert!(CHUNK_BYTES_MAX + 16 <= 65_536);

/// The kind of records in a chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
#[non_exhaustive]
pub enum ChunkKind {
    /// Tetrahedra of a sealed sub-domain.
    Tets = 33,
    /// Vertices of a sealed sub-domain.
    Vertices = 34,
    /// Facets of a sealed sub-domain.
    Facets = 35,
    /// Interface faces of a sealed sub-domain.
    InterfaceFaces = 36,
    /// Summaries of chunks of tetrahedra.
    TetSummaries = 40,
    /// Summaries of chunks of vertices.
    VertexSummaries = 41,
    /// Summaries of chunks of facets.
    FacetSummaries = 42,
    /// Summaries of chunks of interface faces.
    InterfaceSummaries = 43,
    /// Tetrahedra of a coarse snapshot.
    CoarseTets = 49,
    /// Vertices of a coarse snapshot.
    CoarseVertices = 50,
    /// Facets of a coarse snapshot.
    CoarseFacets = 51,
    /// Interface faces of a coarse snapshot.
    CoarseFaces = 52,
    /// Numbers of a field.
    FieldValues = 57,
    /// Summaries of chunks of a field.
    FieldSummaries = 58,
    /// Ranges of a field at vertices, of the chunks of tetrahedra.
    FieldTetSummaries = 59,
}

impl ChunkKind {
    /// Key of chunk `chunk` in the table of a sub-domain's file.
    pub const fn key(self, chunk: u32) -> u64 {
        (self as u64) << 56 | chunk as u64
    }
}

/// Where a chunk belongs; a chunk found anywhere else is damage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChunkAddress {
    /// Kind of its records.
    pub kind: ChunkKind,
    /// Rank of the sub-domain.
    pub subdomain: u32,
    /// Generation of the file.
    pub generation: u32,
    /// Number among the chunks of its kind, from 0.
    pub chunk: u32,
}

impl ChunkAddress {
    /// Key of the chunk in the file.
    pub const fn key(self) -> u64 {
        self.kind.key(self.chunk)
    }
}

/// A damaged chunk, or a chunk from another place.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("sub-domain {}, {:?} chunk {}: {reason}", address.subdomain, address.kind, address.chunk)]
pub struct ChunkError {
    /// Where the chunk belongs.
    pub address: ChunkAddress,
    /// The damage.
    pub reason: ChunkDamage,
}

/// Damage of a chunk.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ChunkDamage {
    /// Too short or too long.
    #[error("expected {HEAD_BYTES} to {CHUNK_BYTES_MAX} bytes, found {found}")]
    Length {
        /// Bytes of the value.
        found: usize,
    },
    /// The content is not what was written.
    #[error("its checksum {found:016x} does not match its content ({expected:016x})")]
    Checksum {
        /// Computed from the content.
        expected: u64,
        /// As stored.
        found: u64,
    },
    /// The chunk belongs elsewhere, or is of another format.
    #[error("its head names {field} {found}, expected {expected}")]
    Head {
        /// Which entry of the head.
        field: &'static str,
        /// By its address.
        expected: u32,
        /// As stored.
        found: u32,
    },
    /// The payload cannot be decompressed.
    #[error("its payload cannot be decompressed")]
    Compression,
    /// The payload holds no such records.
    #[error("its payload is malformed: {0}")]
    Payload(#[from] Malformed),
}

/// A record that can be stored in chunks.
pub trait ChunkRecord: Copy + Send + Sync {
    /// The kind of its chunks.
    const KIND: ChunkKind;
    /// Largest number of records of a chunk, whatever their compressed size. Bounds the memory for decoding.
    const COUNT_MAX: usize;
    /// More bytes than a record can take before compression.
    const RAW_BYTES_MAX: usize;

    /// Appends the columns of `records`, the first of which has number `first`.
    fn encode(records: &[Self], first: u32, columns: &mut ColumnWriter);
    /// Reads back `count` records.
    fn decode(
        columns: &mut columns::ColumnReader<'_>,
        first: u32,
        count: usize,
        records: &mut Vec<Self>,
    ) -> Result<(), Malformed>;
}
