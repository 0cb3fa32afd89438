//! The bisection tree: its subtrees, their working meshes, the planes of its cuts.
//!
//! A subtree is a range of ranks, named by its first. A cut is named by the first rank of its high side. So cuts are numbered from
//! left to right, and the tree follows from the number of sub-domains alone.

use rkyv::{Archive, Deserialize, Serialize};

use crate::blob::{BlobContent, u32s};
use crate::page::{NONE, PageKind, RECORDS, dense, sparse};

/// Ranks `first..first + count`: a node of the tree.
#[derive(Archive, Serialize, Deserialize, Clone, Copy, Debug, PartialEq, Eq)]
pub struct RankRange {
    /// The first rank.
    pub first: u32,
    /// How many ranks there are.
    pub count: u32,
}

impl RankRange {
    /// The root of a tree of `n` sub-domains.
    pub const fn root(n: u32) -> Self {
        Self { first: 0, count: n }
    }

    /// Its ranks.
    pub const fn ranks(self) -> std::ops::Range<u32> {
        self.first..self.first + self.count
    }

    /// The cut that divides it: the first rank of its high child.
    pub const fn cut(self) -> u32 {
        self.first + self.count / 2
    }

    /// Its low and its high child.
    pub const fn children(self) -> [Self; 2] {
        let low = self.count / 2;
        [
            Self { first: self.first, count: low },
            Self { first: self.first + low, count: self.count - low },
        ]
    }

    /// Share of the load that belongs to the low child.
    pub fn low_share(self) -> f64 {
        f64::from(self.count / 2) / f64::from(self.count)
    }

    /// True if a tree of `n` sub-domains has this node.
    pub fn is_in_tree(self, n: u32) -> bool {
        self.path(n).1 == self
    }

    /// The cuts above it, from the top, in a tree of `n` sub-domains that has it.
    pub fn cuts_above(self, n: u32) -> Vec<u32> {
        self.path(n).0
    }

    /// The path from the root: the cuts passed, and the node where the path ends.
    fn path(self, n: u32) -> (Vec<u32>, Self) {
        let (mut cuts, mut at) = (Vec::new(), Self::root(n));
        while at != self && at.count > 1 {
            cuts.push(at.cut());
            let [low, high] = at.children();
            at = if self.first < high.first { low } else { high };
        }
        (cuts, at)
    }
}

/// Counts of the ids of one kind of record. Ids are assigned in order; freed slots are reused, the last freed first.
#[derive(Archive, Serialize, Deserialize, Clone, Copy, Debug, PartialEq, Eq)]
pub struct IdCounts {
    /// The least id that was never used.
    pub fresh: u32,
    /// The slot freed last, or [`NONE`].
    pub free_head: u32,
    /// Records in use.
    pub n_live: u32,
}

impl IdCounts {
    /// Counts of `n` records numbered without gaps.
    pub const fn without_gaps(n: u32) -> Self {
        Self { fresh: sparse(n), free_head: NONE, n_live: n }
    }

    /// True if `n_pages` pages have slots for these ids: false only for damage.
    fn fits(&self, n_pages: u32) -> bool {
        let ids = u64::from(dense(self.fresh));
        let is_free = self.free_head == NONE || u64::from(dense(self.free_head)) < ids;
        ids <= u64::from(n_pages) * RECORDS as u64 && u64::from(self.n_live) <= ids && is_free
    }
}

impl Default for IdCounts {
    fn default() -> Self {
        Self::without_gaps(0)
    }
}

/// Counts that, with the pages, are the whole state of a working mesh.
#[derive(Archive, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MeshState {
    /// Counts of tetrahedra.
    pub tets: IdCounts,
    /// Counts of vertices.
    pub vertices: IdCounts,
    /// Counts of facets.
    pub facets: IdCounts,
    /// Counts of interface faces.
    pub interface_faces: IdCounts,
}

