//! Sizes that grow no steeper than the gradation allows.

use std::ops::Range;

use fixedbitset::FixedBitSet;
use rayon::prelude::*;

use super::corners::TreeCorners;
use super::parts::{CornerParts, OfLeaves, PartLeaves, PartWork};
use tetdb_base::storage::{SpillVec, parallel};

/// Rounds of grading and closing hanging corners. The last ones change little; each costs as much as
/// the first.
const GRADE_ROUNDS: u32 = 4;
/// A hanging corner's mean may exceed its graded value by this factor. The slope bound is stated with more slack; at
/// 1.001 every round finds something left to lower.
const EXCESS_MAX: f32 = 1.01;
/// Hanging corners whose means are computed before they are set, and those of a task.
const MEANS_AT_ONCE: usize = 1 << 18;
const MEANS_OF_TASK: usize = 1 << 13;

/// Gives hanging corners their means, where these are known.
pub(super) fn close_finite(corners: &TreeCorners, h: &mut SpillVec<f32>) {
    let n = corners.hanging.len();
    let mut hanging = corners.hanging.reader();
    let mut first = 0;
    while first < n {
        // No corner hangs on one of its own level.
        let level = hanging.get(first).level;
        let end = partition_point(first..n, |k| hanging.get(k).level == level);
        let end = end.min(first + MEANS_AT_ONCE);
        let means: Vec<_> = parallel(|| {
            let starts = (first..end).into_par_iter().step_by(MEANS_OF_TASK);
            starts.map(|k| means(corners, k..end.min(k + MEANS_OF_TASK), h)).collect()
        });
        for (corner, mean) in means.into_iter().flatten() {
            h.set(corner, mean);
        }
        first = end;
    }
}

/// Some hanging corners and their means, of those that are known.
fn means(corners: &TreeCorners, range: Range<usize>, h: &SpillVec<f32>) -> Vec<(usize, f32)> {
    let (mut hanging, mut h) = (corners.hanging.reader(), h.reader());
    let of = |k| {
        let hanging = hanging.get(k);
        (hanging.corner as usize, mean_on(hanging.on, |on| h.get(on)))
    };
    range.map(of).filter(|(_, mean)| mean.is_finite()).collect()
}

/// The first place of a range where `is_before` does not hold, or its end.
fn partition_point(range: Range<usize>, mut is_before: impl FnMut(usize) -> bool) -> usize {
    let (mut low, mut high) = (range.start, range.end);
    while low < high {
        let middle = low.midpoint(high);
        match is_before(middle) {
            true => low = middle + 1,
            false => high = middle,
        }
    }
    low
}

fn mean_on(on: [u32; 4], mut h: impl FnMut(usize) -> f32) -> f32 {
    let mut sum = f64::from(h(on[0] as usize));
    for &v in &on[1..] {
        sum += f64::from(h(v as usize));
    }
    (sum * 0.25) as f32
}

/// The slope bound between corners of the same leaf.
pub(super) struct Grading<'a> {
    pub parts: &'a CornerParts,
    pub corners: &'a mut TreeCorners,
    pub beta: f64,
    /// By leaf, how many times `beta` its slope may be; once where it is not given.
    pub slope_factor: Option<&'a SpillVec<f32>>,
}

impl Grading<'_> {
    /// Lowers values until no two corners of a leaf differ by more than the slope allows.
    ///
    /// The result is the largest such function below the given values, in any order.
    pub fn grade(&mut self, h: &mut SpillVec<f32>) {
        let of = OfLeaves { ids: &self.corners.of_leaf, slope_factor: self.slope_factor };
        self.parts.settle(of, h, &Slope { beta: self.beta });
    }

    /// Grades, and gives hanging corners their means: lowering only, so that both hold in the end.
    ///
    /// A mean above its graded value lowers the largest corners of its four, none of them below that value: so the
    /// smallest value of all is unchanged.
    pub fn grade_closed(&mut self, h: &mut SpillVec<f32>) {
        for _ in 0..GRADE_ROUNDS {
            self.grade(h);
            let mut changed = false;
            for k in (0..self.corners.hanging.len()).rev() {
                let hanging = self.corners.hanging.get(k);
                let own = h.get(hanging.corner as usize);
                if mean_on(hanging.on, |on| h.get(on)) > own * EXCESS_MAX {
                    changed = true;
                    let level = level_for_mean(hanging.distinct(), h, own);
                    for &on in hanging.distinct() {
                        h.change(on as usize, |h| *h = h.min(level));
                    }
                }
            }
            close_finite(self.corners, h);
            if !changed {
                break;
            }
        }
    }
}

/// Lowers the values of a part as far as those around it ask for.
struct Slope {
    beta: f64,
}

