//! Ranges of corners that threads work on side by side.
//!
//! A task reads the values of all corners as they were, and changes those of its own range. Its leaves are all that have one of its corners:
//! a leaf between two ranges is in the lists of both. So results do not depend on the number of threads.

use std::ops::Range;

use rayon::prelude::*;

use super::corners::TreeCorners;
use super::tree::Tree;
use tetdb_base::storage::{ScratchSpace, SpillVec, SpillVecReader, check_cancelled, parallel};

/// Corners of a part: their values and leaves fit in a cache. Tests have many small parts.
const PART: usize = if cfg!(test) { 1 << 8 } else { 1 << 14 };
/// Parts whose new values are held until all of them are done.
const PARTS_AT_ONCE: usize = 64;

/// The leaves of each range of corners.
pub(super) struct CornerParts {
    /// Leaves and their levels, part after part, ascending within each.
    leaves: SpillVec<[u32; 2]>,
    /// Where each part begins in `leaves`, and the end of the last.
    starts: Vec<usize>,
    /// For each part the others that have leaves in common with it.
    beside: Vec<Vec<u32>>,
    n_corners: usize,
}

/// Work on one part at a time.
pub(super) trait PartWork: Sync {
    /// Changes the values of the corners from `first` on; `h` is any corner's value as it was. Returns whether there is more to do: for
    /// [`CornerParts::settle`] whether a value changed.
    fn run(
        &self,
        leaves: &mut PartLeaves,
        first: usize,
        h: &mut impl FnMut(usize) -> f32,
        own: &mut [f32],
    ) -> bool;
}

/// Records of all leaves.
#[derive(Clone, Copy)]
pub(super) struct OfLeaves<'a> {
    pub ids: &'a SpillVec<[u32; 8]>,
    /// How many times the gradation's slope each may have; once where it is not given.
    pub slope_factor: Option<&'a SpillVec<f32>>,
}

/// The leaves of a part.
pub(super) struct PartLeaves<'a> {
    /// True if only values of other parts changed since the last time.
    pub is_again: bool,
    range: Range<usize>,
    leaves: SpillVecReader<'a, [u32; 2]>,
    ids: SpillVecReader<'a, [u32; 8]>,
    slope_factor: Option<SpillVecReader<'a, f32>>,
}

/// A leaf in the list of a part.
#[derive(Clone, Copy)]
pub(super) struct PartLeaf {
    number: usize,
    level: u32,
}

impl PartLeaf {
    /// Its side in units of the root's.
    #[inline(always)]
    pub fn side(self) -> f64 {
        1.0 / f64::from(1u32 << self.level)
    }
}

impl PartLeaves<'_> {
    /// Number of leaves.
    pub fn len(&self) -> usize {
        self.range.len()
    }

    /// A leaf by its place in the list, and its corners.
    #[inline(always)]
    pub fn at(&mut self, k: usize) -> (PartLeaf, [u32; 8]) {
        let [number, level] = self.leaves.get(self.range.start + k);
        let leaf = PartLeaf { number: number as usize, level };
        (leaf, self.ids.get(leaf.number))
    }

    /// How many times the gradation's slope a leaf may have.
    #[inline(always)]
    pub fn slope_factor(&mut self, leaf: PartLeaf) -> f64 {
        self.slope_factor.as_mut().map_or(1.0, |all| f64::from(all.get(leaf.number)))
    }
}

impl CornerParts {
    /// Parts with the leaves for whose corners `is_due` holds.
    pub fn new(
        tree: &Tree,
        corners: &mut TreeCorners,
        scratch: &ScratchSpace,
        is_due: impl Fn(&[u32; 8]) -> bool,
    ) -> Self {
        let n_parts = corners.n_corners.div_ceil(PART);
        let mut starts = vec![0; n_parts + 1];
        let mut beside = vec![Vec::new(); n_parts];
        for i in 0..corners.of_leaf.len() {
            let ids = corners.of_leaf.get(i);
            if is_due(&ids) {
                each_part(&ids, |part| {
                    starts[part + 1] += 1;
                    each_part(&ids, |other| {
                        let beside: &mut Vec<u32> = &mut beside[part];
                        if other != part && !beside.contains(&(other as u32)) {
                            beside.push(other as u32);
                        }
                    });
                });
            }
        }
        for part in 0..n_parts {
            starts[part + 1] += starts[part];
        }
        let mut ends = starts.clone();
        let mut leaves = scratch.vec(starts[n_parts], [0; 2]);
        for (i, leaf) in tree.leaves().enumerate() {
            let ids = corners.of_leaf.get(i);
            if is_due(&ids) {
                each_part(&ids, |part| {
                    leaves.set(ends[part], [i as u32, leaf.level]);
                    ends[part] += 1;
                });
            }
        }
        Self { leaves, starts, beside, n_corners: corners.n_corners }
    }

