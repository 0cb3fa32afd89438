//! Blobs of the catalog: bytes of any length under a number below 2^24, in pieces.
//!
//! The number is `base << 20 | index`. The index is a rank or the number of a cut, both below 2^20.

use std::fmt;

const INDEX_BITS: u32 = 20;

/// A blob of the catalog, and what its bytes are.
///
/// The three `Previous` blobs are those of the same names as they were before the last change of the sub-domain. They are read, and no
/// longer written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Blob {
    /// The size field of the whole: `TETDBSZ2` and an octree.
    SizeField,
    /// u32: version of the recipe that the store was begun with.
    Recipe,
    /// u32: how many sub-domains there will be.
    SubdomainCount,
    /// Six f64: low and high corner of the box around the surface.
    Bounds,
    /// [`SubtreeMesh`](crate::tree::SubtreeMesh) of the subtree with this first rank. It stays when the sub-domain is sealed.
    Subtree(u32),
    /// Four f64 of [`CutPlane`](crate::tree::CutPlane), by cut.
    CutPlane(u32),
    /// [`FaceOwners`](crate::topology::FaceOwners), by cut.
    FaceOwners(u32),
    /// [`SubdomainTotals`](crate::totals::SubdomainTotals), by rank.
    Totals(u32),
    /// The size field of a sub-domain that was meshed again with other sizes, by rank.
    SubdomainField(u32),
    /// UTF-8: the sizes that were requested for such a sub-domain, by rank.
    Request(u32),
    /// Previous [`Blob::Totals`].
    PreviousTotals(u32),
    /// Previous [`Blob::SubdomainField`].
    PreviousField(u32),
    /// Previous [`Blob::Request`].
    PreviousRequest(u32),
    /// [`StageFaces`](crate::topology::StageFaces), by cut; only where stages are kept.
    StageFaces(u32),
    /// Two u32 for each pair of vertices, by pair of labels.
    PeriodicVertices(u32),
    /// Two u64 for each pair of triangles, by pair of labels.
    PeriodicTriangles(u32),
}

impl Blob {
    /// Its number in the keys of its pieces, below 2^24.
    pub const fn number(self) -> u32 {
        let (base, index) = match self {
            Self::SizeField => (0, 1),
            Self::Recipe => (0, 2),
            Self::SubdomainCount => (0, 3),
            Self::Bounds => (0, 4),
            Self::Subtree(first) => (1, first),
            Self::CutPlane(cut) => (2, cut),
            Self::FaceOwners(cut) => (3, cut),
            Self::Totals(rank) => (4, rank),
            Self::SubdomainField(rank) => (5, rank),
            Self::Request(rank) => (6, rank),
            Self::PreviousTotals(rank) => (7, rank),
            Self::PreviousField(rank) => (8, rank),
            Self::PreviousRequest(rank) => (9, rank),
            Self::StageFaces(cut) => (10, cut),
            Self::PeriodicVertices(id) => (11, id),
            Self::PeriodicTriangles(id) => (12, id),
        };
        (base << INDEX_BITS) + index
    }

    /// The inverse of [`Blob::number`]; `None` for a number without a blob.
    pub const fn from_number(number: u32) -> Option<Self> {
        let index = number & ((1 << INDEX_BITS) - 1);
        Some(match (number >> INDEX_BITS, index) {
            (0, 1) => Self::SizeField,
            (0, 2) => Self::Recipe,
            (0, 3) => Self::SubdomainCount,
            (0, 4) => Self::Bounds,
            (1, first) => Self::Subtree(first),
            (2, cut) => Self::CutPlane(cut),
            (3, cut) => Self::FaceOwners(cut),
            (4, rank) => Self::Totals(rank),
            (5, rank) => Self::SubdomainField(rank),
            (6, rank) => Self::Request(rank),
            (7, rank) => Self::PreviousTotals(rank),
            (8, rank) => Self::PreviousField(rank),
            (9, rank) => Self::PreviousRequest(rank),
            (10, cut) => Self::StageFaces(cut),
            (11, id) => Self::PeriodicVertices(id),
            (12, id) => Self::PeriodicTriangles(id),
            _ => return None,
        })
    }

    /// Its rank or cut; 0 for a blob of the whole store.
    pub const fn index(self) -> u32 {
        match self.number() >> INDEX_BITS {
            0 => 0,
            base => self.number() - (base << INDEX_BITS),
        }
    }