impl PartWork for Slope {
    /// Sweeps go forward and backward by turns, because a lowered value travels along with the sweep of its direction.
    fn run(
        &self,
        leaves: &mut PartLeaves,
        first: usize,
        h: &mut impl FnMut(usize) -> f32,
        own: &mut [f32],
    ) -> bool {
        let n = leaves.len();
        // Corners that were lowered since their neighbors were last checked.
        let mut changed = FixedBitSet::with_capacity(own.len());
        let mut next = FixedBitSet::with_capacity(own.len());
        let mut sweep = 0u64;
        loop {
            let mut is_done = true;
            for k in 0..n {
                let k = if sweep.is_multiple_of(2) { k } else { n - 1 - k };
                let (leaf, ids) = leaves.at(k);
                let places = ids.map(|id| (id as usize).wrapping_sub(first));
                let is_due = match sweep {
                    0 => !leaves.is_again || places.iter().any(|&place| place >= own.len()),
                    _ => places.iter().any(|&place| changed.contains(place)),
                };
                if !is_due {
                    continue;
                }
                let mut before = [0.0; 8];
                for ((value, place), id) in before.iter_mut().zip(places).zip(ids) {
                    *value = own.get(place).copied().unwrap_or_else(|| h(id as usize));
                }
                let mut lowered = before;
                let step = self.beta * leaf.side() * leaves.slope_factor(leaf);
                let steps = [0.0, step, step * 2f64.sqrt(), step * 3f64.sqrt()];
                relax(&mut lowered, &steps);
                for ((place, value), before) in places.into_iter().zip(lowered).zip(before) {
                    if value != before && place < own.len() {
                        own[place] = value;
                        changed.insert(place);
                        next.insert(place);
                        is_done = false;
                    }
                }
            }
            if is_done {
                return sweep > 0;
            }
            std::mem::swap(&mut changed, &mut next);
            next.clear();
            sweep += 1;
        }
    }
}

/// Lowers a leaf's values to the bounds of the others; `steps` are the largest differences by squared distance of corners in sides.
///
/// From the least value upwards, so that each is final when it bounds others.
#[inline]
fn relax(h: &mut [f32; 8], steps: &[f64; 4]) {
    let mut is_left = [true; 8];
    loop {
        let (mut least, mut from, mut most) = (f32::INFINITY, 0, f32::NEG_INFINITY);
        for (corner, &value) in h.iter().enumerate() {
            if is_left[corner] && value < least {
                (least, from) = (value, corner);
            }
            most = most.max(value);
        }
        // The least step from the least value allows the greatest.
        if bound(least, steps[1]) >= most {
            return;
        }
        is_left[from] = false;
        let bounds = steps.map(|step| bound(least, step));
        for (corner, value) in h.iter_mut().enumerate() {
            *value = value.min(bounds[(corner ^ from).count_ones() as usize]);
        }
    }
}

/// The level at which to cut the values of some corners so that their mean becomes `wanted`, which is
/// below the present mean.
fn level_for_mean(on: &[u32], h: &mut SpillVec<f32>, wanted: f32) -> f32 {
    let mut values = [f64::INFINITY; 4];
    for (value, &corner) in values.iter_mut().zip(on) {
        *value = f64::from(h.get(corner as usize));
    }
    values.sort_unstable_by(f64::total_cmp);
    let mut rest = f64::from(wanted) * on.len() as f64;
    for (i, &value) in values[..on.len()].iter().enumerate() {
        let level = rest / (on.len() - i) as f64;
        if level <= value {
            return level as f32;
        }
        rest -= value;
    }
    wanted
}

/// The largest value allowed at a step from `value`.
pub(super) fn bound(value: f32, step: f64) -> f32 {
    (f64::from(value) + step) as f32
}

#[cfg(test)]
mod tests {
    use super::super::tree::Tree;
    use super::*;
    use tetdb_base::storage::ScratchSpace;

    /// A tree with small leaves around one diagonal.
    fn tree() -> Tree {
        fn shape(depth: u32, is_beside: bool, list: &mut Vec<bool>) {
            list.push(depth < 2 || depth < 7 && is_beside);
            if list.last() == Some(&true) {
                (0..8).for_each(|o| shape(depth + 1, is_beside && [0, 3, 7].contains(&o), list));
            }
        }
        let mut list = Vec::new();
        shape(0, true, &mut list);
        Tree::from_shape(&list).numbered()
    }

    #[test]
    fn parts_settle_where_sweeps_over_all_leaves_do() {
        let tree = tree();
        let dir = tempfile::tempdir().expect("a folder");
        for scratch in [ScratchSpace::boundless(), ScratchSpace::new(1 << 16, dir.path())] {
            let mut corners = TreeCorners::new(&tree, &scratch);
            let parts = CornerParts::new(&tree, &mut corners, &scratch, |_| true);
            let wild = |i: usize| ((i * 7919 % 1009) as f32 / 100.0).exp() - 2.0;
            let mut h = scratch.vec(corners.n_corners, 0.0f32);
            (0..h.len()).for_each(|i| h.set(i, wild(i)));
            let mut expected: Vec<f32> = (0..h.len()).map(wild).collect();
            let beta = 0.3;
            let mut is_done = false;
            while !std::mem::replace(&mut is_done, true) {
                for (i, leaf) in tree.leaves().enumerate() {
                    let ids = corners.of_leaf.get(i).map(|id| id as usize);
                    for (a, b) in (0..64usize).map(|k| (k / 8, k % 8)).filter(|(a, b)| a != b) {
                        let step = beta * leaf.side() * f64::from((a ^ b).count_ones()).sqrt();
                        let most = bound(expected[ids[a]], step);
                        if most < expected[ids[b]] {
                            expected[ids[b]] = most;
                            is_done = false;
                        }
                    }
                }
            }
            let corners = &mut corners;
            Grading { parts: &parts, corners, beta, slope_factor: None }.grade(&mut h);
            assert!(expected.len() > 5_000, "{}", expected.len());
            assert!((0..h.len()).all(|i| h.get(i) == expected[i]));
        }
    }
}
