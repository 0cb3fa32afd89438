//! Sealed chunks: records of one kind, differences and varints, zstd, a checksummed head.
//!
//! [`Packer`] cuts a stream of records into well filled chunks, [`Encoder`] and [`Decoder`] do one chunk.
//! A decoder meets whatever a disk returns: it answers damage with an error, never with a panic, and
//! allocates nothing that the head's checked count does not justify.

mod coarse;
mod codec;
mod columns;
mod facets;
mod packer;
mod steps;
mod summaries;
#[cfg(test)]
mod tests;
mod tets;
mod vertices;

pub use codec::{Decoder, Encoder};
pub use columns::{Columns, Malformed};
pub use packer::{Packed, Packer};
pub use summaries::{RangeSummary, TetSummary, VertexSummary};

use thiserror::Error;

/// Longest stored value: with redb's 16 bytes it stays in 64 KiB.
pub const CHUNK_BYTES_MAX: usize = 65_520;
/// Bytes of the head.
pub const HEAD_BYTES: usize = 48;

const _: () = assert!(CHUNK_BYTES_MAX + 16 <= 65_536);

/// What a chunk holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
#[non_exhaustive]
pub enum ChunkKind {
    Tets = 33,
    Vertices = 34,
    Facets = 35,
    InterfaceFaces = 36,
    TetSummaries = 40,
    VertexSummaries = 41,
    FacetSummaries = 42,
    InterfaceSummaries = 43,
    CoarseTets = 49,
    CoarseVertices = 50,
    CoarseFacets = 51,
    CoarseFaces = 52,
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
    pub kind: ChunkKind,
    pub subdomain: u32,
    pub generation: u32,
    pub chunk: u32,
}

impl ChunkAddress {
    /// Its key in the file.
    pub const fn key(self) -> u64 {
        self.kind.key(self.chunk)
    }
}

/// A stored chunk is not what it should be.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("sub-domain {}, {:?} chunk {}: {reason}", address.subdomain, address.kind, address.chunk)]
pub struct ChunkError {
    pub address: ChunkAddress,
    pub reason: ChunkDamage,
}

/// What is wrong with a chunk.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ChunkDamage {
    #[error("expected {HEAD_BYTES} to {CHUNK_BYTES_MAX} bytes, found {found}")]
    Length { found: usize },
    #[error("its checksum {found:016x} does not match its content ({expected:016x})")]
    Checksum { expected: u64, found: u64 },
    #[error("its head names {field} {found}, expected {expected}")]
    Head {
        field: &'static str,
        expected: u32,
        found: u32,
    },
    #[error("its payload cannot be decompressed")]
    Compression,
    #[error("its payload is malformed: {0}")]
    Payload(#[from] Malformed),
}

/// A record that can be stored in chunks.
pub trait ChunkRecord: Copy {
    /// The kind of its chunks.
    const KIND: ChunkKind;
    /// Most records of a chunk, whatever they compress to: bounds what decoding allocates.
    const COUNT_MAX: usize;
    /// More bytes than a record can take before compression.
    const RAW_BYTES_MAX: usize;

    /// Appends the columns of `records`, the first of which has number `first`.
    fn encode(records: &[Self], first: u32, columns: &mut Columns);
    /// Reads back `count` records.
    fn decode(
        columns: &mut columns::Reader<'_>,
        first: u32,
        count: usize,
        records: &mut Vec<Self>,
    ) -> Result<(), Malformed>;
}
