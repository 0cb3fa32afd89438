//! Corners of the octree's leaves, numbered once each, and hanging corners.
//!
//! ```text
//!   p-------+---+      A corner in the middle of a larger leaf's edge or face hangs: its value
//!   |       |   |      is the mean of that edge's two or that face's four corners (p, q), so that the
//!   |       u---+      field is continuous across. Since neighbors differ by one level, the corners
//!   |       |   |      it hangs on belong to leaves one level up; taken level by level, each chain ends
//!   +-------q---+      at a corner that is free.
//! ```

use fixedbitset::FixedBitSet;
use rayon::prelude::*;

use super::SizingError;
use super::tree::{LATTICE, Leaf, Tree};
use tetdb_base::storage::{
    KeyedId, OrRaise, ScratchSpace, SortRecord, SpillVec, StorageError, parallel, sort_record,
};

/// Corners sampled in one batch.
const CORNERS_AT_ONCE: usize = 1 << 16;
/// Leaves whose corners a thread looks at before the next ones.
const LEAVES_AT_ONCE: usize = 1 << 12;

sort_record! {
    /// A hanging corner and the four corners (an edge's two, twice) whose mean it takes.
    #[derive(Eq, bytemuck::Pod, bytemuck::Zeroable)]
    #[repr(C)]
    pub(super) struct Hanging {
        /// Level of the smaller leaf: coarser ones come first.
        pub(super) level: u32,
        pub(super) corner: u32,
        pub(super) on: [u32; 4],
    }
}

impl Hanging {
    /// Returns whether it is in the middle of an edge; else of a face.
    fn on_edge(&self) -> bool {
        self.on[0] == self.on[2]
    }

    /// The two or four corners, once each.
    pub fn distinct(&self) -> &[u32] {
        if self.on_edge() { &self.on[..2] } else { &self.on }
    }

    /// Distance to the corners it hangs on, in units of the root's side.
    pub fn distance(&self) -> f64 {
        let side = 1.0 / f64::from(1u32 << self.level);
        if self.on_edge() { side } else { side * 2f64.sqrt() }
    }
}

/// Corners of a tree.
pub(super) struct TreeCorners {
    /// Corner numbers of each leaf, in the octants' order.
    pub of_leaf: SpillVec<[u32; 8]>,
    pub n_corners: usize,
    /// Sorted by level, each corner once.
    pub hanging: SpillVec<Hanging>,
}

impl TreeCorners {
    /// A disk that fails unwinds.
    pub fn new(tree: &Tree, scratch: &ScratchSpace) -> Self {
        let numbered = number_corners(tree, scratch);
        let (mut of_leaf, n_corners) = numbered.or_raise();
        let hanging = find_hanging(tree, &mut of_leaf, scratch).or_raise();
        Self { of_leaf, n_corners, hanging }
    }

    /// Calls `size` once for the lattice position of each corner, on all threads, and `store` with the corner and its
    /// size.
    pub fn sample(
        &mut self,
        tree: &Tree,
        size: &(dyn Fn([u32; 3]) -> Result<f64, SizingError> + Sync),
        mut store: impl FnMut(usize, f64),
    ) -> Result<(), SizingError> {
        let mut is_sampled = FixedBitSet::with_capacity(self.n_corners);
        let mut batch: Vec<(u32, [u32; 3])> = Vec::with_capacity(CORNERS_AT_ONCE + 8);
        let mut sample_batch = |batch: &mut Vec<(u32, [u32; 3])>| {
            let sizes: Result<Vec<f64>, _> =
                parallel(|| batch.par_iter().map(|&(_, at)| size(at)).collect());
            for ((id, _), size) in batch.drain(..).zip(sizes?) {
                store(id as usize, size);
            }
            Ok(())
        };
        for (i, leaf) in tree.leaves().enumerate() {
            for (c, id) in self.of_leaf.get(i).into_iter().enumerate() {
                if !is_sampled.put(id as usize) {
                    batch.push((id, leaf.corner(c)));
                }
            }
            if batch.len() >= CORNERS_AT_ONCE {
                sample_batch(&mut batch)?;
            }
        }
        sample_batch(&mut batch)
    }
}

/// Numbers corners along the Morton curve, so that near corners are near in memory.
fn number_corners(
    tree: &Tree,
    scratch: &ScratchSpace,
) -> Result<(SpillVec<[u32; 8]>, usize), StorageError> {
    let mut keys = scratch.sorter::<KeyedId>();
    let mut leaves = (0..).zip(tree.leaves());
    let mut n_leaves = 0;
    loop {
        let some: Vec<(usize, Leaf)> = leaves.by_ref().take(LEAVES_AT_ONCE).collect();
        if some.is_empty() {
            break;
        }
        n_leaves += some.len();
        let key = |(i, leaf): &(usize, Leaf), c: usize| {
            KeyedId { key: morton(leaf.corner(c)), id: (8 * i + c) as u32 }.to_bytes()
        };
        let of = |leaf: &(usize, Leaf)| std::array::from_fn::<_, 8, _>(|c| key(leaf, c));
        let found: Vec<_> = parallel(|| some.par_iter().map(of).collect());
        keys.extend(found.as_flattened())?;
    }
    let keys = keys.finish()?;
    let mut of_leaf = scratch.vec(n_leaves, [0u32; 8]);
    let mut n_corners = 0u32;
    let mut last = None;
    for key in keys {
        let KeyedId { key: corner, id: slot } = key?;
        if last != Some(corner) {
            n_corners += 1;
            last = Some(corner);
        }
        let number = n_corners - 1;
        of_leaf.change(slot as usize / 8, |ids| ids[slot as usize % 8] = number);
    }
    Ok((of_leaf, n_corners as usize))
}

