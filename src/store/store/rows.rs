//! Rows as bytes: a checksum seeded by the key, then the archived record.

use rkyv::api::high::{HighDeserializer, HighSerializer, HighValidator};
use rkyv::bytecheck::CheckBytes;
use rkyv::rancor::Error;
use rkyv::ser::allocator::ArenaHandle;
use rkyv::util::AlignedVec;
use rkyv::{Archive, Deserialize, Serialize};
use xxhash_rust::xxh3::xxh3_64_with_seed;

/// Kinds of rows of the catalog.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum RowKind {
    Format = 64,
    State = 65,
    Job = 66,
    Labels = 67,
    Regions = 68,
    Subdomain = 69,
    File = 70,
    Interface = 71,
    Topology = 72,
    Journal = 73,
    Blob = 74,
    Coarse = 75,
    Previous = 76,
    Stage = 77,
    RegionNames = 78,
    Wires = 79,
}

impl RowKind {
    /// Key of a row: kind (8 bits), major (24 bits), minor (32 bits).
    pub(super) const fn key(self, major: u32, minor: u32) -> u64 {
        (self as u64) << 56 | (major as u64 & 0xff_ffff) << 32 | minor as u64
    }

    /// All keys of the kind.
    pub(super) const fn keys(self) -> std::ops::Range<u64> {
        (self as u64) << 56..(self as u64 + 1) << 56
    }
}

/// Bytes with their checksum in front.
pub(super) fn guarded_bytes(key: u64, bytes: &[u8]) -> Vec<u8> {
    let mut value = xxh3_64_with_seed(bytes, key).to_le_bytes().to_vec();
    value.extend_from_slice(bytes);
    value
}

/// The inverse of [`guarded_bytes`].
pub(super) fn checked_bytes(key: u64, value: &[u8]) -> Result<&[u8], String> {
    let Some((sum, bytes)) = value.split_first_chunk::<8>() else {
        return Err(format!("has only {} bytes", value.len()));
    };
    if u64::from_le_bytes(*sum) != xxh3_64_with_seed(bytes, key) {
        return Err("does not match its checksum".to_owned());
    }
    Ok(bytes)
}

/// Archives a record.
pub(super) fn encode<T>(key: u64, record: &T) -> Vec<u8>
where
    T: for<'a> Serialize<HighSerializer<AlignedVec, ArenaHandle<'a>, Error>>,
{
    let bytes = rkyv::to_bytes::<Error>(record).expect("memory is the only resource this takes");
    guarded_bytes(key, &bytes)
}

/// Checks and opens a record.
pub(super) fn decode<T>(key: u64, value: &[u8]) -> Result<T, String>
where
    T: Archive,
    T::Archived:
        for<'a> CheckBytes<HighValidator<'a, Error>> + Deserialize<T, HighDeserializer<Error>>,
{
    let bytes = checked_bytes(key, value)?;
    let mut aligned = AlignedVec::<16>::with_capacity(bytes.len());
    aligned.extend_from_slice(bytes);
    rkyv::from_bytes::<T, Error>(&aligned).map_err(|e| format!("cannot be opened: {e}"))
}