/// Numbers of a [`MeshState`].
pub const MESH_STATE_WORDS: usize = 12;

impl MeshState {
    /// Counts of records numbered without gaps.
    pub const fn without_gaps(
        n_tets: u32,
        n_vertices: u32,
        n_facets: u32,
        n_interface_faces: u32,
    ) -> Self {
        Self {
            tets: IdCounts::without_gaps(n_tets),
            vertices: IdCounts::without_gaps(n_vertices),
            facets: IdCounts::without_gaps(n_facets),
            interface_faces: IdCounts::without_gaps(n_interface_faces),
        }
    }

    fn counts(&self) -> [IdCounts; 4] {
        [self.tets, self.vertices, self.facets, self.interface_faces]
    }

    /// True if so many pages of tetrahedra, vertices, facets and interface faces have slots for the ids counted here: false only for damage.
    pub fn fits(&self, n_pages: [u32; 4]) -> bool {
        self.counts().iter().zip(n_pages).all(|(counts, n)| counts.fits(n))
    }

    /// Tetrahedra in use.
    pub const fn n_tets(&self) -> u32 {
        self.tets.n_live
    }

    /// The counts as numbers, for storing in addition to the pages.
    pub fn to_words(self) -> [u32; MESH_STATE_WORDS] {
        let counts = self.counts().map(|c| [c.fresh, c.free_head, c.n_live]);
        counts.as_flattened().try_into().expect("four times three")
    }

    /// The inverse of [`MeshState::to_words`].
    pub const fn from_words(w: [u32; MESH_STATE_WORDS]) -> Self {
        const fn counts(w: &[u32; MESH_STATE_WORDS], i: usize) -> IdCounts {
            IdCounts { fresh: w[i], free_head: w[i + 1], n_live: w[i + 2] }
        }
        Self {
            tets: counts(&w, 0),
            vertices: counts(&w, 3),
            facets: counts(&w, 6),
            interface_faces: counts(&w, 9),
        }
    }
}

/// Kinds of pages of a working mesh, in the order of [`SubtreeMesh::extents`].
pub const WORKING_KINDS: [PageKind; 7] = [
    PageKind::Tets,
    PageKind::TetAttributes,
    PageKind::Vertices,
    PageKind::VertexAttributes,
    PageKind::Facets,
    PageKind::InterfaceFaces,
    PageKind::Scratch,
];

/// The working mesh of a subtree, in the file of its first rank.
#[derive(Archive, Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
pub struct SubtreeMesh {
    /// Its ranks.
    pub ranks: RankRange,
    /// The generation of the file.
    pub generation: u32,
    /// Counts of the records.
    pub state: MeshState,
    /// The first page and the number of pages, for each of [`WORKING_KINDS`].
    pub extents: [[u32; 2]; WORKING_KINDS.len()],
    /// Predicted load of the subtree.
    pub load: f64,
}

const SUBTREE_WORDS: usize = 5 + MESH_STATE_WORDS + 2 * WORKING_KINDS.len();

impl SubtreeMesh {
    /// True if the state fits into the pages of the extents, and no page has a number too large: false only for damage.
    pub fn is_sound(&self) -> bool {
        let [tets, _, vertices, _, facets, interface_faces, _] = self.extents.map(|[_, n]| n);
        self.extents.iter().all(|[first, n]| first.checked_add(*n).is_some())
            && self.state.fits([tets, vertices, facets, interface_faces])
    }

    /// Pages of all kinds.
    pub fn n_pages(&self) -> u64 {
        self.extents.iter().map(|&[_, n]| u64::from(n)).sum()
    }

    /// The bytes of [`Blob::Subtree`](crate::blob::Blob::Subtree), whose index is the first rank: words of the number of ranks,
    /// generation, load (two), state, extents.
    pub fn to_bytes(&self) -> Vec<u8> {
        let load = self.load.to_bits();
        let head = [self.ranks.count, self.generation, load as u32, (load >> 32) as u32];
        let words = (head.into_iter())
            .chain(self.state.to_words())
            .chain(self.extents.into_iter().flatten());
        words.flat_map(u32::to_le_bytes).collect()
    }

