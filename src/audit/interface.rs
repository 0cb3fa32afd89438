//! Interface faces: each in exactly two sub-domains, the same from both.

use std::collections::BTreeMap;
use std::path::Path;

use tetdb_schema::digest::Digest;
use tetdb_schema::record::InterfaceFace;

use super::claims::word;
use super::{Finding, Offender, Report};
use crate::sealed::Corner;
use crate::storage::{Sorter, StorageError};
use crate::store::StoreError;
use tetdb_schema::catalog::InterfaceRow;

/// Cut, index, sub-domain, other, three vertex ids in their turn, sum of the coordinate mixes.
const BYTES: usize = 48;

/// All interface faces of all sub-domains, and the digests by cut and pair, from either side.
pub(super) struct Interfaces {
    sorter: Sorter<BYTES>,
    /// By cut, lower and higher rank: faces and digest from the lower and from the higher side.
    sides: BTreeMap<(u32, u32, u32), [(u64, Digest); 2]>,
}

impl Interfaces {
    pub(super) fn new(dir: &Path, memory_bytes: usize) -> Self {
        Self {
            sorter: Sorter::new(dir, memory_bytes as u64),
            sides: BTreeMap::new(),
        }
    }

    /// A face of `subdomain`; its vertices are counter-clockwise seen from outside it.
    pub(super) fn push(
        &mut self,
        subdomain: u32,
        face: &InterfaceFace,
        corners: &[Corner; 3],
    ) -> Result<(), StorageError> {
        let mixes = corners.map(|c| c.mix);
        let (low, high) = (subdomain.min(face.other), subdomain.max(face.other));
        let sides = self.sides.entry((face.cut, low, high)).or_default();
        let side = &mut sides[usize::from(subdomain != low)];
        side.0 += 1;
        side.1.add_face(mixes, face.cut);
        let mut ids = corners.map(|c| c.id);
        let least = (0..3).min_by_key(|&i| ids[i]).unwrap_or(0);
        ids.rotate_left(least);
        // From the higher side the turn is the other way round.
        if subdomain != low {
            ids.swap(1, 2);
        }
        let sum = mixes.iter().fold(0u64, |s, &m| s.wrapping_add(m));
        let mut record = [0; BYTES];
        let words = [face.cut, face.index, subdomain, face.other];
        for (bytes, word) in record[..16].chunks_exact_mut(4).zip(words) {
            bytes.copy_from_slice(&word.to_be_bytes());
        }
        for (bytes, v) in record[16..]
            .chunks_exact_mut(8)
            .zip([ids[0], ids[1], ids[2], sum])
        {
            bytes.copy_from_slice(&v.to_be_bytes());
        }
        self.sorter.push(record)
    }

    /// Matches the faces and compares the digests with the catalog's rows.
    pub(super) fn finish(
        self,
        rows: &[InterfaceRow],
        report: &mut Report,
    ) -> Result<(), StoreError> {
        let mut group: Vec<[u8; BYTES]> = Vec::new();
        for record in self.sorter.finish()? {
            let record = record?;
            if group.first().is_some_and(|g| g[..8] != record[..8]) {
                judge(&group, report);
                group.clear();
            }
            group.push(record);
        }
        if !group.is_empty() {
            judge(&group, report);
        }
        let mut expected: BTreeMap<_, _> = rows
            .iter()
            .map(|r| {
                (
                    (r.cut, r.low, r.high),
                    (r.faces, Digest { lanes: r.digest }),
                )
            })
            .collect();
        for (key, sides) in self.sides {
            let row = expected.remove(&key);
            if sides[0] != sides[1] || row != Some(sides[0]) {
                differs(key, report);
            }
        }
        for key in expected.into_keys() {
            differs(key, report);
        }
        Ok(())
    }
}

fn judge(group: &[[u8; BYTES]], report: &mut Report) {
    let [a, b] = group else {
        let count = group.len();
        return unmatched(&group[0], format!("{count} faces instead of 2"), report);
    };
    if word(a, 2) != word(b, 3) || word(a, 3) != word(b, 2) {
        unmatched(a, "its sub-domains do not name each other".into(), report);
    } else if a[16..] != b[16..] {
        unmatched(a, "its vertices differ between the sides".into(), report);
    }
}

fn unmatched(record: &[u8; BYTES], what: String, report: &mut Report) {
    let finding = Finding::UnmatchedInterface;
    report.find(finding, || {
        let what = format!(
            "face {} of cut {}: {what}",
            word(record, 1),
            word(record, 0)
        );
        Offender::new(finding, Some(word(record, 2)), what)
    });
}

fn differs((cut, low, high): (u32, u32, u32), report: &mut Report) {
    let finding = Finding::CatalogDiffers;
    report.find(finding, || {
        let what = format!(
            "the interface of sub-domains {low} and {high} by cut {cut} is not what its row says"
        );
        Offender::new(finding, Some(low), what)
    });
}