    /// Returns whether no leaf is in any part.
    pub fn is_empty(&self) -> bool {
        self.leaves.is_empty()
    }

    /// Changes all values once: work reads those of `h` and changes those of `next`. Returns whether there is more to do in any part.
    pub fn change(
        &self,
        of: OfLeaves,
        h: &SpillVec<f32>,
        next: &mut SpillVec<f32>,
        work: &impl PartWork,
    ) -> bool {
        let all: Vec<usize> = (0..self.beside.len()).collect();
        let mut is_more = false;
        for some in all.chunks(PARTS_AT_ONCE) {
            for (part, own, is_more_here) in self.changed(of, [h, next], some, false, work) {
                is_more |= is_more_here;
                range_of(part, self.n_corners).zip(own).for_each(|(i, value)| next.set(i, value));
            }
        }
        is_more
    }

    /// Changes values until nothing changes, whatever the order.
    pub fn settle(&self, of: OfLeaves, h: &mut SpillVec<f32>, work: &impl PartWork) {
        let mut due: Vec<usize> = (0..self.beside.len()).collect();
        let mut is_again = false;
        while !due.is_empty() {
            let mut is_next = vec![false; self.beside.len()];
            for some in due.chunks(PARTS_AT_ONCE) {
                for (part, own, is_changed) in self.changed(of, [h, h], some, is_again, work) {
                    if is_changed {
                        range_of(part, self.n_corners)
                            .zip(own)
                            .for_each(|(i, value)| h.set(i, value));
                        self.beside[part].iter().for_each(|&other| is_next[other as usize] = true);
                    }
                }
            }
            due.clear();
            due.extend((0..is_next.len()).filter(|&part| is_next[part]));
            is_again = true;
        }
    }

    /// The new values of some parts, and what the work returned: from values of all corners, and those of the parts that it changes.
    fn changed(
        &self,
        of: OfLeaves,
        [h, own]: [&SpillVec<f32>; 2],
        some: &[usize],
        is_again: bool,
        work: &impl PartWork,
    ) -> Vec<(usize, Vec<f32>, bool)> {
        let run = |&part: &usize| {
            check_cancelled();
            let range = range_of(part, self.n_corners);
            let mut own = own.reader();
            let mut own: Vec<f32> = range.clone().map(|i| own.get(i)).collect();
            let mut leaves = PartLeaves {
                is_again,
                range: self.starts[part]..self.starts[part + 1],
                leaves: self.leaves.reader(),
                ids: of.ids.reader(),
                slope_factor: of.slope_factor.map(SpillVec::reader),
            };
            let first = range.start;
            let is_more = match h.as_slice() {
                Some(h) => work.run(&mut leaves, first, &mut |i| h[i], &mut own),
                None => {
                    let mut h = h.reader();
                    work.run(&mut leaves, first, &mut |i| h.get(i), &mut own)
                }
            };
            (part, own, is_more)
        };
        parallel(|| some.par_iter().map(run).collect())
    }
}

/// The corners of a part, of `n` in all.
fn range_of(part: usize, n: usize) -> Range<usize> {
    part * PART..((part + 1) * PART).min(n)
}

/// Calls `with` once for each part that has one of these corners.
#[inline]
fn each_part(ids: &[u32; 8], mut with: impl FnMut(usize)) {
    let parts = ids.map(|id| id as usize / PART);
    for (c, &part) in parts.iter().enumerate() {
        if !parts[..c].contains(&part) {
            with(part);
        }
    }
}