/// Interleaves the bits of a lattice position, 21 per axis.
#[inline]
fn morton(p: [u32; 3]) -> u64 {
    let spread = |x: u32| {
        let mut x = u64::from(x);
        x = (x | x << 32) & 0x001f_0000_0000_ffff;
        x = (x | x << 16) & 0x001f_0000_ff00_00ff;
        x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
        x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
        (x | x << 2) & 0x1249_2492_4924_9249
    };
    spread(p[0]) | spread(p[1]) << 1 | spread(p[2]) << 2
}

fn find_hanging(
    tree: &Tree,
    of_leaf: &mut SpillVec<[u32; 8]>,
    scratch: &ScratchSpace,
) -> Result<SpillVec<Hanging>, StorageError> {
    let mut found = scratch.sorter::<Hanging>();
    let mut leaves = (0..).zip(tree.leaves());
    loop {
        let some: Vec<(usize, Leaf)> = leaves.by_ref().take(CORNERS_AT_ONCE).collect();
        if some.is_empty() {
            break;
        }
        let of = |some: &[(usize, Leaf)]| {
            let mut ids = of_leaf.reader();
            hanging_of(tree, some, |i| ids.get(i))
        };
        let found_now: Vec<_> = parallel(|| some.par_chunks(LEAVES_AT_ONCE).map(of).collect());
        for hanging in found_now.into_iter().flatten() {
            found.push(hanging)?;
        }
    }
    let mut hanging = scratch.builder();
    let mut last = None;
    for next in found.finish()? {
        let next = next?;
        if last != Some(next.corner) {
            hanging.push(next);
            last = Some(next.corner);
        }
    }
    Ok(hanging.finish())
}

/// The corners of some leaves that hang on larger ones beside them, each once.
fn hanging_of(
    tree: &Tree,
    leaves: &[(usize, Leaf)],
    mut of_leaf: impl FnMut(usize) -> [u32; 8],
) -> Vec<Hanging> {
    let mut found = Vec::new();
    for (i, leaf) in leaves {
        let mut ids = None;
        for cell in leaf.outer_neighbors() {
            let Some((large, larger)) = larger_leaf(tree, leaf, cell) else {
                continue;
            };
            let ids = *ids.get_or_insert_with(|| of_leaf(*i));
            let ids_large = of_leaf(larger as usize);
            let hanging = |(c, &id): (usize, &u32)| hangs(leaf, c, id, &large, &ids_large);
            found.extend(ids.iter().enumerate().filter_map(hanging));
        }
    }
    found.sort_unstable_by_key(|h| (h.level, h.corner, h.on));
    found.dedup_by_key(|h| (h.level, h.corner));
    found
}

/// The leaf at a neighboring cell, when it is larger.
fn larger_leaf(tree: &Tree, leaf: &Leaf, cell: [u32; 3]) -> Option<(Leaf, u32)> {
    let (number, level) = tree.leaf_at(cell);
    let width = LATTICE >> level;
    let anchor = cell.map(|x| x & !(width - 1));
    (level < leaf.level).then_some((Leaf { anchor, level }, number))
}

/// The hanging corner of a leaf on a leaf twice as large, if it hangs.
fn hangs(
    leaf: &Leaf,
    corner: usize,
    id: u32,
    large: &Leaf,
    ids_large: &[u32; 8],
) -> Option<Hanging> {
    let p = leaf.corner(corner);
    let width = leaf.width();
    // Position on the large leaf in halves of its side: 0, 1, 2, or outside.
    let mut halves = [0u32; 3];
    for axis in 0..3 {
        halves[axis] = p[axis].checked_sub(large.anchor[axis])? / width;
    }
    if halves.iter().any(|&x| x > 2) || halves.iter().all(|&x| x != 1) {
        return None;
    }
    let mut on = [0; 4];
    for (i, on) in on.iter_mut().enumerate() {
        let mut choice = i;
        let mut octant = 0;
        for (axis, &half) in halves.iter().enumerate() {
            let upper = match half {
                1 => {
                    let bit = choice & 1;
                    choice >>= 1;
                    bit
                }
                half => half as usize / 2,
            };
            octant |= upper << axis;
        }
        *on = ids_large[octant];
    }
    Some(Hanging { level: leaf.level, corner: id, on })
}

/// Pairs of corners of a cell with the squared distance in sides: all 28 of them.
pub(super) const PAIRS: [(u8, u8, u8); 28] = pairs();

const fn pairs() -> [(u8, u8, u8); 28] {
    let mut list = [(0, 0, 0); 28];
    let mut n = 0;
    let mut distance2 = 1;
    while distance2 <= 3 {
        let mut a = 0u8;
        while a < 8 {
            let mut b = a + 1;
            while b < 8 {
                if (a ^ b).count_ones() == distance2 {
                    list[n] = (a, b, distance2 as u8);
                    n += 1;
                }
                b += 1;
            }
            a += 1;
        }
        distance2 += 1;
    }
    list
}
