//! What sub-domains sum up to: regions and interfaces of the whole mesh; and the rows of the journal.

use std::collections::BTreeMap;
use std::time::Instant;

use tetdb_schema::digest::Digest;

use crate::pipeline::error::PipelineError;
use crate::pipeline::tree::blob;
use tetdb_schema::catalog::{InterfaceRow, JournalRow, Measure, RegionRow, StoreState};
use tetdb_store::sealed::SealedError;
use tetdb_store::sealed::{InterfaceSide, RegionTotals, Sealed};
use tetdb_store::store::{Catalog, StoreError};

/// Regions and interfaces of a sealed sub-domain, kept until all are there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SealedTotals {
    pub regions: BTreeMap<u32, RegionTotals>,
    pub interfaces: Vec<InterfaceSide>,
}

impl SealedTotals {
    pub fn of(sealed: &Sealed) -> Self {
        Self { regions: sealed.regions.clone(), interfaces: sealed.interfaces.clone() }
    }

    /// Number of regions, three words of each, then five of each interface.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut words = vec![self.regions.len() as u64];
        for (&region, totals) in &self.regions {
            words.extend([u64::from(region), totals.tets, totals.volume.to_bits()]);
        }
        for side in &self.interfaces {
            let [a, b] = side.digest.lanes;
            words.extend([u64::from(side.cut), u64::from(side.other), side.faces, a, b]);
        }
        words.into_iter().flat_map(u64::to_le_bytes).collect()
    }

    /// The inverse of [`SealedTotals::to_bytes`].
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let words: Vec<u64> = bytes
            .chunks_exact(8)
            .map(|b| u64::from_le_bytes(std::array::from_fn(|i| b[i])))
            .collect();
        let (&n, rest) = words.split_first()?;
        let regions = rest.get(..(n as usize).checked_mul(3)?)?;
        let mut totals = Self::default();
        for r in regions.chunks_exact(3) {
            let region = RegionTotals { tets: r[1], volume: f64::from_bits(r[2]) };
            totals.regions.insert(r[0] as u32, region);
        }
        for s in rest[regions.len()..].chunks_exact(5) {
            totals.interfaces.push(InterfaceSide {
                cut: s[0] as u32,
                other: s[1] as u32,
                faces: s[2],
                digest: Digest { lanes: [s[3], s[4]] },
            });
        }
        Some(totals)
    }
}

/// What sub-domains sum up to.
pub struct Totals {
    pub regions: Vec<RegionRow>,
    /// By cut.
    pub interfaces: BTreeMap<u32, Vec<InterfaceRow>>,
}

/// The whole from the totals of all `n` sub-domains; those in `changed` go first.
pub fn sum_totals(
    catalog: &mut Catalog,
    n: u32,
    changed: &BTreeMap<u32, SealedTotals>,
) -> Result<Totals, PipelineError> {
    let mut regions = catalog.regions()?;
    let mut row_of = BTreeMap::new();
    for (i, row) in (0..).zip(&mut regions).filter(|(_, r)| r.filled) {
        (row.tets, row.volume) = (0, 0.0);
        row_of.insert(row.region, i);
    }
    let mut interfaces: BTreeMap<u32, Vec<InterfaceRow>> = BTreeMap::new();
    for rank in 0..n {
        let totals = match changed.get(&rank) {
            Some(totals) => totals.clone(),
            None => totals_of(catalog, blob::SEALED, rank)?,
        };
        for (region, here) in &totals.regions {
            let Some(&i) = row_of.get(region) else {
                continue;
            };
            let row: &mut RegionRow = &mut regions[i];
            row.tets += here.tets;
            row.volume += here.volume;
        }
        // One side tells; verification compares it with the other.
        for side in totals.interfaces.iter().filter(|s| rank < s.other) {
            interfaces.entry(side.cut).or_default().push(InterfaceRow {
                cut: side.cut,
                low: rank,
                high: side.other,
                faces: side.faces,
                digest: side.digest.lanes,
            });
        }
    }
    Ok(Totals { regions, interfaces })
}

/// The totals of a sub-domain, kept in the blobs that begin with `first`.
pub fn totals_of(catalog: &mut Catalog, first: u32, rank: u32) -> Result<SealedTotals, StoreError> {
    let bytes = catalog.blob(first + rank)?.unwrap_or_default();
    SealedTotals::from_bytes(&bytes).ok_or_else(|| {
        StoreError::Sealed(SealedError::Content {
            path: catalog.dir().to_owned(),
            subdomain: rank,
            what: "its totals are missing or damaged".to_owned(),
        })
    })
}

/// A row of the journal for a step that began at `clock`.
pub fn journal(
    state: StoreState,
    step: &str,
    clock: Instant,
    measures: &[(&str, f64)],
) -> JournalRow {
    JournalRow {
        state,
        subdomain: Some(0),
        step: step.to_owned(),
        seconds: clock.elapsed().as_secs_f64(),
        measures: measures
            .iter()
            .map(|&(name, value)| Measure { name: name.to_owned(), value })
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn totals_come_back_from_their_bytes() {
        let mut totals = SealedTotals::default();
        let region = RegionTotals { tets: 17, volume: 0.1 };
        totals.regions.insert(4, region);
        totals.interfaces.push(InterfaceSide {
            cut: 3,
            other: 2,
            faces: 9,
            digest: Digest { lanes: [5, 6] },
        });
        assert_eq!(SealedTotals::from_bytes(&totals.to_bytes()), Some(totals));
        assert_eq!(SealedTotals::from_bytes(&[9, 0, 0, 0, 0, 0, 0, 0]), None);
    }
}