    /// The blobs of a sub-domain that change when it is meshed again, each with its previous version.
    pub const fn versioned(rank: u32) -> [[Self; 2]; 3] {
        [
            [Self::Totals(rank), Self::PreviousTotals(rank)],
            [Self::SubdomainField(rank), Self::PreviousField(rank)],
            [Self::Request(rank), Self::PreviousRequest(rank)],
        ]
    }
}

/// Such as `totals of sub-domain 3`.
impl fmt::Display for Blob {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::SizeField => write!(f, "size field"),
            Self::Recipe => write!(f, "version of the recipe"),
            Self::SubdomainCount => write!(f, "number of sub-domains"),
            Self::Bounds => write!(f, "box of the surface"),
            Self::Subtree(first) => write!(f, "mesh of the subtree at sub-domain {first}"),
            Self::CutPlane(cut) => write!(f, "plane of cut {cut}"),
            Self::FaceOwners(cut) => write!(f, "owners of the faces of cut {cut}"),
            Self::Totals(rank) => write!(f, "totals of sub-domain {rank}"),
            Self::SubdomainField(rank) => write!(f, "size field of sub-domain {rank}"),
            Self::Request(rank) => write!(f, "requested sizes of sub-domain {rank}"),
            Self::PreviousTotals(rank) => write!(f, "previous totals of sub-domain {rank}"),
            Self::PreviousField(rank) => write!(f, "previous size field of sub-domain {rank}"),
            Self::PreviousRequest(rank) => {
                write!(f, "previous requested sizes of sub-domain {rank}")
            }
            Self::StageFaces(cut) => write!(f, "faces kept of cut {cut}"),
            Self::PeriodicVertices(id) => write!(f, "vertices of periodic pair {id}"),
            Self::PeriodicTriangles(id) => write!(f, "triangles of periodic pair {id}"),
        }
    }
}

/// Bytes of a blob as a value, in both directions.
pub trait BlobContent: Sized {
    /// The bytes of the blob.
    fn to_bytes(&self) -> Vec<u8>;
    /// The inverse of [`BlobContent::to_bytes`]; `None` for bytes that no writer writes.
    fn from_bytes(bytes: &[u8]) -> Option<Self>;
}

impl BlobContent for u32 {
    fn to_bytes(&self) -> Vec<u8> {
        self.to_le_bytes().to_vec()
    }

    fn from_bytes(bytes: &[u8]) -> Option<Self> {
        Some(Self::from_le_bytes(bytes.try_into().ok()?))
    }
}

/// A box: low corner, high corner.
impl BlobContent for [[f64; 3]; 2] {
    fn to_bytes(&self) -> Vec<u8> {
        f64_bytes(self.as_flattened())
    }

    fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let [a, b, c, d, e, f] = f64s(bytes)?.try_into().ok()?;
        Some([[a, b, c], [d, e, f]])
    }
}

/// A plane: normal, offset.
impl BlobContent for [f64; 4] {
    fn to_bytes(&self) -> Vec<u8> {
        f64_bytes(self)
    }

    fn from_bytes(bytes: &[u8]) -> Option<Self> {
        f64s(bytes)?.try_into().ok()
    }
}

pub(crate) fn f64_bytes(numbers: &[f64]) -> Vec<u8> {
    numbers.iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// `None` when the length is not that of whole numbers.
pub(crate) fn f64s(bytes: &[u8]) -> Option<Vec<f64>> {
    Some(u64s(bytes)?.into_iter().map(f64::from_bits).collect())
}

/// `None` when the length is not that of whole numbers.
pub(crate) fn u64s(bytes: &[u8]) -> Option<Vec<u64>> {
    let (numbers, rest) = bytes.as_chunks::<8>();
    rest.is_empty().then(|| numbers.iter().map(|&b| u64::from_le_bytes(b)).collect())
}

/// `None` when the length is not that of whole numbers.
pub(crate) fn u32s(bytes: &[u8]) -> Option<Vec<u32>> {
    let (numbers, rest) = bytes.as_chunks::<4>();
    rest.is_empty().then(|| numbers.iter().map(|&b| u32::from_le_bytes(b)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_blobs_are_the_same_thing() {
        assert_eq!(Blob::SubdomainField(7).number(), (5 << 20) + 7);
        assert_eq!(Blob::StageFaces((1 << 20) - 1).number(), (11 << 20) - 1);
        let mut n_blobs = 0;
        for number in (0..16).flat_map(|base| (0..6).map(move |index| base << 20 | index)) {
            if let Some(blob) = Blob::from_number(number) {
                assert_eq!(blob.number(), number);
                assert!(blob.index() == number % (1 << 20) || number < 5);
                n_blobs += 1;
            }
        }
        assert_eq!(n_blobs, 4 + 12 * 6);
    }
}
