//! Ranges of corners that threads work on side by side.
//!
//! A task reads the values of all corners as they were, and changes those of its own range. Its leaves are all that have one of its corners:
//! a leaf between two ranges is in the lists of both. So results do not depend on the number of threads. Where values are in a scratch file,
//! parts are worked on one by one.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use bytemuck::Pod;
use rayon::prelude::*;

use super::corners::TreeCorners;
use super::tree::Tree;
use tetdb_base::storage::{ScratchSpace, SpillVec, check_cancelled, parallel};

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
        leaves: &PartLeaves,
        first: usize,
        h: &mut impl FnMut(usize) -> f32,
        own: &mut [f32],
    ) -> bool;
}

/// Records of all leaves.
pub(super) struct OfLeaves<'a> {
    pub ids: &'a mut SpillVec<[u32; 8]>,
    /// How many times the gradation's slope each may have; once where it is not given.
    pub slope_factor: Option<&'a mut SpillVec<f32>>,
}

/// The leaves of a part.
pub(super) struct PartLeaves<'a> {
    /// True if only values of other parts changed since the last time.
    pub is_again: bool,
    leaves: Cow<'a, [[u32; 2]]>,
    ids: LeafRecords<'a, [u32; 8]>,
    slope_factor: Option<LeafRecords<'a, f32>>,
}

impl PartLeaves<'_> {
    /// Number of leaves.
    pub fn len(&self) -> usize {
        self.leaves.len()
    }

    /// Corners of a leaf.
    #[inline(always)]
    pub fn ids(&self, k: usize) -> [u32; 8] {
        self.ids.get(k, self.leaves[k][0])
    }

    /// Side of a leaf in units of the root's.
    #[inline(always)]
    pub fn side(&self, k: usize) -> f64 {
        1.0 / f64::from(1u32 << self.leaves[k][1])
    }

    /// How many times the gradation's slope a leaf may have.
    #[inline(always)]
    pub fn slope_factor(&self, k: usize) -> f64 {
        (self.slope_factor.as_ref()).map_or(1.0, |all| f64::from(all.get(k, self.leaves[k][0])))
    }
}

/// Records of the leaves of a part: in the array of all leaves, or copied from a scratch file.
enum LeafRecords<'a, T> {
    All(&'a [T]),
    Own(Vec<T>),
}

impl<T: Copy> LeafRecords<'_, T> {
    #[inline(always)]
    fn get(&self, k: usize, leaf: u32) -> T {
        match self {
            Self::All(all) => all[leaf as usize],
            Self::Own(own) => own[k],
        }
    }
}

