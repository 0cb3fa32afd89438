//! The written tetrahedra of a sub-domain, and their vertices: two sets of numbers.

use std::collections::BTreeSet;
use std::path::Path;

use crate::write::error::Result;
use crate::write::stream::{RecordReader, scratch};
use tetdb_store::sealed::{BitSet, Subdomain};

/// A set of numbers, with the count of members below each.
///
/// Shape: a bit for each number, and a count for each 64 numbers. Memory: 1.5 bits for each number.
pub(in crate::write) struct RankedSet {
    words: Vec<u64>,
    before: Vec<u32>,
}

impl RankedSet {
    fn new(words: Vec<u64>) -> Self {
        let sums = words.iter().scan(0, |sum, word| {
            let before = *sum;
            *sum += word.count_ones();
            Some(before)
        });
        let before = sums.collect();
        Self { words, before }
    }

    /// Number of members.
    pub fn n(&self) -> u64 {
        let last = self.before.last().zip(self.words.last());
        last.map_or(0, |(before, word)| u64::from(before + word.count_ones()))
    }

    /// Number of members below `number`; `None` where it is no member.
    #[inline]
    pub fn rank(&self, number: u32) -> Option<u32> {
        let (place, bit) = (number as usize / 64, number % 64);
        let word = *self.words.get(place)?;
        let below = (word & ((1 << bit) - 1)).count_ones();
        (word >> bit & 1 == 1).then(|| self.before[place] + below)
    }
}

/// The tetrahedra of one sub-domain that are written, all or those of some regions, and their vertices.
pub(in crate::write) struct Subset {
    pub tets: RankedSet,
    pub vertices: RankedSet,
}

impl Subset {
    /// Finds the tetrahedra of these regions, or all when there are none, and saves them with their vertices at `path`; returns the numbers of both.
    ///
    /// Errors: damage, the disk.
    pub fn gather(part: &mut Subdomain, regions: &BTreeSet<u32>, path: &Path) -> Result<[u64; 2]> {
        let n_vertices = part.row().vertices;
        let (mut tets, mut vertices) = (BitSet::new(part.row().tets), BitSet::new(n_vertices));
        for chunk in 0..part.tet_summaries().len() {
            let [least, greatest] = part.tet_summaries()[chunk].regions;
            if !regions.is_empty() && regions.range(least..=greatest).next().is_none() {
                continue;
            }
            let chunk = part.tet_chunk(chunk as u32)?;
            for (local, tet) in (chunk.first..).zip(&chunk.records) {
                if regions.is_empty() || regions.contains(&tet.region) {
                    tets.insert(local.into());
                    for v in tet.nodes {
                        if u64::from(v) >= n_vertices {
                            part.corner(v)?;
                        }
                        vertices.insert(v.into());
                    }
                }
            }
        }
        let mut stream = scratch(path)?;
        for word in tets.words().iter().chain(vertices.words()) {
            stream.record(&word.to_le_bytes())?;
        }
        stream.finish()?;
        Ok([tets, vertices].map(|set| set.words().iter().map(|w| u64::from(w.count_ones())).sum()))
    }

    /// Loads the subset of a sub-domain with `n` tetrahedra from `path`. Errors: the disk.
    pub fn load(path: &Path, n: u64) -> Result<Self> {
        let mut words = Vec::new();
        RecordReader::open(path, 0)?.each(|word| {
            words.push(u64::from_le_bytes(*word));
            Ok(())
        })?;
        let vertices = words.split_off(n.div_ceil(64) as usize);
        Ok(Self { tets: RankedSet::new(words), vertices: RankedSet::new(vertices) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ranked_set_counts_what_is_below() {
        let members: Vec<u32> = (0..500).filter(|n| n % 7 == 3 || n % 64 == 63).collect();
        let mut words = vec![0u64; 8];
        for &n in &members {
            words[n as usize / 64] |= 1 << (n % 64);
        }
        let set = RankedSet::new(words);
        for n in 0..600 {
            let expected = members.iter().position(|&m| m == n);
            assert_eq!(set.rank(n), expected.map(|i| i as u32));
        }
    }
}
