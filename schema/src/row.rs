//! Keys and values of the catalog's rows: a checksum seeded with the key, then the content.
//!
//! The content is an archived record, except for two kinds: the format row ([`FORMAT_MAGIC`] and the version as u16), and the
//! pieces of blobs (see [`Blob`]).

use std::ops::Range;

use xxhash_rust::xxh3::xxh3_64_with_seed;

use crate::archive::{Archivable, from_archive, to_archive};
use crate::blob::Blob;

/// First bytes of the format row; the version follows as u16.
pub const FORMAT_MAGIC: &[u8; 8] = b"TETDBCAT";
/// Bytes of the pieces a blob is cut into: with 16 bytes of redb and 8 of checksum within 64 KiB.
pub const BLOB_PIECE: usize = 65_536 - 24;

/// The content of a row. In brackets: the numbers of its key, major and minor, where they are not 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
#[non_exhaustive]
pub enum RowKind {
    /// [`FORMAT_MAGIC`] and the version.
    Format = 64,
    /// [`StoreState`](crate::catalog::StoreState).
    State = 65,
    /// [`Job`](crate::catalog::Job).
    Job = 66,
    /// `Vec<String>`: names of the labels.
    Labels = 67,
    /// Vector of [`RegionRow`](crate::catalog::RegionRow).
    Regions = 68,
    /// [`SubdomainRow`](crate::catalog::SubdomainRow) (0, rank).
    Subdomain = 69,
    /// [`FileRow`](crate::catalog::FileRow) (sub-domain, generation).
    File = 70,
    /// Vector of [`InterfaceRow`](crate::catalog::InterfaceRow) (0, cut).
    Interface = 71,
    /// [`TopologyRow`](crate::catalog::TopologyRow) (0, rank).
    Topology = 72,
    /// [`JournalRow`](crate::catalog::JournalRow) (0, position).
    Journal = 73,
    /// A piece of a [`Blob`] (number of the blob, number of the piece).
    Blob = 74,
    /// [`CoarseRow`](crate::catalog::CoarseRow) (0, rank).
    Coarse = 75,
    /// [`SubdomainRow`](crate::catalog::SubdomainRow) before the last change (0, rank); read, no longer written.
    Previous = 76,
    /// [`StageRow`](crate::catalog::StageRow) (stage, cut).
    Stage = 77,
    /// `Vec<String>`: names of the regions, from region 1 on.
    RegionNames = 78,
    /// [`WiresRow`](crate::catalog::WiresRow).
    Embedded = 79,
    /// Vector of [`LabelSet`](crate::labels::LabelSet), ascending by label.
    LabelSets = 80,
    /// [`FieldRow`](crate::field::FieldRow) (0, number of the field).
    Field = 81,
    /// [`FieldPart`](crate::field::FieldPart) (number of the field, rank).
    FieldPart = 82,
    /// [`FieldPart`](crate::field::FieldPart) of a sub-domain before its last change (number of the field, rank); read, no longer written.
    PreviousFieldPart = 83,
    /// [`VersionRow`](crate::catalog::VersionRow) (0, number of the version).
    Version = 84,
    /// The content of a row of a version; the rest of the key is a number drawn from the content.
    Copy = 85,
    /// [`PeriodicRow`](crate::periodic::PeriodicRow) (0, number of the pair).
    Periodic = 86,
}

impl RowKind {
    /// All kinds, by number.
    pub const ALL: [Self; 23] = [
        Self::Format,
        Self::State,
        Self::Job,
        Self::Labels,
        Self::Regions,
        Self::Subdomain,
        Self::File,
        Self::Interface,
        Self::Topology,
        Self::Journal,
        Self::Blob,
        Self::Coarse,
        Self::Previous,
        Self::Stage,
        Self::RegionNames,
        Self::Embedded,
        Self::LabelSets,
        Self::Field,
        Self::FieldPart,
        Self::PreviousFieldPart,
        Self::Version,
        Self::Copy,
        Self::Periodic,
    ];

    /// The kind of a key; `None` for a key of no row.
    pub fn from_key(key: u64) -> Option<Self> {
        Self::ALL.into_iter().find(|&kind| kind as u64 == key >> 56)
    }

    /// Key of a row: kind (8 bits), major (24 bits), minor (32 bits).
    pub const fn key(self, major: u32, minor: u32) -> u64 {
        (self as u64) << 56 | (major as u64 & 0xff_ffff) << 32 | minor as u64
    }

    /// Key of the first place for a copy of `content`; if another content is there, the next place is tried.
    pub fn copy_key(content: &[u8]) -> u64 {
        (Self::Copy as u64) << 56 | xxh3_64_with_seed(content, 0) >> 8
    }

    /// All keys of the kind.
    pub const fn keys(self) -> Range<u64> {
        (self as u64) << 56..(self as u64 + 1) << 56
    }
}

/// Keys of the rows that a version has, ascending; see [`VersionRow`](crate::catalog::VersionRow).
pub const VERSIONED: [Range<u64>; 6] = [
    RowKind::State.keys(),
    RowKind::Regions.keys(),
    RowKind::Subdomain.keys(),
    blob_key(Blob::Totals(0), 0)..blob_key(Blob::PreviousTotals(0), 0),
    RowKind::Field.keys(),
    RowKind::FieldPart.keys(),
];

/// Returns whether a version has the row with this key.
pub fn is_versioned(key: u64) -> bool {
    VERSIONED.iter().any(|keys| keys.contains(&key))
}

/// Key of a piece of a blob, from 0. The first piece that is missing ends the blob.
pub const fn blob_key(blob: Blob, piece: u32) -> u64 {
    RowKind::Blob.key(blob.number(), piece)
}

/// Bytes with their checksum in front.
pub fn guarded_bytes(key: u64, bytes: &[u8]) -> Vec<u8> {
    let mut value = xxh3_64_with_seed(bytes, key).to_le_bytes().to_vec();
    value.extend_from_slice(bytes);
    value
}

/// The inverse of [`guarded_bytes`]. Errors: the reason in words.
pub fn checked_bytes(key: u64, value: &[u8]) -> Result<&[u8], String> {
    let Some((sum, bytes)) = value.split_first_chunk::<8>() else {
        return Err(format!("has only {} bytes", value.len()));
    };
    if u64::from_le_bytes(*sum) != xxh3_64_with_seed(bytes, key) {
        return Err("does not match its checksum".to_owned());
    }
    Ok(bytes)
}

/// The value of a row that holds an archived record.
pub fn encode(key: u64, record: &impl Archivable) -> Vec<u8> {
    guarded_bytes(key, &to_archive(record))
}

/// Checks the value of a row and opens its record. Errors: the reason in words.
pub fn decode<T: Archivable>(key: u64, value: &[u8]) -> Result<T, String> {
    from_archive(checked_bytes(key, value)?)
}