/// An array that all threads read: one at a time if it is in a scratch file.
enum SharedArray<'a, T> {
    Memory(&'a [T]),
    Disk(Mutex<&'a mut SpillVec<T>>),
}

impl<'a, T: Pod> SharedArray<'a, T> {
    fn new(array: &'a mut SpillVec<T>) -> Self {
        match array.as_slice().is_some() {
            true => Self::Memory(array.as_slice().unwrap_or_default()),
            false => Self::Disk(Mutex::new(array)),
        }
    }

    fn range(&self, range: Range<usize>) -> Cow<'_, [T]> {
        match self {
            Self::Memory(all) => Cow::Borrowed(&all[range]),
            Self::Disk(array) => {
                let mut array = array.lock().unwrap_or_else(PoisonError::into_inner);
                Cow::Owned(range.map(|i| array.get(i)).collect())
            }
        }
    }

    fn of(&self, leaves: &[[u32; 2]]) -> LeafRecords<'_, T> {
        match self {
            Self::Memory(all) => LeafRecords::All(all),
            Self::Disk(array) => {
                let mut array = array.lock().unwrap_or_else(PoisonError::into_inner);
                LeafRecords::Own(leaves.iter().map(|leaf| array.get(leaf[0] as usize)).collect())
            }
        }
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
        &mut self,
        of: OfLeaves,
        h: &mut SpillVec<f32>,
        next: &mut SpillVec<f32>,
        work: &impl PartWork,
    ) -> bool {
        let shared = SharedLeaves::new(&mut self.leaves, &self.starts, of);
        if let (Some(h), Some(next)) = (h.as_slice(), next.as_mut_slice()) {
            let run = |(part, own): (usize, &mut [f32])| {
                check_cancelled();
                work.run(&shared.of(part, false), part * PART, &mut |i| h[i], own)
            };
            let run =
                || next.par_chunks_mut(PART).enumerate().map(run).reduce(|| false, |a, b| a | b);
            return parallel(run);
        }
        let mut any = false;
        for part in 0..self.beside.len() {
            let range = range_of(part, self.n_corners);
            let mut own: Vec<f32> = range.clone().map(|i| next.get(i)).collect();
            any |= work.run(&shared.of(part, false), range.start, &mut |i| h.get(i), &mut own);
            range.zip(own).for_each(|(i, value)| next.set(i, value));
        }
        any
    }

    /// Changes values until nothing changes, whatever the order.
    pub fn settle(&mut self, mut of: OfLeaves, h: &mut SpillVec<f32>, work: &impl PartWork) {
        let mut due: Vec<usize> = (0..self.beside.len()).collect();
        let mut is_again = false;
        while !due.is_empty() {
            let mut is_next = vec![false; self.beside.len()];
            for some in due.chunks(PARTS_AT_ONCE) {
                check_cancelled();
                for (part, own) in self.changed(&mut of, h, some, is_again, work) {
                    range_of(part, self.n_corners).zip(own).for_each(|(i, value)| h.set(i, value));
                    self.beside[part].iter().for_each(|&other| is_next[other as usize] = true);
                }
            }
            due.clear();
            due.extend((0..is_next.len()).filter(|&part| is_next[part]));
            is_again = true;
        }
    }

    /// The new values of those of some parts that change.
    fn changed(
        &mut self,
        of: &mut OfLeaves,
        h: &mut SpillVec<f32>,
        some: &[usize],
        is_again: bool,
        work: &impl PartWork,
    ) -> Vec<(usize, Vec<f32>)> {
        let of = OfLeaves { ids: of.ids, slope_factor: of.slope_factor.as_deref_mut() };
        let (starts, n) = (&self.starts, self.n_corners);
        let shared = SharedLeaves::new(&mut self.leaves, starts, of);
        if let Some(h) = h.as_slice() {
            let run = |&part: &usize| {
                let mut own = h[range_of(part, n)].to_vec();
                let is_changed =
                    work.run(&shared.of(part, is_again), part * PART, &mut |i| h[i], &mut own);
                is_changed.then_some((part, own))
            };
            return parallel(|| some.par_iter().filter_map(run).collect());
        }
        let run = |&part: &usize| {
            let mut own: Vec<f32> = range_of(part, n).map(|i| h.get(i)).collect();
            let is_changed =
                work.run(&shared.of(part, is_again), part * PART, &mut |i| h.get(i), &mut own);
            is_changed.then_some((part, own))
        };
        some.iter().filter_map(run).collect()
    }
}

/// The leaves of all parts, for all threads.
struct SharedLeaves<'a> {
    leaves: SharedArray<'a, [u32; 2]>,
    starts: &'a [usize],
    ids: SharedArray<'a, [u32; 8]>,
    slope_factor: Option<SharedArray<'a, f32>>,
}

impl<'a> SharedLeaves<'a> {
    fn new(leaves: &'a mut SpillVec<[u32; 2]>, starts: &'a [usize], of: OfLeaves<'a>) -> Self {
        Self {
            leaves: SharedArray::new(leaves),
            starts,
            ids: SharedArray::new(of.ids),
            slope_factor: of.slope_factor.map(SharedArray::new),
        }
    }

    fn of(&self, part: usize, is_again: bool) -> PartLeaves<'_> {
        let leaves = self.leaves.range(self.starts[part]..self.starts[part + 1]);
        let ids = self.ids.of(&leaves);
        let slope_factor = self.slope_factor.as_ref().map(|all| all.of(&leaves));
        PartLeaves { is_again, leaves, ids, slope_factor }
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
