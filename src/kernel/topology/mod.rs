//! Neighbors: the number of faces that each two subtrees share, updated at every bisection.
//!
//! A subtree of the bisection tree is named by its first rank. When it is bisected, its low child keeps the name. Only the faces of
//! the high child change owner ([`FaceOwners`](tetdb_schema::topology::FaceOwners)), and with them two of these numbers.
//!
//! Source: the paper, section 1.3.

use std::collections::BTreeMap;

/// Number of shared faces for each pair of subtrees, the lower name first.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NeighborCounts {
    pairs: BTreeMap<(u32, u32), u64>,
}

impl NeighborCounts {
    /// Sets the number of faces that a pair shares.
    pub fn set(&mut self, a: u32, b: u32, faces: u64) {
        self.pairs.insert((a.min(b), a.max(b)), faces);
    }

    /// Counts one more face between two subtrees.
    pub fn add(&mut self, a: u32, b: u32) {
        *self.pairs.entry((a.min(b), a.max(b))).or_default() += 1;
    }

    /// Counts one face less between two subtrees.
    pub fn remove(&mut self, a: u32, b: u32) {
        let key = (a.min(b), a.max(b));
        if let Some(n) = self.pairs.get_mut(&key) {
            *n -= 1;
            if *n == 0 {
                self.pairs.remove(&key);
            }
        }
    }

    /// The neighbors of a subtree by name, and the number of faces shared with each.
    pub fn list(&self, name: u32) -> Vec<(u32, u64)> {
        let mut found: Vec<(u32, u64)> = (self.pairs.iter())
            .filter_map(|(&(a, b), &n)| match name {
                name if name == a => Some((b, n)),
                name if name == b => Some((a, n)),
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
    use tetdb_schema::topology::FaceOwners;

    #[test]
    fn faces_change_owner_and_tables_stay_symmetric() {
        let mut owners = FaceOwners::new(5, 0, 2);
        let mut neighbors = NeighborCounts::default();
        neighbors.set(0, 2, 5);
        // The high subtree is bisected: faces 3 and 4 go to subtree 3.
        for index in [3, 4] {
            let other = owners.other(index, 1).expect("a face of the cut");
            owners.faces[index as usize][1] = 3;
            neighbors.remove(2, other);
            neighbors.add(3, other);
        }
        assert_eq!(neighbors.list(0), [(2, 3), (3, 2)]);
        assert_eq!(neighbors.list(3), [(0, 2)]);
    }
}
