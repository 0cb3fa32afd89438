//! Archived records: `rkyv` bytes, checked whenever they are opened.

use rkyv::api::high::{HighDeserializer, HighSerializer, HighValidator};
use rkyv::bytecheck::CheckBytes;
use rkyv::rancor::Error;
use rkyv::ser::allocator::ArenaHandle;
use rkyv::util::AlignedVec;
use rkyv::{Archive, Deserialize, Serialize};

/// A record with an archived form that is checked before it is opened.
pub trait Archivable:
    Sized
    + Archive<
        Archived: for<'a> CheckBytes<HighValidator<'a, Error>>
                      + Deserialize<Self, HighDeserializer<Error>>,
    > + for<'a> Serialize<HighSerializer<AlignedVec, ArenaHandle<'a>, Error>>
{
}

impl<T> Archivable for T where
    T: Archive<
            Archived: for<'a> CheckBytes<HighValidator<'a, Error>>
                          + Deserialize<T, HighDeserializer<Error>>,
        > + for<'a> Serialize<HighSerializer<AlignedVec, ArenaHandle<'a>, Error>>
{
}

/// The archived form of a record.
pub fn to_archive(record: &impl Archivable) -> AlignedVec {
    rkyv::to_bytes::<Error>(record).expect("memory is the only resource this takes")
}

/// Checks and opens an archived record. Errors: the reason in words, to follow the name of a file or row.
pub fn from_archive<T: Archivable>(bytes: &[u8]) -> Result<T, String> {
    let mut aligned = AlignedVec::<16>::with_capacity(bytes.len());
    aligned.extend_from_slice(bytes);
    rkyv::from_bytes::<T, Error>(&aligned).map_err(|e| format!("cannot be opened: {e}"))
}
