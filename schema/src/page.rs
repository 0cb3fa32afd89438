//! Working pages: 64 KiB frames of 32-byte records, checksummed when they leave memory.

pub use rend::u32_le;
use thiserror::Error;
use xxhash_rust::xxh3::Xxh3;

/// Version of everything in this crate; a store of another version is refused.
pub const FORMAT_VERSION: u16 = 1;
/// Slots of a frame; the last two hold no record.
pub const SLOTS: usize = 2048;
/// `id >> SLOT_BITS` is the page, `id & SLOT_MASK` the slot.
pub const SLOT_BITS: u32 = 11;
/// See [`SLOT_BITS`].
pub const SLOT_MASK: u32 = (SLOTS - 1) as u32;
/// Records a page holds.
pub const RECORDS: usize = 2046;
/// Bytes of a frame in memory.
pub const FRAME_BYTES: usize = SLOTS * size_of::<Slot>();
/// Bytes of a page in the database: all but the last slot.
pub const STORED_BYTES: usize = (SLOTS - 1) * size_of::<Slot>();
/// "no neighbor", "no tetrahedron", "end of the free list".
pub const NONE: u32 = u32::MAX;

const MAGIC: u32 = u32::from_le_bytes(*b"TETP");
const HEADER_SLOT: usize = RECORDS;

/// One record of any working page: eight little-endian words, which is its archived form.
pub type Slot = [u32_le; 8];
/// A whole frame.
pub type Frame = [Slot; SLOTS];
/// The stored slots of a frame.
pub type StoredPage = [Slot; SLOTS - 1];

const _: () = assert!(size_of::<Slot>() == 32 && align_of::<Slot>() == 4);
const _: () = assert!(FRAME_BYTES == 65_536 && STORED_BYTES == 65_504);
const _: () = assert!(STORED_BYTES + 16 <= 65_536);

/// Position of record `id` when the slots without records are left out.
#[inline]
pub const fn dense(id: u32) -> u32 {
    (id >> SLOT_BITS) * RECORDS as u32 + (id & SLOT_MASK)
}

/// The id at position `n`; inverse of [`dense`].
#[inline]
pub const fn sparse(n: u32) -> u32 {
    ((n / RECORDS as u32) << SLOT_BITS) | (n % RECORDS as u32)
}

/// The id after `id`.
#[inline]
pub const fn next_id(id: u32) -> u32 {
    if (id & SLOT_MASK) as usize == RECORDS - 1 { id + 3 } else { id + 1 }
}

/// The kind of records in a page.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
#[non_exhaustive]
pub enum PageKind {
    /// Tetrahedra: nodes and neighbors.
    Tets = 1,
    /// Regions and flags of tetrahedra.
    TetAttributes = 2,
    /// Vertices: positions, lengths, a tetrahedron of each.
    Vertices = 3,
    /// Tags and owners of vertices.
    VertexAttributes = 4,
    /// Input triangles.
    Facets = 5,
    /// Faces shared with other sub-domains.
    InterfaceFaces = 6,
    /// A map for a step's own use; never a result.
    Scratch = 7,
    /// The tetrahedra on both sides of facets.
    FacetTets = 8,
}

/// Key of page `page` of `kind` in the table of a sub-domain's file.
pub const fn page_key(kind: PageKind, page: u32) -> u64 {
    (kind as u64) << 56 | page as u64
}

/// Where a page belongs; a page found anywhere else is damage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PageAddress {
    /// Kind of its records.
    pub kind: PageKind,
    /// Rank of the sub-domain.
    pub subdomain: u32,
    /// Number among the pages of its kind, from 0.
    pub page: u32,
}

/// A damaged page, or a page of another place.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum PageError {
    /// Too short or too long.
    #[error("page {address:?}: expected {STORED_BYTES} bytes, found {found}")]
    Length {
        /// Where the page belongs.
        address: PageAddress,
        /// Bytes of the value.
        found: usize,
    },
    /// The content is not what was written.
    #[error("page {address:?}: checksum {found:016x} does not match its content ({expected:016x})")]
    Checksum {
        /// Where the page belongs.
        address: PageAddress,
        /// Computed from the content.
        expected: u64,
        /// As stored.
        found: u64,
    },
    /// The page belongs elsewhere, or is of another format.
    #[error("page {address:?}: the header names {field} {found}, expected {expected}")]
    Header {
        /// Where the page belongs.
        address: PageAddress,
        /// Which entry of the header.
        field: &'static str,
        /// By its address.
        expected: u32,
        /// As stored.
        found: u32,
    },
}

/// Writes the header of a frame, so that `frame[..SLOTS - 1]` may be stored.
pub fn seal_page(frame: &mut [Slot], address: PageAddress, generation: u32) {
    seal_full_page(frame, address, generation, 0);
}

