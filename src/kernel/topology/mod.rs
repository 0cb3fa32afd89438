//! Neighbors of sub-domains: owners of interface faces, updated at every bisection.
//!
//! A cut's faces are numbered. For each face, the table of the cut has the sub-domains on the low side and on the high
//! side. A sub-domain is named by the rank of its first final sub-domain. When it is bisected, its low child keeps the
//! name. So only the faces of the high child change owner, and neither the neighbor nor its files are read.
//!
//! Source: the paper, section 1.3.

use std::collections::BTreeMap;

use rkyv::{Archive, Deserialize, Serialize};

/// Owners of the faces of one cut. Shape: `faces[i]` = the parts on the low and on the high side of face `i`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Owners {
    /// Names of the parts on the low and on the high side of each face.
    pub faces: Vec<[u32; 2]>,
}

impl Owners {
    /// The faces of a new cut between two parts.
    pub fn new(faces: u32, low: u32, high: u32) -> Self {
        Self { faces: vec![[low, high]; faces as usize] }
    }

    /// Little-endian words, low before high.
    pub fn to_bytes(&self) -> Vec<u8> {
        let words = self.faces.iter().flatten();
        words.flat_map(|w| w.to_le_bytes()).collect()
    }

    /// The inverse of [`Owners::to_bytes`]; `None` when the length is not that of whole faces.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        if !bytes.len().is_multiple_of(8) {
            return None;
        }
        let word = |b: &[u8]| u32::from_le_bytes([b[0], b[1], b[2], b[3]]);
        let faces = bytes.chunks_exact(8);
        Some(Self { faces: faces.map(|b| [word(b), word(&b[4..])]).collect() })
    }

    /// Who has the face on the other side; `None` when the cut has no such face.
    pub fn other(&self, index: u32, side: u32) -> Option<u32> {
        let owners = self.faces.get(index as usize)?;
        Some(owners[1 - (side as usize & 1)])
    }

    /// The faces of one sub-domain, with the owner on the other side of each.
    pub fn across(&self, part: u32) -> OppositeOwners {
        let faces = (0..).zip(&self.faces);
        let other = |(index, &owners): (u32, &[u32; 2])| match owners {
            [a, b] if a == part => Some([index, b]),
            [a, b] if b == part => Some([index, a]),
            _ => None,
        };
        OppositeOwners { faces: faces.filter_map(other).collect() }
    }
}

/// The faces that one sub-domain has in a cut. Shape: `faces[i]` = the number of a face and the sub-domain on its other
/// side, ascending.
#[derive(Archive, Serialize, Deserialize, Clone, Debug, Default, PartialEq, Eq)]
pub struct OppositeOwners {
    faces: Vec<[u32; 2]>,
}

impl OppositeOwners {
    /// Who has the face on the other side; `None` when the part has no such face.
    pub fn other(&self, index: u32) -> Option<u32> {
        let at = self.faces.binary_search_by_key(&index, |face| face[0]);
        Some(self.faces[at.ok()?][1])
    }
}

/// Shared faces of each pair of parts, the lower name first.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NeighborCounts {
    pairs: BTreeMap<(u32, u32), u64>,
}

impl NeighborCounts {
    /// Sets the number of faces that a pair shares.
    pub fn set(&mut self, a: u32, b: u32, faces: u64) {
        self.pairs.insert((a.min(b), a.max(b)), faces);
    }

    /// Counts one more face between two parts.
    pub fn add(&mut self, a: u32, b: u32) {
        *self.pairs.entry((a.min(b), a.max(b))).or_default() += 1;
    }

    /// Counts one face less between two parts.
    pub fn remove(&mut self, a: u32, b: u32) {
        let key = (a.min(b), a.max(b));
        if let Some(n) = self.pairs.get_mut(&key) {
            *n -= 1;
            if *n == 0 {
                self.pairs.remove(&key);
            }
        }
    }

    /// The neighbors of a sub-domain by name, and the number of faces shared with each.
    pub fn list(&self, part: u32) -> Vec<(u32, u64)> {
        let mut found: Vec<(u32, u64)> = (self.pairs.iter())
            .filter_map(|(&(a, b), &n)| match part {
                p if p == a => Some((b, n)),
                p if p == b => Some((a, n)),
                _ => None,
            })
            .collect();
        found.sort_unstable();
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_change_owner_and_tables_stay_symmetric() {
        let mut owners = Owners::new(5, 0, 2);
        let mut neighbors = NeighborCounts::default();
        neighbors.set(0, 2, 5);
        // The high part is bisected: faces 3 and 4 go to part 3.
        for index in [3, 4] {
            let other = owners.other(index, 1).expect("a face of the cut");
            owners.faces[index as usize][1] = 3;
            neighbors.remove(2, other);
            neighbors.add(3, other);
        }
        assert_eq!(neighbors.list(0), [(2, 3), (3, 2)]);
        assert_eq!(neighbors.list(3), [(0, 2)]);
        assert_eq!(owners.other(4, 0), Some(3));
        let [two, three] = [2, 3].map(|part| owners.across(part));
        assert_eq!((two.other(2), two.other(3)), (Some(0), None));
        assert_eq!((three.other(2), three.other(3)), (None, Some(0)));
        assert_eq!(owners.across(0).other(4), Some(3));
        assert_eq!(Owners::from_bytes(&owners.to_bytes()), Some(owners));
        assert_eq!(Owners::from_bytes(&[1]), None);
    }
}
