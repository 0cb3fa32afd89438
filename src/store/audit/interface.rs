//! Interface faces: each in exactly two sub-domains, the same from both.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::Path;

use tetdb_schema::digest::Digest;
use tetdb_schema::record::InterfaceFace;

use super::{Finding, Report};
use crate::sealed::{Corner, MergeReader};
use crate::store::StoreError;
use tetdb_base::storage::{Sorter, StorageError, sort_record};
use tetdb_schema::catalog::InterfaceRow;

sort_record! {
    /// An interface face of one sub-domain.
    #[derive(rkyv::Archive, rkyv::Serialize, rkyv::Deserialize)]
    struct FaceSide {
        cut: u32,
        index: u32,
        subdomain: u32,
        other: u32,
        /// Vertex ids in their turn as seen from the lower side, the least first.
        ids: [u64; 3],
        /// Sum of the mixes of the vertices' coordinates.
        sum: u64,
    }
}

/// Two sub-domains at a cut.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct CutPair {
    cut: u32,
    low: u32,
    high: u32,
}

/// The interface faces of a pair.
#[derive(Clone, Copy, Default, PartialEq)]
struct SharedFaces {
    count: u64,
    digest: Digest,
}

/// All interface faces of all sub-domains, and the digests by cut and pair, from either side.
pub(super) struct InterfaceAudit {
    sorter: Sorter<FaceSide>,
    /// From the lower and from the higher side.
    sides: BTreeMap<CutPair, [SharedFaces; 2]>,
}

/// The interface faces of some sub-domains.
#[derive(rkyv::Archive, rkyv::Serialize, rkyv::Deserialize, Clone, Debug)]
pub(super) struct InterfaceSides {
    faces: Vec<FaceSide>,
    pairs: Vec<PairSides>,
}

/// Two sub-domains at a cut: number and digest of their faces there, from the lower and from the higher side.
#[derive(rkyv::Archive, rkyv::Serialize, rkyv::Deserialize, Clone, Debug)]
struct PairSides {
    cut: u32,
    low: u32,
    high: u32,
    counts: [u64; 2],
    digests: [[u64; 2]; 2],
}

impl CutPair {
    fn from_row(row: &InterfaceRow) -> Self {
        let &InterfaceRow { cut, low, high, .. } = row;
        Self { cut, low, high }
    }
}

impl SharedFaces {
    fn from_row(row: &InterfaceRow) -> Self {
        Self { count: row.faces, digest: Digest { lanes: row.digest } }
    }
}

impl InterfaceAudit {
    pub(super) fn new(dir: &Path, memory_bytes: usize) -> Self {
        Self { sorter: Sorter::new(dir, memory_bytes as u64), sides: BTreeMap::new() }
    }

    /// Adds a face of `subdomain`, whose vertices are counter-clockwise seen from outside the sub-domain.
    pub(super) fn push(
        &mut self,
        subdomain: u32,
        face: &InterfaceFace,
        corners: &[Corner; 3],
    ) -> Result<(), StorageError> {
        let mixes = corners.map(|c| c.mix);
        let (low, high) = (subdomain.min(face.other), subdomain.max(face.other));
        let cut = face.cut;
        let sides = self.sides.entry(CutPair { cut, low, high }).or_default();
        let side = &mut sides[usize::from(subdomain != low)];
        side.count += 1;
        side.digest.add_face(mixes, face.cut);
        let mut ids = corners.map(|c| c.id);
        let least = (0..3).min_by_key(|&i| ids[i]).unwrap_or(0);
        ids.rotate_left(least);
        // From the higher side the turn is the other way round.
        if subdomain != low {
            ids.swap(1, 2);
        }
        let sum = mixes.iter().fold(0u64, |s, &m| s.wrapping_add(m));
        self.sorter.push(FaceSide {
            cut: face.cut,
            index: face.index,
            subdomain,
            other: face.other,
            ids,
            sum,
        })
    }

    /// Returns the pushed faces, for [`add`](Self::add) in another process. Memory: all of them. Errors: the disk.
    pub(super) fn into_sides(self) -> Result<InterfaceSides, StorageError> {
        let pairs = self.sides.into_iter();
        let pairs = pairs.map(|(CutPair { cut, low, high }, sides)| PairSides {
            cut,
            low,
            high,
            counts: sides.map(|side| side.count),
            digests: sides.map(|side| side.digest.lanes),
        });
        Ok(InterfaceSides {
            faces: self.sorter.finish()?.collect::<Result<_, _>>()?,
            pairs: pairs.collect(),
        })
    }

    /// Adds the faces of other sub-domains. Errors: the disk.
    pub(super) fn add(&mut self, other: InterfaceSides) -> Result<(), StorageError> {
        for pair in other.pairs {
            let PairSides { cut, low, high, .. } = pair;
            let sides = self.sides.entry(CutPair { cut, low, high }).or_default();
            let more = pair.counts.into_iter().zip(pair.digests);
            for (side, (count, lanes)) in sides.iter_mut().zip(more) {
                side.count += count;
                side.digest.merge(&Digest { lanes });
            }
        }
        (other.faces.into_iter()).try_for_each(|face| self.sorter.push(face))
    }

    /// Matches the faces and compares the digests with the catalog's rows.
    pub(super) fn finish(
        self,
        rows: &[InterfaceRow],
        report: &mut Report,
    ) -> Result<(), StoreError> {
        let (mut sides, mut group) = (MergeReader::new(self.sorter.finish()?), Vec::new());
        while sides.next_group(&mut group, |a, b| (a.cut, a.index) == (b.cut, b.index))? {
            compare_sides(&group, report);
        }
        let mut expected: BTreeMap<CutPair, SharedFaces> =
            rows.iter().map(|row| (CutPair::from_row(row), SharedFaces::from_row(row))).collect();
        for (pair, sides) in self.sides {
            let row = expected.remove(&pair);
            if sides[0] != sides[1] || row != Some(sides[0]) {
                differs(pair, report);
            }
        }
        for pair in expected.into_keys() {
            differs(pair, report);
        }
        Ok(())
    }
}

fn compare_sides(group: &[FaceSide], report: &mut Report) {
    let [a, b] = group else {
        let count = group.len();
        return unmatched(&group[0], format_args!("{count} faces instead of 2"), report);
    };
    if a.subdomain != b.other || a.other != b.subdomain {
        unmatched(a, "its sub-domains do not name each other", report);
    } else if (a.ids, a.sum) != (b.ids, b.sum) {
        unmatched(a, "its vertices differ between the sides", report);
    }
}

fn unmatched(side: &FaceSide, what: impl Display, report: &mut Report) {
    let what = format_args!("face {} of cut {}: {what}", side.index, side.cut);
    report.find(Finding::UnmatchedInterface, side.subdomain, what);
}

fn differs(CutPair { cut, low, high }: CutPair, report: &mut Report) {
    let what = format_args!(
        "the interface of sub-domains {low} and {high} by cut {cut} is not what its row says"
    );
    report.find(Finding::CatalogDiffers, low, what);
}