    /// The inverse of [`SubtreeMesh::to_bytes`]; `None` for another length.
    pub fn from_bytes(first: u32, bytes: &[u8]) -> Option<Self> {
        let mut words = vec![first];
        words.extend(u32s(bytes)?);
        let words: [u32; SUBTREE_WORDS] = words.try_into().ok()?;
        let (state, extents) = words[5..].split_first_chunk()?;
        let (extents, _) = extents.as_chunks();
        Some(Self {
            ranks: RankRange { first, count: words[1] },
            generation: words[2],
            load: f64::from_bits(u64::from(words[3]) | u64::from(words[4]) << 32),
            state: MeshState::from_words(*state),
            extents: extents.try_into().ok()?,
        })
    }
}

/// The plane of a cut, around which its zone is refined.
#[derive(Archive, Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
pub struct CutPlane {
    /// Number of the cut, from 1.
    pub cut: u32,
    /// Normal and offset: `normal · x = offset`.
    pub plane: [f64; 4],
}

impl CutPlane {
    /// The bytes of [`Blob::CutPlane`](crate::blob::Blob::CutPlane), whose index is the number of the cut: four f64.
    pub fn to_bytes(&self) -> Vec<u8> {
        self.plane.to_bytes()
    }

    /// The inverse of [`CutPlane::to_bytes`]; `None` for another length.
    pub fn from_bytes(cut: u32, bytes: &[u8]) -> Option<Self> {
        Some(Self { cut, plane: BlobContent::from_bytes(bytes)? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_of_sub_domains_has_a_tree() {
        for n in [1, 2, 3, 5, 7, 100, 4096] {
            let mut ranks = 0;
            let mut cuts = Vec::new();
            let mut stack = vec![RankRange::root(n)];
            while let Some(node) = stack.pop() {
                if node.count == 1 {
                    assert_eq!(node.first, ranks);
                    ranks += 1;
                    continue;
                }
                assert!(node.is_in_tree(n));
                let above = node.cuts_above(n);
                assert!(above.len() <= 12);
                cuts.push(node.cut());
                let [low, high] = node.children();
                assert_eq!(high.first, node.cut());
                assert_eq!(high.cuts_above(n), [above, vec![node.cut()]].concat());
                stack.extend([high, low]);
            }
            cuts.sort_unstable();
            assert_eq!(ranks, n);
            assert_eq!(cuts, (1..n).collect::<Vec<_>>());
        }
    }

    #[test]
    fn only_nodes_of_the_tree_are_nodes() {
        let is_in = |first, count, n| RankRange { first, count }.is_in_tree(n);
        assert!(is_in(0, 1, 1) && is_in(2, 1, 5) && is_in(2, 3, 5));
        for (first, count, n) in [(0, 0x99_0001, 1), (0, 0, 1), (1, 1, 1), (0, 3, 5), (1, 2, 4)] {
            assert!(!is_in(first, count, n), "{first} {count} of {n}");
        }
    }

    #[test]
    fn a_subtree_comes_back_from_its_bytes() {
        let mesh = SubtreeMesh {
            ranks: RankRange { first: 4, count: 3 },
            generation: 9,
            state: MeshState::without_gaps(5000, 700, 60, 8),
            extents: std::array::from_fn(|i| [i as u32, 3]),
            load: -0.1,
        };
        assert!(mesh.is_sound());
        let bytes = mesh.to_bytes();
        assert_eq!(bytes.len(), 120);
        assert_eq!(bytes[..8], [3, 0, 0, 0, 9, 0, 0, 0]);
        assert_eq!(SubtreeMesh::from_bytes(4, &bytes), Some(mesh));
        assert_eq!(SubtreeMesh::from_bytes(4, &bytes[4..]), None);
    }
}
