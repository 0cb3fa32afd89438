//! Regions and interfaces of one sub-domain, kept until those of the whole mesh can be summed.

use std::collections::BTreeMap;

use crate::blob::{BlobContent, u64s};
use crate::digest::Digest;

/// The share of a region that lies in this sub-domain.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct RegionTotals {
    /// Its tetrahedra.
    pub tets: u64,
    /// Summed in the sealed order.
    pub volume: f64,
}

/// One side of an interface as this sub-domain has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InterfaceSide {
    /// Number of the cut, from 1.
    pub cut: u32,
    /// The sub-domain on the other side.
    pub other: u32,
    /// Number of faces.
    pub faces: u64,
    /// Digest of the faces, seen from this side.
    pub digest: Digest,
}

/// Regions and interfaces of a sealed sub-domain.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SubdomainTotals {
    /// By number of the region.
    pub regions: BTreeMap<u32, RegionTotals>,
    /// By cut, then by the other sub-domain.
    pub interfaces: Vec<InterfaceSide>,
}

/// u64: the number of regions, then three words of each region, then five of each interface.
impl BlobContent for SubdomainTotals {
    fn to_bytes(&self) -> Vec<u8> {
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

    fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let words = u64s(bytes)?;
        let (&n, rest) = words.split_first()?;
        let (regions, sides) = rest.split_at_checked(usize::try_from(n).ok()?.checked_mul(3)?)?;
        let ([], (sides, [])) = (regions.as_chunks::<3>().1, sides.as_chunks()) else {
            return None;
        };
        let region = |&[region, tets, volume]: &[u64; 3]| {
            (region as u32, RegionTotals { tets, volume: f64::from_bits(volume) })
        };
        let side = |&[cut, other, faces, a, b]: &[u64; 5]| InterfaceSide {
            cut: cut as u32,
            other: other as u32,
            faces,
            digest: Digest { lanes: [a, b] },
        };
        Some(Self {
            regions: regions.as_chunks().0.iter().map(region).collect(),
            interfaces: sides.iter().map(side).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn totals_come_back_from_their_bytes() {
        let side = InterfaceSide { cut: 3, other: 2, faces: 9, digest: Digest { lanes: [5, 6] } };
        let totals = SubdomainTotals {
            regions: [(4, RegionTotals { tets: 17, volume: 0.1 })].into(),
            interfaces: vec![side],
        };
        assert_eq!(SubdomainTotals::from_bytes(&totals.to_bytes()), Some(totals));
        assert_eq!(SubdomainTotals::from_bytes(&[9, 0, 0, 0, 0, 0, 0, 0]), None);
    }
}
