//! Orders and receipts as bytes: a head with version and checksum, then the archived record.
//!
//! | bytes | what |
//! |---|---|
//! | 0..8 | `TETDBWRK` |
//! | 8..10 | version |
//! | 10..12 | what it is, see [`Kind`] |
//! | 12..16 | zero |
//! | 16..24 | xxh3 of the rest, seeded with the xxh3 of bytes 0..16 |

use rkyv::api::high::{HighDeserializer, HighSerializer, HighValidator};
use rkyv::bytecheck::CheckBytes;
use rkyv::rancor::Error;
use rkyv::ser::allocator::ArenaHandle;
use rkyv::util::AlignedVec;
use rkyv::{Archive, Deserialize, Serialize};
use xxhash_rust::xxh3::{xxh3_64, xxh3_64_with_seed};

const MAGIC: &[u8; 8] = b"TETDBWRK";
/// Raised whenever the layout of any record changes.
const VERSION: u16 = 1;
const HEAD: usize = 24;

/// What the bytes hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The plan of all tasks.
    Plan = 1,
    /// Orders of one task.
    Orders = 2,
    /// Receipts of one task.
    Receipts = 3,
    /// A size field.
    SizeField = 4,
    /// What is the same for all sub-domains of a verification.
    Verification = 5,
    /// The row of a sub-domain to be verified.
    PartOrder = 6,
    /// What was found of a sub-domain.
    PartReport = 7,
}

/// What stands before a body.
pub fn head(kind: Kind, body: &[u8]) -> Vec<u8> {
    let mut head = MAGIC.to_vec();
    head.extend(VERSION.to_le_bytes());
    head.extend((kind as u16).to_le_bytes());
    head.extend([0; 4]);
    let sum = xxh3_64_with_seed(body, xxh3_64(&head));
    head.extend(sum.to_le_bytes());
    head
}

/// Archives a record.
pub fn to_bytes<T>(kind: Kind, record: &T) -> Vec<u8>
where
    T: for<'a> Serialize<HighSerializer<AlignedVec, ArenaHandle<'a>, Error>>,
{
    let body = rkyv::to_bytes::<Error>(record).expect("memory is the only resource this takes");
    let mut bytes = head(kind, &body);
    bytes.extend_from_slice(&body);
    bytes
}

/// The body behind its head. Errors: in words what is wrong with the bytes.
pub fn body(kind: Kind, bytes: &[u8]) -> Result<&[u8], String> {
    let Some((head, body)) = bytes.split_first_chunk::<HEAD>() else {
        return Err(format!("it has only {} bytes", bytes.len()));
    };
    let (front, sum) = head.split_at(16);
    if !front.starts_with(MAGIC) {
        return Err("it is none of ours".to_owned());
    }
    let number = |at: usize| u16::from_le_bytes([front[at], front[at + 1]]);
    if number(8) != VERSION {
        let found = number(8);
        return Err(format!("it has version {found}, this program reads {VERSION}"));
    }
    if xxh3_64_with_seed(body, xxh3_64(front)).to_le_bytes() != sum {
        return Err("it does not match its checksum".to_owned());
    }
    match number(10) == kind as u16 {
        true => Ok(body),
        false => Err("it is of another kind".to_owned()),
    }
}

/// Checks and opens a record. Errors: in words what is wrong with the bytes.
pub fn from_bytes<T>(kind: Kind, bytes: &[u8]) -> Result<T, String>
where
    T: Archive,
    T::Archived:
        for<'a> CheckBytes<HighValidator<'a, Error>> + Deserialize<T, HighDeserializer<Error>>,
{
    let body = body(kind, bytes)?;
    let mut aligned = AlignedVec::<16>::with_capacity(body.len());
    aligned.extend_from_slice(body);
    rkyv::from_bytes::<T, Error>(&aligned).map_err(|e| format!("it cannot be opened: {e}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_changed_or_missing_byte_is_noticed() {
        let record: Vec<u32> = (0..9).collect();
        let bytes = to_bytes(Kind::Orders, &record);
        let read = |bytes: &[u8]| from_bytes::<Vec<u32>>(Kind::Orders, bytes);
        assert_eq!(read(&bytes), Ok(record));
        for at in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[at] ^= 4;
            assert!(read(&damaged).is_err(), "byte {at}");
            assert!(read(&bytes[..at]).is_err(), "cut to {at} bytes");
        }
        assert!(from_bytes::<Vec<u32>>(Kind::Receipts, &bytes).is_err());
    }
}