/// Writes the header of a frame whose first `count` slots hold records, with that count.
pub fn seal_full_page(frame: &mut [Slot], address: PageAddress, generation: u32, count: u32) {
    let version_kind = u32::from(FORMAT_VERSION) | (address.kind as u32) << 16;
    let words = [0, 0, MAGIC, version_kind, address.subdomain, address.page, generation, count];
    frame[HEADER_SLOT] = words.map(u32_le::from_native);
    let sum = checksum(frame);
    frame[HEADER_SLOT][0] = u32_le::from_native(sum as u32);
    frame[HEADER_SLOT][1] = u32_le::from_native((sum >> 32) as u32);
}

/// The bytes of a frame that are stored.
pub fn stored_bytes(frame: &[Slot]) -> &[u8] {
    bytemuck::cast_slice(&frame[..SLOTS - 1])
}

fn checksum(frame: &[Slot]) -> u64 {
    let mut hash = Xxh3::new();
    hash.update(bytemuck::cast_slice(&frame[..HEADER_SLOT]));
    hash.update(bytemuck::cast_slice(&frame[HEADER_SLOT][2..]));
    hash.digest()
}

/// Copies a stored page into a frame and checks it against its address.
///
/// Returns the generation that wrote it. Errors: any difference in length, checksum or header.
pub fn open_page(bytes: &[u8], address: PageAddress, frame: &mut [Slot]) -> Result<u32, PageError> {
    if bytes.len() != STORED_BYTES {
        let found = bytes.len();
        return Err(PageError::Length { address, found });
    }
    bytemuck::cast_slice_mut::<Slot, u8>(&mut frame[..SLOTS - 1]).copy_from_slice(bytes);
    check_page(frame, address)
}

/// Checks a page that was read into a frame against its address.
///
/// Returns the generation that wrote it. Errors: any difference in checksum or header.
pub fn check_page(frame: &[Slot], address: PageAddress) -> Result<u32, PageError> {
    let header = frame[HEADER_SLOT].map(u32_le::to_native);
    let found = u64::from(header[0]) | u64::from(header[1]) << 32;
    let expected = checksum(frame);
    if found != expected {
        return Err(PageError::Checksum { address, expected, found });
    }
    let version_kind = u32::from(FORMAT_VERSION) | (address.kind as u32) << 16;
    for (field, expected, found) in [
        ("magic", MAGIC, header[2]),
        ("version and kind", version_kind, header[3]),
        ("sub-domain", address.subdomain, header[4]),
        ("page", address.page, header[5]),
    ] {
        if expected != found {
            return Err(PageError::Header { address, field, expected, found });
        }
    }
    Ok(header[6])
}

/// The number of records in the header of an open page; 0 in a mesh that is not finished.
pub fn page_count(frame: &[Slot]) -> u32 {
    frame[HEADER_SLOT][7].to_native()
}

/// Borrows a stored page in place, for readers that bring their own aligned bytes.
///
/// Errors: a slice of another length or alignment.
pub fn access_page(bytes: &[u8]) -> Result<&StoredPage, rkyv::rancor::Error> {
    rkyv::access::<StoredPage, rkyv::rancor::Error>(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unused_slots_are_never_ids() {
        for n in [0, 1, 2045, 2046, 4091, 4092, 100_000] {
            assert_eq!(dense(sparse(n)), n);
            assert!((sparse(n) & SLOT_MASK) < RECORDS as u32);
        }
        let mut id = 0;
        for n in 0..10_000 {
            assert_eq!(id, sparse(n));
            id = next_id(id);
        }
    }

    #[test]
    fn a_page_comes_back_and_any_flipped_bit_is_found() {
        let address = PageAddress { kind: PageKind::Vertices, subdomain: 3, page: 9 };
        let mut frame = vec![[u32_le::from_native(7); 8]; SLOTS];
        seal_page(&mut frame, address, 2);
        let mut bytes = stored_bytes(&frame).to_vec();
        let mut back = vec![[u32_le::from_native(0); 8]; SLOTS];
        assert_eq!(open_page(&bytes, address, &mut back), Ok(2));
        assert_eq!(back[..SLOTS - 1], frame[..SLOTS - 1]);
        for bit in (0..STORED_BYTES * 8).step_by(997) {
            bytes[bit / 8] ^= 1 << (bit % 8);
            assert!(open_page(&bytes, address, &mut back).is_err(), "bit {bit}");
            bytes[bit / 8] ^= 1 << (bit % 8);
        }
        let elsewhere = PageAddress { page: 8, ..address };
        assert!(open_page(&bytes, elsewhere, &mut back).is_err());
        assert!(open_page(&bytes[1..], address, &mut back).is_err());
    }
}
