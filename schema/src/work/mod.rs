//! Work for other processes: orders and receipts, as files of the folder `work` and as messages.
//!
//! No part of it belongs to a finished store, and the format has a version of its own. Bytes of a file or message:
//!
//! | bytes | content |
//! |---|---|
//! | 0..8 | `TETDBWRK` |
//! | 8..10 | version |
//! | 10..12 | [`WorkKind`] |
//! | 12..16 | zero |
//! | 16..24 | xxh3 of the rest, seeded with the xxh3 of bytes 0..16 |
//! | 24.. | an archived record, or the bytes of a size field |

mod order;
mod receipt;
mod task;

pub use order::{CutOrder, SubdomainOrder, WorkOrder};
pub use receipt::{CutReceipt, InheritedFace, Receipt, SubdomainReceipt, Traffic};
pub use task::{PlanRecord, RunRecord, TaskMark, TaskOrders, TaskReceipts};

use xxhash_rust::xxh3::{xxh3_64, xxh3_64_with_seed};

use crate::archive::{Archivable, from_archive, to_archive};

const MAGIC: &[u8; 8] = b"TETDBWRK";
/// Raised whenever the layout of any record changes.
const VERSION: u16 = 1;
const HEAD: usize = 24;

/// The content behind a head.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum WorkKind {
    /// [`PlanRecord`] in a file, [`RunRecord`] in a message.
    Plan = 1,
    /// [`TaskOrders`] in a file, [`WorkOrder`] in a message.
    Orders = 2,
    /// [`TaskReceipts`] in a file, [`Receipt`] in a message.
    Receipts = 3,
    /// The size field, as [`Blob::SizeField`](crate::blob::Blob::SizeField) has it.
    SizeField = 4,
    /// Parameters common to all sub-domains of a verification; a message.
    Verification = 5,
    /// The row of a sub-domain to be verified; a message.
    PartOrder = 6,
    /// The findings in a sub-domain; a message.
    PartReport = 7,
}

/// The head of a body.
pub fn head(kind: WorkKind, body: &[u8]) -> Vec<u8> {
    let mut head = MAGIC.to_vec();
    head.extend(VERSION.to_le_bytes());
    head.extend((kind as u16).to_le_bytes());
    head.extend([0; 4]);
    let sum = xxh3_64_with_seed(body, xxh3_64(&head));
    head.extend(sum.to_le_bytes());
    head
}

/// A head and an archived record.
pub fn to_bytes(kind: WorkKind, record: &impl Archivable) -> Vec<u8> {
    let body = to_archive(record);
    let mut bytes = head(kind, &body);
    bytes.extend_from_slice(&body);
    bytes
}

/// The body behind its head. Errors: the reason in words.
pub fn body(kind: WorkKind, bytes: &[u8]) -> Result<&[u8], String> {
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

/// Checks and opens a record. Errors: the reason in words.
pub fn from_bytes<T: Archivable>(kind: WorkKind, bytes: &[u8]) -> Result<T, String> {
    from_archive(body(kind, bytes)?).map_err(|reason| format!("it {reason}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_changed_or_missing_byte_is_noticed() {
        let record: Vec<u32> = (0..9).collect();
        let bytes = to_bytes(WorkKind::Orders, &record);
        let read = |bytes: &[u8]| from_bytes::<Vec<u32>>(WorkKind::Orders, bytes);
        assert_eq!(read(&bytes), Ok(record));
        for at in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[at] ^= 4;
            assert!(read(&damaged).is_err(), "byte {at}");
            assert!(read(&bytes[..at]).is_err(), "cut to {at} bytes");
        }
        assert!(from_bytes::<Vec<u32>>(WorkKind::Receipts, &bytes).is_err());
    }
}
